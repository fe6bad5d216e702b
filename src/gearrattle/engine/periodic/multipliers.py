"""Multipliers and the unit circle: how many lie outside, which come near it, which have crossed it.

A branch loses its stability where multipliers leave the circle: a real one through 1 or -1, a complex pair in between.
Directions in which neighbouring motions repeat as well have a multiplier 1 and do not count. Without damping the
multipliers are inverse in pairs, and leave the circle only where two pairs meet on it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from gearrattle.engine.periodic.point import Point

_REAL = 1e-9  # a multiplier with a smaller imaginary part is real but for rounding
_NEAR = 0.02  # a multiplier whose distances from the circle add up to less may have been there in between
_CONSERVED = 1e-9  # the product of all multipliers is one but for so much where nothing is lost
_LEAVES = 1e-6  # a pair that leaves the circle there goes with the root of the distance, and rounding moves it less
_FARTHER = 3.0  # times the way between both ends that a multiplier may go in between
_FEWEST = 4  # multipliers with two pairs
_FAR = 0.3  # of its size and at least of one: a multiplier that goes farther in a step may have gone anywhere


def det_plus(point: Point) -> float:
    """Return det(I + M): zero where a multiplier is -1."""
    return float(np.prod(1.0 + point.multipliers).real)


def det_minus(point: Point) -> float:
    """Return det(I - M), without the factors of free directions: zero where a multiplier is 1."""
    return float(np.prod(1.0 - _not_free(point)).real)


def pair_size(point: Point) -> float:
    """Return the modulus of the complex pair nearest to the unit circle, less 1; -1 without one.

    Where nothing is lost the moduli have a root at the event. Two pairs m, n meet on the circle and leave it: there
    m + 1/m and n + 1/n, real so far, become conjugate, and the square of their difference is smooth.
    """
    if not is_conservative(point):
        return abs(nearest_pair(point)[0]) - 1.0
    upper = point.multipliers[point.multipliers.imag > _REAL]
    one, other = np.triu_indices(len(upper), 1)
    squares = ((upper + 1.0 / upper)[one] - (upper + 1.0 / upper)[other]) ** 2
    return -float(squares[np.argmin(np.abs(squares))].real) if squares.size else -1.0


def pair_product(point: Point, like: Point) -> float:
    """Return the product of a pair of multipliers, less 1: smooth also where they become real.

    The pair is the one nearest to the complex pair of another point, which is that nearest to the unit circle there.
    Where nothing is lost it is ``pair_size``.
    """
    wanted, _ = nearest_pair(like)
    if not wanted or point.multipliers.size < 2:
        return pair_size(point)
    one, other = np.triu_indices(point.multipliers.size, 1)
    m, n = point.multipliers[one], point.multipliers[other]
    ways = [np.abs(p - wanted) + np.abs(q - wanted.conjugate()) for p, q in ((m, n), (n, m))]
    nearest = int(np.argmin(np.minimum(*ways)))
    return float((m[nearest] * n[nearest]).real) - 1.0


def has_pair_on_circle(point: Point) -> bool:
    """Return whether it is a complex pair that crosses the circle; beside a grazing it leaps, and is not just on it."""
    real = point.multipliers[np.abs(point.multipliers.imag) <= _REAL].real
    return min(nearest_pair(point)[1], _NEAR) < float(np.abs(1.0 + real).min(initial=np.inf))


def _not_free(point: Point) -> NDArray[np.complex128]:
    """The multipliers without those nearest to 1 that belong to free directions."""
    return np.asarray(point.multipliers[np.argsort(np.abs(point.multipliers - 1.0))[point.free :]])


def number_outside(point: Point, crossing: Sequence[complex] = ()) -> int:
    """Return how many multipliers lie outside the unit circle, but for those nearest to some values on it."""
    above, below, pairs = _outside(point, crossing)
    return above + below + 2 * pairs


def _outside(point: Point, crossing: Sequence[complex] = ()) -> tuple[int, int, int]:
    """Numbers of multipliers outside the unit circle: real ones above 1, real ones below -1, complex pairs."""
    values = _not_free(point)
    for value in crossing:
        values = np.delete(values, np.argmin(np.abs(values - value)))
    is_real = np.abs(values.imag) <= _REAL
    above, below = is_real & (values.real > 1.0), is_real & (values.real < -1.0)
    circle = 1.0 + _LEAVES if is_conservative(point) else 1.0
    return int(above.sum()), int(below.sum()), int((~is_real & (np.abs(values) > circle)).sum()) // 2


def is_conservative(point: Point) -> bool:
    """Return whether nothing is lost over a period: then pairs lie on the circle, and leave it where two meet."""
    return bool(abs(np.prod(point.multipliers) - 1.0) < _CONSERVED)


def pairs_crossed(before: Point, after: Point) -> int:
    """Return how many complex pairs leave the unit circle from one point to the next; negative: enter it.

    Two real multipliers outside that meet become a pair without crossing the circle. One of them may have come from
    inside shortly before, at a fold for example: then the product of both has not passed 1.
    """
    above, below, pairs = np.subtract(_outside(after), _outside(before))
    crossed = int(pairs + np.trunc(above / 2.0) + np.trunc(below / 2.0))
    if is_ambiguous(before, after):
        is_odd = _sign_of_products(before) != _sign_of_products(after)
        crossed -= int(np.sign(pairs)) if is_odd != bool(crossed % 2) else 0
    return crossed


def _sign_of_products(point: Point) -> float:
    """The sign of the product of m n - 1 over all pairs m, n of multipliers.

    It changes where a complex pair crosses the circle, and where two real ones are inverse.
    """
    values = _not_free(point)
    one, other = np.triu_indices(len(values), 1)
    return float(np.sign(np.prod(values[one] * values[other] - 1.0).real))


def is_ambiguous(before: Point, after: Point) -> bool:
    """Return whether a pair outside the circle may have become two real multipliers, one of which has then come inside.

    Or, the other way round, a pair may have entered the circle while a real one has left it: then there are two events.
    """
    above, below, pairs = (int(change) for change in np.subtract(_outside(after), _outside(before)))
    return any(change % 2 == 1 and change * pairs < 0 for change in (above, below))


def may_hide_pair(before: Point, after: Point) -> bool:
    """Return whether pairs may cross the circle unseen between two points: they go far, or one leaves it as one enters.

    Which multiplier has become which is told by the least sum of their ways.
    """
    m, n = before.multipliers, after.multipliers
    if m.size < _FEWEST or is_conservative(before):
        return False
    one, other = linear_sum_assignment(np.abs(m[:, None] - n))
    m, n = m[one], n[other]
    is_pair = (np.abs(m.imag) > _REAL) | (np.abs(n.imag) > _REAL)
    if not is_pair.any():
        return False
    m, n = m[is_pair], n[is_pair]
    size, following = np.abs(m), np.abs(n)
    goes_far = np.abs(n - m) > _FAR * np.maximum(np.maximum(size, following), 1.0)
    leaves, enters = (size < 1.0) & (following > 1.0), (size > 1.0) & (following < 1.0)
    return bool(goes_far.any() or (leaves.any() and enters.any()))


def nearest_to_minus_one(point: Point) -> tuple[complex, float]:
    """Return the multiplier nearest to -1, and how near it is."""
    away = np.abs(point.multipliers + 1.0)
    nearest = int(np.argmin(away))
    return complex(point.multipliers[nearest]), float(away[nearest])


def nearest_to_one(point: Point) -> tuple[complex, float]:
    """Return the multiplier nearest to 1, but for free directions, and its distance; infinite where there is none."""
    values = _not_free(point)
    away = np.abs(values - 1.0)
    return (complex(values[np.argmin(away)]), float(away.min())) if values.size else (0j, np.inf)


def nearest_pair(point: Point) -> tuple[complex, float]:
    """Return one of the complex pair nearest to the unit circle, the upper one, and how near it is.

    Infinity without one; pairs that lie on it all along are not counted.
    """
    pairs = point.multipliers[point.multipliers.imag > _REAL]
    if not pairs.size or is_conservative(point):
        return 0j, np.inf
    away = np.abs(np.abs(pairs) - 1.0)
    nearest = int(np.argmin(away))
    return complex(pairs[nearest]), float(away[nearest])


def may_return(before: tuple[complex, float], after: tuple[complex, float], near: float = _NEAR) -> bool:
    """Return whether a multiplier may have come to the circle and back between two points.

    It may where it moves far, or where it is ``near``: both distances add up to less.
    """
    way = before[1] + after[1]
    return way < max(near, _FARTHER * abs(after[0] - before[0]))
