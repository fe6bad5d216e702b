"""Errors in the times of crossings and impacts, and the numbers that a solver missed or invented.

Crossings are matched per clearance, corner and direction, in order of time (``signals.align``): a brief double
crossing that one solver steps over counts as missed and shifts no other match. No pair is further apart than the
*reach*, by default a quarter of the shortest excitation period: a larger difference means another crossing. Impacts
(``signals.find_impacts``) are matched in the same way.

Crossings count up to the horizon; one just after it may still be the partner of one before it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gearrattle.comparison.comparison_record import Record
from gearrattle.comparison.pair_checks import same_grid
from gearrattle.signals import align, find_impacts
from gearrattle.trajectory import Array, IntArray, Trajectory

Kind = Literal["crossing", "impact"]


@dataclass(frozen=True)
class Matches(Record):
    """The events of one kind at one corner.

    Attributes
    ----------
    corner
        where [rad or m].
    direction
        1 for growing, -1 for falling deflection.
    time_error
        (p,) given - reference of every pair [s].
    missed
        (q,) times of the reference's events without a partner [s].
    invented
        (r,) times of the given motion's events without a partner [s].
    """

    clearance: str
    corner: float
    direction: int
    time_error: Array
    missed: Array
    invented: Array


@dataclass(frozen=True)
class EventSummary(Record):
    """Counts of some matches, and magnitudes of their time errors [s], which are NaN without a pair."""

    reference: int
    matched: int
    missed: int
    invented: int
    largest: float
    median: float
    rms: float


@dataclass(frozen=True)
class EventComparison(Record):
    """All events of two motions against each other.

    Attributes
    ----------
    horizon
        end of the window [s].
    reach
        largest distance of a pair [s].
    matches
        by clearance, corner and direction; only where one of the motions has events.
    """

    kind: Kind
    horizon: float
    reach: float
    matches: tuple[Matches, ...]
    total: EventSummary

    def of(self, clearance: str) -> EventSummary:
        """Return the summary of one clearance, by name."""
        return summary(tuple(match for match in self.matches if match.clearance == clearance))


def summary(matches: tuple[Matches, ...]) -> EventSummary:
    """Return counts and time errors of several matches together."""
    errors = np.abs(np.concatenate([np.empty(0), *(match.time_error for match in matches)]))
    missed = sum(match.missed.size for match in matches)
    some = bool(errors.size)
    return EventSummary(
        reference=errors.size + missed,
        matched=errors.size,
        missed=missed,
        invented=sum(match.invented.size for match in matches),
        largest=float(errors.max()) if some else float("nan"),
        median=float(np.median(errors)) if some else float("nan"),
        rms=float(np.sqrt(np.mean(errors**2))) if some else float("nan"),
    )


def compare_crossings(
    candidate: Trajectory, reference: Trajectory, horizon: float | None = None, *, reach: float | None = None
) -> EventComparison:
    """Return how the corner crossings of two motions match inside [0, horizon].

    Parameters
    ----------
    horizon
        end of the window [s]; None: the whole motion.
    reach
        largest distance of a pair [s]; None: ``default_reach``.

    Raises
    ------
    ModelError
        other driveline or other grid.
    """
    return _compare("crossing", candidate, reference, horizon, reach)


def compare_impacts(
    candidate: Trajectory, reference: Trajectory, horizon: float | None = None, *, reach: float | None = None
) -> EventComparison:
    """Return how the impacts of two motions match inside [0, horizon]; arguments as ``compare_crossings``."""
    return _compare("impact", candidate, reference, horizon, reach)


def default_reach(reference: Trajectory) -> float:
    """Return a quarter of the shortest excitation period [s]; a twentieth of the period where nothing excites."""
    layout = reference.layout
    return float(0.5 * np.pi / (layout.omega * layout.orders.max())) if layout.orders.size else 0.05 * layout.period


def _compare(
    kind: Kind, candidate: Trajectory, reference: Trajectory, horizon: float | None, reach: float | None
) -> EventComparison:
    same_grid(candidate, reference)
    end = reference.end if horizon is None else min(horizon, reference.end)
    reach = default_reach(reference) if reach is None else reach
    mine = _events(kind, candidate)
    theirs = _events(kind, reference)
    matches = tuple(_matched(reference, mine, theirs, end, reach))
    return EventComparison(kind, end, reach, matches, summary(matches))


@dataclass(frozen=True)
class _Events:
    time: Array
    key: IntArray  # (E, 3) clearance, index of the corner, direction


def _events(kind: Kind, trajectory: Trajectory) -> _Events:
    log = trajectory.events
    rows = np.arange(len(log)) if kind == "crossing" else find_impacts(trajectory).row
    which = log.clearance[rows]
    origin = log.from_region[rows]
    to = log.to_region[rows]
    corner = np.minimum(origin, to) - trajectory.layout.region_of_first_piece[which]
    return _Events(log.time[rows], np.stack([which, corner, np.sign(to - origin)], axis=1))


def _matched(owner: Trajectory, mine: _Events, theirs: _Events, end: float, reach: float) -> Iterator[Matches]:
    layout = owner.layout
    for clearance, corner, direction in np.unique(np.concatenate([mine.key, theirs.key]), axis=0).tolist():
        key = (clearance, corner, direction)
        a, b = (
            events.time[np.all(events.key == key, axis=1) & (events.time <= end + reach)] for events in (mine, theirs)
        )
        alignment = align(a, b, reach)
        counted = b[alignment.reference] <= end
        missed = b[alignment.missed]
        invented = a[alignment.invented]
        match = Matches(
            clearance=layout.clearance_names[clearance],
            corner=float(layout.corners[clearance][corner]),
            direction=direction,
            time_error=(a[alignment.candidate] - b[alignment.reference])[counted],
            missed=missed[missed <= end],
            invented=invented[invented <= end],
        )
        if match.time_error.size + match.missed.size + match.invented.size:
            yield match
