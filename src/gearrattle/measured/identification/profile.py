"""Profile likelihood: the range of one parameter while all others are fitted again.

The interval of parameter p holds every value at which min over the others of chi-square stays within 3.841 of its
minimum, the 95 % point of chi-square with one degree of freedom (Raue et al., Bioinformatics 25 (2009) 1923). Unlike
a standard error it need not be symmetric, and it is open where the data set no end inside the bounds. Where residuals
are not independent, or of another size, the minimum may be left by more or less than that (``estimates``).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.multi_start import EXACT, Effort, Residuals, local, of_free

Array = NDArray[np.float64]

LEVEL = 3.841458820694124
"""95 % point of chi-square with one degree of freedom."""


def profile(
    residuals: Residuals,
    x: Array,
    parameter: int,
    box: tuple[Array, Array],
    errors: tuple[float, float],
    *,
    effort: Effort = EXACT,
) -> tuple[float, float]:
    """Return the ends of the interval as logarithms; -inf or inf where the bound comes first.

    Parameters
    ----------
    x
        (P,) the minimum.
    box
        (P,) lowest and highest x.
    errors
        standard error of x[p], for the first step (need not be finite); by how much chi-square rises to the ends.
    """
    spread, rise = errors
    ends = []
    for side in (-1, 1):
        limit = float(box[(side + 1) // 2][parameter])
        above = _raised(residuals, x, parameter, box, (rise, effort))
        ends.append(_end(above, float(x[parameter]), side, limit, spread))
    return ends[0], ends[1]


def _raised(
    residuals: Residuals, x: Array, parameter: int, box: tuple[Array, Array], wanted: tuple[float, Effort]
) -> Callable[[float], float]:
    """Return the function: value of the parameter to lowest chi-square less that at the ends of the interval.

    The others are searched from where they ended at the nearest value known: from afar a search may end elsewhere.
    """
    rise, effort = wanted
    others = np.arange(x.size) != parameter
    rows = residuals(x)[0]
    target = float(rows @ rows) + rise
    known = {float(x[parameter]): (x[others], -rise)}

    def above(value: float) -> float:
        if value in known:
            return known[value][1]
        best = known[min(known, key=lambda other: abs(other - value))][0]
        reduced = of_free(residuals, np.where(others, x, value), others)
        if others.any():
            ended = local(reduced, best, (box[0][others], box[1][others]), effort)
            best = best if ended is None else ended
        rows = reduced(best)[0]
        known[value] = best, float(rows @ rows) - target
        return known[value][1]

    return above


def _end(above: Callable[[float], float], centre: float, side: int, limit: float, spread: float) -> float:
    """Return where chi-square passes the target on one side."""
    from scipy.optimize import brentq

    room = abs(limit - centre)
    step = 1.96 * spread if math.isfinite(spread) and spread > 0.0 else 0.1 * room
    inner = centre
    outer = centre
    while outer != limit:
        outer = centre + side * min(step, room)
        outer = limit if step >= room else outer
        if above(outer) >= 0.0:
            return float(brentq(above, inner, outer, xtol=1e-4 * abs(outer - centre)))
        inner = outer
        step = 1.5 * step
    return side * math.inf
