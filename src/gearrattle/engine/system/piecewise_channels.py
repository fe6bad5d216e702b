"""Channels of piecewise polynomials, each on intervals of its own, and their union as ``Signals``.

A channel keeps its own knots until all are known; where another one has a knot inside an interval, the polynomial is
rewritten about that knot,

    sum_j a_j (t - t_g)^j = sum_i b_i (t - t_g - d)^i,    b_i = sum_(j >= i) C(j, i) a_j d^(j - i).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.piecewise_signals import Signals

Array = NDArray[np.float64]

SAME = 1e-13
"""Share of the last time below which two knots are equal: a polynomial is used that far beyond its interval."""


@dataclass(frozen=True)
class Channel:
    """One piecewise polynomial of time."""

    knots: Array  # (G + 1,) ascending [s]
    coefficients: Array  # (G, D + 1) of ascending powers of the time since the interval's start [SI]

    def at(self, time: Array, derivative: int = 0) -> Array:
        """(t,) values, or a derivative, at times (t,) [s]."""
        none = np.zeros((0, 1))
        return Signals(self.knots, self.coefficients[:, None, :], none, none).at(np.asarray(time), derivative)[:, 0]

    def on(self, knots: Array) -> Array:
        """(G', D + 1) coefficients on other intervals, each of which lies inside one of its own."""
        middle = 0.5 * (knots[1:] + knots[:-1])
        interval = np.clip(np.searchsorted(self.knots, middle, side="right") - 1, 0, len(self.coefficients) - 1)
        return shifted(self.coefficients[interval], knots[:-1] - self.knots[interval])

    def between(self, begin: float, end: float) -> Channel:
        """The same channel from one time to another, counted from the first."""
        inside = self.knots[(self.knots > begin) & (self.knots < end)]
        knots = np.concatenate([[begin], inside, [end]])
        return Channel(knots - begin, self.on(knots))

    def integral(self, value: float = 0.0) -> Channel:
        """The channel of which this one is the derivative, continuous, from a value at its start on."""
        powers = np.arange(1, self.coefficients.shape[1] + 1)
        inner = self.coefficients / powers
        length = np.diff(self.knots)[:, None] ** powers
        start = value + np.concatenate([[0.0], np.cumsum((inner * length).sum(axis=1))[:-1]])
        return Channel(self.knots, np.column_stack([start, inner]))

    def plus(self, value: float) -> Channel:
        """The channel and a constant."""
        coefficients = self.coefficients.copy()
        coefficients[:, 0] += value
        return Channel(self.knots, coefficients)

    def times(self, factor: float) -> Channel:
        """The channel times a factor."""
        return Channel(self.knots, self.coefficients * factor)


def shifted(coefficients: Array, by: Array) -> Array:
    """(G, D + 1) coefficients of the same polynomials about points (G,) further on."""
    degree = coefficients.shape[1] - 1
    out = coefficients.copy()
    further = by != 0.0
    original = coefficients[further]
    powers = by[further, None] ** np.arange(degree + 1)
    moved = np.zeros_like(original)
    for i in range(degree + 1):
        for j in range(i, degree + 1):
            moved[:, i] += comb(j, i) * original[:, j] * powers[:, j - i]
    out[further] = moved
    return out


def distinct(times: Array) -> Array:
    """Ascending times, the first and the last of them kept, without those that equal their neighbour to rounding.

    Two times are equal if they differ by less than 1e-13 of the last. Every time that is kept differs by more than that
    from the time kept before, so that a series of near times does not vanish as a whole.
    """
    apart = SAME * float(times[-1])
    if np.all(np.diff(times) > apart):
        return times
    kept = [float(times[0])]
    for time in times[1:-1].tolist():
        if time - kept[-1] > apart and times[-1] - time > apart:
            kept.append(time)
    return np.array([*kept, float(times[-1])])


def joined(channels: Sequence[Channel], torque: Array, error: Array) -> Signals:
    """Put channels on common intervals.

    channels: C of them, all beginning at 0; the shortest ends the whole.
    torque: (n, C) torque on every inertia for a unit of every channel.
    error: (m, C) transmission error of every element for a unit of every channel.
    """
    end = min(float(channel.knots[-1]) for channel in channels)
    knots = np.unique(np.concatenate([channel.knots for channel in channels]))
    knots = distinct(np.concatenate([[0.0], knots[(knots > 0.0) & (knots < end)], [end]]))
    degree = max(channel.coefficients.shape[1] for channel in channels)
    coefficients = np.zeros((len(knots) - 1, len(channels), degree))
    for c, channel in enumerate(channels):
        coefficients[:, c, : channel.coefficients.shape[1]] = channel.on(knots)
    return Signals(knots, coefficients, torque, error)
