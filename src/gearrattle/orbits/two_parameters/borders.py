"""Folds, grazings and ends of families as curves over a second value, and the points at which they end or meet.

Takes the events of a Branch and their curves; gives Borders and SpecialPoints.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.events import FOLD, GRAZING
from gearrattle.engine.periodic.grazing import JUMP, RELEASE
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.family_ends import EDGE

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Array = NDArray[np.float64]

DRAWN = (FOLD, GRAZING, EDGE)
"""Kinds of events whose curves are followed."""
_SAME = 1e-5  # of both ranges: special points of two curves that lie nearer are the same
_LOST = "not found further"
_BEYOND = "beyond the range of the first value"


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
        what grazes; empty for another event.
    second, value
        (N,) the second value, ascending, and the first one at the event [SI].
    ends_below, ends_above
        why it ends inside the range there: a special point, "beyond the range of the first value", where it is not
        followed to the end, or "not found further"; empty where it does not.
    """

    event: int
    kind: str
    clearance: str
    second: Array
    value: Array
    ends_below: str
    ends_above: str


@dataclass(frozen=True)
class SpecialPoint:
    """A point at which curves of events end or meet.

    Attributes
    ----------
    kind
        one of ``special`` in ``Branch.boundary``.
    value, second
        where [SI].
    """

    kind: str
    value: float
    second: float


def borders_of(
    events: pd.DataFrame,
    boundary: Callable[[int], xr.Dataset],
    ranges: tuple[tuple[float, float], tuple[float, float]],
    progress: Callable[[float], None] | None,
    shown: Callable[[float], str],
) -> tuple[list[Border], list[SpecialPoint], list[str]]:
    """Follow every fold, grazing and end of a family of a branch.

    Parameters
    ----------
    events
        of the branch.
    boundary
        gives the curve of an event by its row.
    ranges
        ascending ends of the value and of the second one [SI].
    progress
        called with the finished share; an exception from it ends the work.
    shown
        writes the value of an event.

    Returns
    -------
    tuple[list[Border], list[SpecialPoint], list[str]]
        The curves, their special points, and notes on events that could not be followed.
    """
    is_drawn, jumps = events["kind"].isin(DRAWN), events["grazing"].isin([JUMP, RELEASE])
    chosen = events.index[is_drawn & ~events["collision"] & ~jumps]
    borders, curves = list[Border](), list["xr.Dataset"]()
    notes = [
        f"The grazing at {shown(value)} is not followed: the motion or its gradient jumps there."
        for value in events.loc[is_drawn & jumps, "value"].tolist()
    ]
    spans = ranges[0][1] - ranges[0][0], ranges[1][1] - ranges[1][0]
    for done, row in enumerate(chosen, 1):
        kind, clearance = str(events["kind"][row]), str(events["clearance"][row])
        try:
            curve = boundary(int(row))
        except (ConvergenceError, np.linalg.LinAlgError) as error:
            notes.append(f"The {kind} at {shown(float(events['value'][row]))} was not followed: {error}.")
            continue
        curves.append(curve)
        second, special = curve["second"].values, [str(kind) for kind in curve["special"].values]
        is_inside = second[0] > ranges[1][0] + _SAME * spans[1], second[-1] < ranges[1][1] - _SAME * spans[1]
        in_range = [ranges[0][0] <= curve["value"].values[i] <= ranges[0][1] for i in (0, -1)]
        reasons = [
            (special[i] or (_LOST if in_plane else _BEYOND)) if inside else ""
            for i, inside, in_plane in zip((0, -1), is_inside, in_range, strict=True)
        ]
        borders.append(Border(int(row), kind, clearance, second, curve["value"].values, reasons[0], reasons[1]))
        if progress is not None:
            progress(done / len(chosen))
    if progress is not None:
        progress(1.0)  # where no event was there, or the last one could not be followed
    return borders, special_points_of(curves, spans), notes


def special_points_of(curves: Sequence[xr.Dataset], spans: tuple[float, float]) -> list[SpecialPoint]:
    """Return the special points of curves, once each: a cusp is the end of two folds.

    Parameters
    ----------
    curves
        of events, as ``Branch.boundary`` gives them.
    spans
        lengths of the ranges of value and second [SI].
    """
    points: list[SpecialPoint] = []
    for curve in curves:
        columns = (curve[name].values.tolist() for name in ("special", "value", "second"))
        for kind, value, second in zip(*columns, strict=True):
            is_known = any(
                point.kind == kind
                and abs(point.value - value) < _SAME * spans[0]
                and abs(point.second - second) < _SAME * spans[1]
                for point in points
            )
            if kind and not is_known:
                points.append(SpecialPoint(str(kind), float(value), float(second)))
    return points
