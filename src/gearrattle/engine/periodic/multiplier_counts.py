"""Multipliers and the unit circle: how many lie outside.

Directions in which neighbouring motions repeat as well have a multiplier 1 and do not count. Without damping the
multipliers are inverse in pairs, and leave the circle only where two pairs meet on it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.point import Point

REAL = 1e-9  # a multiplier with a smaller imaginary part is real except for rounding
_CONSERVED = 1e-9  # the product of all multipliers is one except for so much where nothing is lost
_LEAVES = 1e-6  # a pair that leaves the circle there goes with the root of the distance, and rounding moves it less


def not_free(point: Point) -> NDArray[np.complex128]:
    """Return the multipliers without those nearest to 1 that belong to free directions."""
    return np.asarray(point.multipliers[np.argsort(np.abs(point.multipliers - 1.0))[point.free :]])


def nearest_to(number: float, values: NDArray[np.complex128]) -> tuple[complex, float]:
    """Return the value nearest to a number, and its distance; infinite where there is none."""
    away = np.abs(values - number)
    return (complex(values[np.argmin(away)]), float(away.min())) if values.size else (0j, np.inf)


def number_outside(point: Point, crossing: Sequence[complex] = ()) -> int:
    """Return how many multipliers lie outside the unit circle, except for those nearest to some values on it."""
    above, below, pairs = outside(point, crossing)
    return above + below + 2 * pairs


def outside(point: Point, crossing: Sequence[complex] = ()) -> tuple[int, int, int]:
    """Return numbers of multipliers outside the unit circle: real ones above 1, real ones below -1, complex pairs."""
    values = not_free(point)
    for value in crossing:
        values = np.delete(values, np.argmin(np.abs(values - value)))
    is_real = np.abs(values.imag) <= REAL
    above = is_real & (values.real > 1.0)
    below = is_real & (values.real < -1.0)
    circle = 1.0 + _LEAVES if is_conservative(point) else 1.0
    return int(above.sum()), int(below.sum()), int((~is_real & (np.abs(values) > circle)).sum()) // 2


def is_conservative(point: Point) -> bool:
    """Return whether nothing is lost over a period: then pairs lie on the circle, and leave it where two meet."""
    return bool(abs(np.prod(point.multipliers) - 1.0) < _CONSERVED)
