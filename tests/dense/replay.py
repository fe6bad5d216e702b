"""Follow a logged sequence of regions from a given state, densely, with the rounding it may have suffered.

A segment is the motion inside one region from one instant to the next. It is laid out on steps of ``region.h``; every
step in which a deflection might come near a corner of its region (linear interpolation is off by at most h^2/8 of the
largest second derivative) is looked at as a polynomial with all its derivatives, and the smallest gap found there.

Rounding: each step errs by at most eps |z| + eps h |M| |z| a component, |M| with absolute terms, and errors travel by
the step's matrix. With Q the squares of these, S = sum_j A^j Q A^jT, and N steps of a motion with Z components, the
Cauchy-Schwarz inequality bounds the sum of all errors by sqrt(N Z S_ii). That is what ``spread`` holds, squared.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.dense.plain import EPS, TERMS, Region
from tests.dense.rounding import Sums

LOOKS = 33
"""Points at which a suspicious step is looked at before Newton's method takes over."""
_FRACTIONS = np.linspace(0.0, 1.0, LOOKS)
_ORDERS = np.arange(TERMS + 1)
_FIRST = _ORDERS[1:]
_SECOND = _ORDERS[2:] * (_ORDERS[2:] - 1)


@dataclass(frozen=True)
class Segment:
    """What one segment came to.

    Attributes
    ----------
    end
        (Z,) state at its end. spread: (Z, Z) squared rounding there.
    noise
        (K,) rounding of the clearances' deflections anywhere in it.
    states
        (Z, N + 2) at the steps, the end included. lengths: (N + 1,) of the steps.
    gap
        (K, 2) smallest distance from the lower and the upper corner, where near; inf where not.
    when
        (K, 2) time of it since the start.
    """

    end: np.ndarray
    spread: np.ndarray
    noise: np.ndarray
    states: np.ndarray
    lengths: np.ndarray
    gap: np.ndarray
    when: np.ndarray


def follow(
    region: Region, z: np.ndarray, spread: np.ndarray, duration: float, *, sums: Sums, size: np.ndarray
) -> Segment:
    """Follow one region for a duration.

    Parameters
    ----------
    region
        the region. z: (Z,) state. spread: (Z, Z) its squared rounding.
    duration
        how long.
    sums
        what the deflections are made from.
    size
        (Z,) largest state of the whole run: a solver may round at that size, if it adds a forced motion to a free
        one.
    """
    count = int(duration // region.h)
    rest = min(max(duration - count * region.h, 0.0), region.h)
    states, i = z[:, None], 0
    while states.shape[1] <= count:
        states = np.hstack([states, region.stride(i) @ states])
        i += 1
    partial = region.partial(rest)
    end = partial @ states[:, count]
    states = np.hstack([states[:, : count + 1], end[:, None]])
    lengths = np.full(count + 1, region.h)
    lengths[-1] = rest
    spread, noise = _rounding(region, states, spread, count=count, partial=partial, sums=sums, size=size)
    gap, when = _gaps(region, states, lengths)
    return Segment(end, spread, noise, states, lengths, gap, when)


def _rounding(region, states, spread, *, count, partial, sums, size):
    """Squared rounding at the end, and the largest of the clearances' deflections anywhere in the segment."""
    largest = np.maximum(np.abs(states).max(axis=1), size)
    m, width = len(sums.carried), len(largest)
    own = EPS * (largest + region.h * (region.size @ largest))
    own[:m] += EPS * (sums.loops @ (largest[:m] + sums.carried))
    both = np.array([np.diag(own**2) * ((count + 1) * width), spread])
    start = spread
    if count:
        power = np.eye(width)
        left = count
        i = 0
        while left:
            stride = region.stride(i)
            if left & 1:
                power = stride @ power
            both = both + stride @ both @ stride.T
            left >>= 1
            i += 1
        start = power @ spread @ power.T
    rows = region.watch[0]
    noise = np.sqrt(np.einsum("kz,zy,ky->k", rows, both[0] + both[1], rows))
    return partial @ (start + both[0]) @ partial.T, noise


def _gaps(region: Region, states: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest distance from the corners around the region, where it might be small, and when."""
    count = len(region.lower)
    gap, when = np.full((count, 2), np.inf), np.zeros((count, 2))
    if not count:
        return gap, when
    delta, _, second, third = region.watch @ states
    bend = np.maximum(np.abs(second[:, :-1]), np.abs(second[:, 1:]))
    twist = np.maximum(np.abs(third[:, :-1]), np.abs(third[:, 1:]))
    reach = 1.5 * lengths**2 / 8 * (bend + lengths * twist)
    low = np.minimum(delta[:, :-1], delta[:, 1:]) - reach - region.lower[:, None]
    high = region.upper[:, None] - np.maximum(delta[:, :-1], delta[:, 1:]) - reach
    scale = 1e-9 * np.abs(delta).max(axis=1)[:, None]
    near = np.stack([low <= scale, high <= scale], axis=1)
    k, side, step = np.nonzero(near)
    if not len(k):
        return gap, when
    least, at = lowest(_gap_series(region, states, lengths, k=k, side=side, step=step))
    at = step * region.h + at * lengths[step]
    order = np.argsort(-least, kind="stable")  # the smallest is written last
    gap[k[order], side[order]] = least[order]
    when[k[order], side[order]] = at[order]
    return gap, when


def _gap_series(region, states, lengths, *, k, side, step):
    """(S, TERMS + 1) coefficients over a step of the gap of clearance k to its lower (0) or upper (1) corner."""
    coefficients = np.einsum("stz,zs->st", region.series[k], states[:, step])
    coefficients *= (lengths[step] / region.h)[:, None] ** _ORDERS
    sign = 1.0 - 2.0 * side
    corner = np.where(side == 0, region.lower[k], region.upper[k])
    coefficients[:, 0] -= corner
    return coefficients * sign[:, None]


def lowest(series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest value on [0, 1] of polynomials (S, TERMS + 1), and where."""
    table = series @ (_FRACTIONS ** _ORDERS[:, None])
    best = np.argmin(table, axis=1)
    x = _FRACTIONS[best]
    low, high = _FRACTIONS[np.maximum(best - 1, 0)], _FRACTIONS[np.minimum(best + 1, LOOKS - 1)]
    value = table[np.arange(len(x)), best]
    for _ in range(4):
        powers = x[:, None] ** _ORDERS
        slope = np.sum(series[:, 1:] * _FIRST * powers[:, :-1], axis=1)
        bend = np.sum(series[:, 2:] * _SECOND * powers[:, :-2], axis=1)
        x = np.clip(x - np.divide(slope, bend, out=np.zeros_like(slope), where=bend > 0), low, high)
    refined = np.sum(series * x[:, None] ** _ORDERS, axis=1)
    better = refined < value
    return np.where(better, refined, value), np.where(better, x, _FRACTIONS[best])
