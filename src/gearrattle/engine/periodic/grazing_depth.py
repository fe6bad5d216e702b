"""The depth of a touch: a smooth function of the state, with contact or without.

The motion in the region before the touch is continued beyond the corner, without contact; its deflection has an
extremum there. The *depth* of the touch is the distance of that extremum beyond the corner: zero at a grazing, negative
without contact. The contact has no effect on it: it is smooth where the period map is not.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from gearrattle.engine.periodic.compiled_course import bound_of, row_of
from gearrattle.engine.periodic.motion import Pass, State, Touch
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_SAMPLES = 64  # per period
_NEAR = 1.0 / 64.0  # periods: largest distance of the extremum from its expected instant
_ITERATIONS = 30  # of Newton's method
_SETTLED = 1e-12  # periods: last step of Newton's method; the next one would be of the order of its square


def depth(period_map: PeriodMap, state: State, touch: Touch) -> tuple[float, Touch]:
    """Return the depth of a touch [SI], and the touch with the instant of the extremum.

    ConvergenceError: there is no extremum nearby.
    """
    z, pieces, start = before_touch(period_map, state, touch)
    generator = period_map.flow.generator(pieces)
    time = touch.time
    row, bound = _approached(period_map.flow, pieces, touch)
    rate = row @ generator
    for _ in range(_ITERATIONS):
        now = expm(generator * (time - start)) @ z
        change = -float(rate @ now) / float(rate @ generator @ now)
        time += float(np.clip(change, -_NEAR, _NEAR))
        if abs(change) < _SETTLED * max(1.0, time):
            side = 1.0 if touch.upward else -1.0
            return side * (float(row @ now) - bound), replace(touch, time=time)
    raise ConvergenceError("the extremum at a corner is lost")


def _approached(flow: Flow, pieces: Pieces, touch: Touch) -> tuple[Array, float]:
    """The row of the quantity that approaches a bound [SI], and that bound: a corner, or the bound of a limiter.

    ConvergenceError: there is no such bound.
    """
    bound = bound_of(flow, pieces, touch.watch, touch.upward)
    is_other = touch.corner is not None and touch.corner != _corner_ahead(flow.system, pieces, touch)
    if is_other or not np.isfinite(bound):
        raise ConvergenceError("the extremum at a corner is lost")
    return row_of(flow, pieces, touch.watch), bound


def _corner_ahead(system: PiecewiseSystem, pieces: Pieces, touch: Touch) -> int:
    """The corner of a clearance that lies ahead in a region, on the side of a touch."""
    return pieces[system.clearances[touch.watch]] - 1 + touch.upward


def before_touch(
    period_map: PeriodMap, state: State, touch: Touch, *, is_located: bool = False
) -> tuple[Array, tuple[int, ...], float]:
    """Return a state z = (balanced y, inputs) before a touch, the pieces of its region, and its time in periods.

    is_located: whether the instant of the touch is that of the extremum.
    Between the returned time and the touch there is no crossing. Parameters and errors as for ``depth``; a touch beyond
    the end of the motion raises ConvergenceError.
    """
    flow = period_map.flow
    system = period_map.system
    march = period_map.marched(state, samples_per_cycle=_SAMPLES)
    crossings = period_map.passages(march)
    times = crossings.time / system.inputs.period
    slack = 0.0 if is_located else _NEAR
    limit = _begin_of(crossings, times, touch, int(march.samples.pieces[0, touch.watch]), slack)
    row = max(0, int(np.ceil(limit * _SAMPLES)) - 1)
    if row >= len(march.samples.states):
        raise ConvergenceError("the extremum at a corner is lost")
    cycle, fraction = divmod(row, _SAMPLES)
    inputs = flow.inputs_at(np.array([float(cycle)]), np.array([fraction / _SAMPLES]))[0]
    z = np.concatenate([march.samples.states[row, : flow.states], inputs])
    pieces = period_map.pieces_of(march.samples.pieces[row])
    time = row / _SAMPLES
    for i in np.flatnonzero((times > time) & (times < limit)).tolist():
        z = expm(flow.generator(pieces) * (times[i] - time)) @ z
        pieces = system.beyond(pieces, int(crossings.watch[i]), int(crossings.upward[i]))
        time = float(times[i])
        known = flow.known(pieces)
        memories = z[flow.states - known.size : flow.states]
        memories[:] = np.where(np.isnan(known), memories, known)
    return z, pieces, time


def with_corner(period_map: PeriodMap, motion: Pass, touch: Touch) -> Touch:
    """Return the touch of a motion that grazes with the corner that it touches.

    ConvergenceError: there is no corner on that side: the motion does not graze.
    """
    system = period_map.system
    corner = _corner_ahead(system, pieces_before(period_map, motion, touch), touch)
    if not 0 <= corner < len(system.laws[system.clearances[touch.watch]].corners):
        raise ConvergenceError("a corner was expected where there is none")
    return replace(touch, corner=corner)


def pieces_before(period_map: PeriodMap, motion: Pass, touch: Touch) -> Pieces:
    """Return the pieces of the region in which a motion is before a touch."""
    crossings = motion.crossings
    system = period_map.system
    times = crossings.time / motion.period
    pieces = period_map.along(motion)[0]
    limit = _begin_of(crossings, times, touch, pieces[system.clearances[touch.watch]], 0.0)
    for i in np.flatnonzero(times < limit).tolist():
        pieces = system.beyond(pieces, int(crossings.watch[i]), int(crossings.upward[i]))
    return pieces


def _begin_of(crossings: Passages, times: Array, touch: Touch, piece: int, slack: float) -> float:
    """The begin of a touch in periods: the crossing of the corner, or without one the instant of the extremum.

    piece: of the clearance at the start.
    """
    begin = touch.time
    for i, j in _visits_around(crossings, times, touch, slack):
        ours = crossings.upward[:i][crossings.watch[:i] == touch.watch]
        corner = piece + int((2 * ours - 1).sum()) - 1 + touch.upward
        if corner == touch.corner or (touch.corner is None and times[j] - times[i] <= _NEAR):
            begin = min(begin, float(times[i]))
    return begin


def _visits_around(crossings: Passages, times: Array, touch: Touch, slack: float) -> list[tuple[int, int]]:
    """The pairs of crossings out and back, of any corner, between which the instant of a touch lies.

    slack: time [periods] by which the extremum of a short visit may lie outside of it; 0 if the touch is located, for
    another visit may be near. A long visit may have ended just before another touch.
    """
    ours = np.flatnonzero(crossings.watch == touch.watch)
    return [
        (i, j)
        for i, j in pairwise(ours.tolist())
        for own in [slack if times[j] - times[i] <= _NEAR else 0.0]
        if crossings.upward[i] == touch.upward and times[i] - own < touch.time < times[j] + own
    ]


def without_touch(motion: Pass, touch: Touch) -> Passages:
    """Return the crossings of a motion without those of a touch, if it is one of a depth near rounding."""
    crossings = motion.crossings
    times = crossings.time / motion.period
    kept = np.ones(times.size, np.bool_)
    for i, j in _visits_around(crossings, times, touch, 0.0):
        kept[[i, j]] &= times[j] - times[i] > _NEAR or crossings.upward[j] == crossings.upward[i]
    return crossings.where(kept)
