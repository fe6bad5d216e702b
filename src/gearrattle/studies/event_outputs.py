"""Outputs of a study of events: first impact, number of impacts, peak torques, time to settle, length of the ramps.

All motions have the first four, steady ones with their start-up too; the last is a number of the model alone. "hardest
impact" is not among them: it comes from the crossings, as an output of the whole driveline (``output.WORST``).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.model import Model
from gearrattle.model.ramps import spans_of
from gearrattle.quantities.event import event_of
from gearrattle.results import Run
from gearrattle.studies.output import EVENT, Output
from gearrattle.trajectory import Layout

FIRST = "first impact"
COUNT = "impacts"
PEAK = "peak torque"
SETTLE = "time to settle"
RAMP_TIME = "ramp time"
NAMES = frozenset({FIRST, COUNT, PEAK, SETTLE, RAMP_TIME})
"""Outputs that are worked out here; others of an event are quantities of the metric "event"."""


def known_event_outputs(model: Model, layout: Layout) -> dict[str, Output]:
    """Return the outputs of an event that a driveline has, by name."""
    is_si = model.units == "SI"
    second, torque = ("s", "N m") if is_si else ("1", "1")
    elements = layout.element_names
    outputs = [
        Output(FIRST, "", (), (second,), criterion=EVENT, lacking="no impact"),
        Output(COUNT, "", (), ("1",), criterion=EVENT),
        Output(PEAK, "part", elements, (torque,) * len(elements), criterion=EVENT),
        Output(SETTLE, "", (), (second,), criterion=EVENT),
    ]
    if _ramp_spans(model):
        outputs.append(Output(RAMP_TIME, "", (), (second,), criterion=EVENT))
    return {output.name: output for output in outputs}


def values_of_event(outputs: Sequence[Output], run: Run) -> dict[str, NDArray[np.float64]]:
    """Return outputs of an event, (subjects,) or ()."""
    spans = _ramp_spans(run.model)
    if all(output.name == RAMP_TIME for output in outputs):
        return {output.name: np.array(_length_of(spans)) for output in outputs}
    trajectory = run.trajectory
    event = event_of(trajectory, trajectory.layout.negligible)
    peaks = event.peak_torque
    begin = min((start for start, _ in spans), default=0.0)
    end = float(trajectory.time[-1]) if event.settled is None else event.settled
    numbers = {
        FIRST: np.nan if event.first_impact is None else event.first_impact,
        COUNT: float(event.impacts),
        SETTLE: max(end - begin, 0.0),
        RAMP_TIME: _length_of(spans),
    }
    values = {output.name: np.array(numbers[output.name]) for output in outputs if output.name != PEAK}
    for output in outputs:
        if output.name == PEAK:
            sizes = [abs(peaks[part].value) if part in peaks else np.nan for part in output.subjects]
            values[PEAK] = np.array(sizes, dtype=np.float64)
    return values


def _ramp_spans(model: Model) -> list[tuple[float, float]]:
    """Return when every ramp of every torque begins and ends [s]."""
    return [span for torque in model.torques for span in spans_of(torque.ramps)]


def _length_of(spans: Sequence[tuple[float, float]]) -> float:
    """Return the time from the start of the first ramp to the end of the last one [s]; 0 without ramps."""
    if not spans:
        return 0.0
    return max(end for _, end in spans) - min(begin for begin, _ in spans)
