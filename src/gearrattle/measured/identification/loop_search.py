"""Choice of the stages of a measured loop and their ends: forward selection by BIC, each step with a search.

    BIC = M ln(S / M) + p ln M,      p = breaks + reaches + coefficients

(G. Schwarz, Estimating the Dimension of a Model, Annals of Statistics 6, 1978, pp. 461-464) over M cells into which the
samples of each way are averaged; S is the weighted sum of squares left. Coefficients are solved for at every trial
(variable projection; Golub and Pereyra, SIAM Journal on Numerical Analysis 10, 1973, pp. 413-432), so only breaks and
reaches are searched, one after another, over the whole room between their neighbours first and then ever closer: the
torque jumps where friction is released, so a slope in a break does not show its jump.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from gearrattle.measured.identification.loop_data import Loop
from gearrattle.measured.identification.loop_law import (
    COAST,
    DRIVE,
    Regression,
    Shape,
    Slider,
    Solved,
    heights_of,
    least,
    slope_of,
)

MOST = 6
"""Stages that a side may have."""
_CELLS = 300  # of each way
LEAST = 0.02  # of the loop's range: no stage is narrower
REACH = 0.01  # of the loop's range: where sliders' reaches begin
# of the range: bounds of reaches
SHORTEST = 2e-4
LONGEST = 0.25
_NOTHING = 1e-6
_WORTH = 2.0  # by which BIC must fall: less is not worth more than a bare mention (Kass and Raftery, 1995, p. 777)
# values tried at once: over all the room, then ever closer
_FIRST = 24
_TRIALS = 9
_CLOSE = 5e-4  # of the range: how closely breaks are searched
_CLOSE_LOG = 0.15  # how closely the logarithms of reaches are searched
RATIOS = (8.0, 20.0)  # stick stiffness over slope, to begin with


class Search:
    """A loop under search.

    Args of the constructor:
        loop: what to fit.
    """

    def __init__(self, loop: Loop) -> None:
        self.loop = loop
        self.low, self.high = loop.ends
        self.span = self.high - self.low
        self.regression = Regression(loop, _CELLS, REACH * self.span)
        self.without: frozenset[Slider] = frozenset()

    def at(self, shape: Shape) -> Solved:
        """Solve for the coefficients of a shape."""
        return self.regression.solve(shape, self.without)

    def bic(self, solution: Solved) -> float:
        """Schwarz's criterion; heights of zero and their reaches are no parameters."""
        cells = self.regression.torque.size
        alive = [
            c > 0.0 for (kind, _, _), c in zip(solution.labels, solution.coefficients, strict=True) if kind == "slider"
        ]
        number = len(solution.labels) - len(alive) + 2 * sum(alive)
        number += len(solution.shape.drive) + len(solution.shape.coast)
        return float(cells * math.log(solution.left / cells) + number * math.log(cells))

    def refine(self, solution: Solved, rounds: int = 3, *, near: bool = False) -> Solved:
        """Search breaks and reaches, one after another, until a round gains nothing."""
        for turn in range(rounds):
            before = solution.left
            width = 0.02 if near or turn else 1.0
            for side, i in solution.shape.every_break():
                solution = self._move_break(solution, side, i, width)
            for slider in solution.shape.sliders():
                if slider not in self.without:
                    solution = self._move_reach(solution, slider)
            if before - solution.left < 1e-5 * before:
                break
        return solution

    def restarted(self, solution: Solved) -> Solved:
        """Search again from sliders that all stick alike, each so many times as stiff as its stage.

        Behind a turn only the sum of all sliders is seen, so one may have taken another's reach; then moving one
        after another leads nowhere.
        """
        best = solution
        for ratio in RATIOS:
            other = solution
            for _ in range(3):
                other = self.at(stuck(other, ratio, self.loop))
            best = least((best, self.refine(other, 2, near=True)))
        return best

    def room(self, shape: Shape, side: str, index: int) -> tuple[float, float]:
        """Between which deflections, in magnitude, a break may lie."""
        breaks = shape.breaks(side)
        end = self.high if side == DRIVE else -self.low
        narrowest = LEAST * self.span
        below = breaks[index - 1] if index > 0 else 0.0
        above = breaks[index + 1] if index + 1 < len(breaks) else end
        return below + narrowest, above - narrowest

    def _move_break(self, solution: Solved, side: str, index: int, width: float) -> Solved:
        def trial(value: float) -> Solved:
            return self.at(solution.shape.with_break(side, index, value))

        low, high = self.room(solution.shape, side, index)
        here = solution.shape.breaks(side)[index]
        return _closer(solution, trial, here, (low, high), (width * self.span, _CLOSE * self.span))

    def _move_reach(self, solution: Solved, slider: Slider) -> Solved:
        def trial(value: float) -> Solved:
            return self.at(solution.shape.with_reach(slider, math.exp(value)))

        here = math.log(solution.shape.reach_of(slider, REACH * self.span))
        shortest, longest = reach_bounds(self.loop)
        return _closer(solution, trial, here, (math.log(shortest), math.log(longest)), (2.0, _CLOSE_LOG))

    def with_more(self, solution: Solved, limits: tuple[int, int]) -> Iterator[Solved]:
        """Yield the best of every way to add one thing to a shape."""
        shape = solution.shape
        for side, most in zip((DRIVE, COAST), limits, strict=True):
            if len(shape.breaks(side)) + 1 < most:
                added = [self.at(shape.with_breaks(side, breaks)) for breaks in self._added(shape, side)]
                if added:
                    yield least(added)
        yield from (self.at(richer) for richer in with_centre(shape))

    def _added(self, shape: Shape, side: str) -> Iterator[tuple[float, ...]]:
        end = self.high if side == DRIVE else -self.low
        narrowest = LEAST * self.span
        for value in np.linspace(0.0, max(end, 0.0), 2 * _FIRST)[1:-1].tolist():
            if all(abs(value - other) >= narrowest for other in (0.0, end, *shape.breaks(side))):
                yield tuple(sorted((*shape.breaks(side), value)))


def with_centre(shape: Shape) -> Iterator[Shape]:
    """Yield the shapes with one thing more in their first stages."""
    if not shape.parted:
        yield replace(shape, parted=True)
    if not shape.rubs:
        yield from (replace(shape, rubs=side) for side in (DRIVE, COAST))


def _closer(
    solution: Solved,
    trial: Callable[[float], Solved],
    here: float,
    ends: tuple[float, float],
    widths: tuple[float, float],
) -> Solved:
    """Try values about the best one, from as far as the first width down to the second; return the best."""
    width, narrowest = widths
    number = _FIRST
    while width > narrowest:
        low = max(ends[0], here - width)
        high = min(ends[1], here + width)
        if not low < high:
            break
        for value in np.linspace(low, high, number).tolist():
            other = trial(value)
            if other.left < solution.left:
                solution = other
                here = value
        width = 1.25 * (high - low) / (number - 1)
        number = _TRIALS
    return solution


def select(loop: Loop, stages: tuple[int, int] | None) -> tuple[Solved, list[tuple[int, int, float]]]:
    """Choose the stages of a loop: so many on drive side and coast side, or by BIC where that is None."""
    search = Search(loop)
    solution = search.refine(search.at(Shape()), 2)
    steps = [_step(search, solution)]
    limits = stages or (MOST, MOST)
    while True:
        richer = sorted(search.with_more(solution, limits), key=search.bic)[:2]
        if not richer:
            break
        best = min((search.refine(candidate, 2) for candidate in richer), key=search.bic)
        lacking = stages is not None and (len(solution.shape.drive) + 1, len(solution.shape.coast) + 1) != stages
        if search.bic(best) > search.bic(solution) - _WORTH and not lacking:
            break
        solution = search.restarted(best)
        steps.append(_step(search, solution))
    return solution, steps


def reach_bounds(loop: Loop) -> tuple[float, float]:
    """Shortest and longest reach [rad]."""
    low, high = loop.ends
    return SHORTEST * (high - low), LONGEST * (high - low)


def stuck(solution: Solved, ratio: float, loop: Loop, held: frozenset[Slider] = frozenset()) -> Shape:
    """Return the shape with all sliders but those held ``ratio`` times as stiff as their stages, within bounds."""
    shortest, longest = reach_bounds(loop)
    reaches = default_reaches(solution, ratio).items()
    return solution.shape.with_reaches(
        {slider: min(max(reach, shortest), longest) for slider, reach in reaches if slider not in held}
    )


def default_reaches(solution: Solved, ratio: float) -> dict[Slider, float]:
    """Reach of every slider that is ``ratio`` times as stiff as its stage [rad]."""
    return {
        slider: height / (ratio * slope)
        for slider, height in heights_of(solution).items()
        if height > 0.0 and (slope := slope_of(solution, slider)) > 0.0
    }


def idle(solution: Solved) -> Iterator[Slider]:
    """Yield the sliders whose height is negligible against the highest."""
    heights = heights_of(solution)
    yield from (slider for slider, height in heights.items() if height <= _NOTHING * max(heights.values()))


def _step(search: Search, solution: Solved) -> tuple[int, int, float]:
    return len(solution.shape.drive) + 1, len(solution.shape.coast) + 1, search.bic(solution)
