"""The first root of a polynomial in (0, 1], none overlooked.

A bound on the value excludes a root, a bound on the slope makes the polynomial monotone so that the signs at both
ends decide; where neither bound helps the interval is halved. A pair of roots closer than 2^-100 of a thirty-second
of the interval is called a touch.
"""

from __future__ import annotations

import numpy as np

from tests.oracles.fixed_point import ONE, TINY, P, evaluate, to_float

SCAN = 32


def first_root(c: list[int]) -> int | None:
    """Return the first root of sum c_j s^j in (0, 1] (all numbers fixed-point), or None.

    A polynomial that is zero to the digits that count has none: the motion rests on the corner.
    """
    if not c or abs(c[0]) > sum(abs(x) for x in c[1:]) or sum(abs(x) for x in c) <= TINY:
        return None
    values = np.array([to_float(x) for x in c])
    slope = float(np.abs(values) @ np.arange(len(c)))
    middles = (np.arange(SCAN) + 0.5) / SCAN
    at_middles = np.polynomial.polynomial.polyval(middles, values)
    doubtful = np.abs(at_middles) <= slope / (2 * SCAN) * 1.001 + 1e-12 * float(np.abs(values).sum())
    for g in np.flatnonzero(doubtful):
        s = _isolate(_window(c, int(g)), 0)
        if s is not None:
            return (int(g) * ONE + s) // SCAN
    return None


def _window(c: list[int], g: int) -> list[int]:
    """Return the polynomial on [g/SCAN, (g+1)/SCAN], as one in [0, 1]."""
    return [x // SCAN**j for j, x in enumerate(_taylor_shift(c, g, SCAN))]


def _taylor_shift(c: list[int], numerator: int, denominator: int) -> list[int]:
    """Return the coefficients of p(s + numerator/denominator) by repeated synthetic division."""
    c = list(c)
    for i in range(len(c) - 1):
        for j in range(len(c) - 2, i - 1, -1):
            c[j] += numerator * c[j + 1] // denominator
    return c


def _isolate(c: list[int], depth: int) -> int | None:
    """Return the first root in (0, 1], halving until a bound on the value or on the slope decides."""
    if abs(c[0]) > sum(abs(x) for x in c[1:]):
        return None
    if abs(c[1]) > sum(j * abs(x) for j, x in enumerate(c[2:], 2)):
        at_end = sum(c)
        crosses = c[0] != 0 and (at_end == 0 or (c[0] > 0) != (at_end > 0))
        return _polish(c) if crosses else None
    if depth >= 100:
        return None
    left = [x >> j for j, x in enumerate(c)]
    s = _isolate(left, depth + 1)
    if s is not None:
        return s >> 1
    s = _isolate(_taylor_shift(left, 1, 1), depth + 1)
    return None if s is None else (s + ONE) >> 1


def _polish(c: list[int]) -> int:
    """Return the root of a polynomial monotone on [0, 1] with a change of sign, by Newton kept in its bracket."""
    low, high, s = 0, ONE, ONE >> 1
    rising = c[1] > 0
    for _ in range(4 * P):
        value = evaluate(c, s)
        if (value > 0) == rising:
            high = s
        else:
            low = s
        slope = evaluate(c, s, 1)
        new = s - (value << P) // slope if slope else (low + high) >> 1
        if not low <= new <= high:
            new = (low + high) >> 1
        if abs(new - s) <= 1 or high - low <= 1:
            return new
        s = new
    raise ArithmeticError("Newton did not settle")
