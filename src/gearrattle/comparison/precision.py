"""Work against precision: error and cost of every algorithm over a range of tolerances or steps.

Runs are as long as the window of the comparison, in whole cycles: an error beyond it says nothing about an algorithm.
``exact`` has no tolerance to choose and is one point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

from gearrattle.comparison.comparison_record import Record
from gearrattle.comparison.contender_runs import PAPER, Contender, Progress, Result, run_one
from gearrattle.comparison.pointwise import pointwise
from gearrattle.comparison.step_properties import check_budget, check_names, fixed_step_of
from gearrattle.engine.system.perturbation_growth import ROUNDING_95
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.results import Run

TOLERANCES = tuple(10.0**-k for k in range(3, 12))
SHARES = tuple(4.0 * 2.0**-k for k in range(8))
"""Of the default step, for algorithms of fixed step."""
GROWTH = 1e3
_SAMPLES = 256


@dataclass(frozen=True)
class Point(Record):
    """One run: tolerance or step, largest error [``WorkPrecision.unit``], function calls, time [s]."""

    setting: float
    error: float
    function_calls: int
    wall_time: float


@dataclass(frozen=True)
class Curve(Record):
    """The runs of one algorithm, coarse to fine; ``status`` says why there are fewer than asked for."""

    algorithm: str
    points: tuple[Point, ...]
    status: str


@dataclass(frozen=True)
class WorkPrecision(Record):
    """Curves of all algorithms.

    Attributes
    ----------
    window
        errors are the largest up to here [s].
    cycles
        length of every run in periods.
    exact
        the one point of the exact solution; its error is what 95 of 100 motions stay below.
    """

    window: float
    cycles: int
    exact: Point
    curves: tuple[Curve, ...]
    unit: str = "half-gaps"


def work_precision(
    model: Model,
    algorithms: Sequence[str] = PAPER,
    *,
    budget: float = 10.0,
    progress: Progress | None = None,
    most_cycles: int = 8,
    initial: Any = None,
) -> WorkPrecision:
    """Run every algorithm over its tolerances or steps.

    Parameters
    ----------
    budget
        a curve ends with the first run that takes longer [s].
    most_cycles
        length of the runs, if errors stay small (grow less than ``GROWTH``) for so long.

    Raises
    ------
    ModelError
        an unknown algorithm.
    ConvergenceError
        the exact solution failed.
    """
    check_names(algorithms)
    check_budget(budget)
    grid: dict[str, Any] = {"samples_per_cycle": _SAMPLES, "discard": 0, "initial": initial}
    algorithms = [name for name in algorithms if name != "exact"]
    truth = _must(run_one(model, Contender("exact", "exact"), {**grid, "cycles": most_cycles}, float("inf")))
    window = min(float(truth.variation.horizon(GROWTH)), truth.trajectory.end)
    cycles = max(1, ceil(window / truth.trajectory.layout.period * (1.0 - 1e-9)))
    grid["cycles"] = cycles
    truth = _must(run_one(model, Contender("exact", "exact"), grid, float("inf")))
    curves = []
    for number, name in enumerate(algorithms):
        if progress is not None:
            progress(number / len(algorithms))
        curves.append(_curve(model, name, grid, (truth, window), budget))
    point = Point(float("nan"), GROWTH * ROUNDING_95, truth.cost.function_calls, truth.cost.wall_time)
    unit = pointwise(truth.trajectory, truth.trajectory, window).unit
    return WorkPrecision(window, cycles, point, tuple(curves), unit)


def _must(result: Result) -> Run:
    if result.run is None:
        raise ConvergenceError(f"exact: {result.status}")
    return result.run


def _curve(model: Model, name: str, grid: dict[str, Any], truth: tuple[Run, float], budget: float) -> Curve:
    """One algorithm, until its settings or its budget are used up."""
    points = []
    status = "done"
    (exact, window) = truth
    step = fixed_step_of(model, name, exact)
    key, settings = ("tolerance", TOLERANCES) if step is None else ("step", tuple(step * share for share in SHARES))
    for setting in settings:
        result = run_one(model, Contender(name, name, {key: setting}), grid, budget)
        if result.run is None:
            status = result.status
            if result.wall_time >= budget or result.wall_time == 0.0:
                break
            continue
        cost = result.run.cost
        error = pointwise(result.run.trajectory, exact.trajectory, window).worst
        points.append(Point(setting, error, cost.function_calls, cost.wall_time))
    return Curve(name, tuple(points), status)
