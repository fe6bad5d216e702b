"""The staged law with Jenkins sliders as a linear regression: columns over the samples of a measured loop.

Once breaks b_i and the reaches r_i of the sliders are fixed, the torque of a closed loop is linear in all the rest,

    T = preload + sum over stages  k_i l_i(delta) + sum over sliders  H_i e_i / r_i,

l_i the part of the way from 0 to delta that lies in stage i, and e_i the stretch of a slider's spring (G. M. Jenkins,
British Journal of Applied Physics 13, 1962, p. 30). A slider that begins at b is released within b and stretches up to
r on the way out; behind a turn at d it gives way from there down to -r:

    e = min(delta - b, r)  outward,      e = max(min(d - b, r) - (d - delta), -r)  on the way back.

That of the centre is engaged throughout: +-r, and 2 r behind each turn to change its sign. Slopes and heights must not
be negative; the coefficients are the least squares within that, a quadratic programme of a dozen unknowns.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_data import Loop

Array = NDArray[np.float64]
Slider = tuple[str, int]

DRIVE = "drive"
COAST = "coast"
CENTRE = "centre"
_KEPT = 4000  # columns
_PARTS = 5  # parts of a cell at which columns are evaluated before they are averaged


@dataclass(frozen=True)
class Shape:
    """The nonlinear part of a law: its stages, their ends, and the reaches of the sliders.

    Attributes
    ----------
    drive, coast
        breaks from the centre outward, positive magnitudes [rad].
    reach
        by slider, (side, index) [rad]; the centre's is ("centre", 0).
    """

    drive: tuple[float, ...] = ()
    coast: tuple[float, ...] = ()
    parted: bool = False
    rubs: str = ""
    reach: tuple[tuple[Slider, float], ...] = ()

    def breaks(self, side: str) -> tuple[float, ...]:
        """Breaks of one side."""
        return self.drive if side == DRIVE else self.coast

    def every_break(self) -> Iterator[tuple[str, int]]:
        """Yield side and index of all breaks, drive side first."""
        yield from ((side, i) for side in (DRIVE, COAST) for i in range(len(self.breaks(side))))

    def sliders(self) -> Iterator[Slider]:
        """Yield the sliders that the stages may have, that of the centre first."""
        yield CENTRE, 0
        for side in (DRIVE, COAST):
            for i in range(len(self.breaks(side)) + 1):
                if i > 0 or self.rubs == side:
                    yield side, i

    def reach_of(self, slider: Slider, default: float) -> float:
        """Reach of a slider, or a default."""
        return dict(self.reach).get(slider, default)

    def with_reach(self, slider: Slider, value: float) -> Shape:
        """Return a shape with another reach of one slider."""
        return self.with_reaches({slider: value})

    def with_reaches(self, reaches: Mapping[Slider, float]) -> Shape:
        """Return a shape with other reaches of some sliders."""
        return replace(self, reach=tuple({**dict(self.reach), **reaches}.items()))

    def with_break(self, side: str, index: int, value: float) -> Shape:
        """Return a shape with one break moved."""
        moved = list(self.breaks(side))
        moved[index] = value
        return self.with_breaks(side, tuple(moved))

    def with_breaks(self, side: str, breaks: tuple[float, ...]) -> Shape:
        """Return a shape with other breaks on one side."""
        return replace(self, drive=breaks) if side == DRIVE else replace(self, coast=breaks)


class Solved(NamedTuple):
    """A shape with its coefficients: what each is, ("preload" or "slope" or "slider", side, index); and what is left.

    ``left`` is the weighted sum of squares of the residuals [(N m)^2].
    """

    shape: Shape
    labels: tuple[tuple[str, str, int], ...]
    coefficients: Array
    left: float


def least(candidates: Iterable[Solved]) -> Solved:
    """Return the first of those with the least sum of squares."""
    return min(candidates, key=lambda candidate: candidate.left)


def heights_of(solution: Solved) -> dict[Slider, float]:
    """H of every slider [N m]."""
    pairs = zip(solution.labels, solution.coefficients.tolist(), strict=True)
    return {(side, index): value for (kind, side, index), value in pairs if kind == "slider"}


def slopes_of(solution: Solved, side: str) -> list[float]:
    """Slopes of the stages of one side, from the centre outward [N m/rad]."""
    pairs = zip(solution.labels, solution.coefficients.tolist(), strict=True)
    own = {(where, index): value for (kind, where, index), value in pairs if kind == "slope"}
    return [
        own[(side, i)] if (side, i) in own else own[(CENTRE, 0)] for i in range(len(solution.shape.breaks(side)) + 1)
    ]


def slope_of(solution: Solved, slider: Slider) -> float:
    """Slope of the stage whose stick stiffness a slider takes [N m/rad]."""
    side, index = slider
    if side == CENTRE:
        side = COAST if heights_of(solution).get((DRIVE, 0), 0.0) > 0.0 else DRIVE
    return slopes_of(solution, side)[index]


class Regression:
    """Columns over the samples of a loop, or over the means of cells of neighbouring samples.

    Args of the constructor:
        loop: the samples.
        cells: of each way, of equal deflection; 0: every sample counts by itself.
        reach: of sliders whose reach a shape does not say [rad].
    """

    def __init__(self, loop: Loop, cells: int, reach: float) -> None:
        self.loop, self._count = _merged(loop, _PARTS * cells) if cells else (loop, np.ones(loop.torque.size))
        if cells:
            key = _cell(self.loop, loop.ends, cells)
            self._first = np.flatnonzero(np.diff(key, prepend=-1))
        else:
            self._first = np.arange(loop.torque.size)
        weight = np.add.reduceat(self._count, self._first)
        self.weight = weight
        self.torque = self._mean(self.loop.torque)
        self.reach = reach
        self._weigh(weight, float(weight @ self.torque**2))
        self._known: dict[tuple[str, str, float, float], Array] = {}

    @classmethod
    def over(cls, points: Loop, weight: Array, whole: float, reach: float) -> Regression:
        """Return a regression over points that stand for samples.

        Parameters
        ----------
        whole
            sum of the squared torques of all samples [(N m)^2].
        reach
            of sliders whose reach a shape does not say [rad].
        """
        made = cls(points, 0, reach)
        made._weigh(weight, whole)
        return made

    def _weigh(self, weight: Array, whole: float) -> None:
        self.weight = weight
        self.whole = whole
        self._root = np.sqrt(weight)
        self._pull = self._root * self.torque

    def labels(self, shape: Shape, without: frozenset[Slider]) -> tuple[tuple[str, str, int], ...]:
        """Labels of the columns of a shape; ``without`` leaves some sliders out."""
        first = [("slope", side, 0) for side in ((DRIVE, COAST) if shape.parted else (CENTRE,))]
        more = [("slope", side, i + 1) for side in (DRIVE, COAST) for i in range(len(shape.breaks(side)))]
        sliders = [("slider", *slider) for slider in shape.sliders() if slider not in without]
        return (("preload", CENTRE, 0), *first, *more, *sliders)

    def table(self, shape: Shape, labels: tuple[tuple[str, str, int], ...]) -> Array:
        """(M, C) the columns, sliders with height 1."""
        return np.stack([self._column(shape, label) for label in labels], axis=1)

    def residual(self, solution: Solved) -> Array:
        """(M,) torque less that of a law [N m]."""
        return np.asarray(self.torque - self.table(solution.shape, solution.labels) @ solution.coefficients)

    def solve(self, shape: Shape, without: frozenset[Slider] = frozenset()) -> Solved:
        """Least squares with slopes and heights that are not negative."""
        labels = self.labels(shape, without)
        scaled = np.array([self._column(shape, label) for label in labels]) * self._root
        gram = scaled @ scaled.T
        right = scaled @ self._pull
        size = np.sqrt(np.maximum(gram.diagonal(), 1e-300))
        gram = gram / size[:, None] / size
        right = right / size
        gram.flat[:: size.size + 1] += 1e-12
        coefficients = np.linalg.solve(gram, right)
        if np.any(coefficients[1:] < 0.0):
            coefficients = _within(gram, right)
        left = max(self.whole - float(coefficients @ (2.0 * right - gram @ coefficients)), 1e-30 * self.whole)
        return Solved(shape, labels, coefficients / size, left)

    def _column(self, shape: Shape, label: tuple[str, str, int]) -> Array:
        kind, side, index = label
        if kind == "preload":
            return np.ones(self.torque.size)
        if kind == "slope":
            if side == CENTRE:
                return self._column(shape, (kind, DRIVE, 0)) + self._column(shape, (kind, COAST, 0))
            edges = (0.0, *shape.breaks(side), np.inf)
            return self._remembered(kind, side, edges[index], edges[index + 1])
        start = 0.0 if index == 0 else shape.breaks(side)[index - 1]
        return self._remembered(kind, side, start, shape.reach_of((side, index), self.reach))

    def _remembered(self, kind: str, side: str, start: float, end: float) -> Array:
        key = kind, side, start, end
        if key not in self._known:
            if len(self._known) > _KEPT:
                self._known.clear()
            way = -1.0 if side == COAST else 1.0
            if kind == "slope":
                whole = way * np.clip(way * self.loop.deflection - start, 0.0, end - start)
            else:
                whole = stretch(self.loop, side, start, end)
            self._known[key] = self._mean(whole)
        return self._known[key]

    def _mean(self, values: Array) -> Array:
        if self._first.size == values.size:
            return values
        return np.asarray(np.add.reduceat(self._count * values, self._first) / self.weight, dtype=np.float64)


def _cell(loop: Loop, ends: tuple[float, float], cells: int) -> NDArray[np.int64]:
    """(N,) the cell of every sample: those of falling, then those of growing deflection, each upwards."""
    low, high = ends
    cell = np.clip((cells * (loop.deflection - low) / (high - low)).astype(np.int64), 0, cells - 1)
    return np.asarray(cell + cells * (loop.way > 0.0), dtype=np.int64)


def _merged(loop: Loop, cells: int) -> tuple[Loop, Array]:
    """A loop of the means of cells, in the order of the cells, and how many samples each has."""
    _, group, count = np.unique(_cell(loop, loop.ends, cells), return_inverse=True, return_counts=True)
    deflection, torque, way, turn = (
        np.bincount(group, values) / count for values in (loop.deflection, loop.torque, loop.way, loop.turn)
    )
    means = replace(loop, deflection=deflection, torque=torque, way=way, turn=turn, leg=np.zeros(count.size, np.int64))
    return means, count.astype(np.float64)


def stretch(loop: Loop, side: str, start: float, reach: float) -> Array:
    """(N,) stretch over reach of one slider along the closed loop, engaged beyond ``start`` (a magnitude) [rad]."""
    if side == CENTRE:
        behind = np.abs(loop.deflection - loop.turn)
        return np.asarray(loop.way * np.minimum(behind / reach - 1.0, 1.0), dtype=np.float64)
    sign, delta, turn, is_outward = outward(loop, side)
    top = np.minimum(turn - start, reach)
    free = np.where(is_outward, np.minimum(delta - start, reach), np.maximum(top - (turn - delta), -reach))
    return np.asarray(sign * np.where(delta > start, free, 0.0) / reach, dtype=np.float64)


class Outward(NamedTuple):
    """Samples counted outward on one side: its sign, (N,) deflections, turns [rad], and whether they go outward."""

    sign: float
    delta: Array
    turn: Array
    is_outward: NDArray[np.bool_]


def outward(loop: Loop, side: str) -> Outward:
    """Return the samples of a loop counted outward on one side."""
    sign = -1.0 if side == COAST else 1.0
    return Outward(sign, sign * loop.deflection, sign * loop.turn, sign * loop.way > 0.0)


def _within(gram: Array, right: Array) -> Array:
    """Least squares with all coefficients but the first not negative (Lawson and Hanson, 1974, ch. 23)."""
    from scipy.optimize import nnls

    root = np.linalg.cholesky(gram)  # |root^T x - root^-1 right| is the residual
    table = root.T
    target = np.linalg.solve(root, right)
    weights, _ = nnls(np.column_stack([table, -table[:, 0]]), target)
    return np.concatenate([[weights[0] - weights[-1]], weights[1:-1]])
