"""``criteria``: the verdict of all criteria on a run, or on the chunks of a long motion."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import replace

from gearrattle.assembly import is_driven_over_time, negligible_of
from gearrattle.model import Model
from gearrattle.model.value_kinds import AnyTable, Choice, check_arguments
from gearrattle.quantities.chunk_sums import add_chunks
from gearrattle.quantities.evaluation import judge, verdict_of
from gearrattle.quantities.event import event_of
from gearrattle.quantities.quantity_table import CRITERIA
from gearrattle.quantities.verdict import KINDS, TRANSIENT, Verdict
from gearrattle.results import Run, check_run
from gearrattle.trajectory import NegligibleImpacts


def criteria(
    run: Run | Iterable[Run], *, negligible: Mapping[str, float | str] | None = None, kind: str | None = None
) -> Verdict:
    """Evaluate every criterion of a run: whether it rattles, where, and how badly.

    Parameters
    ----------
    run
        from ``simulate`` or ``open_run``; or the chunks of one long motion, in order, from ``stream`` or
        ``open_stream``: they are evaluated as one motion, and are not kept in memory.
    negligible
        sizes below which an impact is a touch, as ``[criteria] negligible`` of a model file; sizes left out are those
        of the model.
    kind
        "steady"; or "transient", with the first impact, the hardest impact and peak torques. None: transient if a
        torque has ramps or is a record; chunks of a long motion are always steady.

    Raises
    ------
    ModelError
        if no cycle remains after the discarded ones, if chunks are not consecutive, or for a wrong threshold.

    Examples
    --------
    >>> verdict = gr.criteria(gr.simulate(gr.example("case3"), cycles=40, discard=20))
    >>> print(verdict.verdict)
    double-sided
    >>> [(part.name, part.regime) for part in verdict.parts]
    [('gear', 'double-sided'), ('spline', 'single-sided'), ('clutch', 'single-sided')]
    >>> verdict.severity
    'rattles'
    """
    check_negligible(negligible)
    if kind is not None:
        check_arguments(kind=(Choice(KINDS), kind))
    if isinstance(run, Run):
        verdict = judge(run.trajectory, units=run.model.units, negligible=_limits(run.model, negligible))
        is_transient = is_driven_over_time(run.model) if kind is None else kind == TRANSIENT
        if not is_transient:
            return verdict
        event = event_of(run.trajectory, verdict.negligible, is_si=run.model.units == "SI")
        return replace(verdict, kind=TRANSIENT, event=event)
    if isinstance(run, str | os.PathLike) or not isinstance(run, Iterable):
        check_run(run)
    sums, _, model = add_chunks(run, CRITERIA, "judged")
    return verdict_of(sums, units=model.units, negligible=_limits(model, negligible))


def check_negligible(negligible: object) -> None:
    """Raise ModelError for thresholds that are not a table; their values are checked together with a model."""
    if negligible is not None:
        check_arguments(negligible=(AnyTable(), negligible))


def _limits(model: Model, negligible: Mapping[str, float | str] | None) -> NegligibleImpacts | None:
    """Return the thresholds of a call, completed by those of the model; None if the call has none."""
    return None if negligible is None else negligible_of(model.with_negligible(negligible))
