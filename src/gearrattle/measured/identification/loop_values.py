"""Numbers of a coupling from a fitted loop's coefficients, breaks and reaches, and their derivatives.

A stage's hysteresis is twice the sum of the heights of all sliders engaged in it; a slider's stick stiffness is its
height over its reach. The slider of the centre has the spring of the side with less friction
(``assembly.friction_sliders``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_errors import Spread
from gearrattle.measured.identification.loop_law import (
    CENTRE,
    COAST,
    DRIVE,
    Shape,
    Slider,
    Solved,
    heights_of,
    slopes_of,
)

Array = NDArray[np.float64]

KEYS = {DRIVE: "stages", COAST: "coast_stages"}
"""Key of a coupling's stages by their side."""
_STEP = 1e-6


def stick_sliders(solution: Solved) -> dict[str, Slider]:
    """The slider of every stick stiffness, by its name in a coupling; sliders without height have none."""
    heights = heights_of(solution)
    made = {}
    for side, key in KEYS.items():
        for i in range(len(solution.shape.breaks(side)) + 1):
            slider = (CENTRE, 0) if i == 0 and heights.get((side, 0), 0.0) == 0.0 else (side, i)
            if heights.get(slider, 0.0) > 0.0:
                made[f"{key}.{i}.stick_stiffness"] = slider
    return made


def values_of(solution: Solved, fixed: frozenset[Slider], sticks: dict[str, Slider] | None = None) -> dict[str, float]:
    """Every number of the law by its name in a coupling.

    ``sticks`` are the sliders of the stick stiffnesses; None: those that have a height.
    """
    heights = heights_of(solution)
    shape = solution.shape
    behind = stick_sliders(solution) if sticks is None else sticks
    values = {"preload": float(solution.coefficients[0])}
    for side, key in KEYS.items():
        total = heights.get((CENTRE, 0), 0.0)
        slopes = slopes_of(solution, side)
        for i, slope in enumerate(slopes):
            total += heights.get((side, i), 0.0)
            values[f"{key}.{i}.stiffness"] = slope
            if i < len(slopes) - 1:
                values[f"{key}.{i}.until"] = shape.breaks(side)[i]
            values[f"{key}.{i}.hysteresis"] = 2.0 * total
            slider = behind.get(f"{key}.{i}.stick_stiffness")
            if slider is not None and slider not in fixed and slider in dict(shape.reach):
                values[f"{key}.{i}.stick_stiffness"] = heights[slider] / dict(shape.reach)[slider]
    return values


def derivatives(solution: Solved, fixed: frozenset[Slider], known: Spread) -> Array:
    """(V, P) derivatives of the law's numbers in the parameters of ``known``."""
    sticks = stick_sliders(solution)
    here = np.array(list(values_of(solution, fixed, sticks).values()))
    columns = []
    for j, value in enumerate(solution.coefficients.tolist()):
        step = _STEP * max(abs(value), 1e-12)
        other = solution.coefficients.copy()
        other[j] += step
        columns.append((solution._replace(coefficients=other), step))
    for side, i in solution.shape.every_break():
        value = solution.shape.breaks(side)[i]
        step = _STEP * value
        columns.append((solution._replace(shape=solution.shape.with_break(side, i, value + step)), step))
    for slider in known.sliders:
        value = solution.shape.reach_of(slider, np.nan)
        moved_shape: Shape = solution.shape.with_reach(slider, value * np.exp(_STEP))
        columns.append((solution._replace(shape=moved_shape), _STEP))
    moved = [np.array(list(values_of(changed, fixed, sticks).values())) for changed, _ in columns]
    return np.stack([(row - here) / step for row, (_, step) in zip(moved, columns, strict=True)], axis=1)
