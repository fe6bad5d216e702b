"""What a state must keep, over a box: the excess over every bound, and where in the box it has a sign for certain.

The excess of a bound is how far the motion goes beyond it, a sum over the orders of the inputs,

    excess(t, phi) = mean(t) + Re sum_j c_j(t) exp(i p_j phi),

with forms over the box for mean and c_j: to first order it is linear in the parameters t at every phase phi. At N
phases that is exact. Between them a trigonometric polynomial of degree p rises by no more than the factor
1 / cos(pi p / N) (H. Ehlich, K. Zeller 1964, Math. Z. 86, 41-44). So along one parameter, the others anywhere in their
ranges, every bound at every phase leaves an interval in which it is kept for certain, and two ends beyond which it is
exceeded for certain.

Takes a ``State``, its motion and coefficients; gives intervals of one parameter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.studies.quiet.forms import Array, Form
from gearrattle.studies.quiet.state import CLIP, SLIP, Motion, State

_FINE = 256  # phases a period of the highest order
_COARSE = 48
_MOST = 4096  # phases, unless _COARSE needs more
_LONG = 64  # periods in which a motion without a period is looked at
_ALLOWED = 1e-9  # of all moduli, for rounding


class Phases:
    """Phases of one period of the inputs, and what a motion may rise by between them."""

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
    kind
        (B,) of each: GAP, STAGE, SLIP, CLIP.
    excess, slopes, above
        (B, N) at the centre at every phase, (d, B, N), and (B,) what the excess may be larger by, between the phases
        too; without a common period there is one phase, at which all orders add up.
    seen, seen_slopes, below
        the same at phases that occur, and (B,) what the excess may be smaller by.
    rest, rest_slopes, rest_above
        (G,), (d, G) and (G,): the excess of the mean alone over every corner, and what it may be larger by.
    """

    kind: NDArray[np.int64]
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
        each = np.arange(self.kind.size)
        slopes = np.abs(self.slopes[:, each, worst])
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


def bounds_of(state: State, motion: Motion, numbers: dict[str, Form], phases: Phases) -> Bounds | None:
    """Return the bounds that are not kept for certain in all of the box; None where all are."""
    rows = list(_excesses(state, motion, numbers))
    kept: list[tuple[int, Form, list[Form]]] = []
    resting: list[Form] = []
    for kind, mean, orders in rows:
        if kind not in (SLIP, CLIP):
            resting.append(mean)
        swing = sum(float(np.abs(c.value) + c.span) for c in orders)
        rest = float(mean.rest) + sum(float(c.rest) for c in orders)
        allowed = _ALLOWED * (swing + abs(float(mean.value)) + float(mean.span))
        if float(mean.value) + float(mean.span) + swing + rest + allowed >= 0.0:
            kept.append((kind, mean, orders))
    return _sampled(kept, resting, phases) if kept else None


def _sampled(kept: list[tuple[int, Form, list[Form]]], resting: list[Form], phases: Phases) -> Bounds:
    """The excess of bounds at every phase."""
    mean = np.array([float(m.value) for _, m, _ in kept])
    mean_slopes = np.array([m.slopes for _, m, _ in kept]).T  # (d, B)
    wave = np.array([[c.value for c in orders] for _, _, orders in kept], dtype=complex).reshape(len(kept), -1)
    wave_slopes = np.array([[c.slopes for c in orders] for _, _, orders in kept], dtype=complex)
    wave_slopes = np.moveaxis(wave_slopes.reshape(len(kept), wave.shape[1], mean_slopes.shape[0]), 2, 0)
    rest = np.array([float(m.rest) + sum(float(c.rest) for c in orders) for _, m, orders in kept])
    swings = np.abs(wave).sum(axis=1) + np.abs(wave_slopes).sum(axis=(0, 2))
    sizes = swings + np.abs(mean) + np.abs(mean_slopes).sum(axis=0)
    # at the phases
    swing = (wave @ phases.waves).real
    slopes = (wave_slopes @ phases.waves).real
    seen = mean[:, None] + swing
    seen_slopes = mean_slopes[:, :, None] + slopes
    most = seen
    most_slopes = seen_slopes
    between = phases.rise * (np.abs(swing) + np.abs(slopes).sum(axis=0)).max(axis=1)
    if not phases.is_whole:  # no period: at some time all orders may add up
        most = (mean + swings)[:, None]
        most_slopes = mean_slopes[:, :, None]
        between = np.zeros(len(kept))
    allowed = _ALLOWED * sizes
    still = np.array([float(m.value) for m in resting])
    still_slopes = np.array([m.slopes for m in resting]).reshape(len(resting), -1).T
    return Bounds(
        np.array([kind for kind, _, _ in kept], dtype=np.int64),
        most,
        most_slopes,
        rest + between + allowed,
        seen,
        seen_slopes,
        rest + allowed,
        still,
        still_slopes,
        np.array([float(m.rest) for m in resting]) + _ALLOWED * (np.abs(still) + np.abs(still_slopes).sum(axis=0)),
    )


def _excesses(state: State, motion: Motion, numbers: dict[str, Form]) -> Iterator[tuple[int, Form, list[Form]]]:
    """Yield kind, mean and orders of the excess over every bound."""
    size = state.family.system.size
    inner = numbers["inner"][state.chosen]
    for corner in state.corners:
        at = size + corner.element
        inside = inner[corner.element].plus(numbers["corner"][corner.number], -1.0)
        mean = motion.mean[at].plus(inside)
        yield corner.kind, _scaled(mean, corner.side), [_scaled(order[at], corner.side) for order in motion.orders]
    for number, element in state.stuck:
        spring = numbers["spring"][number]
        pulls = [spring.times(order[size + element]) for order in motion.orders]
        for side in (1, -1):
            yield SLIP, _scaled(numbers["limit"][number], -1.0), [_scaled(pull, side) for pull in pulls]
    yield from _clippings(state, motion, numbers)


def _clippings(state: State, motion: Motion, numbers: dict[str, Form]) -> Iterator[tuple[int, Form, list[Form]]]:
    """Yield what contact damping exceeds the spring's force by: +-C delta' - |F|."""
    system = state.family.system
    cycles = system.inputs.cycles[system.inputs.cycles > 0.0]
    stiffness = numbers["stiffness"][state.chosen]
    damping = numbers["damping"][state.chosen]
    force = numbers["force"][state.chosen]
    for element in state.clipped:
        at = system.size + element
        side = 1 if state.pieces[element] + system.laws[element].first_label > 0 else -1
        mean = _scaled(stiffness[element].times(motion.mean[at]).plus(force[element]), -side)
        loss = damping[element].times(numbers["rate"][0])
        for way in (1, -1):
            orders = [
                _scaled(stiffness[element].times(order[at]), -side).plus(
                    loss.times(_scaled(order[at], 1j * cycle)), way
                )
                for order, cycle in zip(motion.orders, cycles.tolist(), strict=True)
            ]
            yield CLIP, mean, orders


def _scaled(form: Form, factor: complex) -> Form:
    return Form(factor * form.value, factor * form.slopes, abs(factor) * form.rest)
