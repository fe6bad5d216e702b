"""Where the mean deflection of a clearance passes one of its corners along a branch.

The motion itself does not change there; but describing functions and the regime by the mean change their case.

Takes a Curve and the levels at its points; gives events.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import Event
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.curve import Curve

Array = NDArray[np.float64]

MEAN = "mean at corner"
_LOCATED = 1e-12  # of the way between two points


def mean_events(curve: Continuation, known: Curve, levels: Sequence[Array], corners: Sequence[Array]) -> list[Event]:
    """Return where means pass corners along one branch.

    Parameters
    ----------
    curve
        the Continuation of the branch.
    known
        the branch.
    levels
        of every point: (3, K) lowest, highest and mean deflections of the K clearances.
    corners
        of every clearance (any number) [rad or m].
    """
    return [
        event
        for (before, after), low, high in zip(known.steps(), levels[:-1], levels[1:], strict=True)
        for event in _between(curve, (before, after), (low[2], high[2]), corners)
    ]


def _between(
    curve: Continuation, ends: tuple[Point, Point], means: tuple[Array, Array], corners: Sequence[Array]
) -> Iterator[Event]:
    """Yield where means pass corners between two points."""

    def distance(share: float, watch: int, corner: float) -> float:
        point = curve.between(*ends, share)
        return float(curve.family.map_at(point.parameter).levels(point.motion)[2, watch]) - corner

    for watch, own in enumerate(corners):
        for corner in own.tolist():
            if (means[0][watch] - corner) * (means[1][watch] - corner) < 0.0:
                with suppress(ConvergenceError):  # a corner of the branch in between
                    share = float(brentq(distance, 0.0, 1.0, (watch, corner), xtol=_LOCATED))
                    yield Event(MEAN, curve.between(*ends, share), watch)
