"""Characteristic numbers of a transient event: its first and hardest impact, its duration, and the peak torques.

Averages over cycles have no meaning for an event, such as a tip-in. It is described by the first impact, the hardest
impact, the number of impacts until the torques have settled, and the largest torque of every element.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals import Impacts, are_touches, by_parts, find_impacts, is_gap, steady
from gearrattle.trajectory import Array, NegligibleImpacts, Trajectory
from gearrattle.wording import counted, engineering

_BAND = 0.05
"""Share of the largest change of a torque: the torque has settled when it stays this close to its final mean."""


class PeakTorque(NamedTuple):
    """The largest torque at the first end of an element: value with sign [N m], and time [s]."""

    value: float
    time: float


@dataclass(frozen=True)
class HardestImpact:
    """The impact with the largest energy.

    Attributes
    ----------
    time
        [s].
    approach_speed
        v of the gap [m/s, for a coupling rad/s].
    energy
        m v^2 / 2 [J].
    momentum
        m v [N s, for a coupling N m s].
    """

    part: str
    time: float
    approach_speed: float
    energy: float
    momentum: float


@dataclass(frozen=True)
class Event:
    """Characteristic numbers of a motion that does not repeat, over the cycles that are not discarded.

    Attributes
    ----------
    first_impact
        time at which the first gap closes, negligible impacts included [s]; None if no gap closes.
    hardest
        the impact with the largest energy; None without impacts.
    impacts
        number of impacts of all gaps that are not negligible.
    last_impact
        time at which the last of these impacts begins [s]; None without such impacts.
    settled
        time from which on every torque stays near its mean over the last cycle, within 5 % of its largest change [s];
        None if it does so only in the last cycle.
    peak_torque
        largest torque of every element, by name.
    """

    first_impact: float | None
    hardest: HardestImpact | None
    impacts: int
    last_impact: float | None
    settled: float | None
    peak_torque: Mapping[str, PeakTorque]
    is_si: bool = True

    def to_dict(self) -> dict[str, Any]:
        """Return the event as a dictionary of numbers."""
        peaks = {name: {"value": peak.value, "time": peak.time} for name, peak in self.peak_torque.items()}
        hardest = None if self.hardest is None else asdict(self.hardest)
        times = {"first_impact": self.first_impact, "last_impact": self.last_impact, "settled": self.settled}
        return {**times, "impacts": self.impacts, "hardest": hardest, "peak_torque": peaks}

    @property
    def sentence(self) -> str:
        """The event in a sentence or two."""
        second, joule, torque = ("s", "J", "N m") if self.is_si else ("", "", "")
        words = "No gap is closed."
        if self.hardest is not None:
            hard = self.hardest
            words = (
                f"First impact at {engineering(self.first_impact or 0.0, second)}; the hardest at "
                f"{engineering(hard.time, second)}, of {hard.part} with {engineering(hard.energy, joule)}"
            )
            words += f"; {counted(self.impacts, 'impact')}"
            words += "." if self.last_impact is None else f", the last at {engineering(self.last_impact, second)}."
        largest = max(self.peak_torque.items(), key=lambda item: abs(item[1].value), default=None)
        if largest is not None:
            name, peak = largest
            words += f" Peak torque {engineering(peak.value, torque)} in {name} at {engineering(peak.time, second)}."
        return words


def event_of(trajectory: Trajectory, negligible: NegligibleImpacts, *, is_si: bool = True) -> Event:
    """Return the event of a motion, without its discarded cycles."""
    trajectory = by_parts(trajectory)
    layout = replace(trajectory.layout, negligible=negligible)
    impacts = _of_gaps(trajectory, find_impacts(trajectory).within(steady(trajectory)))
    counted_times = impacts.time[~are_touches(impacts, layout)]
    return Event(
        first_impact=float(impacts.time.min()) if len(impacts) else None,
        hardest=_hardest(trajectory, impacts),
        impacts=int(counted_times.size),
        last_impact=float(counted_times.max()) if counted_times.size else None,
        settled=_settled(trajectory),
        peak_torque=MappingProxyType(_peak_torques(trajectory)),
        is_si=is_si,
    )


def _of_gaps(trajectory: Trajectory, impacts: Impacts) -> Impacts:
    """Return the impacts of gaps, without the stage changes of springs."""
    gaps = np.array([is_gap(trajectory.layout, k) for k in range(trajectory.layout.clearance.size)], dtype=np.bool_)
    return impacts.where(gaps[impacts.clearance])


def _hardest(trajectory: Trajectory, impacts: Impacts) -> HardestImpact | None:
    """Return the impact with the largest energy."""
    if not len(impacts):
        return None
    energy = np.where(np.isfinite(impacts.energy), impacts.energy, 0.0)
    most = int(np.argmax(energy))
    speed = float(abs(impacts.velocity[most]))
    part = trajectory.layout.clearance_names[int(impacts.clearance[most])]
    momentum = float(impacts.mass[most]) * speed
    return HardestImpact(part, float(impacts.time[most]), speed, float(energy[most]), momentum)


def _peak_torques(trajectory: Trajectory) -> dict[str, PeakTorque]:
    """Return the largest torque of every element that turns bodies: of the exact motion where that is known, else of
    its samples.
    """
    layout = trajectory.layout
    judged = steady(trajectory)
    time = judged.closed(trajectory.time)
    torque = judged.closed(trajectory.element_torque)
    exact = _exact_peaks(trajectory)
    peaks = {}
    for k, name in enumerate(layout.element_names):
        if layout.is_bearing[k]:
            continue
        largest = int(np.argmax(np.abs(torque[:, k])))
        peaks[name] = PeakTorque(exact.get(name, float(torque[largest, k])), float(time[largest]))
    return peaks


def _exact_peaks(trajectory: Trajectory) -> dict[str, float]:
    """Return the largest torque of every element whose force is known between samples [N m]."""
    if trajectory.exact is None:
        return {}
    layout = trajectory.layout
    known = trajectory.exact.signals(trajectory)
    turning = [name for name, held in zip(layout.element_names, layout.is_bearing, strict=True) if not held]
    signals = [("force", name) for name in turning if ("force", name) in known]
    statistics = trajectory.exact.statistics(trajectory, signals, with_moments=False) if signals else None
    if statistics is None:
        return {}
    arms = {name: float(layout.radii[k, 0]) for k, name in enumerate(layout.element_names)}
    sides = zip(signals, statistics.low.tolist(), statistics.high.tolist(), strict=True)
    return {name: arms[name] * (high if high >= -low else low) for (_, name), low, high in sides}


def _settled(trajectory: Trajectory) -> float | None:
    """Return the time after which all torques stay within their bands; None if it is in the last cycle."""
    judged = steady(trajectory)
    time = judged.closed(trajectory.time)
    torque = judged.closed(trajectory.element_torque)
    last = min(trajectory.samples_per_cycle, len(time) - 1)
    away = np.abs(torque - torque[-last - 1 :].mean(axis=0))
    beyond: NDArray[np.bool_] = (away > _BAND * away.max(axis=0, initial=0.0)).any(axis=1)
    outside = np.flatnonzero(beyond)
    if not outside.size:
        return float(time[0])
    return None if outside[-1] >= len(time) - 1 - last else float(time[outside[-1] + 1])


def times_of(event: Event) -> Array:
    """Return the times to be marked in plots: first, hardest and last impact [s]."""
    hardest = None if event.hardest is None else event.hardest.time
    marks = (event.first_impact, hardest, event.last_impact)
    return np.array([mark for mark in marks if mark is not None])
