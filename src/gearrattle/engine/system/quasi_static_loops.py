"""The quasi-static torque of an element with sliders along a path of deflections, from one kink to the next.

    F = law(delta) + sum of s e,        |e| <= H / s,

e following the deflection while its slider sticks (G. M. Jenkins, British Journal of Applied Physics 13, 1962, p. 30).
Between corners of the law and starts of slip the torque is a straight line, so few points describe a path exactly.
Time has no effect: damping is not included, and of the auxiliaries only sliders are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.auxiliary import OFF, STICK, Auxiliary
from gearrattle.engine.system.law import PiecewiseLaw

Array = NDArray[np.float64]

_SAME = 1e-14  # of the widest deflection: closer together, two kinks are one


class Follower:
    """A law and its sliders on their way, unloaded at first.

    points: (deflection, torque) passed so far; two of one deflection where friction is released.
    """

    def __init__(self, law: PiecewiseLaw, sliders: Sequence[Auxiliary], start: float = 0.0) -> None:
        self.law = law
        self.sliders = sliders
        self.here = start
        self.piece = law.piece_at(start)
        self.held = [0.0 for _ in sliders]
        self.points = [(start, self.torque())]

    def torque(self) -> float:
        """The torque in the present state."""
        law = self.law
        springs = (slider.memory[STICK] for slider in self.sliders)
        elastic = law.stiffness[self.piece] * self.here + law.offset[self.piece]
        return float(elastic + sum(s * e for s, e in zip(springs, self.held, strict=True)))

    def go(self, target: float) -> None:
        """Go straight to a deflection."""
        way = 1.0 if target > self.here else -1.0
        while self.here != target:
            low, high = self.law.bounds(self.piece)
            corner = high if way > 0.0 else low
            if corner == self.here:
                self._enter(self.piece + int(way))
                continue
            stops = [target] if way * (corner - target) >= 0.0 else [corner]
            for i, slider in enumerate(self.sliders):
                left = float(slider.upper[STICK]) - way * self.held[i]
                if self._engaged(i) and left > _SAME * abs(self.here) and left > 0.0:
                    stops.append(self.here + way * left)
            self._move(min(stops, key=lambda stop: way * stop))

    def _engaged(self, i: int) -> bool:
        return int(self.sliders[i].follow[self.piece, OFF]) == STICK

    def _move(self, stop: float) -> None:
        moved = stop - self.here
        self.here = stop
        for i, slider in enumerate(self.sliders):
            if self._engaged(i):
                self.held[i] = min(max(self.held[i] + moved, float(slider.lower[STICK])), float(slider.upper[STICK]))
        self.points.append((stop, self.torque()))

    def _enter(self, piece: int) -> None:
        """Enter the next piece: sliders that end there are released."""
        self.piece = piece
        before = self.held
        self.held = [held if self._engaged(i) else 0.0 for i, held in enumerate(before)]
        if self.held != before:
            self.points.append((self.here, self.torque()))


def along(law: PiecewiseLaw, sliders: Sequence[Auxiliary], path: Sequence[float]) -> tuple[Array, Array]:
    """The graph of the torque along a path, sliders unloaded at its first deflection.

    sliders: its auxiliaries with a memory.
    path: turning points, one after another.
    Returns deflection and torque (N,) of every kink of the graph, and the turning points.
    """
    follower = Follower(law, sliders, path[0])
    for target in path[1:]:
        follower.go(target)
    deflection, torque = np.array(follower.points).T
    return deflection, torque


def cycle(law: PiecewiseLaw, sliders: Sequence[Auxiliary], low: float, high: float) -> tuple[Array, Array]:
    """The closed graph from ``low`` to ``high`` and back, once it repeats itself: after the second turn it does."""
    follower = Follower(law, sliders, low)
    for target in (high, low, high, low):
        follower.go(target)
    follower.points = [(low, follower.torque())]
    follower.go(high)
    follower.go(low)
    deflection, torque = np.array(follower.points).T
    return deflection, torque
