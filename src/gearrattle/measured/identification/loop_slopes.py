"""Derivatives of a law's torque in its breaks and in the logarithms of its sliders' reaches, sample by sample.

A break b between slopes k and k' whose slider has the height H and the reach r, and a turn at d > b, deflections
counted outward, engaged beyond b with the stretch e of ``loop_law``:

    dT/db     = k - k' - (H / r) de/db,          de/db = 1 where e sticks on the way out, or behind a turn within b + r
    dT/dlog r = -H e / r (outward),              H ([d - b >= r] - e / r) behind a turn, both only where e sticks

What slips depends on neither. At b itself the torque jumps on the way back by what the slider carried; a jump has no
derivative and is left out here: ``loop_jumps`` looks at it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_data import Loop
from gearrattle.measured.identification.loop_law import CENTRE, Slider, Solved, heights_of, outward, slopes_of

Array = NDArray[np.float64]


def slopes_in(loop: Loop, solution: Solved, sliders: tuple[Slider, ...]) -> Array:
    """(N, B + R) derivatives of the torque in all breaks (drive, then coast) and in the logarithms of some reaches."""
    columns = [_in_break(loop, solution, *where) for where in solution.shape.every_break()]
    columns += [_in_reach(loop, solution, slider) for slider in sliders]
    return np.stack(columns, axis=1) if columns else np.empty((loop.torque.size, 0))


def carried(loop: Loop, solution: Solved, side: str, index: int) -> Array:
    """(N,) torque that the slider of a break carries at that break on the way back [N m]; 0 on the way out."""
    start = solution.shape.breaks(side)[index]
    slider = (side, index + 1)
    height = heights_of(solution).get(slider, 0.0)
    reach = solution.shape.reach_of(slider, np.nan)
    sign, _, turn, is_outward = outward(loop, side)
    beyond = turn - start
    left = np.maximum(np.minimum(beyond, reach) - beyond, -reach) / reach if height > 0.0 else 0.0
    return np.asarray(np.where(is_outward, 0.0, sign * height * left), dtype=np.float64)


def _in_break(loop: Loop, solution: Solved, side: str, index: int) -> Array:
    sign, delta, turn, is_outward = outward(loop, side)
    start = solution.shape.breaks(side)[index]
    slopes = slopes_of(solution, side)
    change = np.full(delta.size, slopes[index] - slopes[index + 1])
    height = heights_of(solution).get((side, index + 1), 0.0)
    if height > 0.0:
        reach = solution.shape.reach_of((side, index + 1), np.nan)
        short = (turn - start < reach) & (turn - start - (turn - delta) > -reach)
        change -= height / reach * np.where(is_outward, delta - start < reach, short)
    return np.asarray(sign * np.where(delta > start, change, 0.0), dtype=np.float64)


def _in_reach(loop: Loop, solution: Solved, slider: Slider) -> Array:
    side, index = slider
    height = heights_of(solution)[slider]
    reach = solution.shape.reach_of(slider, np.nan)
    if side == CENTRE:
        behind = np.abs(loop.deflection - loop.turn) / reach
        return np.asarray(-height * loop.way * np.where(behind < 2.0, behind, 0.0), dtype=np.float64)
    sign, delta, turn, is_outward = outward(loop, side)
    start = 0.0 if index == 0 else solution.shape.breaks(side)[index - 1]
    top = np.minimum(turn - start, reach)
    back = (top - (turn - delta)) / reach
    out = (delta - start) / reach
    change = np.where(is_outward, np.where(out < 1.0, -out, 0.0), np.where(back > -1.0, (top >= reach) - back, 0.0))
    return np.asarray(sign * height * np.where(delta > start, change, 0.0), dtype=np.float64)
