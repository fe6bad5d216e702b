"""Neimark-Sacker bifurcations: a complex pair of multipliers crosses the unit circle.

The test function is the modulus of the pair minus 1. Without damping all pairs lie on the circle, and leave it where
two pairs meet.

This file has the test function; ``events_of_step`` finds where it changes its sign, and ``location`` locates the event.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import linear_sum_assignment

from gearrattle.engine.periodic.multiplier_counts import REAL, is_conservative, not_free, outside
from gearrattle.engine.periodic.point import Point

_NEAR = 0.02  # sum of a multiplier's distances from the circle at both ends below which it may reach it in between
_FARTHER = 3.0  # largest way of a multiplier within a step, over the distance between its values at both ends
_FEWEST = 4  # multipliers of two pairs
_FAR = 0.3  # change in a step over max(modulus, 1) above which the path of a multiplier is not known


def pair_size(point: Point) -> float:
    """Return the modulus of the complex pair nearest to the unit circle, minus 1; -1 without a pair.

    Without losses the moduli have a square root at the event. Two pairs m, n meet on the circle and leave it: m + 1/m
    and n + 1/n, real before, become conjugate, and the square of their difference is smooth.
    """
    if not is_conservative(point):
        return abs(nearest_pair(point)[0]) - 1.0
    upper = point.multipliers[point.multipliers.imag > REAL]
    one, other = np.triu_indices(len(upper), 1)
    squares = ((upper + 1.0 / upper)[one] - (upper + 1.0 / upper)[other]) ** 2
    return -float(squares[np.argmin(np.abs(squares))].real) if squares.size else -1.0


def pair_product(point: Point, like: Point) -> float:
    """Return the product of a pair of multipliers, minus 1: smooth also where they become real.

    It is the pair nearest to the complex pair of the point ``like`` that is nearest to the unit circle. Without losses
    the function is ``pair_size``.
    """
    wanted, _ = nearest_pair(like)
    if not wanted or point.multipliers.size < 2:
        return pair_size(point)
    one, other = np.triu_indices(point.multipliers.size, 1)
    m = point.multipliers[one]
    n = point.multipliers[other]
    ways = [np.abs(p - wanted) + np.abs(q - wanted.conjugate()) for p, q in ((m, n), (n, m))]
    nearest = int(np.argmin(np.minimum(*ways)))
    return float((m[nearest] * n[nearest]).real) - 1.0


def has_pair_on_circle(point: Point) -> bool:
    """Return whether a complex pair is near the circle; near a grazing it jumps over the circle."""
    real = point.multipliers[np.abs(point.multipliers.imag) <= REAL].real
    return min(nearest_pair(point)[1], _NEAR) < float(np.abs(1.0 + real).min(initial=np.inf))


def pairs_crossed(before: Point, after: Point) -> int:
    """Return how many complex pairs leave the unit circle from one point to the next; negative: enter it.

    Two real multipliers outside the circle that meet become a pair without crossing it. One of them may have crossed
    the circle shortly before, for example at a fold: then the product of both has not passed 1.
    """
    above, below, pairs = np.subtract(outside(after), outside(before))
    crossed = int(pairs + np.trunc(above / 2.0) + np.trunc(below / 2.0))
    if is_ambiguous(before, after):
        is_odd = _sign_of_products(before) != _sign_of_products(after)
        crossed -= int(np.sign(pairs)) if is_odd != bool(crossed % 2) else 0
    return crossed


def _sign_of_products(point: Point) -> float:
    """The sign of the product of m n - 1 over all pairs m, n of multipliers.

    It changes where a complex pair crosses the circle, and where the product of two real multipliers is 1.
    """
    values = not_free(point)
    one, other = np.triu_indices(len(values), 1)
    return float(np.sign(np.prod(values[one] * values[other] - 1.0).real))


def is_ambiguous(before: Point, after: Point) -> bool:
    """Return whether a pair outside the circle may have become two real multipliers, one of which has entered the
    circle.

    The alternative is a pair that has entered the circle and a real multiplier that has left it, which are two events.
    """
    above, below, pairs = (int(change) for change in np.subtract(outside(after), outside(before)))
    return any(change % 2 == 1 and change * pairs < 0 for change in (above, below))


def may_hide_pair(before: Point, after: Point) -> bool:
    """Return whether crossings of pairs may be hidden between two points: a pair moves far, or one leaves and one
    enters.

    Multipliers of both points are assigned to each other with the least sum of distances.
    """
    m = before.multipliers
    n = after.multipliers
    if m.size < _FEWEST or is_conservative(before):
        return False
    one, other = linear_sum_assignment(np.abs(m[:, None] - n))
    is_pair = (np.abs(m[one].imag) > REAL) | (np.abs(n[other].imag) > REAL)
    m = m[one][is_pair]
    n = n[other][is_pair]
    size = np.abs(m)
    size_after = np.abs(n)
    goes_far = np.abs(n - m) > _FAR * np.maximum(np.maximum(size, size_after), 1.0)
    leaves = (size < 1.0) & (size_after > 1.0)
    enters = (size > 1.0) & (size_after < 1.0)
    return bool(goes_far.any() or (leaves.any() and enters.any()))


def nearest_pair(point: Point) -> tuple[complex, float]:
    """Return the upper multiplier of the complex pair nearest to the unit circle, and its distance from the circle.

    Infinity without a pair; in a motion without losses pairs on the circle are not counted.
    """
    pairs = point.multipliers[point.multipliers.imag > REAL]
    if not pairs.size or is_conservative(point):
        return 0j, np.inf
    away = np.abs(np.abs(pairs) - 1.0)
    nearest = int(np.argmin(away))
    return complex(pairs[nearest]), float(away[nearest])


def may_return(before: tuple[complex, float], after: tuple[complex, float], near: float = _NEAR) -> bool:
    """Return whether a multiplier may have crossed the circle and returned between two points.

    It may have if it moves far, or if the sum of its distances from the circle is less than ``near``.
    """
    way = before[1] + after[1]
    return way < max(near, _FARTHER * abs(after[0] - before[0]))


def crossing_after(before: Point) -> Callable[[Point], float]:
    """Return a test function that changes its sign where a pair crosses the unit circle after a point."""
    return lambda point: abs(pair_size(point)) * (1.0 if pairs_crossed(before, point) == 0 else -1.0)


def pair_of(point: Point) -> list[complex]:
    """Return the complex pair nearest to the unit circle."""
    pair, _ = nearest_pair(point)
    return [pair, pair.conjugate()]
