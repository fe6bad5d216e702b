"""A band-limited signal between its samples, with a bandwidth for every point.

    y_k = sum_i x_i h((i - p_k) / w_k) / sum_i h((i - p_k) / w_k)

h is even, linear between the points of its table, and zero beyond a distance, its reach. Beyond its ends the signal is
continued by point reflection. The number of terms is the sum of 2 w_k reach.
"""

from __future__ import annotations

from math import ceil, floor

import numpy as np

from gearrattle.engine.kernels._jit import inlined, separate


@inlined
def _continued(values, i):
    """The sample i of the continued signal."""
    last = values.size - 1
    if i < 0:
        return 2.0 * values[0] - values[min(-i, last)]
    if i > last:
        return 2.0 * values[last] - values[max(2 * last - i, 0)]
    return values[i]


@separate
def banded(values, position, width, table, per_unit):
    """Values (M,) of the signal.

    position: (M,) in samples.
    width: (M,) w_k, samples per unit of the argument of h.
    table: (T,) values of h at multiples of 1 / per_unit.
    """
    out = np.empty(position.size)
    reach = (table.size - 2.0) / per_unit
    for k in range(position.size):
        # the samples within the band
        p = position[k]
        scale = per_unit / width[k]
        side = reach * width[k]
        first = int(ceil(p - side))
        last = int(floor(p + side))
        total = 0.0
        norm = 0.0
        # the weighted mean of these samples; beyond the ends the signal is continued
        if first >= 0 and last < values.size:
            for i in range(first, last + 1):
                u = abs(i - p) * scale
                j = int(u)
                h = table[j] + (u - j) * (table[j + 1] - table[j])
                total += h * values[i]
                norm += h
        else:
            for i in range(first, last + 1):
                u = abs(i - p) * scale
                j = int(u)
                h = table[j] + (u - j) * (table[j + 1] - table[j])
                total += h * _continued(values, i)
                norm += h
        out[k] = total / norm
    return out
