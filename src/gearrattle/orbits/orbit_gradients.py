"""How the response of a periodic motion, and its multipliers, move with the numbers of the model.

Where q is a number, the motion y = P(y; q) moves by dy/dq = (I - M)^-1 dP/dq. The state so predicted for a slightly
smaller and a slightly larger q is made exact by Newton's method, and the responses of these two motions give a central
difference. The motions are exact to rounding, and so are their extremes between crossings (``engine.system.levels``).
With a change of 1e-5 of q the difference is good to about 1e-7 of the response: its truncation is of 1e-10, rounding
is magnified to 1e-7.

As long as its impacts keep their order the motion moves smoothly. Where one comes or goes on either side of q, it
touches a corner so nearly that there is no gradient to give. Where two exchange their order, as the slips of two stages
do that begin to slip together, there is one if both sides have the same, to 1e-3 of the response: it is their mean.

Takes an Orbit and paths; gives a table.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from gearrattle.assembly import assemble
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.motion import Pass, State, multipliers_of
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import pattern_of
from gearrattle.engine.system.levels import deflection_levels, force_levels
from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.model import Model
from gearrattle.orbits.gradients import number_at, numbers_of, paths_of

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SWING, FORCE, MULTIPLIER = "peak-to-peak deflection", "largest force", "multiplier modulus"
"""Responses: of every clearance the first two, of every multiplier, by its number from 1, the last."""
_CHANGE = 1e-5  # of a number, to both sides
_KINK = 1e-3  # of a response per change of the number by itself: gradients on both sides that differ by more


def responses_of(period_map: PeriodMap, motion: Pass) -> Array:
    """Return (2 K,) peak-to-peak deflections of the K clearances, then the largest moduli of their forces [SI]."""
    along = period_map.flow, *period_map.along(motion)
    low, high, _ = deflection_levels(*along)
    return np.concatenate([high - low, np.abs(force_levels(*along)).max(axis=0, initial=0.0)])


def orbit_gradients(model: Model, period_map: PeriodMap, motion: Pass, paths: Sequence[str] | None) -> pd.DataFrame:
    """Return how the responses of an isolated motion move; see ``Orbit.gradients``.

    Parameters
    ----------
    model
        the driveline.
    period_map
        that the motion is a fixed point of.
    motion
        the motion.
    paths
        of the numbers; None: all that are not zero.

    Raises
    ------
    ModelError
        a path that leads to no number of the model, or to zero.
    """
    import pandas as pd

    names = assemble(model).layout.clearance_names
    multipliers = multipliers_of(motion.gradient)
    subjects = [(response, name) for response in (SWING, FORCE) for name in names]
    subjects += [(MULTIPLIER, str(i + 1)) for i in range(len(multipliers))]
    chosen = list(numbers_of(model, "")) if paths is None else paths_of(paths, model)
    values = [number_at(model, "", path) for path in chosen]
    slopes = [_slopes(model, path, value, period_map, motion) for path, value in zip(chosen, values, strict=True)]
    sizes = np.concatenate([responses_of(period_map, motion), np.abs(multipliers)]).tolist()
    rows = []
    for i, subject in enumerate(subjects):
        own = [
            (*subject, sizes[i], path, value, float(slope[i]), 0.1 * value * float(slope[i]))
            for path, value, slope in zip(chosen, values, slopes, strict=True)
        ]
        rows += sorted(own, key=lambda row: -np.nan_to_num(abs(row[-1]), nan=-1.0))
    return pd.DataFrame(rows, columns=["response", "of", "size", "path", "value", "gradient", "per_10_percent"])


def _slopes(model: Model, path: str, value: float, period_map: PeriodMap, motion: Pass) -> Array:
    """(2 K + N,) derivatives of responses, then of the moduli of multipliers; NaN where there are none."""
    change, multipliers = _CHANGE * abs(value), multipliers_of(motion.gradient)
    clearances = len(period_map.system.clearances)
    try:
        maps = [
            PeriodMap(assemble(model.with_({path: value + d})).system, period_map.cycles) for d in (-change, change)
        ]
        moved = [_moved(other, motion) for other in maps]
    except (ConvergenceError, ModelError, np.linalg.LinAlgError):
        return np.full(2 * clearances + len(multipliers), np.nan)
    patterns = [pattern_of(one) for one in (moved[0], motion, moved[1])]
    if len({tuple(sorted(pattern)) for pattern in patterns}) > 1:
        return np.full(2 * clearances + len(multipliers), np.nan)
    low, own, high = (
        np.concatenate([responses_of(other, one), np.abs(_matched(one, multipliers))])
        for other, one in zip((maps[0], period_map, maps[1]), (moved[0], motion, moved[1]), strict=True)
    )
    bends = np.abs(high - 2.0 * own + low) > _KINK * _CHANGE * np.abs(own)
    is_exchanged = len(set(patterns)) > 1
    return np.asarray(np.where(is_exchanged & bends, np.nan, (high - low) / (2.0 * change)))


def _moved(period_map: PeriodMap, motion: Pass) -> Pass:
    """The motion of a slightly changed driveline, from the state that (I - M)^-1 (P(y; q) - y) predicts."""
    gap = period_map.later(motion.start).y - motion.start.y
    step = np.linalg.solve(np.eye(len(gap)) - motion.gradient, gap)
    return shooting.shoot(period_map, State(motion.start.y + step, motion.start.auxiliary_pieces)).motion


def _matched(motion: Pass, multipliers: Complex) -> Complex:
    """(N,) multipliers of a motion in the order of those of its neighbour."""
    own = multipliers_of(motion.gradient)
    order = linear_sum_assignment(np.abs(own[None, :] - multipliers[:, None]))[1]
    return np.asarray(own[order])
