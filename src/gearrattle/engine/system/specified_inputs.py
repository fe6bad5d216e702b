"""Inputs as they are specified, and the polynomials that stand for them.

    f(t) = sum_j a_j(Omega(t)) sin(n_j phi(t) + p_j)

is evaluated here from its own formula, at any time, with the phase in double-double arithmetic (T. J. Dekker,
Numerische Mathematik 18, 1971): no interval, knot or polynomial of ``run_up_signals`` or ``channels`` takes part. So
``checked`` can find a fault in them before a run, and the energy audit after it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.piecewise_channels import SAME
from gearrattle.engine.system.piecewise_signals import INNER, Signals, Specified
from gearrattle.engine.system.run_up_phase import PER_RADIAN, Ramp
from gearrattle.engine.system.run_up_signals import Tone

Array = NDArray[np.float64]
Pair = tuple[Any, Any]

PROMISED = 1e-12
"""Largest error of polynomials, relative to the size of the input."""
_POINTS = np.array([0.0, *INNER, 1.0])
"""Parts of an interval at which polynomials are compared; no node of theirs but the ends."""
_ROUNDED = 4.0
"""Roundings of the last time by which the time of a polynomial may be off, and of the highest speed likewise."""


class NotKept(ArithmeticError):
    """Polynomials that differ from the specified input by more than is promised."""


@dataclass(frozen=True)
class Swept:
    """Tones along a ramp; ``smooth`` if the first derivative counts as well."""

    ramp: Ramp
    tones: tuple[Tone, ...]
    smooth: bool

    @property
    def sizes(self) -> tuple[float, ...]:
        """The sums of a_j, and of a_j n_j Omega at the highest speed."""
        low, high = sorted((self.ramp.begin, self.ramp.end))
        largest = [tone.largest(low, high) for tone in self.tones]
        slopes = [size * tone.order * high for size, tone in zip(largest, self.tones, strict=True)]
        return (sum(largest), sum(slopes)) if self.smooth else (sum(largest),)

    def at(self, time: Array, rest: Array | float = 0.0, derivative: int = 0) -> Array:
        """(t,) values, or a derivative up to the second, at times (t,) [s]."""
        ramp = self.ramp
        out = np.zeros(np.shape(time))
        speed = ramp.speed(time)
        rate = np.where(time < ramp.over, ramp.rate, 0.0)
        turned: dict[float, Array] = {}
        for tone in self.tones:
            size = tone.at(speed)
            if tone.order not in turned:
                turned[tone.order] = 2.0 * np.pi * turns(ramp, tone.order, time, rest)
            angle = turned[tone.order] + tone.phase
            turning = tone.order * speed
            if derivative == 0:
                out += size * np.sin(angle)
                continue
            slope = tone.at(speed, 1) * rate
            if derivative == 1:
                out += slope * np.sin(angle) + size * turning * np.cos(angle)
                continue
            out += (tone.at(speed, 2) * rate**2 - size * turning**2) * np.sin(angle)
            out += (2.0 * slope * turning + size * tone.order * rate) * np.cos(angle)
        return out

    def rounding(self, time: Array, derivative: int = 0) -> Array:
        """(t,) what four roundings of the highest speed make of the amplitudes, where a table is steep."""
        ramp = self.ramp
        out = np.zeros(np.shape(time))
        speed = ramp.speed(time)
        step = _ROUNDED * np.spacing(max(ramp.begin, ramp.end))
        for tone in self.tones:
            for moved in (speed - step, speed + step):
                change = np.abs(tone.at(moved) - tone.at(speed))
                if derivative == 0:
                    out += change
                else:
                    out += np.abs((tone.at(moved, 1) - tone.at(speed, 1)) * ramp.rate) + change * tone.order * speed
        return out


def turns(ramp: Ramp, order: float, time: Array, rest: Array | float = 0.0) -> Array:
    """(t,) fractions of a turn, about 0, that ``order`` times the angle has made at times (t,) [s]."""
    begin = Fraction(ramp.begin)
    end = Fraction(ramp.end)
    over = Fraction(ramp.over)
    factor = Fraction(order) * PER_RADIAN
    at = _sum(time, rest)
    bend = _times(_pair(factor * (end - begin) / (2 * over)), at)
    rising = _times(_plus(bend, _pair(factor * begin)), at)
    steady = _plus(_times(_pair(factor * end), at), _pair(factor * (begin - end) * over / 2))
    high, low = (np.where(time <= ramp.over, r, s) for r, s in zip(rising, steady, strict=True))
    return np.asarray((high - np.round(high)) + low)


def _pair(value: Fraction) -> tuple[float, float]:
    """A number as the sum of two doubles."""
    high = float(value)
    return high, float(value - Fraction(high))


def _sum(a: Any, b: Any) -> Pair:
    """a + b, and its rounding error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _plus(a: Pair, b: Pair) -> Pair:
    high, low = _sum(a[0], b[0])
    return _sum(high, low + (a[1] + b[1]))


def _times(a: Pair, b: Pair) -> Pair:
    (a_high, a_low) = _split(a[0])
    (b_high, b_low) = _split(b[0])
    high = a[0] * b[0]
    low = ((a_high * b_high - high) + a_high * b_low + a_low * b_high) + a_low * b_low
    return _sum(high, low + (a[0] * b[1] + a[1] * b[0]))


def _split(a: Any) -> Pair:
    """A double as the sum of two of 26 bits."""
    scaled = 134217729.0 * a
    high = scaled - (scaled - a)
    return high, a - high


def checked(signals: Signals) -> Signals:
    """Compare polynomials with what they stand for, at both ends and within every interval.

    Returns the same, with the ``reference`` that they were compared with.

    Raises
    ------
    NotKept
        an error above 1e-12 of the input's size, and above what four roundings of the last time, and of the speed that
        its amplitudes follow, make of it.
    """
    # points of every interval
    knots = signals.knots
    length = np.diff(knots)[:, None]
    since = length * _POINTS
    since[:, -1] = length[:, 0]
    time, rest = (part.ravel() for part in _sum(np.broadcast_to(knots[:-1, None], since.shape), since))
    # the error that rounding allows, and points that may lie across a corner
    off = _ROUNDED * np.spacing(float(knots[-1]))
    merged = np.minimum(since, length - since) <= SAME * knots[-1]  # a corner may stand between knot and point
    reference = np.zeros((len(knots) - 1, signals.channels, INNER.size))
    by_rate = np.any(signals.error != 0.0, axis=0)
    for c, specified in enumerate(signals.specified):
        for derivative, size in enumerate(specified.sizes):
            # polynomial and specified input
            value, slope = (_values(signals, c, since, derivative + d).ravel() for d in range(2))
            expected = specified.at(time, rest, derivative)
            if derivative == by_rate[c]:
                reference[:, c] = expected.reshape(since.shape)[:, 1:-1]
            # the error beyond what is promised
            excess = np.abs(value - expected) - PROMISED * size - off * np.abs(slope)
            excess -= specified.rounding(time, derivative)
            if derivative:
                excess[merged.ravel()] = 0.0
            for at in np.flatnonzero(~(excess <= 0.0)):
                off_by = float(excess[at])
                if merged.flat[at]:
                    off_by = _next_to_corner(specified, time[at], knots[-1], value[at], slope[at]) - PROMISED * size
                if not off_by <= 0.0:
                    raise NotKept(f"at {time[at]:.6g} s an input is off by {off_by:.3g} (size {size:.3g})")
    return replace(signals, reference=reference)


def _next_to_corner(specified: Specified, time: float, end: float, value: float, slope: float) -> float:
    """Distance of a value from the input just before and after a time: near knots count as one (``distinct``)."""
    near = SAME * end * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    values = specified.at(np.maximum(time + near, 0.0))
    return float(max(values.min() - value, value - values.max())) - abs(slope) * float(near[-1])


def _values(signals: Signals, channel: int, since: Array, derivative: int) -> Array:
    """(G, P) values of the polynomials at times (G, P) after the begins."""
    out = np.zeros(since.shape)
    for j in range(signals.degree, derivative - 1, -1):
        falling = float(np.prod(np.arange(j - derivative + 1, j + 1)))
        out = out * since + falling * signals.coefficients[:, channel, j, None]
    return out
