"""``metrics``: rattle metrics of a run, of the chunks of a long run, or of a recording, as a table.

A run has all inputs of metrics. Chunks have those that are sums; ``merging`` of a metric says which values are not. A
recording has its signals, and the caller may add a model, a speed and orders. A metric without an input that it needs
has one row that says what is missing. An event is measured by ``event_metric``, and by the few metrics that are not
averages over cycles.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from gearrattle.assembly import assemble, is_driven_over_time
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.ramps import spans_of
from gearrattle.model.table import did_you_mean
from gearrattle.model.value_kinds import Choice, check_arguments
from gearrattle.quantities.chunk_sums import add_chunks, orders_of
from gearrattle.quantities.evaluation import rows_of
from gearrattle.quantities.event_metric import EventMetric
from gearrattle.quantities.metric_inputs import Inputs
from gearrattle.quantities.metric_sources import inputs_of_chunks, inputs_of_motion, inputs_of_recording
from gearrattle.quantities.quantity import Quantity, Row
from gearrattle.quantities.quantity_table import METRICS
from gearrattle.quantities.rattle_level import RattleLevel
from gearrattle.quantities.verdict import KINDS, TRANSIENT
from gearrattle.recording import Recording
from gearrattle.result import KIND
from gearrattle.results import Run, check_run
from gearrattle.wording import listed

if TYPE_CHECKING:
    import pandas as pd

_AVERAGES = "averages over cycles, which says nothing of an event"
_REMEDY = 'kind = "steady" gives it'


def metrics(
    source: Run | Recording | Iterable[Run],
    model: Model | None = None,
    names: Sequence[str] | None = None,
    *,
    speed: float | None = None,
    orders: Sequence[float] | None = None,
    base_level: float | None = None,
    kappa: float | None = None,
    kind: str | None = None,
) -> pd.DataFrame:
    """Compute all rattle metrics, or some, for a run or a recording.

    Parameters
    ----------
    source
        from ``simulate`` or ``open_run``; or the chunks of one long motion, in order, from ``stream`` or
        ``open_stream``, measured as one motion and not kept in memory; or a ``Recording`` of measured signals,
        uniformly sampled.
    model
        the driveline of a recording, for inertias, radii, drag torques, orders and speed; None if there is none. A run
        has its own model.
    names
        of metrics (column ``metric``); None takes all.
    speed
        reference speed of a recording [rad/s]; None takes the mean of its channel "speed", or else the speed of the
        model if it is constant.
    orders
        of the engine's torque; None takes those of the model's torques.
    base_level
        level of the gearbox without rattle, for the rattle level [dB]; None leaves it uncalibrated.
    kappa
        factor from the intensity of impacts to sound, for the rattle level [1/N]; None leaves it uncalibrated.
    kind
        "steady"; or "transient", with impacts, peak and rms torques and accelerations of an event (metric "event")
        instead of averages over cycles. None: transient if a torque has ramps or is a record, as in ``criteria``; a
        recording and chunks of a long motion are steady.

    Returns
    -------
    pd.DataFrame
        One row per value: metric, subject, quantity, value, unit, window, source, note. A missing value is NaN and has
        a note. ``attrs["notes"]`` holds the notes on all values together.

    Raises
    ------
    ModelError
        unknown name of a metric, recording with faults, speed that is not positive.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=40, discard=20)
    >>> table = gr.metrics(run, names=["impact_intensity"])
    >>> table[["subject", "quantity"]].to_dict("records")[0]
    {'subject': 'spline', 'quantity': 'mean restitution'}
    """
    import pandas as pd

    # metrics to compute
    if kind is not None:
        check_arguments(kind=(Choice(KINDS), kind))
    event = event_metric_of(source) if _is_event(source, kind) else None
    chosen = _chosen(names, base_level, kappa, event)
    units = "SI"
    # inputs of a run, of chunks or of a recording
    if isinstance(source, str | os.PathLike) or not isinstance(source, Iterable | Run | Recording):
        check_run(source, (Recording,))
    if not isinstance(source, Recording):
        if model is not None or speed is not None:
            rule = "a run brings its own model and speed"
            raise ModelError(Problem("model" if model is not None else "speed", "given", rule, "leave it out"))
        if isinstance(source, Run):
            inputs = inputs_of(source, orders)
            units = source.model.units
        else:
            inputs, units = _inputs_of_chunks(source, orders)
    else:
        inputs = _inputs_of_recording(source, model, speed, orders)
        units = units if model is None else model.units
    # measure, one row per value
    rows = _measured(inputs, chosen, units, is_event=event is not None)
    table = pd.DataFrame([row.table_row("metric") for row in rows])
    notes = [*inputs.notes, *([_left_out()] if event is not None and names is None else [])]
    table.attrs |= {KIND: "metrics", "notes": notes}
    return table


def metrics_of_run(run: Run) -> tuple[Row, ...]:
    """Return every metric of a run; for an event only the metrics that apply to events."""
    event = event_metric_of(run) if _is_event(run, None) else None
    chosen = _chosen(None, None, None, event)
    return tuple(_measured(inputs_of(run), chosen, run.model.units, is_event=event is not None))


def _is_event(source: object, kind: str | None) -> bool:
    """Return whether a source is measured as an event; ModelError for chunks with ``kind`` "transient"."""
    if isinstance(source, Run):
        return is_driven_over_time(source.model) if kind is None else kind == TRANSIENT
    if kind == TRANSIENT and not isinstance(source, Recording):
        raise ModelError(Problem("kind", kind, "chunks of a long motion are no event", "simulate the event as one run"))
    return kind == TRANSIENT


def event_metric_of(source: object) -> EventMetric:
    """Return the metric of an event, which begins at the first ramp of a run."""
    if not isinstance(source, Run):
        return EventMetric()
    begins = [begin for torque in source.model.torques for begin, _ in spans_of(torque.ramps)]
    return EventMetric(min(begins, default=None))


def _measured(inputs: Inputs, chosen: Sequence[Quantity[Inputs]], units: str, *, is_event: bool) -> list[Row]:
    """Return the rows of metrics; for an event, metrics that average over cycles have one row that says so."""
    rows: list[Row] = []
    for metric in chosen:
        if is_event and not metric.of_events:
            note = f"{metric.title}: {_AVERAGES}; {_REMEDY}"
            rows.append(metric.row("", metric.title, math.nan, note=note, error=math.nan))
        else:
            rows += rows_of(inputs, [metric], units=units)
    return rows


def _left_out() -> str:
    """Note which metrics do not apply to an event."""
    names = listed([metric.name for metric in METRICS if not metric.of_events], "and")
    return f'an event is not measured by averages over cycles ({names}); kind = "steady" gives them'


def inputs_of(run: Run, orders: Sequence[float] | None = None) -> Inputs:
    """Return the inputs of metrics for a run; ModelError if all cycles are discarded."""
    model = run.model
    trajectory = run.trajectory
    return inputs_of_motion(trajectory, orders_of(model, orders))


def _inputs_of_chunks(chunks: Iterable[Run], orders: Sequence[float] | None) -> tuple[Inputs, str]:
    """Return the inputs of metrics for the chunks of one motion, and the units of its model.

    ModelError if chunks are not consecutive, or if all their cycles are discarded.
    """
    sums, engine, model = add_chunks(chunks, METRICS, "measured", orders)
    return inputs_of_chunks(sums, engine), model.units


def _inputs_of_recording(
    recording: Recording, model: Model | None, speed: float | None, orders: Sequence[float] | None
) -> Inputs:
    if speed is not None and not 0.0 < speed < float("inf"):
        raise ModelError(Problem("speed", f"{speed}", "must be positive [rad/s]", "leave it out to take the model's"))
    if speed is None and model is not None and model.excitation.sweep is None and recording.find("speed") is None:
        speed = model.excitation.omega
    if orders is None:
        orders = [] if model is None else orders_of(model).tolist()
    layout = None if model is None else assemble(model).layout
    return inputs_of_recording(recording, layout, speed, orders)


def _chosen(
    names: Sequence[str] | None, base_level: float | None, kappa: float | None, event: EventMetric | None
) -> list[Quantity[Inputs]]:
    """Return the metrics with these names, the rattle level with its calibration; for an event those that apply."""
    if kappa is not None and not 0.0 < kappa < float("inf"):
        raise ModelError(Problem("kappa", f"{kappa}", "must be positive [1/N]", "leave it out without a calibration"))
    known: dict[str, Quantity[Inputs]] = {metric.name: metric for metric in METRICS}
    known["rattle_level"] = RattleLevel(base_level, kappa)
    if names is None:
        suited = [metric for metric in known.values() if event is None or metric.of_events]
        return suited if event is None else [event, *suited]
    known["event"] = EventMetric() if event is None else event
    wrong = [name for name in names if name not in known]
    if wrong:
        rule = f"there is no such metric; there are {', '.join(known)}"
        raise ModelError([Problem("names", name, rule, did_you_mean(name, tuple(known))) for name in wrong])
    return [known[name] for name in dict.fromkeys(names)]
