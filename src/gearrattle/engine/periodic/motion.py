"""A motion over whole periods: its states, crossings, gradient, and the turning points of its deflections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.crossings_in_order import Passages

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


DECIDED = -1
"""Piece of an auxiliary that follows from the rest of the state."""
_FREE = 1e-9  # a singular value below this is zero


@dataclass(frozen=True)
class Touch:
    """Which corner is touched, and about when.

    corner: which one of the clearance's law, counted from below; None: the next one where the extremum lies, except for
    visits beyond a corner that are so short that they may be rounding.
    """

    watch: int  # the clearance; behind all of them, the auxiliary.
    upward: int  # 1: its deflection, or what it watches, grows towards the corner.
    time: float  # of the extremum, in periods from the start of the motion
    corner: int | None = None


@dataclass(frozen=True)
class State:
    """A state at the start of a period, which decides the motion from there.

    auxiliary_pieces: (C,) pieces of the auxiliaries, ``DECIDED`` for those without a memory, which deflection, rate and
    clock decide; None: deflections and rates decide them, with no memory loaded.
    """

    y: Array  # (N,) deflections of the basis, velocities, memories of auxiliaries [SI]
    auxiliary_pieces: IntArray | None = None


class Approach(NamedTuple):
    """An extremum of a clearance's deflection near a corner."""

    depth: float  # how far it lies beyond the corner [SI]
    time: float  # in periods from the start
    acceleration: float  # of the deflection [SI]
    slope: Array  # (N + 1,) of the depth, by the state at the start and by a parameter [SI]
    time_slope: Array  # (N + 1,) of the time, by the same
    part: int = 0  # of the motion: slopes are by the state at its start


class Dips(NamedTuple):
    """Where rates of deflections come nearest to zero and do not reach it: two turning points may appear there."""

    watch: IntArray  # (D,) clearance
    upward: IntArray  # (D,) ``kernels.turning_point_depths.RISING`` or FALLING, by the sign of the rate
    time: Array  # (D,) in periods from the start
    depth: Array  # (D,) how far the rate lies beyond zero, a negative number [SI, per period]
    slope: Array  # (D,) of that along a direction
    time_slope: Array  # (D,) of the time along it
    level: Array  # (D,) how far the deflection is from the corner nearest to it [SI]
    level_slope: Array  # (D,) of that along the direction


class Turns(NamedTuple):
    """The E turning points of a motion's deflections, each by a corner that it has not reached, or has passed.

    With them come its dips, and the slopes of the instants of its C crossings.
    """

    watch: IntArray  # (E,) clearance
    upward: IntArray  # (E,) 1: its deflection grows towards the corner
    time: Array  # (E,) in periods from the start
    depth: Array  # (E,) how far it lies beyond the corner [SI]
    slope: Array  # (E,) of the depth along a direction
    time_slope: Array  # (E,) of the time along it
    dips: Dips
    delay: Array  # (C,) by how much each crossing of the motion comes later along it [periods]

    def scaled(self, factor: float) -> Turns:
        """Return them with slopes along a direction so many times as long."""
        slopes = {name: factor * getattr(self.dips, name) for name in ("slope", "time_slope", "level_slope")}
        dips = self.dips._replace(**slopes)
        ours = {name: factor * getattr(self, name) for name in ("slope", "time_slope", "delay")}
        return self._replace(dips=dips, **ours)


OF_TURNS = [name for name in Turns._fields if name not in ("dips", "delay")]
"""Fields with an entry for every turning point."""


class Along(NamedTuple):
    """The change along which slopes of the turning points of a part of a motion are."""

    state: Array  # (N,) at the start of the part [SI]
    parameter: float
    outside: IntArray  # (2, K) 1 upwards, 0 downwards: what clearances cross before, and after the part; -1: nothing


class Parts(NamedTuple):
    """The m parts of a motion, of equal length; the end of one may differ from the start of the next."""

    start: Array  # (m, N) [SI]
    end: Array  # (m, N) [SI]
    gradient: Array  # (m, N, N) d end / d start [SI]
    slope: Array  # (m, N) d end / d parameter for a fixed start [SI]


@dataclass(frozen=True)
class Pass:
    """A motion over n periods.

    start, end: its states.
    crossings: all of them and all changes by the clock, in order of time; one at a time at which the motion begins and
    ends comes last.
    """

    start: State
    end: State
    gradient: Array  # (N, N) d end / d start [SI]
    turned: Array  # (R,) how far the reference inertia of every free train has turned [rad]
    crossings: Passages
    period: float  # T [s]
    cycles: int  # n
    approach: Approach | None = None  # of a clearance to a corner; None: there is no extremum, or none was asked for.
    turns: Turns | None = None  # turning points; None: they are not known.
    parts: Parts | None = None  # of a motion that was followed in parts; None: it was followed as a whole.

    @property
    def gap(self) -> Array:
        """(N,) end - start."""
        return self.end.y - self.start.y


def joined(parts: Sequence[Pass], period: float, cycles: int) -> Pass:
    """Return motions of one length that follow one another as one over so many periods [s]."""
    gradient = np.eye(len(parts[0].gradient))
    length = cycles * period / len(parts)
    for part in parts:
        gradient = part.gradient @ gradient
    logs = [part.crossings for part in parts]
    crossings = Passages(
        np.concatenate([i * length + log.time for i, log in enumerate(logs)]),
        np.concatenate([log.watch for log in logs]),
        np.concatenate([log.upward for log in logs]),
        np.concatenate([log.velocity for log in logs]),
        np.concatenate([log.memory for log in logs]),
    )
    turned = np.sum([part.turned for part in parts], axis=0)
    return Pass(parts[0].start, parts[-1].end, gradient, turned, crossings, period, cycles)


def idle_memories(motion: Pass, scale: Array, memories: int) -> IntArray:
    """Return which entries of the state are memories that are released all along a motion, and may be anything.

    scale: (N,) balanced = scale * SI.
    """
    matrix = np.abs(scale[:, None] * motion.gradient / scale - np.eye(scale.size))
    is_idle = (matrix.max(axis=0) < _FREE) & (matrix.max(axis=1) < _FREE)
    is_idle[: scale.size - memories] = False
    return np.flatnonzero(is_idle)
