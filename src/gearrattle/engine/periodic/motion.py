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
"""In place of a piece: the piece of the auxiliary follows from the rest of the state."""
_FREE = 1e-9  # singular value that counts as zero


@dataclass(frozen=True)
class Touch:
    """The corner that is touched, and the approximate instant.

    corner: its index in the clearance's law, from below; None: the next corner at the extremum, where visits beyond a
    corner that may be rounding are ignored.
    """

    watch: int  # index of the watched quantity: clearances, then auxiliaries
    upward: int  # 1: the watched quantity grows towards the corner
    time: float  # of the extremum, in periods from the start of the motion
    corner: int | None = None


@dataclass(frozen=True)
class State:
    """A state at the start of a period, which determines the motion.

    auxiliary_pieces: (C,) pieces of the auxiliaries; ``DECIDED`` for auxiliaries without a memory, whose pieces follow
    from deflection, rate and clock; None: all follow from deflections and rates, with memories zero.
    """

    y: Array  # (N,) deflections of the basis, velocities, memories of auxiliaries [SI]
    auxiliary_pieces: IntArray | None = None


class Approach(NamedTuple):
    """An extremum of a clearance's deflection near a corner."""

    depth: float  # distance of the extremum beyond the corner [SI]
    time: float  # in periods from the start
    acceleration: float  # of the deflection [SI]
    slope: Array  # (N + 1,) of the depth, by the state at the start and by a parameter [SI]
    time_slope: Array  # (N + 1,) of the time, by the same
    part: int = 0  # index of the part of the motion; slopes are by the state at the start of the part


class Dips(NamedTuple):
    """Extrema of rates near zero, at which two turning points may appear."""

    watch: IntArray  # (D,) clearance
    upward: IntArray  # (D,) ``kernels.turning_point_depths.RISING`` or FALLING, by the sign of the rate
    time: Array  # (D,) in periods from the start
    depth: Array  # (D,) distance of the rate beyond zero, negative [SI, per period]
    slope: Array  # (D,) of the depth along a direction
    time_slope: Array  # (D,) of the time along it
    level: Array  # (D,) distance of the deflection from the nearest corner [SI]
    level_slope: Array  # (D,) of the level along the direction


class Turns(NamedTuple):
    """The E turning points of a motion's deflections near corners, before or beyond them.

    Also the dips of the motion, and the slopes of the instants of its C crossings.
    """

    watch: IntArray  # (E,) clearance
    upward: IntArray  # (E,) 1: its deflection grows towards the corner
    time: Array  # (E,) in periods from the start
    depth: Array  # (E,) distance beyond the corner [SI]
    slope: Array  # (E,) of the depth along a direction
    time_slope: Array  # (E,) of the time along it
    dips: Dips
    delay: Array  # (C,) slope of the instant of every crossing along it [periods]

    def scaled(self, factor: float) -> Turns:
        """Return the turning points with slopes along a direction that is ``factor`` times as long."""
        slopes = {name: factor * getattr(self.dips, name) for name in ("slope", "time_slope", "level_slope")}
        dips = self.dips._replace(**slopes)
        ours = {name: factor * getattr(self, name) for name in ("slope", "time_slope", "delay")}
        return self._replace(dips=dips, **ours)


OF_TURNS = [name for name in Turns._fields if name not in ("dips", "delay")]
"""Fields with an entry for every turning point."""


class Along(NamedTuple):
    """The change that defines the slopes of the turning points of a part of a motion."""

    state: Array  # (N,) at the start of the part [SI]
    parameter: float
    outside: IntArray  # (2, K) last crossing before the part, first one after: 1 upwards, 0 downwards, -1 none


class Parts(NamedTuple):
    """The m parts of a motion, of equal length; the end of one may differ from the start of the next."""

    start: Array  # (m, N) [SI]
    end: Array  # (m, N) [SI]
    gradient: Array  # (m, N, N) d end / d start [SI]
    slope: Array  # (m, N) d end / d parameter for a fixed start [SI]


@dataclass(frozen=True)
class Pass:
    """A motion over n periods.

    start, end: states.
    crossings: all crossings and changes by the clock, in order of time; one at the instant at which the motion begins
    and ends is the last.
    """

    start: State
    end: State
    gradient: Array  # (N, N) d end / d start [SI]
    turned: Array  # (R,) angle through which the reference inertia of every free train has turned [rad]
    crossings: Passages
    period: float  # T [s]
    cycles: int  # n
    approach: Approach | None = None  # of a clearance to a corner; None: there is no extremum, or it was not requested
    turns: Turns | None = None  # turning points; None: they are not known.
    parts: Parts | None = None  # of a motion that was followed in parts; None: it was followed as a whole.

    @property
    def gap(self) -> Array:
        """(N,) end - start."""
        return self.end.y - self.start.y


def joined(parts: Sequence[Pass], period: float, cycles: int) -> Pass:
    """Return successive motions of equal length as one motion over ``cycles`` periods of the length ``period`` [s]."""
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
    """Return the indices of the memories whose sliders are released all along a motion, so that they have no effect.

    scale: (N,) balanced = scale * SI.
    """
    matrix = np.abs(scale[:, None] * motion.gradient / scale - np.eye(scale.size))
    is_idle = (matrix.max(axis=0) < _FREE) & (matrix.max(axis=1) < _FREE)
    is_idle[: scale.size - memories] = False
    return np.flatnonzero(is_idle)
