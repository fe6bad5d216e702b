"""The window of a motion that a figure shows, and the units of its axes.

Histories are drawn over normalised cycles, time / T with the common period T; histories of an event over time. They are
drawn twice: the last few cycles (or the cycles with the impacts of an event) in full detail, and the whole run thinned.
Small quantities have an SI prefix, so that the numbers on axes are between 0.1 and 1000.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.quantities.event import times_of
from gearrattle.report.plots.thinning import thin
from gearrattle.signals import Window, last_cycles, steady
from gearrattle.trajectory import Array, Trajectory
from gearrattle.wording import prefixed

if TYPE_CHECKING:
    from gearrattle.report.plots.chosen_parts import Judged

DETAIL_CYCLES = 4
EVENT_CYCLES = 24
"""Largest number of cycles of a transient that are drawn in detail."""
DETAIL_POINTS = 4000
OVERVIEW_POINTS = 3000
COARSE_FROM = 12
"""With fewer samples per cycle, a curve is drawn as points, because a line between them would be wrong."""


@dataclass(frozen=True)
class Scale:
    """A factor to multiply values with, and the unit they are then in."""

    factor: float
    unit: str


def scale(values: Array, unit: str) -> Scale:
    """Choose an SI prefix for values of the given unit; values without a unit keep theirs.

    Values that are not finite are passed over. The unit is e.g. ``"rad"``, and empty for dimensionless quantities.
    """
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max()) if finite.size else 0.0
    return Scale(*prefixed(largest, unit))


def detail(findings: Judged) -> Window:
    """Return what is drawn in detail: the last few cycles, or those in which a transient hits."""
    trajectory = findings.motion.trajectory
    event = findings.verdict.event
    times = np.zeros(0) if event is None else times_of(event)
    if not times.size:
        return last_cycles(trajectory, DETAIL_CYCLES)
    # a cycle before the first impact, one after the last
    judged = steady(trajectory)
    period = trajectory.layout.period
    before = max(0, int((times.min() - judged.start) / period) - 1)
    after = min(judged.cycles, int((times.max() - judged.start) / period) + 2, before + EVENT_CYCLES)
    first = judged.first + before * trajectory.samples_per_cycle
    last = judged.first + after * trajectory.samples_per_cycle
    start = judged.start + before * period
    return Window(start, judged.start + after * period, first, last, after - before)


def detail_words(findings: Judged, window: Window) -> str:
    """Say which cycles are drawn in detail."""
    if findings.verdict.event is not None:
        return "time in which it hits"
    return f"last {window.cycles} cycles simulated" if window.cycles > 1 else "last cycle simulated"


@dataclass(frozen=True)
class TimeAxis:
    """The x axis of histories.

    Attributes
    ----------
    length
        length of a cycle on the axis: 1, or for an event the period.
    words
        words for captions; may be empty.
    """

    trajectory: Trajectory
    length: float
    title: str
    words: str

    @classmethod
    def of(cls, findings: Judged) -> TimeAxis:
        """Return cycles; of an event the time."""
        trajectory = findings.motion.trajectory
        if findings.verdict.event is None:
            return cls(trajectory, 1.0, "time / T  [cycles]", ", in cycles of the common period T")
        title = "time  [s]" if findings.model.units == "SI" else "time"
        return cls(trajectory, trajectory.layout.period, title, "")

    def at(self, time: Array) -> Array:
        """Return where times [s] lie on it."""
        return time * (self.length / self.trajectory.layout.period)

    def ends(self, window: Window) -> tuple[float, float]:
        """Return where a window begins and ends on it."""
        begin, end = self.at(np.array([window.start, window.end])).tolist()
        return begin, end

    def history(self, values: Array, window: Window | None) -> tuple[Array, Array]:
        """Return places on the axis and values (M,) of one curve (Nt,): of a window in detail, or of the whole run
        thinned.
        """
        if window is None:
            index = thin(values, OVERVIEW_POINTS)
        else:
            index = window.first + thin(window.closed(values), DETAIL_POINTS)
        return np.asarray(index * (self.length / self.trajectory.samples_per_cycle)), values[index]


def coarse(trajectory: Trajectory) -> bool:
    """Whether the samples are too far apart to be joined by a line."""
    return trajectory.samples_per_cycle < COARSE_FROM
