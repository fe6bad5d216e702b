"""Auxiliary elements along a motion, and all crossings of bounds in their order.

Written by ``exact``; read by the flow's gradient, by statistics between samples, by runs and their files.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_TOGETHER = 1e-12  # share of the last time below which the difference of two crossings is rounding


@dataclass(frozen=True)
class Passages:
    """All crossings along a motion, of clearances and auxiliaries, in the order of their log."""

    time: Array  # (E,) [s]
    watch: IntArray  # (E,) index of the watched quantity: clearances, then auxiliaries
    upward: IntArray  # (E,) 1: it crosses its upper bound, 0: its lower bound
    velocity: Array  # (E,) delta' of clearances [SI]
    memory: Array  # (E, S) memories of auxiliaries before each crossing [SI]

    def where(self, kept: NDArray[np.bool_] | IntArray) -> Passages:
        """Return the selected crossings, by (E,) truth values or by indices."""
        return Passages(self.time[kept], self.watch[kept], self.upward[kept], self.velocity[kept], self.memory[kept])

    def in_order(self) -> Passages:
        """Return the crossings with those at one instant (to rounding) in the order of the watched quantities.

        Two sliders of one element stick at the same instant, and equal clearances touch at once: their order in the log
        is rounding.
        """
        group = self._groups()
        if group is None:
            return self
        first = self.time[np.searchsorted(group, group)]
        return replace(self.where(self.order()), time=first)

    def order(self) -> IntArray:
        """Return (E,) the indices of the crossings that ``in_order`` returns."""
        group = self._groups()
        return np.arange(len(self.time)) if group is None else np.lexsort((self.upward, self.watch, group))

    def _groups(self) -> IntArray | None:
        """Numbers that are equal for crossings at one instant; None: all instants are different."""
        are_apart = np.diff(self.time) > _TOGETHER * float(self.time.max(initial=0.0))
        return None if are_apart.all() else np.append(0, np.cumsum(are_apart))

    def and_later(self, time: float, watches: IntArray) -> Passages:
        """Return the crossings and changes by the clock at a later time [s], which do not change memories."""
        if not len(watches):
            return self
        last = max(time, float(self.time.max(initial=0.0)))
        count = len(watches)
        return Passages(
            np.append(self.time, np.full(count, last)),
            np.append(self.watch, watches),
            np.append(self.upward, np.ones(count, np.int64)),
            np.append(self.velocity, np.full(count, np.nan)),
            np.concatenate([self.memory, np.zeros((count, self.memory.shape[1]))]),
        )


@dataclass(frozen=True)
class Auxiliaries:
    """Sliders, limiters and alternating stiffness along a motion (``system.auxiliary``): C, S with a memory [SI]."""

    force: Array  # (t, C) force of every auxiliary, added to that of its element [N m or N]
    memory: Array  # (t, C) state e: the stretch of a slider's spring [rad or m]; 0 for a limiter
    piece: IntArray  # (t, C) pieces
    initial: IntArray  # (C,) pieces at the first sample
    passages: Passages  # all crossings, of clearances and auxiliaries
