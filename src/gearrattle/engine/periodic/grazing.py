"""What a grazing does to the gradient M of the period map: its kind, and how strong its square root is.

A distance s beyond a grazing a bound is crossed there and back; what is entered lasts for a time tau ~ √s.

    compliant  The force is continuous at the bound; its slope or its damping changes. M gains what this change does
               within tau, so M = M(0) + C √s + ...: continuous, with a square-root cusp. Clipped damping is no
               exception: its force is continuous, and M differs only while the regions differ.
    jump       A slider begins to slip. What its spring held is forgotten, however short the slip is: M jumps.
    rigid      The law of a compliant corner, too stiff or too damped to be resolved. A touch of the depth d, at which
               the deflection has the acceleration a, lasts sqrt(8 d / a). Where that is longer than the contact's own
               time 1 / w, it is an impact that reverses the velocity, and M falls like 1 / √s. If a depth of 1e-8
               of a T^2 is such an impact, M is unbounded on one side for all that is resolved.

w is the larger of sqrt(k / m) and c / m: k and c what stiffness and damping gain at the corner, m the moving mass.

Takes a Continuation and a motion that grazes; gives a Grazing.

M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems, Springer 2008.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation, Point
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.touch import Touch, pieces_before
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

COMPLIANT, JUMP, RIGID = "compliant", "jump", "rigid"
RESOLVED = 1e-8
"""Depth to which a touch is resolved, in units of a T^2."""
_BEYOND = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10)  # arclength from a grazing to a motion that touches
_LEAST = 1e-10  # of the parameter: a distance that is known well enough
_SMALL = 0.1  # largest tau w, and change of the trace of M, at which the square root rules


@dataclass(frozen=True)
class Grazing:
    """What a grazing does to the gradient.

    Attributes
    ----------
    kind
        COMPLIANT, JUMP or RIGID.
    root
        (tr M at s - tr M(0+)) / √s in the limit s -> 0, s > 0 the distance in the parameter; NaN where M jumps, or
        where it cannot be resolved. C has hardly more than one eigenvalue that is not zero, its trace: where that
        is positive multipliers move towards a fold, where it is negative towards a period doubling.
    """

    kind: str
    root: float = np.nan


def grazing_of(curve: Continuation, point: Point, touch: Touch, side: float, spread: float = np.nan) -> Grazing:
    """Return the kind of a grazing and the strength of its square root.

    Parameters
    ----------
    curve
        the Continuation of the branch.
    point
        the motion that grazes.
    touch
        what is touched.
    side
        1 if motions touch farther along the branch, -1 if they touch before.
    spread
        how long a touch lasts, squared, over the arclength from the grazing [s^2], in the limit; NaN: not known.
    """
    period_map = curve.family.map_at(point.parameter)
    system = period_map.system
    if touch.watch >= len(system.clearances):
        is_slider = system.auxiliaries[touch.watch - len(system.clearances)].kind == "slider"
        return Grazing(JUMP if is_slider else COMPLIANT)
    rate = _rate(period_map, point, touch)
    kind = RIGID if np.sqrt(8.0 * RESOLVED) * system.inputs.period * rate > 1.0 else COMPLIANT
    least = _LEAST * max(abs(point.parameter), abs(curve.family.unit))
    for distance in _BEYOND:
        if rate * np.sqrt(spread * distance) > 2.0 * _SMALL:
            continue
        try:
            far = curve.moved_along(point, side * distance)
            lasts = _duration(far, touch)
            if abs(far.parameter - point.parameter) < 16.0 * least:
                break
            if not 0.0 < rate * lasts < _SMALL:
                continue
            motions = [far, *(curve.moved_along(point, side * distance / times) for times in (4.0, 16.0))]
        except ConvergenceError:
            continue
        away = np.array([abs(motion.parameter - point.parameter) for motion in motions])
        traces = np.array([np.trace(motion.gradient) for motion in motions])
        if abs(traces[0] - traces[2]) < _SMALL and away.min() > least:
            return Grazing(kind, _root(away, traces))
    return Grazing(kind)


def _root(away: Array, traces: Array) -> float:
    """The coefficient b of a + b √s + c s through three values."""
    powers = np.sqrt(away / away[0])[:, None] ** np.arange(3)
    return float(np.linalg.solve(powers, traces)[1] / np.sqrt(away[0]))


def _duration(point: Point, touch: Touch) -> float:
    """How long a motion stays beyond the corner at a touch [s]; 0 if it does not pass it there."""
    crossings, motion = point.motion.crossings, point.motion
    ours = np.flatnonzero(crossings.watch == touch.watch)
    length, now = motion.cycles * motion.period, touch.time * motion.period
    spans = [0.0]
    for i, j in zip(ours, np.roll(ours, -1), strict=True):
        lasts = (crossings.time[j] - crossings.time[i]) % length
        since = (now - crossings.time[i] + 0.25 * length) % length - 0.25 * length
        if crossings.upward[i] == touch.upward and -lasts <= since <= 2.0 * lasts:
            spans.append(float(lasts))
    return min(spans[1:], default=0.0)


def _rate(period_map: PeriodMap, point: Point, touch: Touch) -> float:
    """The rate w of what is entered at a corner [rad/s]."""
    flow, system = period_map.flow, period_map.system
    pieces = pieces_before(period_map, point.motion, touch)
    beyond = system.beyond(pieces, touch.watch, touch.upward)
    element = system.clearances[touch.watch]
    lightness = float((system.rows[element] ** 2 / system.inertia).sum())
    (stiffness, damping), (other, more) = (_slopes(flow, element, p) for p in (pieces, beyond))
    return float(max(np.sqrt(abs(other - stiffness) * lightness), abs(more - damping) * lightness))


def _slopes(flow: Flow, element: int, pieces: Pieces) -> tuple[float, float]:
    """Stiffness and damping of an element in its piece, its auxiliaries' included."""
    law, piece = flow.system.laws[element], pieces[element]
    stiffness, damping = float(law.stiffness[piece]), float(law.damping[piece])
    for auxiliary, p, _ in flow.beside(pieces):
        if auxiliary.element == element:
            stiffness += float(auxiliary.stiffness[p] + auxiliary.memory[p] * auxiliary.moves[p])
            damping += float(auxiliary.damping[p])
    return stiffness, damping
