"""Continuous angle from an encoder that starts over after a turn.

An encoder falls by its span from one sample to the next. An analogue output that was filtered, or sampled in the fall,
has samples in between: there the steps are far from those around them, modulo the span. Such samples are replaced by
the cubic spline through all others. The excess of a step over the usual one, the median of those around, is added up:
over a fall the sum is minus the span, however many steps the fall takes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST_REPLACED = 0.25
"""Part of the samples: falls that take more are refused."""
_AROUND = (9, 31)  # steps whose median is the usual one; more where the falls take longer
_SCATTER_OVER = 61
_FEWEST_IN_A_TURN = 20
_COARSE = 0.2  # of the span: how far a step must be from the usual one where a turn has fewer samples
_FAR = (0.01, 0.1)  # of the span: a step this far from the usual one may lie in a fall; 6 times the usual distance
_REST = 1e-4  # of the span: where the ringing of a filter has died away; or 4 times the usual distance
_REST_OF_STEP = 0.02  # or this part of the usual step
_HIDDEN = 3  # steps before and after those that still move
_RINGS = 20  # steps, at most
_WHOLE = 0.1  # of the span: how closely a fall must sum up to it


class FallError(ValueError):
    """Falls of an encoder that cannot be distinguished from its rotation, with rule and remedy."""

    def __init__(self, rule: str, remedy: str) -> None:
        super().__init__(rule)
        self.rule = rule
        self.remedy = remedy


class Unwrapped(NamedTuple):
    """A continuous angle (N,), in the unit of the encoder."""

    values: Array
    falls: int
    replaced: int


def unwrapped(values: Array, span: float) -> Unwrapped:
    """Return a continuous angle where an encoder starts over.

    Parameters
    ----------
    values
        (N,), N >= 4; two neighbours are less than half the span apart in reality.
    span
        where the encoder starts over, in the unit of the values.

    Raises
    ------
    FallError
        falls take more than ``MOST_REPLACED`` of the samples, or do not sum up to the span.
    """
    steps = np.diff(values)
    is_coarse = float(np.median(np.abs(_within(steps, span)))) > span / _FEWEST_IN_A_TURN
    refusal = None
    for around in _AROUND:
        usual, distance = _usual(steps, span, around)
        groups = _groups(distance, usual, span, is_coarse)
        if not groups:
            return Unwrapped(np.asarray(np.unwrap(values, period=span), dtype=np.float64), 0, 0)
        if is_coarse:
            rule = f"some samples lie within its falls, which less than {_FEWEST_IN_A_TURN} samples a turn do not tell"
            raise FallError(rule, "record it unfiltered or at a higher rate")
        try:
            return _over_falls(values, usual, groups, span)
        except FallError as error:
            refusal = error
    assert refusal is not None
    raise refusal


def _over_falls(values: Array, usual: Array, groups: list[tuple[int, int]], span: float) -> Unwrapped:
    """Make an angle continuous over falls of several steps; FallError where they do not differ from the turning."""
    # steps beyond the usual one, in spans
    steps = np.diff(values)
    excess = np.concatenate([[0.0], np.cumsum(steps - usual)]) / span
    turns = np.rint((steps - usual) / span)
    replaced = np.zeros(values.size, dtype=np.bool_)
    falls = 0
    for first, behind in groups:
        # the fall of a group; at the ends of the record it may be cut
        fallen = float(excess[behind] - excess[first])
        off_whole = abs(fallen - round(fallen)) > _WHOLE
        begins = first == 0 or (off_whole and first < _RINGS)
        ends = behind == steps.size or (off_whole and behind > steps.size - _RINGS)
        # no fall, or one that is no whole number of spans
        if not (begins or ends):
            if round(fallen) == 0:
                continue
            if off_whole:
                rule = (
                    f"from sample {first} to {behind} it falls by {abs(fallen):.3g} of the angle where it starts over"
                )
                raise FallError(rule, "check starts_over, scale and offset, or cut with start and end")
        # the whole fall counts at the group's last step; its samples are replaced
        turns[first:behind] = 0.0
        turns[behind - 1] = round(fallen)
        replaced[0 if begins else first + 1 : values.size if ends else behind] = True
        falls += 1
    # refuse falls that take too much of a turn
    if replaced.mean() > MOST_REPLACED:
        rule = f"its falls take {replaced.mean():.0%} of the samples: a filter smears them over too much of a turn"
        raise FallError(rule, "record it unfiltered or at a higher rate")
    # the continuous angle, samples in the falls by a spline
    whole = values - span * np.concatenate([[0.0], np.cumsum(turns)])
    return Unwrapped(_bridged(whole, replaced, usual), falls, int(replaced.sum()))


def _usual(steps: Array, span: float, around: int) -> tuple[Array, Array]:
    """Return the usual step around each step, modulo the span, and the distance of each from it."""
    from scipy.ndimage import median_filter

    usual = median_filter(_within(steps, span), size=min(around, steps.size), mode="nearest")
    return usual, np.abs(_within(steps - usual, span))


def _within(steps: Array, span: float) -> Array:
    """Return steps modulo the span, from minus half of it to half of it."""
    return np.asarray(np.mod(steps + 0.5 * span, span) - 0.5 * span, dtype=np.float64)


def _groups(distance: Array, usual: Array, span: float, is_coarse: bool) -> list[tuple[int, int]]:
    """Return first steps, and those behind the last, of stretches that may be falls of several steps."""
    from scipy.ndimage import median_filter

    # steps far from the usual ones
    scatter = median_filter(distance, size=min(_SCATTER_OVER, distance.size), mode="nearest")
    limit = _COARSE * span if is_coarse else np.clip(6.0 * scatter, _FAR[0] * span, _FAR[1] * span)
    far = np.flatnonzero(distance > limit)
    moving = distance > np.maximum(4.0 * scatter, np.maximum(_REST * span, _REST_OF_STEP * np.abs(usual)))
    groups: list[tuple[int, int]] = []
    # extend every group over the ringing of a filter
    for step in far.tolist():
        if groups and step < groups[-1][1]:
            continue
        first = step
        while first > max(step - _RINGS, 0) and moving[max(first - 2, 0) : first].any():
            first -= 1
        behind = step + 1
        while behind < min(step + _RINGS, distance.size) and moving[behind : behind + 2].any():
            behind += 1
        if behind - first > 2:  # a filter, whose ringing goes on below the vibration
            first = max(first - _HIDDEN, 0)
            behind = min(behind + _HIDDEN, distance.size)
        # join groups that touch
        if groups and first <= groups[-1][1] + 2:
            first = groups.pop()[0]
        groups.append((first, behind))
    return groups


def _bridged(values: Array, replaced: NDArray[np.bool_], usual: Array) -> Array:
    """Replace samples by the spline through the others; before the first and after the last by the usual steps."""
    from scipy.interpolate import CubicSpline

    at = np.arange(values.size)
    good = at[~replaced]
    result = np.array(values)
    within = replaced & (at > good[0]) & (at < good[-1])
    result[within] = CubicSpline(good, values[good])(at[within])
    result[: good[0]] = values[good[0]] - usual[good[0]] * (good[0] - at[: good[0]])
    result[good[-1] + 1 :] = values[good[-1]] + usual[good[-1] - 1] * (at[good[-1] + 1 :] - good[-1])
    return result
