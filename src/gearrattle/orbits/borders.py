"""Folds and grazings of a branch as curves over a second value, and the cusps in which two folds end.

Takes a Branch and a second value; gives Borders and Cusps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.events import FOLD, GRAZING
from gearrattle.errors import ConvergenceError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Array = NDArray[np.float64]

DRAWN = (FOLD, GRAZING)
"""Kinds of events whose curves are followed."""
_NEAR = 0.01  # of both ranges: ends of two folds that lie nearer meet in a cusp


@dataclass(frozen=True)
class Border:
    """An event over the second value.

    Attributes
    ----------
    event
        its row in the events of the branch.
    kind
        of event.
    clearance
        what grazes; empty for a fold.
    second, value
        (N,) the second value, ascending, and the first one at the event [SI].
    ends_below, ends_above
        whether it ends inside the range there.
    """

    event: int
    kind: str
    clearance: str
    second: Array
    value: Array
    ends_below: bool
    ends_above: bool


@dataclass(frozen=True)
class Cusp:
    """A point where two folds meet and end.

    Attributes
    ----------
    value, second
        where, the middle between the last points of both folds [SI].
    apart
        (2,) distance between these points, in value and second [SI].
    """

    value: float
    second: float
    apart: tuple[float, float]


def borders_of(
    events: pd.DataFrame,
    boundary: Callable[[int], xr.Dataset],
    ends: tuple[float, float],
    progress: Callable[[float], None] | None,
) -> tuple[list[Border], list[str]]:
    """Follow every fold and grazing of a branch.

    Parameters
    ----------
    events
        of the branch.
    boundary
        gives the curve of an event by its row.
    ends
        of the second value [SI].
    progress
        called with the finished share; an exception from it ends the work.

    Returns
    -------
    tuple[list[Border], list[str]]
        The curves, and notes on events that could not be followed.
    """
    chosen = events.index[events["kind"].isin(DRAWN) & ~events["collision"]]
    borders, notes = list[Border](), list[str]()
    for done, row in enumerate(chosen, 1):
        kind, clearance = str(events["kind"][row]), str(events["clearance"][row])
        try:
            curve = boundary(int(row))
        except (ConvergenceError, np.linalg.LinAlgError) as error:
            notes.append(f"The {kind} at {float(events['value'][row]):.6g} was not followed: {error}.")
            continue
        second, value = curve["second"].values, curve["value"].values
        room = 1e-9 * (ends[1] - ends[0])
        inside = bool(second[0] > ends[0] + room), bool(second[-1] < ends[1] - room)
        borders.append(Border(int(row), kind, clearance, second, value, *inside))
        if progress is not None:
            progress(done / len(chosen))
    return borders, notes


def cusps_of(borders: Sequence[Border], spans: tuple[float, float]) -> list[Cusp]:
    """Return where two folds end in the same point.

    Parameters
    ----------
    borders
        the curves.
    spans
        lengths of the ranges of value and second [SI].
    """
    ends = [
        (border.event, np.array([border.value[i], border.second[i]]))
        for border in borders
        if border.kind == FOLD
        for i, is_inside in ((0, border.ends_below), (-1, border.ends_above))
        if is_inside
    ]
    cusps = []
    for (event, one), (other_event, other) in combinations(ends, 2):
        apart = np.abs(one - other)
        if event != other_event and bool(np.all(apart < _NEAR * np.array(spans))):
            middle = 0.5 * (one + other)
            cusps.append(Cusp(float(middle[0]), float(middle[1]), (float(apart[0]), float(apart[1]))))
    return cusps
