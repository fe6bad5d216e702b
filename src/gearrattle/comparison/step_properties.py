"""Properties of an algorithm before it runs: whether its step is fixed, and the growth of a mode in a step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from gearrattle.assembly import assemble, coordinates_of
from gearrattle.comparison.contender_runs import Contender
from gearrattle.engine.solvers import SOLVERS, Task
from gearrattle.engine.solvers.one_step import FixedStep
from gearrattle.engine.solvers.step_stability import growths, labels_of, regions_visited
from gearrattle.engine.system.flow import flow_of
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.results import Run
from gearrattle.simulation.settings import settled


def check_names(algorithms: Iterable[str]) -> None:
    """Refuse an algorithm that does not exist (ModelError)."""
    known = tuple(SOLVERS)
    unknown = [name for name in algorithms if name not in known]
    if unknown:
        rule = f"must be one of {', '.join(SOLVERS)}"
        raise ModelError([Problem("algorithms", f'"{name}"', rule) for name in unknown])


def check_budget(budget: float) -> None:
    """Refuse a budget that is no positive time (ModelError)."""
    if not budget > 0.0:
        raise ModelError(Problem("budget", f"{budget:g}", "must be greater than zero", "seconds for each contender"))


def has_fixed_step(algorithm: str) -> bool:
    """Whether every step of an algorithm is the same."""
    return isinstance(SOLVERS[algorithm], FixedStep)


def fixed_step_of(model: Model, algorithm: str, truth: Run, asked: float | str | None = None) -> float | None:
    """The step an algorithm takes [s]: the one asked for, else its own; None if it chooses its steps."""
    solver = SOLVERS[algorithm]
    t = truth.trajectory
    if not isinstance(solver, FixedStep):
        return None
    used = settled(model, {"step": asked})
    start = coordinates_of(model, t, 0, slice(1))[0], coordinates_of(model, t, 1, slice(1))[0]
    return solver.step_of(Task(assemble(model).system, *start, 1, 1, None, used.simulation.step))


def growths_of(model: Model, contender: Contender, settings: Mapping[str, Any], truth: Run) -> dict[str, float]:
    """Largest factor by which a contender's step multiplies a mode, in the regions the true motion visits.

    Of thousands of regions, only those visited most often are treated (``solvers.step_stability.regions_visited``).

    Above 1 the mode grows, and the motion of the algorithm there is a numerical artefact. Empty where steps are chosen.
    Regions are named by the labels of their clearances, such as "(1, 0, -1)".
    """
    solver = SOLVERS[contender.algorithm]
    asked = {**settings, **contender.settings}.get("step")
    step = fixed_step_of(model, contender.algorithm, truth, asked)
    if step is None or not isinstance(solver, FixedStep):
        return {}
    system = assemble(model).system
    t = truth.trajectory
    flow = flow_of(system)
    first = t.layout.region_of_first_piece
    pieces = [0] * len(system.laws)
    for k, label in zip(system.clearances, t.initial_region - first, strict=True):
        pieces[k] = int(label)
    log = t.events
    regions, _ = regions_visited(flow, tuple(pieces), log.clearance, log.to_region - first[log.clearance])
    growth_by_region = growths(solver.tableau, step, flow, regions)
    return {
        f"({', '.join(str(label) for label in labels_of(flow, region))})": growth_by_region[region]
        for region in growth_by_region
    }
