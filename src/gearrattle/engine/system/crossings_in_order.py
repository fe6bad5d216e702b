"""Auxiliary elements along a motion, and all crossings of bounds in their order.

Made by ``exact``; read by the flow's gradient, by statistics between samples, by runs and their files.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_TOGETHER = 1e-12  # of the time: what crosses closer together crosses at once


@dataclass(frozen=True)
class Passages:
    """All crossings along a motion, clearances' and auxiliaries', in the order in which they came."""

    time: Array  # (E,) [s]
    # watch, upward: (E,) what crossed its bound (a clearance, or behind them an auxiliary element); 1: the upper one
    watch: IntArray
    upward: IntArray
    velocity: Array  # (E,) delta' of clearances [SI]
    memory: Array  # (E, S) memories of auxiliaries before each crossing [SI]

    def where(self, kept: NDArray[np.bool_] | IntArray) -> Passages:
        """Return the crossings that are to be kept, by (E,) truth values or by their indices."""
        return Passages(self.time[kept], self.watch[kept], self.upward[kept], self.velocity[kept], self.memory[kept])

    def in_order(self) -> Passages:
        """Return the same, with what crosses at one instant except for rounding in the order of watches.

        Two sliders of one element stick at the same instant, and equal clearances touch at once: rounding decides in
        what order these are known.
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
        """Numbers that are equal for crossings at one instant; None: no two are at one."""
        are_apart = np.diff(self.time) > _TOGETHER * float(self.time.max(initial=0.0))
        return None if are_apart.all() else np.append(0, np.cumsum(are_apart))

    def and_later(self, time: float, watches: IntArray) -> Passages:
        """Return the same and changes by the clock at a later time [s], none of which changes a memory."""
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

    force: Array  # (t, C) what each adds to its element's force [N m or N]
    memory: Array  # (t, C) state of each: the stretch of a slider's spring [rad or m]; 0 for a limiter
    piece: IntArray  # (t, C) pieces
    initial: IntArray  # (C,) pieces at the first sample
    passages: Passages  # all crossings, clearances' and auxiliaries', in the order in which they came
