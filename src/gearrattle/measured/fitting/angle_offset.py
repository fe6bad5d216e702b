"""The angle between the zeros of two shafts, from the orders that both have."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_FINER = 16  # points on the shortest wave
_LONGEST = 60.0  # turns of the shaft within which orders that are no whole numbers come back
_NEWTON = 4


def angle_offset(cross: NDArray[np.complex128], order: NDArray[np.float64]) -> float:
    """Return the angle phi [rad] at which Re sum_o c_o exp(-i o phi) is largest.

    ``cross`` (m,) are products of conjugate simulated and of measured amplitudes; an ``order`` (m,) may come more than
    once.
    """
    # the sum of every distinct order
    orders, columns = np.unique(order, return_inverse=True)
    sums = np.zeros(orders.size, np.complex128)
    np.add.at(sums, columns, cross)
    if orders.size == 1:  # one wave: the angle nearest to zero is meant
        return float(np.angle(sums[0]) / orders[0])
    # the best of a grid, over as many turns as the orders need to come back
    count = np.arange(1.0, _LONGEST + 1.0)
    away = np.abs(np.multiply.outer(count, orders) - np.round(np.multiply.outer(count, orders))).max(axis=1)
    back = count[int(np.argmax(away < 1e-6))] if np.any(away < 1e-6) else _LONGEST
    points = int(np.ceil(_FINER * back * orders[-1]))
    angle = (np.arange(points) / points - 0.5) * 2.0 * np.pi * back
    level = np.zeros(points)
    for one, at in zip(sums.tolist(), orders.tolist(), strict=True):
        level += np.real(one * np.exp(-1j * at * angle))
    best = float(angle[int(np.argmax(level))])
    # Newton's steps to the largest
    for _ in range(_NEWTON):
        waves = sums * np.exp(-1j * orders * best)
        bend = float(np.sum(orders**2 * waves.real))
        if bend <= 0.0:
            break
        best += float(np.sum(orders * waves.imag)) / bend
    return best
