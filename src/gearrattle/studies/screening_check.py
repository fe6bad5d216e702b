"""Check of a screening by simulation: the choice of cases near the border, and the score of the forecast.

The cases nearest to the border tell most: those in which the range of some gear's lift ratio holds 1, or comes nearest
to it. Of equally near ones some are taken that lie evenly over the map. A gear that the forecast says is quiet and that
rattles when simulated, or the other way round, is a wrong forecast; undecided ones are neither right nor wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.studies.dataset_layout import rattling_from
from gearrattle.studies.output import REGIME, SEVERITY
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

CHECKED = 8
"""Cases that a check simulates if no number is asked for."""
FORECASTS = ("quiet", "undecided", "lifts off")
"""Forecasts of a screening for a gear; codes in this order."""
QUIET, UNDECIDED, LIFTS = range(3)


@dataclass(frozen=True)
class Checked:
    """Numbers of right and wrong forecasts of one gear, by simulation.

    ``said_quiet``, ``said_lifts`` and ``undecided`` count simulated cases by their forecast; ``ran_quiet``,
    ``ran_rattling`` and ``undecided_rattling`` say how many of each ran so, a touch being no rattle.
    """

    said_quiet: int
    ran_quiet: int
    said_lifts: int
    ran_rattling: int
    undecided: int
    undecided_rattling: int


def forecasts_of(low: Array, high: Array) -> NDArray[np.int8]:
    """Return the codes of ``FORECASTS``: quiet where no linear driveline lifts the gear off, lifts off where all do."""
    codes = np.full(low.shape, UNDECIDED, dtype=np.int8)
    codes[high <= 1.0] = QUIET
    codes[low > 1.0] = LIFTS
    return codes


def near_border(low: Array, high: Array, most: int) -> NDArray[np.int64]:
    """Return (M, 2) speed and load of the cases nearest to the border, in the order of the map.

    Low and high are the (speed, load, gear) least and largest lift ratios.
    """
    with np.errstate(divide="ignore"):
        below = -np.log(high)
        above = np.log(low)
    far = np.maximum(np.maximum(below, above), 0.0).min(axis=2).ravel()
    order = np.argsort(far, kind="stable")
    if order.size > most:
        # of those as near as the last one that is taken, some that lie evenly over the map
        last = far[order[most - 1]]
        nearer = np.flatnonzero(far < last)
        alike = np.flatnonzero(far == last)
        missing = most - nearer.size
        evenly = ((np.arange(missing) + 0.5) * alike.size / missing).astype(np.int64)
        order = np.concatenate([nearer, alike[evenly]])
    return np.stack(np.unravel_index(np.sort(order), low.shape[:2]), axis=1).astype(np.int64)


def rattles_in(data: xr.Dataset) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return (speed, load, gear) which gears rattle when simulated, by severity where it was kept, and which were."""
    codes = data[SEVERITY if SEVERITY in data else REGIME]
    values = np.asarray(codes.values)
    return values >= rattling_from(codes), values >= 0


def checked(forecast: NDArray[np.int8], rattles: NDArray[np.bool_], judged: NDArray[np.bool_]) -> Checked:
    """Count forecasts of one gear and what the simulations say of them.

    All are (speed, load): codes of ``FORECASTS``, whether the gear rattles when simulated, and where it was simulated.
    """

    def count(code: int, *, rattling: bool | None = None) -> int:
        cases = judged & (forecast == code)
        return int(cases.sum() if rattling is None else (cases & (rattles == rattling)).sum())

    return Checked(
        count(QUIET),
        count(QUIET, rattling=False),
        count(LIFTS),
        count(LIFTS, rattling=True),
        count(UNDECIDED),
        count(UNDECIDED, rattling=True),
    )
