"""How an event of a branch moves with a number of the driveline: its gradient, by implicit differentiation.

An event is a point of the branch at which a test function vanishes (``events``). Let q be the number. In the plane
through the event at right angles to the branch the motion moves by w_q, its parameter by p_q, its test function by
tau_q; along the branch the test function has the slope tau_s. So the event moves along the branch by
s_q = - tau_q / tau_s, and

    dp / dq = p_q + T_p s_q,      T_p: the tangent's part along the parameter.

At a fold T_p is zero, and this is - psi P_q / psi P_p, psi the left null vector of I - M. Differences are central; the
motions and determinants differenced are exact. Beside a grazing, where determinants have a root, they are of fourth
order and over shorter steps: there is a gradient if all motions have the crossings of the event, and the root is nearly
straight over them.

At a grazing itself, motions on the touching side have such a root. There no motion is differenced: w_q follows from the
slopes of the motion by q and by p, and tau is the depth of the touch, whose slopes by the state, by p and by q are
known, except for the touch of a limiter, whose depth is differenced. They are those of the motion that grazes, followed
without contact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.equations import Bordered
from gearrattle.engine.periodic.events.event_record import DOUBLING, FOLD, GRAZING, NEIMARK_SACKER, Event
from gearrattle.engine.periodic.events.grazing import apart
from gearrattle.engine.periodic.events.losses import LOSSES
from gearrattle.engine.periodic.events.neimark_sacker import pair_product
from gearrattle.engine.periodic.families import Family
from gearrattle.engine.periodic.grazing_depth import depth
from gearrattle.engine.periodic.motion import State, Touch
from gearrattle.engine.periodic.newton import Corrector
from gearrattle.engine.periodic.point import Guess, Point
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

KINDS = (FOLD, DOUBLING, NEIMARK_SACKER, GRAZING)
"""Kinds of events that have a gradient."""
ALONG = 1e-5  # arclength from an event to the points of the central difference along the branch
_CHANGE = 1e-5  # of q: half the difference
_SHARES = (1.0, 0.1, 0.01, 0.001)  # of both, the first over which the test function is straight
_BENT = 0.01
_STRAIGHT = 3e-4
"""Bends of a test function below which differences of fourth order are good to 4e-8 at a root, of second to 2e-7."""
_DEPTH_STEP = 1e-6  # of w: half the difference of a depth whose slope is not known

FamiliesOf = Callable[[float], tuple[Family, Family]]
Pair = tuple[float, float]


class Drift:
    """How an event moves with numbers of the driveline; not for grazings, see ``gradient_of_grazing``.

    event: of one of the ``KINDS``.
    """

    def __init__(self, event: Event, curve: Continuation) -> None:
        self._event = event
        self._curve = curve
        self._known: dict[float, Pair] = {}  # of ``_along``

    def gradient(self, families_of: FamiliesOf, value: float) -> float:
        """Return dp / dq.

        families_of: gives the driveline with q smaller, and with q larger, by a change [SI].
        value: of q [SI], not zero.
        ConvergenceError: there is no motion near the event, or a grazing lies too near to it.
        """
        for share in _SHARES:
            along = self._along(share)
            change = share * _CHANGE * abs(value)
            bend = _bend(along, along)
            if not bend <= _BENT:  # or NaN
                continue
            tests, parameters = self._across(families_of, change)
            bend_across = _bend(tests, along)
            if not bend_across <= _BENT:
                continue
            rises = np.array([_rise(pair) for pair in (along, tests, parameters)])
            if max(bend, bend_across) > _STRAIGHT:
                pairs = self._along(0.5 * share), *self._across(families_of, 0.5 * change)
                rises = (8.0 * np.array([_rise(pair) for pair in pairs]) - rises) / 3.0
            ahead, beyond, shift = rises
            moved = self._event.point.tangent[-1] * self._curve.family.unit * share * ALONG
            return float(0.5 * shift - moved * beyond / ahead) / change
        raise ConvergenceError("a grazing lies too near to the event")

    def _along(self, share: float) -> Pair:
        """The test function a share of the longest step behind and ahead on the branch."""
        if share not in self._known:
            steps = -share * ALONG, share * ALONG
            self._known[share] = self._tests(
                (self._curve.family, self._curve.moved_along(self._event.point, step)) for step in steps
            )
        return self._known[share]

    def _across(self, families_of: FamiliesOf, change: float) -> tuple[Pair, Pair]:
        """The test function and the parameter with q smaller, and with q larger, by a change."""
        families = families_of(change)
        low, high = (self._curve.of(family).in_plane(self._event.point) for family in families)
        return self._tests(zip(families, (low, high), strict=True)), (low.parameter, high.parameter)

    def _tests(self, motions: Iterable[tuple[Family, Point]]) -> Pair:
        """The test function of two motions; NaN for one with other crossings than the event."""
        own = sorted(self._event.point.word)
        low, high = (
            test_of(self._event, family, point) if sorted(point.word) == own else np.nan for family, point in motions
        )
        return low, high


def slope_along(event: Event, curve: Continuation) -> float:
    """Return the slope of the test function along the branch, by a central difference."""
    behind, ahead = (test_of(event, curve.family, curve.moved_along(event.point, side * ALONG)) for side in (-1.0, 1.0))
    return (ahead - behind) / (2.0 * ALONG)


def gradient_of_grazing(event: Event, curve: Continuation, over: Family, value: float) -> float:
    """Return dp / dq of a grazing at which the gradient is continuous.

    value: of q [SI].
    ConvergenceError: there is no extremum at the corner.
    """
    assert event.touch is not None
    point = apart(curve, event.point, event.touch)
    guess = point.guess(point.w)
    states = point.scale.size
    by_p = _followed(curve.family, point, guess, event.touch)
    by_q = _followed(over, point, guess._replace(w=np.append(guess.w[:-1], value / over.unit)), event.touch)
    equations = Bordered(by_p.matrix, point.tangent)
    unit = np.eye(1, by_q.matrix.shape[1], states)[0]
    tangent = equations.null_vector(point.tangent)[0]
    shift = equations.solution(np.append(-by_q.matrix[:, states], 0.0))
    along = (by_p.depth_slope(shift) + by_q.depth_slope(unit)) / by_p.depth_slope(tangent)
    return float((shift - tangent * along)[states] * curve.family.unit / over.unit)


class _Followed(NamedTuple):
    """A motion that grazes, followed in a family."""

    family: Family
    guess: Guess
    scale: Array  # (N,) of states to w
    touch: Touch
    matrix: Array  # (P, P + 1) of ``Corrector.matrix``
    row: Array | None  # (P + 1,) slopes of the depth; None: not known

    def depth_slope(self, direction: Array) -> float:
        """Return the slope of the depth along a direction (P + 1,) [SI]."""
        if self.row is not None:
            return float(self.row @ direction)
        own = direction[: self.guess.w.size]
        size = float(np.linalg.norm(own))
        if size == 0.0:
            raise ConvergenceError("the slope of the depth is not known")
        step = _DEPTH_STEP / size
        behind, ahead = (self._depth(self.guess.w + side * own) for side in (-step, step))
        return (ahead - behind) / (2.0 * step)

    def _depth(self, w: Array) -> float:
        state = State(w[:-1] / self.scale, self.guess.pieces)
        return depth(self.family.map_at(float(w[-1] * self.family.unit)), state, self.touch)[0]


def _followed(family: Family, point: Point, guess: Guess, touch: Touch) -> _Followed:
    """The motion of a point, in a family and in the units of the point."""
    corrector = Corrector(family, (point.scale, point.size))
    motion, slope = corrector.followed(guess, touch)
    near = motion.approach
    row = None if near is None or near.slope is None else corrector.row(near.slope, near.part, motion)
    return _Followed(family, guess, corrector.scale, touch, corrector.matrix(motion, slope), row)


def _rise(pair: Pair) -> float:
    return pair[1] - pair[0]


def _bend(tests: Pair, along: Pair) -> float:
    """How much a test function bends, zero at the event: the sum of both values over the rise, or over that along.

    Large beside a grazing, where there is a root.
    """
    return abs(tests[1] + tests[0]) / max(abs(_rise(tests)), abs(_rise(along)), np.finfo(float).tiny)


def test_of(event: Event, family: Family, point: Point) -> float:
    """Return the test function of an event, at a point nearby."""
    if event.kind == GRAZING:
        assert event.touch is not None
        return depth(family.map_at(point.parameter), point.motion.start, event.touch)[0]
    if event.kind == NEIMARK_SACKER:
        return pair_product(point, event.point)
    test: Callable[[Point], float] = LOSSES[event.kind].test
    return test(point)
