"""Numbers as integers in units of 2^-256: 77 digits after the point, and ten times faster than mpmath's own floats.

Products are shifted back by P; a time step is a power of two, so that multiplying and dividing by it is a shift.
"""

from __future__ import annotations

from fractions import Fraction
from math import factorial

from mpmath import mp, mpf

P = 256
ONE = 1 << P
TINY = 1 << (P - 170)
"""What counts as zero when a state lies "exactly" on a corner: 7e-52."""


def fixed(number: str | int | Fraction | mpf) -> int:
    """Return a number as an integer multiple of 2^-P, correctly rounded."""
    if isinstance(number, mpf):
        with mp.workprec(2 * P + 64):
            return int(mp.nint(mp.ldexp(number, P)))
    return round(Fraction(number) * ONE)


def real(number: int) -> mpf:
    """Return the exact value of a fixed-point number."""
    with mp.workprec(4 * P):
        return mp.ldexp(mpf(number), -P)


def to_float(number: int) -> float:
    """Return the nearest double."""
    return float(Fraction(number, ONE))


def times_h(x: int, shift: int) -> int:
    """Return x h for the step h = 2^-shift."""
    return x >> shift if shift >= 0 else x << -shift


def over_h(x: int, shift: int) -> int:
    """Return x / h for the step h = 2^-shift."""
    return x << shift if shift >= 0 else x >> -shift


def evaluate(c: list[int], s: int, derivative: int = 0) -> int:
    """Return the polynomial (or a derivative with respect to s) at s in [0, 1]."""
    value = 0
    for j in range(len(c) - 1, derivative - 1, -1):
        falling = factorial(j) // factorial(j - derivative) if derivative else 1
        value = (value * s >> P) + c[j] * falling
    return value
