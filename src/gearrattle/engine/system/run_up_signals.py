"""A run-up: harmonics whose phase follows a changing speed and whose amplitudes follow tables over it.

    f(t) = sum_j a_j(Omega(t)) sin(n_j phi(t) + p_j)                                      phi' = Omega

is smooth between the corners of its tables, so it is interpolated in Chebyshev points, piece by piece. On [-1, 1] a
function that is analytic and bounded by M inside the ellipse with foci -1, 1 and half axes adding to rho has Chebyshev
coefficients |c_k| <= 2 M rho^-k, and interpolation in n + 1 points adds to each its aliases (L. N. Trefethen,
Approximation Theory and Approximation Practice, 2013, theorems 8.1 and 8.2):

    |f - p| <= 2 sum_(k > n) |c_k| <= 4 M rho^-n / (rho - 1).

Here M is known: |sin(u + i v)| <= cosh v, the phase is a square of the time, and a polynomial of degree d bounded by A
on [-1, 1] is bounded by A rho^d on the ellipse. The intervals are T / 2^q, the longest that the best rho allows at the
highest speed, and equally long everywhere: derivatives are states of the exact engine, and stay comparable; and its
steps, dyadic parts of the period T too, end on their ends by themselves.

What drives an inertia needs f only. A transmission error needs f' and f'' as well: f'' is interpolated and integrated
twice. A cubic then lets value and slope meet exactly at the knots; it is bounded by what it corrects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from gearrattle.engine.system.piecewise_channels import Channel, distinct
from gearrattle.engine.system.run_up_phase import Ramp

Array = NDArray[np.float64]

DEGREE = 15
"""Degree of the polynomials: the highest whose every derivative counts in a Taylor window of the exact engine, its
ORDER less four. Intervals are the longer for it."""
TRUNCATION = 5e-13
"""Bound on what the polynomials leave out, relative to the sum of the amplitudes; as much again is left to rounding."""
_RHO = np.geomspace(1.1, 200.0, 200)
_MOST = 2_000_000
_STRETCH = 0.125
"""An interval next to a corner may be longer than others by this part; one shorter than this part counts as short."""
_ROUNDING = 4e-16
"""Coefficients of short intervals below this part of the largest value are rounding."""


class TooLong(ValueError):
    """A run-up of too many intervals."""


@dataclass(frozen=True)
class Tone:
    """One harmonic; order 0 and phase pi/2 make a mean."""

    order: float  # multiple of the shaft's angle
    phase: float  # of its sine [rad]
    speeds: Array  # (S + 1,) ascending corners of its amplitude [rad/s]; they cover the ramp
    amplitudes: Array  # (S, d + 1) of ascending powers of the speed since the corner below [SI]

    @property
    def degree(self) -> int:
        """Degree of the amplitude over the speed."""
        used = np.flatnonzero(np.any(self.amplitudes != 0.0, axis=0))
        return int(used[-1]) if used.size else 0

    def at(self, speed: Array, derivative: int = 0) -> Array:
        """Amplitude, or its derivative over the speed, at speeds of any shape."""
        return self.of_piece(self.piece(speed), speed, derivative)

    def piece(self, speed: Array) -> NDArray[np.int64]:
        """Index of the corner below, at speeds of any shape."""
        return np.clip(np.searchsorted(self.speeds, speed, side="right") - 1, 0, len(self.amplitudes) - 1)

    def of_piece(self, piece: NDArray[np.int64], speed: Array, derivative: int = 0) -> Array:
        """The amplitude, or a derivative of it by the speed, of given pieces between corners."""
        since = speed - self.speeds[piece]
        out = np.zeros_like(since)
        for j in range(self.amplitudes.shape[1] - 1, derivative - 1, -1):
            out = out * since + float(np.prod(np.arange(j - derivative + 1, j + 1))) * self.amplitudes[piece, j]
        return out

    def largest(self, low: float, high: float) -> float:
        """Bound on the amplitude between two speeds."""
        inside = self.speeds[(self.speeds > low) & (self.speeds < high)]
        corners = np.concatenate([[low], inside, [high]])
        middle = 0.5 * (corners[1:] + corners[:-1])
        piece = self.piece(middle)
        half = 0.5 * np.diff(corners)
        terms = [np.abs(self.of_piece(piece, middle, j)) * half**j / (1.0, 1.0, 2.0)[j] for j in range(3)]
        return float(np.sum(terms, axis=0).max())


@dataclass(frozen=True)
class Sound:
    """Tones of one channel; ``smooth`` if its derivatives matter as well."""

    tones: tuple[Tone, ...]
    smooth: bool


def channels(ramp: Ramp, sounds: Sequence[Sound], until: float, period: float) -> list[Channel]:
    """Write channels as polynomials on common intervals.

    sounds: one per channel.
    until: the last interval ends no earlier [s].
    period: T [s].
    Returns channels whose value differs from f by less than 1e-12 of the sum of its tones' largest amplitudes a_j; with
        ``smooth`` f' and f'' by less than 1e-12 of the sums of a_j n_j Omega and of a_j (n_j Omega)^2 as well, Omega
        being the highest speed.

    Raises
    ------
    TooLong
        more than two million intervals.
    """
    longest = min(_longest(ramp, sound, until) for sound in sounds)
    length = period * 0.5 ** np.ceil(np.log2((1.0 + _STRETCH) * period / longest))
    if until / length > _MOST:
        raise TooLong(f"{until / length:.3g} intervals")
    grid = length * np.arange(np.ceil(until / length) + 1.0)
    knots = _knots(grid, _corners(ramp, sounds, float(grid[-1])), length)
    orders = sorted({tone.order for sound in sounds for tone in sound.tones})
    turned = dict(zip(orders, 2.0 * np.pi * ramp.turns(orders, knots[:-1]), strict=True))
    return [Channel(knots, _polynomials(_Course(ramp, knots, turned), sound)) for sound in sounds]


def _corners(ramp: Ramp, sounds: Sequence[Sound], until: float) -> Array:
    """Times at which an amplitude has a corner, or the ramp ends; 0 first, the end of the last interval last."""
    low, high = sorted((ramp.begin, ramp.end))
    speeds = {float(s) for sound in sounds for tone in sound.tones for s in tone.speeds if low < s < high}
    times = np.array(sorted({0.0, ramp.over, until, *(ramp.time(s) for s in speeds)}))
    return distinct(times[times <= until])


def _knots(grid: Array, corners: Array, length: float) -> Array:
    """Multiples of a length, and all corners; both begin at 0 and end with the last multiple.

    A multiple too near to an inner corner is left out, but never the first and the last one.
    """
    inner = corners[1:-1]
    after = np.searchsorted(inner, grid)
    near = np.minimum(np.abs(grid - np.append(inner, np.inf)[after]), np.abs(grid - np.append(-np.inf, inner)[after]))
    kept = near > _STRETCH * length
    kept[[0, -1]] = True
    return distinct(np.unique(np.concatenate([grid[kept], inner])))


def _longest(ramp: Ramp, sound: Sound, until: float) -> float:
    """Longest interval that keeps the bound [s]; found by bisection, to a hundredth."""
    if not any(tone.order for tone in sound.tones):
        return until
    low, high = sorted((ramp.begin, ramp.end))
    enough = until
    too_long = 2.0 * until
    while not _suffices(sound, low, high, ramp, enough):
        too_long = enough
        enough = 0.5 * enough
        if enough * _MOST < until:
            raise TooLong("more than two million intervals")
    while enough < until and too_long > 1.01 * enough:
        middle = 0.5 * (enough + too_long)
        if _suffices(sound, low, high, ramp, middle):
            enough = middle
        else:
            too_long = middle
    return enough


def _suffices(sound: Sound, low: float, high: float, ramp: Ramp, length: float) -> bool:
    """Whether intervals of one length keep the bound."""
    with np.errstate(over="ignore"):  # an ellipse too wide for any use
        left, allowed = bound(sound, low, high, abs(ramp.rate), length, over=ramp.over)
    return bool(np.all(left <= TRUNCATION * allowed))


def bound(
    sound: Sound, low: float, high: float, rate: float, length: float, *, over: float = np.inf
) -> tuple[Array, Array]:
    """Bounds on what is left out of f, f' and f'', and the sums of amplitudes they are measured by.

    Derivatives are by x, the time in half intervals. Only f counts unless the sound is smooth.

    low, high: speeds in the interval [rad/s].
    rate: magnitude of the acceleration [rad/s^2].
    length: of the interval [s].
    over: how long the speed changes [s]; its end is a knot, so that no interval sees more of it.
    """
    half = 0.5 * length
    rho = _RHO
    reach = 0.5 * (rho + 1 / rho)
    height = 0.5 * (rho - 1 / rho)
    square = 0.25 * (rho**2 - rho**-2)
    largest = np.zeros_like(rho)
    allowed = np.zeros(3)
    for tone in sound.tones:
        size = tone.largest(low, high)
        first = tone.order * high * half
        second = 0.5 * tone.order * rate * min(half, 0.5 * over) ** 2
        grown = size * rho**tone.degree * np.cosh(np.minimum(first * height + second * square, 700.0))
        if sound.smooth:
            turning = first + 2.0 * second * reach
            d = tone.degree**2  # Markov: |a'| <= d^2 A, |a''| <= d^2 (d^2 - 1) / 3 A on [-1, 1]
            grown = grown * (turning**2 + 2.0 * second + 2.0 * d * turning + d * (d - 1.0) / 3.0)
        largest += grown
        allowed += size * first ** np.arange(3.0) if tone.order else 0.0
    degree = DEGREE - 2 if sound.smooth else DEGREE
    error = float(np.min(4.0 * largest * rho ** -float(degree) / (rho - 1.0)))
    if not sound.smooth:
        return np.array([error, 0.0, 0.0]), allowed
    # integrated from the left: at most 2, 2 and 1 times
    value = 2.0 * error
    slope = 2.0 * error
    bend = error
    return np.array([2.0 * value + 0.5 * slope, 1.5 * value + 2.0 * slope, bend + 3.0 * value + 3.0 * slope]), allowed


@dataclass(frozen=True)
class _Course:
    """Intervals of a run-up: their knots (G + 1,), and the angle of every order at their begins, (G,) [rad]."""

    ramp: Ramp
    knots: Array
    turned: dict[float, Array]

    def values(self, sound: Sound, since: Array, derivative: int) -> Array:
        """(G, P) f, f' or f'' at times (G, P) after the begins."""
        ramp = self.ramp
        knots = self.knots
        centre = 0.5 * (knots[1:] + knots[:-1])
        rate = np.where(centre < ramp.over, ramp.rate, 0.0)[:, None]
        # The knot at the ramp's end may be a corner just before it (``distinct``): the speed is the last one after it.
        begin = np.where(centre < ramp.over, ramp.speed(knots[:-1]), ramp.end)[:, None]
        speed = begin + rate * since
        middle = ramp.speed(centre)
        turned = since * (begin + 0.5 * rate * since)
        out = np.zeros(since.shape)
        for tone in sound.tones:
            piece = tone.piece(middle)[:, None]
            a, slope, bend = (tone.of_piece(piece, speed, d) * rate**d if d <= derivative else 0.0 for d in range(3))
            if tone.order == 0.0:
                out += (a, slope, bend)[derivative] * np.sin(tone.phase)
                continue
            angle = self.turned[tone.order][:, None] + tone.phase + tone.order * turned
            if derivative == 0:
                out += a * np.sin(angle)
                continue
            turning = tone.order * speed
            if derivative == 1:
                out += slope * np.sin(angle) + a * turning * np.cos(angle)
                continue
            out += (bend - a * turning**2) * np.sin(angle)
            out += (2.0 * slope * turning + a * tone.order * rate) * np.cos(angle)
        return out


def _polynomials(course: _Course, sound: Sound) -> Array:
    """(G, DEGREE + 1) coefficients on all intervals."""
    length = np.diff(course.knots)
    degree = DEGREE - 2 if sound.smooth else DEGREE
    nodes = chebyshev.chebpts1(degree + 1)
    values = course.values(sound, 0.5 * length[:, None] * (1.0 + nodes), 2 if sound.smooth else 0)
    series = values @ (2.0 / (degree + 1) * np.cos(np.outer(np.arccos(nodes), np.arange(degree + 1))))
    series[:, 0] *= 0.5
    # Divided by powers of a short interval, what is rounding alone would become large derivatives.
    largest = np.abs(values).max(axis=1, initial=0.0, keepdims=True)
    short = length < _STRETCH * length.max()
    series[short[:, None] & (np.abs(series) < _ROUNDING * largest)] = 0.0
    powers = series @ _monomials(degree)
    if not sound.smooth:
        return np.asarray(powers / length[:, None] ** np.arange(DEGREE + 1))
    j = np.arange(2, DEGREE + 1)
    sides = np.column_stack([np.zeros_like(length), length])
    ends = np.stack([course.values(sound, sides, derivative) for derivative in (0, 1)])
    begin, end = np.moveaxis(ends, 2, 0) * np.array([np.ones_like(length), length])
    inner = np.column_stack([begin.T, powers * (length**2)[:, None] / (j * (j - 1))])
    wrong = end[0] - inner.sum(axis=1), end[1] - inner @ np.arange(DEGREE + 1.0)
    inner[:, 2] += np.where(short, 0.0, 3.0 * wrong[0] - wrong[1])  # short intervals meet to rounding as they are
    inner[:, 3] += np.where(short, 0.0, wrong[1] - 2.0 * wrong[0])
    return np.asarray(inner / length[:, None] ** np.arange(DEGREE + 1))


def _monomials(degree: int) -> Array:
    """(k, j) coefficients of the Chebyshev polynomials of 2 u - 1 in powers of u; whole numbers."""
    out = np.zeros((degree + 1, degree + 1))
    out[0, 0] = 1.0
    if degree:
        out[1, :2] = -1.0, 2.0
    for k in range(2, degree + 1):
        out[k] = -2.0 * out[k - 1] - out[k - 2]
        out[k, 1:] += 4.0 * out[k - 1, :-1]
    return out
