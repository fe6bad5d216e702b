"""Special points of a curve of events over a second parameter q: cusps, turning points, resonances, meetings.

Along the branch of the driveline q, at the arclength s, the test function of an event is tau(s; q). Two events of one
kind meet and vanish where

    tau = 0,      d tau / ds = 0:

for folds a *cusp*, for other events a *turning point* of their curve. A Neimark-Sacker bifurcation ends where its pair
m comes to 1 (*1:1 resonance*) or to -1 (*1:2 resonance*): beyond, two real multipliers m, 1 / m are none. There m + 1/m
is 2 or -2; it is smooth in q, so it is extrapolated. A fold meets a grazing where the tangent's part along the
parameter vanishes at the grazing, in the limit from the side without contact; beyond the grazing it changes like a
square root, so there the curve of folds bends into that of grazings. Events of motions of n periods come to a *period
doubling* where their motion repeats after n / 2 periods: a grazing where one of n / 2 periods has a multiplier -1, a
fold where the square of how far its motion misses, extrapolated, is zero. The extremum that grazes meets the next one,
a minimum a maximum, in a *cubic tangency*: at a corner the deflection has neither velocity nor acceleration. Both
vanish there; q has an extremum over the acceleration, so it is extrapolated over its square and cube.

Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, 4th ed., Springer 2023, chapter 8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import LOSSES, events_between
from gearrattle.engine.periodic.events.base import DOUBLING, FOLD, GRAZING, Event
from gearrattle.engine.periodic.events.neimark_sacker import nearest_pair
from gearrattle.engine.periodic.grazing_depth import bend
from gearrattle.engine.periodic.two_parameters.event_gradient import test_of
from gearrattle.engine.periodic.two_parameters.relocation import missed_after, polynomial_at, relocated
from gearrattle.errors import ConvergenceError

CUSP, TURNING, MEETING = "cusp", "turning point", "fold meets grazing"
FOLD_AT_DOUBLING, GRAZING_AT_DOUBLING = "fold meets period doubling", "grazing meets period doubling"
ONE_TO_ONE, ONE_TO_TWO = "1:1 resonance", "1:2 resonance"
TANGENCY = "cubic tangency"
KINDS = (CUSP, TURNING, MEETING, FOLD_AT_DOUBLING, GRAZING_AT_DOUBLING, TANGENCY, ONE_TO_ONE, ONE_TO_TWO)
Follower = Callable[[float], Continuation]

_STEP, _SHORTEST = 1e-4, 1e-7  # arclength of differences along the branch: the largest one, and the smallest
_PARABOLA = 0.2, 0.01
"""Differences over a step and half of it, at most: of second derivatives, of extrema over the step."""
_FARTHEST = 0.3  # arclength from a known event to a special point
_SECANTS = 30
_LOCATED = 1e-12  # of q
_LONGER = 100.0  # times the step before: over a short one rounding may be most of the change of a slope
_GAINED = 1e-15  # of a test function: nothing nearer to its extremum is sought for less
_ROUNDING = 1e-6  # of m + 1/m: a pair nearer to 2 or -2 may be real by rounding
_LEFT, _FEW = 0.1, 8  # of the way to a resonance that every motion leaves; motions
_PARABOLA_OF = 3  # known events
_SPACED = 1.4  # times the acceleration of one grazing: that of the next one for the extrapolation, at least
_BENT = 0.2  # of the acceleration of the first known grazing: what is left of it at the last one, at most
_BESIDE = 0.1  # of m + 1/m: a pair farther from 2 or -2 has no resonance near
_NEAR = 4e-6  # arclength from a grazing to the motions by which its limit is extrapolated
_EXTRAPOLATED = (5.0, -10.0, 10.0, -5.0, 1.0)  # weights of the values at 1, 2, ... times that for the one at 0
_FIRST, _AROUND = 1e-6, 0.03  # arclength of the first step from a fold, and within which its grazing is sought


def meeting_of_two(event: Event, follower: Follower, q: float, step: float) -> tuple[float, Event]:
    """Return where an event meets another one of its kind and both vanish: q, and the event there.

    ConvergenceError: they do not meet near.
    """
    along = _step_along(event, follower(q))
    return _root(lambda value: _extremum(event, follower(value), along), q, step)


def _step_along(event: Event, curve: Continuation) -> float:
    """The largest arclength along the branch within which the test function of an event is a parabola."""

    def derivatives(step: float) -> tuple[float, float]:
        tests = [test_of(event, curve.family, curve.moved_along(event.point, way * step)) for way in (-1.0, 0.0, 1.0)]
        return (tests[2] - tests[0]) / (2.0 * step), (tests[0] - 2.0 * tests[1] + tests[2]) / step**2

    step = _STEP
    while step > _SHORTEST:
        with suppress(ConvergenceError):
            (slope, bend), (slope_over_half, bend_over_half) = derivatives(step), derivatives(0.5 * step)
            change, shift = abs(bend - bend_over_half), abs(slope - slope_over_half)
            if change < _PARABOLA[0] * abs(bend) and shift < _PARABOLA[1] * abs(bend) * step:
                return step
        step *= 0.25
    return step


def _extremum(event: Event, curve: Continuation, step: float) -> tuple[float, Event]:
    """The extremum of the test function along the branch near an event: its value, and the event moved there."""
    origin = curve.in_plane(event.point)

    def slope(length: float) -> float:
        behind, ahead = (curve.moved_along(origin, length + side * step) for side in (-1.0, 1.0))
        tests = [test_of(event, curve.family, point) for point in (behind, ahead)]
        return (tests[1] - tests[0]) / (2.0 * step)

    length = 0.0
    now = slope(0.0)
    change = step
    for _ in range(_SECANTS):
        length, before, now = length + change, now, slope(length + change)
        if now == before or abs(length) > _FARTHEST:
            break
        farthest = min(0.5 * _FARTHEST, _LONGER * abs(change))
        change = float(np.clip(-now * change / (now - before), -farthest, farthest))
        if abs(change) < 1e-2 * step or abs(now * change) < _GAINED:
            point = curve.moved_along(origin, length + change)
            return test_of(event, curve.family, point), replace(event, point=point)
    raise ConvergenceError("the test function has no extremum near")


def resonance_of(event: Event) -> str:
    """Return the name of the resonance that the pair of a Neimark-Sacker bifurcation is near to."""
    return ONE_TO_ONE if nearest_pair(event.point)[0].real > 0.0 else ONE_TO_TWO


def resonance(before: tuple[float, Event], last: tuple[float, Event], follower: Follower) -> tuple[float, Event]:
    """Return where the pair of a Neimark-Sacker bifurcation comes to 1 or to -1: q, and the event moved there.

    ConvergenceError: it comes to neither.
    """

    def left(event: Event) -> float:
        return 2.0 - 2.0 * abs(nearest_pair(event.point)[0].real)

    for tried in range(_FEW):
        fall = left(before[1]) - left(last[1])
        if fall <= 0.0 or left(last[1]) > _BESIDE:
            raise ConvergenceError("the pair stays away from the real axis")
        steps = left(last[1]) / fall  # to the resonance
        change = last[1].point.w - before[1].point.w
        way = last[0] - before[0]
        if left(last[1]) < _ROUNDING or tried == _FEW - 1:
            break
        following = last[0] + (1.0 - _LEFT) * steps * way
        share = (1.0 - _LEFT) * steps
        before = last
        last = (following, relocated(last[1], follower(following), share * change, _FARTHEST))
    point = last[1].point
    parameter = point.parameter + steps * (point.parameter - before[1].point.parameter)
    return last[0] + steps * way, replace(last[1], point=replace(point, parameter=parameter))


def fold_at_doubling(folds: Sequence[tuple[float, float, Event]]) -> tuple[float, Event]:
    """Return where motions of n periods that fold come to repeat after n / 2: q, and the nearest fold moved there.

    Over the square of how far they miss their begin after n / 2 periods, q and the parameter are smooth: extrapolated
    to zero.

    ConvergenceError: there are fewer.
    """
    if len(folds) < _PARABOLA_OF:
        raise ConvergenceError("too few folds are known")
    ends = [(missed**2, np.array([q, event.point.parameter])) for missed, q, event in folds]
    q, parameter = (float(value) for value in polynomial_at(ends, 0.0))
    nearest = folds[0][-1]
    return q, replace(nearest, point=replace(nearest.point, parameter=parameter))


def tangency(known: Sequence[tuple[float, Event]], follower: Follower) -> tuple[float, Event]:
    """Return where the extremum that grazes meets the next one: q, and the last grazing moved there.

    ConvergenceError: there are fewer than three, or the extremum keeps its acceleration.
    """
    accelerations = list[float]()
    values = list[tuple[float, float]]()
    acceleration = 0.0
    for q, event in reversed(known):
        assert event.touch is not None
        point = event.point
        acceleration = bend(follower(q).family.map_at(point.parameter), point.motion.start, event.touch)
        if not accelerations or abs(acceleration) > _SPACED * abs(accelerations[-1]):
            accelerations.append(acceleration)
            values.append((q, point.parameter))
    if len(accelerations) < _PARABOLA_OF or abs(accelerations[0]) > _BENT * abs(acceleration):
        raise ConvergenceError("the extremum keeps its acceleration")
    powers = np.array(accelerations[:_PARABOLA_OF])[:, None] ** (0, 2, 3)
    q, parameter = (float(value) for value in np.linalg.solve(powers, values[:_PARABOLA_OF])[0])
    last = known[-1][1]
    return q, replace(last, point=replace(last.point, parameter=parameter))


def meeting_of_grazing(
    grazings: Mapping[float, Event], follower: Follower, step: float, kind: str = FOLD
) -> tuple[float, Event]:
    """Return where a grazing meets a fold, or an event of another kind: q, and the grazing there.

    grazings: by q, what is known of the grazing near; the search starts at the first.
    ConvergenceError: they do not meet near.
    """
    known = dict(grazings)
    if not known:
        raise ConvergenceError("no grazing is near")

    def limit(q: float) -> tuple[float, Event]:
        curve = follower(q)
        if q not in known:
            nearest, *others = sorted(known, key=lambda other: abs(other - q))
            event = known[nearest]
            change = np.zeros_like(known[nearest].point.w)
            if others:
                change = (known[others[0]].point.w - event.point.w) * (q - nearest) / (others[0] - nearest)
            known[q] = relocated(event, curve, change, _FARTHEST)
        return limit_at(known[q], curve, kind), known[q]

    return _root(limit, next(iter(known)), step)


def grazing_at_doubling(grazings: Mapping[float, Event], follower: Follower, step: float) -> tuple[float, Event]:
    """Return where a grazing of motions of n periods is one of n / 2 periods, at their doubling: q, and the grazing.

    ConvergenceError: the motions near do not come to n / 2 periods.
    """

    def of_half(q: float) -> Continuation:
        curve = follower(q)
        return curve.of(curve.family.over(curve.family.cycles // 2))

    halves = {q: _of_half_as_many_periods(event, of_half(q)) for q, event in grazings.items()}
    return meeting_of_grazing(halves, of_half, step, DOUBLING)


def _of_half_as_many_periods(grazing: Event, curve: Continuation) -> Event:
    """The grazing of motions of half as many periods that lies near one."""
    point, touch = grazing.point, grazing.touch
    assert touch is not None
    cycles = curve.family.cycles
    missed = missed_after(curve.family, point, cycles)
    at_parameter = np.append(np.zeros(len(point.state)), 1.0)
    between = curve.near(point.w + 0.5 * np.append(missed, 0.0), at_parameter, point)
    event = replace(grazing, point=between, touch=replace(touch, time=touch.time % cycles))
    return relocated(event, curve, np.zeros_like(point.w), _FARTHEST)


def limit_at(grazing: Event, curve: Continuation, kind: str) -> float:
    """Return the test function of a kind of event at a grazing, in the limit from the side without contact.

    ConvergenceError: no motions without contact are near.
    """
    for side in (_NEAR, -_NEAR):
        with suppress(ConvergenceError):  # where motions touch, they may change too fast
            points = [curve.moved_along(grazing.point, (i + 1.0) * side) for i in range(len(_EXTRAPOLATED))]
            if test_of(grazing, curve.family, points[0]) < 0.0:
                return float(np.dot(_EXTRAPOLATED, [LOSSES[kind].test(point) for point in points]))
    raise ConvergenceError("no motions without contact are near the grazing")


def grazing_near(fold: Event, curve: Continuation) -> Event | None:
    """Return the grazing nearest to a fold on its branch; None if there is none near."""
    nearest = []
    for side in (-1.0, 1.0):
        before = replace(fold.point, length=0.0)
        step = side * _FIRST
        while abs(before.length) < _AROUND:
            try:
                after = replace(curve.moved_along(before, step), length=before.length + step)
                events = events_between(curve, *((before, after) if side > 0.0 else (after, before)))
            except ConvergenceError:
                break
            grazings = [event for event in events if event.kind == GRAZING and event.touch is not None]
            if grazings:
                nearest.append(min(grazings, key=lambda event: abs(event.point.length)))
                break
            before = after
            step = 2.0 * step
    return min(nearest, key=lambda event: abs(event.point.length), default=None)


def _root(function: Callable[[float], tuple[float, Event]], q: float, step: float) -> tuple[float, Event]:
    """The zero of a function of q by the secant method, and the event there."""
    value, _ = function(q)
    change = step
    scale = abs(step)
    for _ in range(_SECANTS):
        following, event = function(q + change)
        q = q + change
        before = value
        value = following
        if value == before or abs(change) > 1e3 * scale:
            break
        change = -value * change / (value - before)
        if abs(change) <= _LOCATED * max(abs(q), scale):
            return q, event
    raise ConvergenceError("no special point is near")
