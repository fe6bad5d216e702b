"""Least squares of a law over every sample: all breaks and reaches at once, from many starts.

With white noise the least squares are the maximum of the likelihood, whose error reaches the bound of Cramer and Rao.
Steps are those of Levenberg and Marquardt (D. W. Marquardt, SIAM Journal on Applied Mathematics 11, 1963, pp. 431-441)
in coefficients, breaks and logarithms of reaches; the coefficients are solved for anew at every trial. Breaks with a
jump then move to the best place by what ``loop_jumps`` tells, and the steps begin again. Behind a turn only the sum of
all sliders is seen, so reaches have several minima: they begin at those found and at sliders that all stick alike;
``loop_reaches`` finds more. The search of other fits (``multi_start``), which sees no jumps, ended in five of six loops
2 to 4 variances above this one or nowhere, from the same stages.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_data import Loop
from gearrattle.measured.identification.loop_jumps import best_place
from gearrattle.measured.identification.loop_law import COAST, DRIVE, Shape, Slider, Solved, heights_of, least
from gearrattle.measured.identification.loop_linear import Linear, Normal
from gearrattle.measured.identification.loop_moments import Moments
from gearrattle.measured.identification.loop_search import LEAST, RATIOS, REACH, reach_bounds, stuck

Array = NDArray[np.float64]

_STEPS = 40
_GAIN = 1e-4  # of the variance: a smaller one ends the steps
# damping
_WEAKEST = 1e-9
_STRONGEST = 1e6
_ROUNDS = 8


@dataclass(frozen=True)
class Polish:
    """Constants of the final least squares of a law: sliders that it has not, and sliders whose reach is kept."""

    moments: Moments
    without: frozenset[Slider] = frozenset()
    held: frozenset[Slider] = frozenset()

    @property
    def loop(self) -> Loop:
        """The samples."""
        return self.moments.loop

    def at(self, shape: Shape) -> Solved:
        """Solve for the coefficients of a shape."""
        return self.moments.at(shape, self.without)

    def free(self, solution: Solved) -> tuple[Slider, ...]:
        """Sliders with a height whose reaches are not held."""
        return tuple(s for s, height in heights_of(solution).items() if height > 0.0 and s not in self.held)

    def linear(self, solution: Solved) -> Linear:
        """Return the law made linear in all free parameters."""
        return Linear(self.moments, solution, self.free(solution))

    def smooth(self, solution: Solved) -> Solved:
        """Step to the nearest minimum."""
        damping = 1e-3
        gain = _GAIN * self.moments.variance(solution)
        for _ in range(_STEPS):
            sliders = self.free(solution)
            if not sliders and not solution.shape.drive and not solution.shape.coast:
                break
            normal = Linear(self.moments, solution, sliders).normal()
            before = solution.left
            while damping < _STRONGEST:
                other = self.at(self._moved(solution, sliders, _step(normal, damping)))
                if other.left < solution.left:
                    solution = other
                    damping = max(0.1 * damping, _WEAKEST)
                    break
                damping *= 10.0
            if before - solution.left < gain:
                break
        return solution

    def whole(self, solution: Solved) -> Solved:
        """Step to the nearest minimum, and move breaks over samples until nothing is better."""
        solution = self.smooth(solution)
        for _ in range(_ROUNDS):
            before = solution.left
            for where in solution.shape.every_break():
                position = best_place(self.linear(solution), solution, where)
                solution = least((solution, self.at(solution.shape.with_break(*where, position))))
            if not solution.left < before:
                break
            solution = self.smooth(solution)
        return solution

    def best(self, solution: Solved) -> Solved:
        """Return the best of all starts."""
        solution = self.whole(solution)
        best = least((solution, *(self.smooth(start) for start in self._starts(solution))))
        return self.whole(best) if best.left < solution.left else solution

    def _starts(self, solution: Solved) -> list[Solved]:
        ratios = RATIOS if self.free(solution) else ()
        return [self.at(stuck(solution, ratio, self.loop, self.held)) for ratio in ratios]

    def _moved(self, solution: Solved, sliders: tuple[Slider, ...], step: Array) -> Shape:
        low, high = self.loop.ends
        narrowest = LEAST * (high - low)
        shape = solution.shape
        j = len(solution.labels)
        for side, end in ((DRIVE, high), (COAST, -low)):
            breaks = []
            edge = 0.0
            for i, value in enumerate(solution.shape.breaks(side)):
                room = end - narrowest * (len(solution.shape.breaks(side)) - i)
                edge = min(max(value + float(step[j]), edge + narrowest), room)
                breaks.append(edge)
                j += 1
            shape = shape.with_breaks(side, tuple(breaks))
        shortest, longest = reach_bounds(self.loop)
        for slider in sliders:
            moved = solution.shape.reach_of(slider, REACH * (high - low)) * math.exp(float(np.clip(step[j], -1.0, 1.0)))
            shape = shape.with_reach(slider, min(max(moved, shortest), longest))
            j += 1
        return shape


def _step(normal: Normal, damping: float) -> Array:
    """Step of all parameters; coefficients on their bound of zero stay there."""
    free = normal.free
    scaled, size = normal.scaled(free)
    step = np.zeros(free.size)
    step[free] = np.linalg.solve(scaled + (damping + 1e-13) * np.eye(size.size), normal.right[free] / size) / size
    return step
