"""Metrics of an event: impacts and their energy loss, and peak and rms torques and accelerations during the event.

Most metrics are averages over cycles. They have no meaning for a tip-in, because they depend on the length of the run
after it. An event is measured from its start until every torque has settled (``quantities.event``), or to the end of
the run if they do not settle. It starts at the first ramp, or else at the end of the discarded cycles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.quantities.event import Event, event_of
from gearrattle.quantities.metric_inputs import Inputs, sampled
from gearrattle.quantities.quantity import Quantity, Row, deflection_rate_unit
from gearrattle.signals import is_gap, measure_impacts, reduced_inertia
from gearrattle.signals.levels import thinned
from gearrattle.signals.summaries import summary_of
from gearrattle.trajectory import Array

WHOLE = "driveline"
"""The subject of rows about no single part."""
_LEVELS = ("torque", "acceleration")
_UNITS = {"torque": "N m", "acceleration": "rad/s^2"}
_WORDS = {"torque": "torque", "acceleration": "angular acceleration"}


@dataclass(frozen=True)
class EventMetric(Quantity[Inputs]):
    """Numbers of an event from its begin [s]; None: from the end of the discarded cycles."""

    begin: float | None = None
    of_events: bool = True
    name: str = "event"
    title: str = "The event"
    formula: str = "impacts m v^2 / 2; max |x| and <x^2>^(1/2) from the start of the event until it has settled"
    unit: str = "1"
    source: str = "definition: from the log of crossings, and the samples of the event"
    window: str = "the event"
    sampling: str = "of impacts none; of torques and accelerations: well above the frequency of stiff contacts"
    merging: str = "not of chunks: a long motion is no event"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return impacts of every gap, and levels of every torque and acceleration; for a recording only levels."""
        first = float(inputs.time[0]) if self.begin is None else max(self.begin, float(inputs.time[0]))
        last = float(inputs.time[-1])
        rows = []
        event = None
        if inputs.motion is not None:
            event = event_of(inputs.motion, inputs.known_layout.negligible)
            last = last if event.settled is None else max(event.settled, first)
            rows = self._of_the_whole(event, last - first, inputs.interval) + self._of_gaps(inputs)
        inside = (inputs.time >= first) & (inputs.time <= last)
        if np.count_nonzero(inside) < 3:
            inside[:] = True
        exact = _exact_peaks(inputs, event)
        for quantity in _LEVELS:
            for subject, signal in inputs.of(quantity).items():
                if isinstance(signal, np.ndarray):
                    unit = inputs.units.get((quantity, subject), _UNITS[quantity])
                    rows += self._levels(inputs, (quantity, subject, unit), inside, exact.get((quantity, subject)))
        return rows

    def _of_the_whole(self, event: Event, length: float, interval: float) -> list[Row]:
        """Return times and number of impacts."""
        none = "no gap is closed"
        hardest = event.hardest
        where = none if hardest is None else f"the hardest impact is of {hardest.part}"
        at = math.nan if event.first_impact is None else event.first_impact
        last = math.nan if event.last_impact is None else event.last_impact
        unsettled = "" if event.settled is not None else "not settled when the run ends: at least this long"
        return [
            self.row(WHOLE, "first impact", at, "s", none if event.first_impact is None else ""),
            self.row(WHOLE, "impacts", event.impacts, "1"),
            self.row(WHOLE, "last impact", last, "s", "no impact counts" if event.last_impact is None else ""),
            self.row(WHOLE, "time to settle", length, "s", unsettled, interval),
            self.row(WHOLE, "hardest impact", 0.0 if hardest is None else hardest.energy, "J", where),
            self.row(WHOLE, "instant of the hardest impact", math.nan if hardest is None else hardest.time, "s", where),
        ]

    def _of_gaps(self, inputs: Inputs) -> list[Row]:
        """Return for every gap the hardness of its impacts and the energy that they lose."""
        layout = inputs.known_layout
        rows = []
        for k, name in enumerate(layout.clearance_names):
            if not is_gap(layout, k):
                continue
            element = int(layout.clearance[k])
            mass = reduced_inertia(layout, element)
            largest = float(measure_impacts(inputs.crossings, layout, k).largest_speed)
            speed = 0.0 if math.isnan(largest) else largest
            rows += [
                self.row(name, "largest approach speed", speed, deflection_rate_unit(layout, element)),
                self.row(name, "largest impact energy", 0.5 * mass * speed**2, "J"),
                self.row(name, "energy lost in impacts", 0.5 * mass * inputs.contacts(k).squares, "J"),
            ]
        return rows

    def _levels(
        self, inputs: Inputs, signal: tuple[str, str, str], inside: NDArray[np.bool_], exact: float | None
    ) -> list[Row]:
        """Return peak, time of the peak, and rms of a signal over the event."""
        quantity, subject, unit = signal
        word = _WORDS[quantity]
        samples = np.asarray(inputs.signals[quantity, subject])[inside]
        summary = summary_of(samples)
        at = float(inputs.time[inside][int(np.argmax(np.abs(samples)))])
        peak = summary.peak if exact is None else exact
        error = summary.miss if exact is None else 0.0
        note = sampled(subject, summary, peak) if exact is None else ""
        level = _rms(samples)
        apart = max((abs(_rms(some) - level) for some in thinned(samples)), default=math.nan)
        return [
            self.row(subject, f"peak {word}", peak, unit, note, error),
            self.row(subject, f"instant of the peak {word}", at, "s", error=inputs.interval),
            self.row(subject, f"rms {word}", level, unit, error=apart),
        ]


def _exact_peaks(inputs: Inputs, event: Event | None) -> dict[tuple[str, str], float]:
    """Return the largest torques and accelerations that are known between samples, by quantity and subject."""
    motion = inputs.motion
    if motion is None or motion.exact is None or event is None:
        return {}
    known = motion.exact.signals(motion)
    peaks = {("torque", name): abs(p.value) for name, p in event.peak_torque.items() if ("force", name) in known}
    accelerations = [signal for signal in known if signal[0] == "acceleration"]
    statistics = motion.exact.statistics(motion, accelerations, with_moments=False) if accelerations else None
    if statistics is not None:
        sides = zip(accelerations, statistics.low.tolist(), statistics.high.tolist(), strict=True)
        peaks |= {signal: max(high, -low) for signal, low, high in sides}
    return peaks


def _rms(samples: Array) -> float:
    return float(np.sqrt(np.mean(samples**2)))
