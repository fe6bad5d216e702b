"""Least squares of a piecewise linear law over every sample of a loop, by moments: as cheap as a hundred samples.

Between two neighbouring kinks of a law all its columns are straight lines, so of the n samples there only

    n,  sum x,  sum x^2,  sum T,  sum x T

count, and two points stand for them: with mean m and variance v of the deflections, at m - p and m + q, p q = v, with
weights n q / (p + q) and n p / (p + q) and torques on the samples' own regression line. p and q are chosen in the ratio
of the ways from m to the outermost samples, so both points lie between those (Bhatia and Davis, American Mathematical
Monthly 107, 2000, pp. 353-357: v is at most the product of those ways). Sums over a stretch are differences of sums
kept from the first sample on; nothing is averaged and no sample left out.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_data import Loop
from gearrattle.measured.identification.loop_law import CENTRE, COAST, DRIVE, Regression, Shape, Slider, Solved

Array = NDArray[np.float64]


class _Legs(NamedTuple):
    """Samples of one way behind one turn, by growing deflection; ``sums`` (5, n + 1) from the first sample on."""

    way: float
    turn: float
    deflection: Array
    sums: NDArray[np.longdouble]


class Moments:
    """A loop whose sums are known.

    Args of the constructor:
        loop: the samples.
        reach: of sliders whose reach a shape does not say [rad].
    """

    def __init__(self, loop: Loop, reach: float) -> None:
        self.loop = loop
        self.reach = reach
        self.whole = float(loop.torque @ loop.torque)
        behind, group = np.unique(np.stack([loop.way, loop.turn]), axis=1, return_inverse=True)
        self._legs = [
            _legs(float(way), float(turn), loop, np.flatnonzero(group.ravel() == n))
            for n, (way, turn) in enumerate(behind.T)
        ]

    def regression(self, *shapes: Shape) -> Regression:
        """Return a regression over points, for these shapes only."""
        parts = []
        for legs in self._legs:
            kinks = [_kinks(shape, legs.way, legs.turn, self.reach) for shape in shapes]
            parts.append(_points(legs, np.unique(np.concatenate(kinks))))
        deflection, torque, weight = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        counts = [part[0].size for part in parts]
        way, turn = (np.repeat([getattr(legs, key) for legs in self._legs], counts) for key in ("way", "turn"))
        points = replace(self.loop, deflection=deflection, torque=torque, way=way, turn=turn, leg=way.astype(np.int64))
        return Regression.over(points, weight, self.whole, self.reach)

    def at(self, shape: Shape, without: frozenset[Slider]) -> Solved:
        """Solve for the coefficients of a shape, without some sliders."""
        return self.regression(shape).solve(shape, without)

    def variance(self, solution: Solved) -> float:
        """Return the mean square of what a law leaves of the samples [(N m)^2]."""
        return solution.left / self.loop.torque.size

    def between(self, sign: float, way: float, low: float, high: float) -> Loop:
        """Samples between two deflections counted outward, from low to high [rad].

        ``sign`` is 1 on the drive side, -1 on the coast side; ``way`` is 1 outward, -1 on the way back.
        """
        delta = sign * self.loop.deflection
        rows = np.flatnonzero((way * sign * self.loop.way > 0.0) & (delta > low) & (delta <= high))
        rows = rows[np.argsort(delta[rows], kind="stable")]
        kept = {key: getattr(self.loop, key)[rows] for key in ("deflection", "torque", "way", "turn", "leg")}
        return replace(self.loop, **kept)


def _legs(way: float, turn: float, loop: Loop, rows: NDArray[np.int64]) -> _Legs:
    rows = rows[np.argsort(loop.deflection[rows], kind="stable")]
    x = loop.deflection[rows].astype(np.longdouble)
    torque = loop.torque[rows]
    sums = np.zeros((5, rows.size + 1), dtype=np.longdouble)
    sums[:, 1:] = np.cumsum(np.stack([np.ones_like(x), x, x * x, torque, x * torque]), axis=1)
    return _Legs(way, turn, loop.deflection[rows], sums)


def _kinks(shape: Shape, way: float, turn: float, reach: float) -> Array:
    """Deflections at which a column of the law bends or jumps behind this turn [rad]."""
    kinks = [0.0, turn + 2.0 * way * shape.reach_of((CENTRE, 0), reach)]
    for side, sign in ((DRIVE, 1.0), (COAST, -1.0)):
        starts = (0.0, *shape.breaks(side))
        kinks += [sign * start for start in starts]
        for i, start in enumerate(starts):
            r = shape.reach_of((side, i), reach)
            beyond = sign * turn - start
            kinks.append(sign * (start + r if sign * way > 0.0 else sign * turn - min(beyond, r) - r))
    return np.array(kinks)


def _points(legs: _Legs, kinks: Array) -> tuple[Array, Array, Array]:
    """Deflections, torques and weights of two points for every stretch that has samples."""
    # stretches between two neighbouring kinks
    x = legs.deflection
    cuts = np.where(kinks > 0.0, np.searchsorted(x, kinks, "right"), np.searchsorted(x, kinks, "left"))
    edges = np.unique(np.concatenate([[0], cuts, [x.size]]))
    # moments of the samples in every stretch
    count, *sums = np.diff(legs.sums[:, edges], axis=1)
    mean, square, torque, product = (total / count for total in sums)
    spread = np.maximum(square - mean * mean, 0.0)
    together = product - mean * torque
    # ways from the mean to the outermost samples; a stretch without spread is one point
    below = np.maximum(mean - x[edges[:-1]], 0.0)
    above = np.maximum(x[edges[1:] - 1] - mean, 0.0)
    flat = spread <= 1e-30 + 1e-15 * mean * mean
    flat |= (below <= 0.0) | (above <= 0.0)
    # two points with the same moments, and their weights
    ratio = np.sqrt(np.where(flat, 1.0, below) / np.where(flat, 1.0, above))
    root = np.sqrt(np.where(flat, 0.0, spread))
    p = root * ratio
    q = root / ratio
    slope = np.where(flat, 0.0, together / np.where(flat, 1.0, spread))
    part = ratio / (ratio + 1.0 / ratio)
    made = (
        np.concatenate([mean - p, mean + q]),
        np.concatenate([torque - slope * p, torque + slope * q]),
        np.concatenate([count * (1.0 - part), count * part]),
    )
    deflection, torques, weight = (array.astype(np.float64) for array in made)
    return deflection, torques, weight
