"""Bounds of a state over a box: the excess over each, and the intervals of a parameter where its sign is certain.

The excess of a bound is how far the motion goes beyond it, a sum over the orders of the inputs,

    excess(t, phi) = mean(t) + Re sum_j c_j(t) exp(i p_j phi),

with forms over the box for mean and c_j: to first order it is linear in the parameters t at every phase phi. At N
phases that is exact. Between them a trigonometric polynomial of degree p rises by no more than the factor
1 / cos(pi p / N) (H. Ehlich, K. Zeller 1964, Math. Z. 86, 41-44). So along one parameter, the others anywhere in their
ranges, every bound at every phase leaves an interval in which it is kept for certain, and two ends beyond which it is
exceeded for certain.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.studies.quiet.rest_state import CLIP, SLIP, Motion, State, positive_orders
from gearrattle.studies.quiet.taylor_forms import Array, Form, joined

_FINE = 256  # phases a period of the highest order
_COARSE = 48
_MOST = 4096  # phases, unless _COARSE needs more
_LONG = 64  # periods in which a motion without a period is looked at
_ALLOWED = 1e-9  # of all moduli, for rounding


class Phases:
    """Phases of one period of the inputs, and the factor by which a motion may rise between them."""

    def __init__(self, cycles: Array) -> None:
        turning = cycles[cycles > 0.0]
        highest = float(turning.max(initial=0.0))
        self.is_whole = bool(np.all(np.abs(turning - np.rint(turning)) < 1e-9))
        length = 1.0 if self.is_whole else float(_LONG)
        count = int(np.ceil(min(_FINE * highest * length, max(_MOST, _COARSE * highest * length)))) or 1
        phase = 2.0 * np.pi * length * np.arange(count) / count
        self.waves: NDArray[np.complex128] = np.exp(1j * np.outer(turning, phase))
        self.rise = 1.0 / np.cos(np.pi * highest / count) - 1.0 if turning.size else 0.0


@dataclass(frozen=True)
class Bounds:
    """The excess over every bound of a state that is not kept in all of a box for certain.

    Attributes
    ----------
    kind, element
        (B,) of each: GAP, STAGE, SLIP, CLIP, and its element.
    excess, slopes, above
        (B, N) at the centre at every phase, (d, B, N), and (B,) what the excess may be larger by, between the phases
        too; without a common period there is one phase, at which all orders add up.
    seen, seen_slopes, below
        the same at phases that occur, and (B,) what the excess may be smaller by.
    rest, rest_slopes, rest_above
        (G,), (d, G) and (G,): the excess of the mean alone over every corner, and what it may be larger by.
    """

    kind: NDArray[np.int64]
    element: NDArray[np.int64]
    excess: Array
    slopes: Array
    above: Array
    seen: Array
    seen_slopes: Array
    below: Array
    rest: Array
    rest_slopes: Array
    rest_above: Array

    @cached_property
    def span(self) -> Array:
        """(B, N) by how much the excess changes within the box."""
        return np.asarray(np.abs(self.slopes).sum(axis=0))

    def kept(self, axis: int, chosen: NDArray[np.bool_] | None = None) -> tuple[float, float]:
        """Return the interval of one parameter in [-1, 1] where the chosen bounds are kept for certain."""
        chosen = np.ones(self.kind.size, dtype=np.bool_) if chosen is None else chosen
        slope = self.slopes[axis][chosen]
        most = self.excess[chosen] + self.span[chosen] - np.abs(slope) + self.above[chosen, None]
        return _negative(most, slope)

    def at_rest(self, axis: int) -> tuple[float, float]:
        """Return the interval of one parameter in which the mean state lies within its pieces."""
        slope = self.rest_slopes[axis]
        most = self.rest + np.abs(self.rest_slopes).sum(axis=0) - np.abs(slope) + self.rest_above
        return _negative(most, slope)

    def exceeded(self, axis: int, chosen: NDArray[np.bool_]) -> tuple[float, float]:
        """Return two values of one parameter: below the first, and above the second, a chosen bound is exceeded."""
        slope = self.seen_slopes[axis][chosen]
        others = np.abs(self.seen_slopes[:, chosen]).sum(axis=0) - np.abs(slope)
        least = self.seen[chosen] - others - self.below[chosen, None]
        if np.any(least - np.abs(slope) > 0.0):
            return 1.0, -1.0
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = -least / slope
        low = turn[slope < 0.0].max(initial=-1.0)
        high = turn[slope > 0.0].min(initial=1.0)
        return float(min(low, 1.0)), float(max(high, -1.0))

    def influence(self) -> Array:
        """(d,) share of every parameter in what the bound nearest to its end changes by in the box; last: the rest."""
        worst = np.argmax(self.excess + self.span, axis=1)
        slopes = np.abs(self.slopes[:, np.arange(self.kind.size), worst])
        parts = np.vstack([slopes, self.above])
        return np.asarray((parts / (parts.sum(axis=0) + 1e-300)).max(axis=1))


def _negative(most: Array, slope: Array) -> tuple[float, float]:
    """Interval of s in [-1, 1] in which all of most + slope s are below zero; the second end is the lower for none."""
    if np.any((slope == 0.0) & (most >= 0.0)):
        return 1.0, -1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = -most / slope
    low = turn[slope < 0.0].max(initial=-1.0)
    high = turn[slope > 0.0].min(initial=1.0)
    return float(low), float(high)


class _Excess(NamedTuple):
    """Kinds and elements (B,) of bounds, mean (B,) and orders (H, B) of the excess over them."""

    kind: NDArray[np.int64]
    element: NDArray[np.int64]
    mean: Form
    orders: Form


def bounds_of(state: State, motion: Motion, numbers: dict[str, Form], phases: Phases) -> Bounds | None:
    """Return the bounds that are not kept for certain in all of the box; None where all are."""
    corners = _over_corners(state, motion, numbers)
    others = [*_slips(state, motion, numbers), *_clippings(state, motion, numbers)]
    kind = np.concatenate([corners.kind, *(part.kind for part in others)])
    element = np.concatenate([corners.element, *(part.element for part in others)])
    mean = joined(corners.mean, *(part.mean for part in others))
    orders = joined(corners.orders, *(part.orders for part in others))
    # whether all orders together stay below
    swing = (np.abs(orders.value) + orders.span).sum(axis=0)
    most = mean.value + mean.span + swing
    allowed = _ALLOWED * (swing + np.abs(mean.value) + mean.span)
    close = np.flatnonzero(most + mean.rest + orders.rest.sum(axis=0) + allowed >= 0.0)
    if not close.size:
        return None
    return _sampled(_Excess(kind[close], element[close], mean.at(close), orders.at(close)), corners.mean, phases)


def _sampled(near: _Excess, resting: Form, phases: Phases) -> Bounds:
    """The excess over bounds at every phase."""
    # remainders, and what rounding may add
    kind, element, mean, orders = near
    rest = mean.rest + orders.rest.sum(axis=0)
    swings = (np.abs(orders.value) + orders.span).sum(axis=0)
    allowed = _ALLOWED * (swings + np.abs(mean.value) + mean.span)
    # at the phases
    swing = (orders.value.T @ phases.waves).real
    slopes = (np.swapaxes(orders.slopes, 1, 2) @ phases.waves).real
    seen = mean.value[:, None] + swing
    seen_slopes = mean.slopes[:, :, None] + slopes
    # between the phases
    most = seen
    most_slopes = seen_slopes
    between = phases.rise * (np.abs(swing) + np.abs(slopes).sum(axis=0)).max(axis=1)
    if not phases.is_whole:  # no period: at some time all orders may add up
        most = (mean.value + swings)[:, None]
        most_slopes = mean.slopes[:, :, None]
        between = np.zeros(kind.size)
    return Bounds(
        kind=kind,
        element=element,
        excess=most,
        slopes=most_slopes,
        above=rest + between + allowed,
        seen=seen,
        seen_slopes=seen_slopes,
        below=rest + allowed,
        rest=resting.value,
        rest_slopes=resting.slopes,
        rest_above=resting.rest + _ALLOWED * (np.abs(resting.value) + resting.span),
    )


def _over_corners(state: State, motion: Motion, numbers: dict[str, Form]) -> _Excess:
    """The excess over every corner."""
    side, at, number, kind = state.corner_columns
    inside = numbers["inner"].at(state.piece_numbers).at(at).plus(numbers["corner"].at(number), -1.0)
    deflection = at + state.family.system.size
    mean = motion.mean.at(deflection).plus(inside)
    return _Excess(kind, at, mean.scaled(side), motion.orders.at(deflection).scaled(side))


def _slips(state: State, motion: Motion, numbers: dict[str, Form]) -> Iterator[_Excess]:
    """Yield the excess of the force on friction that sticks over its limit, both ways."""
    if not state.stuck:
        return
    number, element = np.array(state.stuck).T
    limit = numbers["limit"].at(number).scaled(-1.0)
    pull = numbers["spring"].at(number).rows(1).times(motion.orders.at(element + state.family.system.size))
    kind = np.full(number.size, SLIP)
    yield from (_Excess(kind, element, limit, pull.scaled(way)) for way in (1.0, -1.0))


def _clippings(state: State, motion: Motion, numbers: dict[str, Form]) -> Iterator[_Excess]:
    """Yield the excess of contact damping over the spring's force: +-C delta' - |F|."""
    if not state.clipped:
        return
    system = state.family.system
    element = np.array(state.clipped)
    labels = np.array([state.pieces[k] + system.laws[k].first_label for k in state.clipped])
    side = np.where(labels > 0, 1.0, -1.0)
    stiffness, damping, force = (
        numbers[name].at(state.piece_numbers[element]) for name in ("stiffness", "damping", "force")
    )
    deflection = motion.orders.at(element + system.size)
    mean = stiffness.times(motion.mean.at(element + system.size)).plus(force).scaled(-side)
    elastic = stiffness.rows(1).times(deflection).scaled(-side)
    rate = deflection.scaled(1j * positive_orders(system)[:, None])
    loss = damping.times(numbers["rate"]).rows(1).times(rate)
    yield from (_Excess(np.full(element.size, CLIP), element, mean, elastic.plus(loss, way)) for way in (1.0, -1.0))
