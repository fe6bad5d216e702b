"""From coefficients, breaks and reaches of a fitted loop to the numbers of a coupling, and their derivatives.

A stage's hysteresis is twice the sum of the heights of all sliders engaged in it; a slider's stick stiffness is its
height over its reach. The slider of the centre has the spring of the side with less friction (``assembly.friction``).

Takes a ``Solved`` law; gives numbers by their names in a coupling.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.identification.loop_errors import Spread
from gearrattle.identification.loop_law import CENTRE, COAST, DRIVE, Shape, Solved, heights_of, slopes_of

Array = NDArray[np.float64]

_STEP = 1e-6


def values_of(found: Solved, fixed: frozenset[tuple[str, int]]) -> dict[str, float]:
    """Every number of the law by its name in a coupling; stick stiffnesses only where they were fitted."""
    heights, shape = heights_of(found), found.shape
    values = {"preload": float(found.coefficients[0])}
    for side, key in ((DRIVE, "stages"), (COAST, "coast_stages")):
        total, slopes = heights.get((CENTRE, 0), 0.0), slopes_of(found, side)
        for i, slope in enumerate(slopes):
            slider = (side, i)
            total += heights.get(slider, 0.0)
            values[f"{key}.{i}.stiffness"] = slope
            if i < len(slopes) - 1:
                values[f"{key}.{i}.until"] = shape.breaks(side)[i]
            values[f"{key}.{i}.hysteresis"] = 2.0 * total
            if i == 0 and heights.get(slider, 0.0) == 0.0:
                slider = (CENTRE, 0)
            told = slider not in fixed
            if heights.get(slider, 0.0) > 0.0 and told and slider in dict(shape.reach):
                values[f"{key}.{i}.stick_stiffness"] = heights[slider] / dict(shape.reach)[slider]
    return values


def derivatives(found: Solved, fixed: frozenset[tuple[str, int]], known: Spread) -> Array:
    """(V, P) derivatives of the law's numbers in the parameters of ``known``."""
    here = np.array(list(values_of(found, fixed).values()))
    columns = []
    for j, value in enumerate(found.coefficients.tolist()):
        step = _STEP * max(abs(value), 1e-12)
        moved = found.coefficients.copy()
        moved[j] += step
        columns.append((found._replace(coefficients=moved), step))
    for side in (DRIVE, COAST):
        for i, value in enumerate(found.shape.breaks(side)):
            step = _STEP * value
            columns.append((found._replace(shape=found.shape.with_break(side, i, value + step)), step))
    for slider in known.sliders:
        value = found.shape.reach_of(slider, np.nan)
        moved_shape: Shape = found.shape.with_reach(slider, value * np.exp(_STEP))
        columns.append((found._replace(shape=moved_shape), _STEP))
    return np.stack([(np.array(list(values_of(each, fixed).values())) - here) / step for each, step in columns], axis=1)
