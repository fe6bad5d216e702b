"""A branch and a run in parts: of one stability and one direction of the value, and of a period.

Takes a Branch; gives its parts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.period_map import PeriodMap, State
from gearrattle.engine.periodic.point import Point
from gearrattle.orbits.branch_members import Followed
from gearrattle.orbits.run_distance import Grid
from gearrattle.orbits.stability import courses_of

Array = NDArray[np.float64]

_SAME = 1e-6  # of a value: an end that is nearer is reached
_ROUNDING = 1e-13  # of a value: a smaller step does not turn back


@dataclass(frozen=True)
class BranchPart:
    """A part of a branch of one stability over which its value only grows, or only falls.

    Attributes
    ----------
    is_stable
        whether its motions are.
    line
        a number: parts of one line follow each other with no fold in between.
    value
        (N,) growing [SI].
    peak_to_peak
        (N, K) deflections of the K clearances [rad or m].
    branch
        number of the branch.
    nodes
        N motions, those of events included.
    events
        those at its two ends: rows of ``Branch.events``, or -1.
    """

    is_stable: bool
    line: int
    value: Array
    peak_to_peak: Array
    branch: int
    nodes: tuple[Point, ...]
    events: tuple[int, int]

    def at(self, value: float | Array) -> Array:
        """(..., K) peak-to-peak deflections at values; those of the end beyond it."""
        swings: Array = np.stack([np.interp(value, self.value, column) for column in self.peak_to_peak.T], axis=-1)
        return swings

    def reaches(self, value: float) -> bool:
        """Whether there is a motion at a value; ends but for rounding included."""
        rounding = _SAME * abs(value)
        return bool(self.value[0] - rounding <= value <= self.value[-1] + rounding)


@dataclass(frozen=True)
class RunParts:
    """A run in parts of a period.

    Attributes
    ----------
    upward
        whether the speed grows.
    per_period
        parts of a period T.
    value
        (Q,) in the middle of every part [SI].
    highest, lowest
        (Q, K) deflections in every part [rad or m].
    deflection
        (Q, M, K) at M instants of every part, evenly spread from its begin on [rad or m].
    starts
        (P,) at the starts of the periods T, in the order of the run [SI].
    state_before
        gives, for a value and a period map, the state at the start of the period in which the value is reached.
    """

    upward: bool
    per_period: int
    value: Array
    highest: Array
    lowest: Array
    deflection: Array
    starts: Array
    state_before: Callable[[float, PeriodMap], State]

    @property
    def grid(self) -> Grid:
        """The instants of a period."""
        return Grid(self.per_period, self.deflection.shape[1])

    def passed(self, value: float) -> NDArray[np.bool_]:
        """(Q,) whether the middle of a part lies beyond a value."""
        return self.value > value if self.upward else self.value < value


def branch_parts(branch: Followed) -> Sequence[BranchPart]:
    """The parts of all branches of one stability, ends at events included."""
    swings, event_swings = branch.data["peak_to_peak"].values, branch.event_levels[:, 1] - branch.event_levels[:, 0]
    located = [event.point for events in branch.events_of_curves for event in events]
    motions, first_line = list[BranchPart](), 0
    for number, course in enumerate(courses_of(branch)):
        lines = first_line + _turns(course.value)
        first_line = int(lines[-1]) + 1 if course.stable else first_line
        steps = enumerate(zip(course.stable, lines.tolist(), strict=True))
        for (is_stable, line), group in groupby(steps, key=lambda step: step[1]):
            own = [step for step, _ in group]
            part = slice(own[0], own[-1] + 2)
            value, nodes = course.value[part], course.nodes[part]
            swing = np.array([swings[i] if e < 0 else event_swings[e] for i, e in nodes])
            order = np.argsort(value, kind="stable")
            every = tuple(branch.points[i] if e < 0 else located[e] for i, e in (nodes[k] for k in order))
            ends = nodes[0][1], nodes[-1][1]
            known = (number, every, ends)
            motions.append(BranchPart(is_stable, line, value[order], swing[order], *known))
    return motions


def _turns(value: Array) -> NDArray[np.int64]:
    """(N - 1,) how often (N,) values have turned back before each of their steps."""
    steps = np.diff(value)
    signs = np.sign(np.where(np.abs(steps) <= _ROUNDING * np.abs(value[1:]), 0.0, steps))
    moved = np.maximum.accumulate(np.where(signs != 0.0, np.arange(len(signs)), 0))
    filled = signs[moved]
    return np.concatenate([[0], np.cumsum(filled[1:] * filled[:-1] < 0.0)])[: len(steps)]
