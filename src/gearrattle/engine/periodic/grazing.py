"""What a grazing does to the gradient M of the period map: its kind, and how strong its square root is.

A distance s beyond a grazing a bound is crossed there and back; what is entered lasts for a time tau ~ √s.

    compliant  The force is continuous at the bound; its slope or its damping changes. M gains what this change does
               within tau, so M = M(0) + C √s + ...: continuous, with a square-root cusp. Clipped damping is no
               exception: its force is continuous, and M differs only while the regions differ.
    jump       A slider begins to slip. What its spring held is forgotten, however short the slip is: M jumps.
    release    A slider is let go with the torque that its spring holds: the motion itself jumps (``release``).
    rigid      The law of a compliant corner, too stiff or too damped to be resolved. A touch of the depth d, at which
               the deflection has the acceleration a, lasts sqrt(8 d / a). Where that is longer than the contact's own
               time 1 / w, it is an impact that reverses the velocity, and M falls like 1 / √s. If a depth of 1e-8
               of a T^2 is such an impact, M is unbounded on one side for all that is resolved.

w is the larger of sqrt(k / m) and c / m: k and c what stiffness and damping gain at the corner, m the moving mass. With
A the rates of the region left, W the row of the deflection and u what a torque does to the velocities, the flow gains,
its saltations on the way in and out included, -(k u + c A u) W for as long as the touch lasts. So

    tr M(s) - tr M(0) = -W C (k u + c A u) sqrt(8 d / a),

C the gradient over one motion from the touch on, and d grows in proportion to s: the strength of the root is known from
the motion that grazes.

Takes a Continuation and a motion that grazes; gives a Grazing.

M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems, Springer 2008.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.period_map import Approach, PeriodMap
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.release import is_release
from gearrattle.engine.periodic.touch import Touch, before_touch, depth, pieces_before, without_touch
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.passages import Passages
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.variation import variation
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

COMPLIANT, JUMP, RELEASE, RIGID = "compliant", "jump", "release", "rigid"
RESOLVED = 1e-8
"""Depth to which a touch is resolved, in units of a T^2."""
VERTICAL = 1e-9
"""Part of a tangent along the parameter that is rounding: the branch is vertical there, or folds."""
_AT_ONCE = 1e-9  # periods: crossings so shortly before a touch happen with it
_ASIDE = (1e-11, 1e-10, 1e-9, 1e-8)  # arclength from a grazing to one that does not touch by rounding
_APART = 1e-4  # arclength from a grazing, on its side without contact, to motions whose depth tells its slope


@dataclass(frozen=True)
class Grazing:
    """What a grazing does to the gradient.

    Attributes
    ----------
    kind
        COMPLIANT, JUMP, RELEASE or RIGID.
    root
        (tr M at s - tr M(0+)) / √s in the limit s -> 0, s > 0 the distance in the parameter; NaN where M or the motion
        jumps or M is not bounded, at the bound of a limiter, and where the parameter does not change along the branch:
        the grazing lies in a fold, or at the end of a vertical part. What M gains has hardly more than one eigenvalue
        that is not zero, its trace: where that is positive multipliers move towards a fold, where it is negative
        towards a period doubling.
    """

    kind: str
    root: float = np.nan


def grazing_of(curve: Continuation, point: Point, touch: Touch, nearby: Approach | None = None) -> Grazing:
    """Return the kind of a grazing and the strength of its square root.

    Parameters
    ----------
    curve
        the Continuation of the branch.
    point
        the motion that grazes, from the side without contact.
    touch
        what is touched.
    nearby
        the touch of a motion so near that it serves where that of this one is not known: one that touches after all, by
        rounding, lies beyond the corner, and another corner is the next.
    """
    family = curve.family
    known = [approach for approach in (point.motion.approach, nearby) if approach is not None]
    approach = min(known, key=lambda approach: abs(approach.depth), default=None)
    if touch.watch >= family.clearances:
        system = family.map_at(point.parameter).system
        is_slider = system.auxiliaries[touch.watch - len(system.clearances)].kind == "slider"
        return Grazing(JUMP if is_slider else COMPLIANT)
    with suppress(ConvergenceError):
        if family.memories and is_release(family.map_at(point.parameter), point, touch):
            return Grazing(RELEASE)
    if approach is None or np.isnan(approach.rate):
        slope, part = (None, 0) if approach is None else (approach.slope, approach.part)
        without_contact = apart(curve, point, touch)
        period_map = family.map_at(without_contact.parameter)
        approach = _approach_of(period_map, without_contact, touch)._replace(slope=slope, part=part)
    if np.sqrt(8.0 * RESOLVED) * point.motion.period * approach.rate > 1.0:
        return Grazing(RIGID)
    steep = _slope(curve, point, touch, approach)
    return Grazing(COMPLIANT, float(approach.gain * np.sqrt(8.0 * steep / abs(approach.acceleration))))


def apart(curve: Continuation, point: Point, touch: Touch) -> Point:
    """Return a motion that grazes, or one as near as can be if rounding makes it touch.

    A limiter then does something else.
    """
    if _is_apart(point, touch):
        return point
    for distance in _ASIDE:
        for side in (-distance, distance):
            with suppress(ConvergenceError):
                motion = curve.moved_along(point, side)
                if _is_apart(motion, touch):
                    return motion
    return point


def _is_apart(point: Point, touch: Touch) -> bool:
    """Whether a motion does not touch."""
    return len(without_touch(point.motion, touch).time) == len(point.motion.crossings.time)


def _slope(curve: Continuation, point: Point, touch: Touch, approach: Approach) -> float:
    """How the depth of a touch grows along the branch, over the distance in the parameter [SI]; NaN: not known."""
    along = abs(float(point.tangent[-1]))
    if along < VERTICAL:
        return np.nan
    if approach.slope is not None:
        change = point.change_of(approach.part) * np.append(point.size / point.scale, curve.family.unit)
        return abs(float(approach.slope @ change)) / (along * curve.family.unit)
    for side in (-_APART, _APART):
        slopes = []
        for distance in (side, 2.0 * side):
            try:
                motion = curve.moved_along(point, distance)
                deep = depth(curve.family.map_at(motion.parameter), motion.motion.start, touch)[0]
            except ConvergenceError:
                break
            if deep < 0.0 and motion.parameter != point.parameter:
                slopes.append(-deep / abs(motion.parameter - point.parameter))
        if len(slopes) == 2 and 2.0 * slopes[0] > slopes[1]:
            return 2.0 * slopes[0] - slopes[1]
    return np.nan


def _approach_of(period_map: PeriodMap, point: Point, touch: Touch) -> Approach:
    """What is known of a touch of any driveline; its depth is zero, and how that moves is not known."""
    flow, system = period_map.flow, period_map.system
    pieces = pieces_before(period_map, point.motion, touch)
    beyond = system.beyond(pieces, touch.watch, touch.upward)
    element = system.clearances[touch.watch]
    kick = system.rows[element] / system.inertia
    lightness = float(system.rows[element] @ kick)
    (stiffness, damping), (other, more) = (_slopes(flow, element, p) for p in (pieces, beyond))
    rate = float(max(np.sqrt(abs(other - stiffness) * lightness), abs(more - damping) * lightness))
    try:
        located = depth(period_map, point.motion.start, touch)[1]
        begin = replace(located, time=located.time - _AT_ONCE)
        z, last, since = before_touch(period_map, point.motion.start, begin)
    except ConvergenceError:
        return Approach(np.nan, touch.time, rate=rate)
    period, n, generator = system.inputs.period, flow.states, flow.generator(last)
    acceleration = flow.rate[element] @ generator @ expm(generator * (located.time - since)) @ z / period
    first = len(flow.coordinates.elements)
    pushed = np.zeros(n)
    pushed[first : first + system.size] = kick * flow.scaling.velocity
    beyond = system.beyond(last, touch.watch, touch.upward)
    (stiffness, damping), (other, more) = (_slopes(flow, element, p, is_mean=True) for p in (last, beyond))
    added = period * (other - stiffness) * pushed + (more - damping) * generator[:n, :n] @ pushed
    crossings = without_touch(point.motion, located)
    path = _from_then_on(crossings, (begin.time * period, located.time * period), period_map.length)
    if not _is_possible(system, last, path):  # another touch lies so near that its crossings are not those of one visit
        return Approach(np.nan, located.time, float(acceleration), rate=rate)
    cycle = variation(flow, last, path, end=period_map.length)
    grown = period_map.scale * (cycle.gradient() @ (added / period_map.scale))
    gain = -float(flow.deflection[element, :n] @ grown) / period
    return Approach(np.nan, located.time, float(acceleration), gain=gain, rate=rate)


def _from_then_on(crossings: Passages, instants: tuple[float, float], length: float) -> Passages:
    """The crossings of a motion that begins at the second of two instants [s] of a period of a given length.

    Those between both come after it: a slider sticks where the deflection is extreme, and there a corner is touched.
    """
    begin, time = instants
    after, before = crossings.where(crossings.time >= begin), crossings.where(crossings.time < begin)
    watch, upward, velocity, memory = (
        np.concatenate([getattr(part, name) for part in (after, before)])
        for name in ("watch", "upward", "velocity", "memory")
    )
    times = np.concatenate([np.maximum(after.time - time, 0.0), before.time + (length - time)])
    return Passages(times, watch, upward, velocity, memory)


def _is_possible(system: PiecewiseSystem, pieces: Pieces, path: Passages) -> bool:
    """Whether crossings lead through pieces that there are."""
    for watch, upward in zip(path.watch.tolist(), path.upward.tolist(), strict=True):
        if watch < len(system.clearances):
            element = system.clearances[watch]
            if not 0 <= pieces[element] + (1 if upward else -1) < system.laws[element].pieces:
                return False
        pieces = system.beyond(pieces, watch, upward)
    return True


def _slopes(flow: Flow, element: int, pieces: Pieces, *, is_mean: bool = False) -> tuple[float, float]:
    """Stiffness and damping of an element in its piece, its auxiliaries' included.

    In the mean of a short touch the bounds of a clipped damping add no stiffness: on the way in they add what they take
    on the way out.
    """
    law, piece = flow.system.laws[element], pieces[element]
    stiffness, damping = float(law.stiffness[piece]), float(law.damping[piece])
    for auxiliary, p, _ in flow.beside(pieces):
        if auxiliary.element == element:
            if auxiliary.remembers or not is_mean:
                stiffness += float(auxiliary.stiffness[p] + auxiliary.memory[p] * auxiliary.moves[p])
            damping += float(auxiliary.damping[p])
    return stiffness, damping
