"""Levels of a motion: how far it deflects the clearances, and where their corners are; and where means pass corners.

The motion itself does not change where a mean passes a corner; but describing functions and the regime by the mean
change their case. The value that a branch goes over may move corners: those of clearances and of stages.

Takes Points; gives levels. Takes a Curve and the levels at its points; gives events.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import Event
from gearrattle.engine.periodic.family import Family
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.curve import Curve

Array = NDArray[np.float64]

MEAN = "mean at corner"
_LOCATED = 1e-12  # of the way between two points


@dataclass(frozen=True)
class Levels:
    """How far a motion deflects the clearances, and where their corners are.

    Attributes
    ----------
    deflections
        (3, K) lowest, highest and mean deflections [rad or m].
    corners
        of every clearance (any number) [rad or m].
    """

    deflections: Array
    corners: tuple[Array, ...]


def levels_of(family: Family, point: Point, like: Sequence[Array]) -> Levels:
    """Return the levels of a motion.

    Parameters
    ----------
    family
        that the motion belongs to.
    point
        the motion.
    like
        the corners of the clearances of the model itself. Where a clearance has closed there is none of that name, and
        all are NaN; so are the corners of a clearance that has other ones.
    """
    period_map = family.map_at(point.parameter)
    corners = [period_map.system.laws[k].corners for k in period_map.system.clearances]
    if len(corners) != len(like):
        return Levels(np.full((3, len(like)), np.nan), tuple(np.full(own.shape, np.nan) for own in like))
    known = (
        own if own.shape == model.shape else np.full(model.shape, np.nan)
        for own, model in zip(corners, like, strict=True)
    )
    return Levels(period_map.levels(point.motion), tuple(known))


def corners_of(levels: Sequence[Levels]) -> tuple[Array, ...]:
    """Return of every clearance (levels, corners) where its corners are."""
    return tuple(np.stack(own) for own in zip(*(one.corners for one in levels), strict=True))


def mean_events(curve: Continuation, known: Curve, levels: Sequence[Levels]) -> list[Event]:
    """Return where means pass corners along one branch.

    Parameters
    ----------
    curve
        the Continuation of the branch.
    known
        the branch.
    levels
        of every point.
    """
    return [
        event
        for ends, before, after in zip(known.steps(), levels[:-1], levels[1:], strict=True)
        for event in _between(curve, ends, before, after)
    ]


def _between(curve: Continuation, ends: tuple[Point, Point], before: Levels, after: Levels) -> Iterator[Event]:
    """Yield where means pass corners between two points."""

    def distance(share: float, watch: int, corner: int) -> float:
        point = curve.between(*ends, share)
        return float(_away(levels_of(curve.family, point, before.corners), watch)[corner])

    for watch in range(len(before.corners)):
        for corner in np.flatnonzero(_away(before, watch) * _away(after, watch) < 0.0).tolist():
            with suppress(ConvergenceError):  # a corner of the branch in between
                share = float(brentq(distance, 0.0, 1.0, (watch, corner), xtol=_LOCATED))
                yield Event(MEAN, curve.between(*ends, share), watch)


def _away(levels: Levels, watch: int) -> Array:
    """How far the mean of a clearance is beyond each of its corners [rad or m]."""
    return np.asarray(levels.deflections[2, watch] - levels.corners[watch])
