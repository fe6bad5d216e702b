"""``metrics``: rattle metrics of a run, of the chunks of a long one, or of a recording, as a table.

Of a run everything is known; of chunks all that adds up, and ``merging`` of each metric says what does not. Of a
recording, what a model, a speed and orders say beside it; a metric that lacks something gives one row that says what.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean
from gearrattle.quantities import (
    METRICS,
    Heard,
    Metric,
    RattleLevel,
    Row,
    gather_motion,
    hear_chunks,
    hear_motion,
    hear_recording,
    measure,
)
from gearrattle.recording import Recording
from gearrattle.result import KIND
from gearrattle.results import Run, check_run
from gearrattle.trajectory import Array
from gearrattle.wording import counted

if TYPE_CHECKING:
    import pandas as pd

BARE = frozenset({"1", "1/cycle", "dB"})
"""Units that a dimensionless model has as well."""


def metrics(
    source: Run | Recording | Iterable[Run],
    model: Model | None = None,
    names: Sequence[str] | None = None,
    *,
    speed: float | None = None,
    orders: Sequence[float] | None = None,
    base_level: float | None = None,
    kappa: float | None = None,
) -> pd.DataFrame:
    """Measure a run or a recording by every rattle metric, or by some.

    Args:
        source: from ``simulate`` or ``open_run``; or the chunks of one long motion, in order, from ``stream`` or
            ``open_stream``, measured as one, and none of them kept; or a ``Recording`` of measured signals, uniformly
            sampled.
        model: the driveline of a recording: inertias, radii, drag torques, orders, speed; None without. A run brings
            its own.
        names: of metrics (column ``metric``); None takes all.
        speed: reference speed of a recording [rad/s]; None takes the mean of its channel "speed", then the model's.
        orders: of the engine's torque; None takes those of the model's torques.
        base_level: level of the gearbox without rattle, for the rattle level [dB]; None leaves it uncalibrated.
        kappa: what makes a level of the intensity of impacts [1/N]; None leaves it uncalibrated.

    Returns:
        One row a value: metric, subject, quantity, value, unit, window, source, note. What there is not is NaN, with
        a note. ``attrs["notes"]`` holds what there is to know about all of them.

    Raises:
        ModelError: a name there is not, an ill recording, a speed that is not positive.
    """
    import pandas as pd

    chosen = _chosen(names, base_level, kappa)
    units = "SI"
    if isinstance(source, str | os.PathLike) or not isinstance(source, Iterable | Run | Recording):
        check_run(source, (Recording,))
    if not isinstance(source, Recording):
        if model is not None or speed is not None:
            rule = "a run brings its own model and speed"
            raise ModelError(Problem("model" if model is not None else "speed", "given", rule, "leave it out"))
        if isinstance(source, Run):
            heard, units = heard_of(source, orders), source.model.units
        else:
            heard, units = _heard_in_chunks(source, orders)
    else:
        heard = _heard_on_a_rig(source, model, speed, orders)
        units = units if model is None else model.units
    table = pd.DataFrame([asdict(row) for row in rows_of(heard, chosen, units)])
    table.attrs |= {KIND: "metrics", "notes": list(heard.notes)}
    return table


def rows_of(
    heard: Heard, chosen: Sequence[Metric] = METRICS, units: str = "SI", quantities: Collection[str] | None = None
) -> list[Row]:
    """Return the rows, of some quantities alone if these are named; without units, a dimension reads "1"."""
    rows = measure(heard, chosen, quantities)
    return rows if units == "SI" else [row if row.unit in BARE else replace(row, unit="1") for row in rows]


def heard_of(run: Run, orders: Sequence[float] | None = None) -> Heard:
    """Return what metrics hear of a run.

    Raises:
        ModelError: if no cycle remains after the discarded ones.
    """
    model, trajectory = run.model, run.trajectory
    engine = engine_orders(model) if orders is None else np.unique(np.asarray(orders, dtype=np.float64))
    return hear_motion(trajectory, engine, one_speed=model.excitation.sweep is None)


def _heard_in_chunks(chunks: Iterable[Run], orders: Sequence[float] | None) -> tuple[Heard, str]:
    """Return what metrics hear of the chunks of one motion, and the units of its model.

    Raises:
        ModelError: chunks that do not follow each other, or none that is not discarded.
    """
    tally, end, last = None, None, None
    engine = np.zeros(0)
    for last in chunks:
        chunk = last.trajectory
        if end not in (None, chunk.first_cycle):
            rule = f"must follow the chunk before, which ends at cycle {end}"
            raise ModelError(Problem("chunk", f"one that begins at cycle {chunk.first_cycle}", rule))
        if end is None:
            engine = engine_orders(last.model) if orders is None else np.unique(np.asarray(orders, dtype=np.float64))
        end = chunk.first_cycle + chunk.cycles
        tally = gather_motion(chunk, engine, tally)
    if last is None or tally is None or tally.moments is None:
        raise ModelError(
            Problem("discard", f"all of {counted(end or 0, 'cycle')}", "at least one cycle must remain to be measured")
        )
    steady = last.model.excitation.sweep is None
    return hear_chunks(tally, last.trajectory.cost.algorithm, engine, one_speed=steady), last.model.units


def engine_orders(model: Model) -> Array:
    """Return the orders of the torques' harmonics that are not zero, ascending."""
    return np.unique([h.order for t in model.torques for h in t.harmonics if h.amplitude and h.order])


def _heard_on_a_rig(
    recording: Recording, model: Model | None, speed: float | None, orders: Sequence[float] | None
) -> Heard:
    if speed is not None and not 0.0 < speed < float("inf"):
        raise ModelError(Problem("speed", f"{speed}", "must be positive [rad/s]", "leave it out to take the model's"))
    if speed is None and model is not None and recording.find("speed") is None:
        speed = model.excitation.omega
    if orders is None:
        orders = [] if model is None else engine_orders(model).tolist()
    layout = None if model is None else assemble(model).layout
    return hear_recording(recording, layout, speed, orders)


def _chosen(names: Sequence[str] | None, base_level: float | None, kappa: float | None) -> list[Metric]:
    """Return the metrics of these names, the rattle level with its calibration."""
    if kappa is not None and not 0.0 < kappa < float("inf"):
        raise ModelError(Problem("kappa", f"{kappa}", "must be positive [1/N]", "leave it out without a calibration"))
    known = {metric.name: metric for metric in METRICS}
    known["rattle_level"] = RattleLevel(base_level, kappa)
    wrong = [name for name in names or () if name not in known]
    if wrong:
        rule = f"there is no such metric; there are {', '.join(known)}"
        raise ModelError([Problem("names", name, rule, did_you_mean(name, tuple(known))) for name in wrong])
    return list(known.values()) if names is None else [known[name] for name in dict.fromkeys(names)]
