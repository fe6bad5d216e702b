"""Algorithms side by side on one model, compared with the exact solution: the paper's Tables 3 and 4, with true errors.

Every contender runs the same model from the same start on the same output grid. Up to the *window*, where errors of
1e-6, or of the tolerance if finer, have grown to a thousandth at most, its error is given sample by sample and crossing
by crossing; beyond the predictability horizon only its statistics are. The same is done with the exact motion begun
1e-12 half-gaps away: no algorithm can be expected to do better than that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from gearrattle.assembly import assemble
from gearrattle.comparison.coherence_comparison import compare_coherence
from gearrattle.comparison.comparison_rows import Comparison, Row
from gearrattle.comparison.comparison_table import table_of
from gearrattle.comparison.contender_runs import (
    CEILING,
    PAPER,
    Algorithms,
    Contender,
    Progress,
    Result,
    contenders,
    run_one,
)
from gearrattle.comparison.crossing_comparison import compare_crossings, compare_impacts
from gearrattle.comparison.error_floor import floor_of
from gearrattle.comparison.motion_statistics import Portrait, portrait
from gearrattle.comparison.nearby_motions import exact_portraits, nearby
from gearrattle.comparison.pointwise import envelope, pointwise, worst_history
from gearrattle.comparison.recommendation import recommendation, with_verdicts
from gearrattle.comparison.statistics_comparison import compare_statistics
from gearrattle.comparison.step_properties import check_budget, check_names, growths_of, has_fixed_step
from gearrattle.comparison.transmissibility_comparison import compare_transmissibility
from gearrattle.engine.system.perturbation_growth import GROWTH
from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.model import Model, check_model
from gearrattle.model.value_kinds import CALLBACK, check_arguments
from gearrattle.result import KIND
from gearrattle.results import Run
from gearrattle.simulation.settings import settled
from gearrattle.simulation.simulate import check_takes

if TYPE_CHECKING:
    import pandas as pd

_AWAY = 1e-12  # half-gaps
_STILL_SMALL = 1e-3
_COARSE = 1e-6


def compare(
    model: Model,
    algorithms: Algorithms = PAPER,
    *,
    reference: str = "exact",
    cycles: int | None = None,
    discard: int | None = None,
    samples_per_cycle: int | None = None,
    tolerance: float = 1e-6,
    step: float | str | None = None,
    initial: str | Mapping[str, Sequence[float]] | None = None,
    budget: float = 60.0,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Compare algorithms on a model; the exact solution is the judge.

    Parameters
    ----------
    model
        the driveline.
    algorithms
        names, each once; or a mapping from label to settings (``algorithm``, ``tolerance``, ``step``), so
        that one algorithm can take part twice.
    reference
        the judge, an algorithm's name. The 1995 paper's coherences are against "rk2".
    cycles, discard, samples_per_cycle, initial
        as in ``gearrattle.simulate``.
    tolerance
        of the algorithms that choose their steps.
    step
        of the algorithms of fixed step; theirs by default.
    budget
        longest time for each contender [s]; one that needs more is stopped, and said to be.
    progress
        called with the finished share.

    Returns
    -------
    pd.DataFrame
        A table with one line an algorithm. The whole comparison, with its recommendation in words, hangs on it:
        ``table.attrs["comparison"]`` is a ``Comparison``.

    Raises
    ------
    ModelError
        bad settings or an unknown algorithm.
    ConvergenceError
        the reference failed.

    Examples
    --------
    >>> table = gr.compare(gr.example("case1"), ["rk2", "rk4"], cycles=6, discard=2, budget=5.0)
    >>> list(table.index)
    ['exact', 'rk2', 'rk4', 'exact, 1e-12 away']
    """
    check_model(model)
    check_arguments(progress=(CALLBACK, progress))
    comparison = side_by_side(**locals())  # every argument, by its name
    table = table_of(comparison)
    table.attrs |= {KIND: Comparison.kind, "comparison": comparison}
    return table


def side_by_side(
    model: Model,
    algorithms: Algorithms = PAPER,
    *,
    reference: str = "exact",
    tolerance: float = 1e-6,
    step: float | str | None = None,
    budget: float = 60.0,
    progress: Progress | None = None,
    **grid: Any,
) -> Comparison:
    """Return the comparison of algorithms; ``grid`` holds cycles, discard, samples_per_cycle and initial."""
    # check contenders, budget and settings before anything runs
    everyone = contenders(algorithms)
    check_names([reference, *(contender.algorithm for contender in everyone)])
    check_budget(budget)
    shared = {key: value for key, value in grid.items() if value is not None}
    settled(model, {**shared, "tolerance": tolerance, "step": step})
    for algorithm in (reference, *(contender.algorithm for contender in everyone)):
        check_takes(assemble(model), algorithm)
    # run the reference
    share = _Share(progress, len(everyone) + 3)
    judge = Contender(reference, reference, {} if reference == "exact" else {"tolerance": tolerance, "step": step})
    result = run_one(model, judge, shared, float("inf"), share.next())
    if result.run is None:
        raise ConvergenceError(f"the reference, {reference}: {result.status}", remedy='reference = "exact"')
    truth = result.run
    # window, horizon, and exact motions from nearby
    horizon = float(truth.predictability_horizon)
    window = window_of(truth, tolerance)
    start = horizon if horizon < truth.trajectory.end else None  # all is predictable: from the steady part on
    peers = _where_there_is_enough(
        lambda: exact_portraits(model, truth.trajectory, shared, start, budget=budget, progress=share.next())
    )
    # judge the reference and every contender
    rows = [judged(result, truth, window, peers, start)]
    for contender in everyone:
        own = {"step": step} if has_fixed_step(contender.algorithm) else {"tolerance": tolerance}
        result = run_one(model, contender, {**shared, **own}, budget, share.next())
        growths = growths_of(model, contender, {**shared, **own}, truth)
        rows.append(replace(judged(result, truth, window, peers, start), growths=growths))
    # the exact motion from nearby, as the ceiling
    away = Contender(CEILING, "exact", {"initial": nearby(truth.trajectory, _AWAY)})
    rows.append(judged(run_one(model, away, shared, budget, share.next()), truth, window, peers, start))
    # all together, with verdicts and recommendation
    share.next()
    t = truth.trajectory
    comparison = Comparison(
        model=model.name,
        reference=reference,
        rows=tuple(rows),
        tolerance=tolerance,
        window=window,
        horizon=horizon,
        period=t.layout.period,
        cycles=t.cycles,
        discard=t.discard,
        samples_per_cycle=t.samples_per_cycle,
        budget=budget,
    )
    comparison = replace(comparison, rows=with_verdicts(comparison))
    return replace(comparison, recommendation=recommendation(comparison))


def window_of(truth: Run, tolerance: float) -> float:
    """Time up to which errors are given sample by sample [s]: where 1e-6, or the tolerance if finer, has grown to 1e-3.

    A coarse tolerance is no reason to look away sooner, and a fine one none to look beyond the horizon.
    """
    growth = min(_STILL_SMALL / min(tolerance, _COARSE), GROWTH)
    return min(float(truth.variation.horizon(growth)), truth.trajectory.end)


class _Share:
    """One progress report, divided among several runs."""

    def __init__(self, progress: Progress | None, runs: int) -> None:
        self.progress = progress
        self.runs = runs
        self.begun = 0
        self.reached = 0.0

    def next(self) -> Progress:
        """Return the progress of the next run; repeated timing of a run does not move it back."""
        done = self.begun
        self.begun = self.begun + 1

        def report_share(share: float) -> None:
            self.reached = max(self.reached, (done + share) / self.runs)
            if self.progress is not None:
                self.progress(self.reached)

        report_share(0.0)
        return report_share


def judged(
    result: Result, truth: Run, window: float, peers: Sequence[Portrait] | None = None, start: float | None = None
) -> Row:
    """A contender's motion against the reference, and from ``start`` on its statistics among those of exact motions."""
    # a contender without a run
    label = result.contender.label
    algorithm = result.contender.algorithm
    if result.run is None:
        return Row(label, algorithm, result.status)
    # statistics beyond the horizon, against exact motions from nearby
    candidate = result.run.trajectory
    reference = truth.trajectory
    statistics = None
    if peers and len(peers) > 1:
        floor = floor_of(candidate, reference, start) if reference.cost.algorithm == "exact" else None
        statistics = compare_statistics(portrait(candidate, start), peers, floor, units=truth.model.units)
    # errors, crossings and impacts inside the window
    return Row(
        label,
        algorithm,
        result.status,
        cost=result.run.cost,
        error=pointwise(candidate, reference, window),
        crossings=compare_crossings(candidate, reference, window),
        impacts=compare_impacts(candidate, reference, window),
        statistics=statistics,
        transmissibility=compare_transmissibility(candidate, reference),
        coherence=_where_there_is_enough(lambda: compare_coherence(candidate, reference)),
        history=envelope(
            reference.time, worst_history(candidate, reference, reference.time.size), 2.0 * truth.predictability_horizon
        ),
        notes=candidate.notes,
    )


def _where_there_is_enough(compute: Any) -> Any:
    """Return the result of a computation, or None where the run is too short for it."""
    try:
        return compute()
    except ModelError:
        return None
