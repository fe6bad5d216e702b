"""Common clock of two records: the delay of the measured one, and the length of a cycle by its clock.

The delay of a motion that repeats is known only within one period. Let x_k and z_k be the Fourier lines of the
simulated and of the measured mean cycle. The delay d is where their correlation,

    c(d) = Re sum_k conj(x_k) z_k exp(-i w_k d) / sqrt(sum |x_k|^2 sum |z_k|^2),

is largest: over all lines ("cycle"), or over the one line that is strongest in both ("phase"). The length of a cycle on
the measured clock follows from the phase that the strongest measured line gains per cycle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array

LEAST = 0.5
"""Smallest correlation with which all lines set a clock."""
_POINTS_PER_WAVE = 16  # grid points of the delay on the shortest wave, at least
_LEAST_TURN = 0.01  # rad over the whole record; a smaller turn is no difference of speed
_LEAST_ERRORS = 5.0  # standard errors that a turn must exceed
_LEAST_SHARE = 0.05  # of the power, in the line that shows the speed

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Delay:
    """Delay of a clock, with its correlation.

    Attributes
    ----------
    delay
        to be added to the measured times [s].
    agreement
        the correlation at this delay.
    rival
        the next highest peak of the correlation; 0 without one.
    """

    delay: float
    agreement: float
    rival: float


def chosen_lines(x: Complex, z: Complex, method: str) -> NDArray[np.bool_]:
    """(K,) lines that set the clock: all of them for "cycle", the strongest common one for "phase"."""
    if method != "phase":
        return np.ones(x.size, dtype=np.bool_)
    return np.asarray(np.arange(x.size) == int(np.argmax(np.abs(x * z))))


def delay_of(x: Complex, z: Complex, period: float, lines: NDArray[np.bool_]) -> Delay:
    """Return the delay, at most half a period either way, at which two mean cycles agree best.

    Parameters
    ----------
    x, z
        (K,) lines 1 to K of the simulated and of the measured mean cycle, each on its own clock.
    period
        [s].
    lines
        (K,) lines that count.
    """
    scale = float(np.sqrt(np.sum(np.abs(x) ** 2) * np.sum(np.abs(z) ** 2)))
    if scale == 0.0:
        return Delay(0.0, 0.0, 0.0)
    cross = np.asarray(np.where(lines, np.conj(x) * z, 0.0) / scale, dtype=np.complex128)
    return delay_of_largest_sum(cross, period)


def delay_of_largest_sum(cross: Complex, period: float) -> Delay:
    """Return the delay, at most half a period either way, at which the sum of products of lines is largest.

    Parameters
    ----------
    cross
        (K,) conj(x_k) z_k of lines 1 to K; zero where a line does not count.
    period
        [s].
    """
    points = _POINTS_PER_WAVE * int(2 ** np.ceil(np.log2(cross.size + 1)))
    padded = np.zeros(points, dtype=np.complex128)
    padded[1 : cross.size + 1] = cross
    c = np.fft.fft(padded).real
    best = int(np.argmax(c))
    delay = best / points * period
    if np.count_nonzero(cross) == 1:  # one line alone: take the delay nearest to zero
        line = int(np.argmax(cross != 0.0))
        delay = float(np.angle(cross[line])) / (2.0 * np.pi * (line + 1)) * period
    for _ in range(4):
        delay += float(step(cross, delay, period))
    peaks = (c >= np.roll(c, 1)) & (c >= np.roll(c, -1)) & (np.arange(points) != best)
    rival = float(np.max(c[peaks], initial=0.0))
    at = cross * np.exp(-2j * np.pi * np.arange(1, cross.size + 1) * delay / period)
    return Delay(float((delay / period + 0.5) % 1.0 - 0.5) * period, float(at.sum().real), rival)


def step(cross: Complex, delay: float, period: float) -> Array:
    """(...) Newton's step [s] to the largest correlation; zero where the correlation is not concave.

    cross: (..., K) products of lines.
    """
    w = 2.0 * np.pi * np.arange(1, cross.shape[-1] + 1) / period
    turned = cross * np.exp(-1j * w * delay)
    slope = (turned.imag * w).sum(axis=-1)
    bend = (turned.real * w**2).sum(axis=-1)
    return np.asarray(np.where(bend > 0.0, slope / np.where(bend > 0.0, bend, 1.0), 0.0))


def period_by_clock(amplitudes: Complex, power: float, period: float, *, refine: bool = False) -> float:
    """Return the length of a cycle on the clock of a record.

    Parameters
    ----------
    amplitudes
        (N, K) lines of every cycle of a channel, cut at ``period``.
    power
        mean square of the channel.
    period
        assumed [s].
    refine
        take a turn below its two limits as well.

    Returns
    -------
    float
        ``period`` itself where no other length is certain: the strongest line has less than 5 % of the power, or turns
        by less than 0.01 rad over the record, or by less than five standard errors.
    """
    count = len(amplitudes)
    line = int(np.argmax(np.mean(np.abs(amplitudes) ** 2, axis=0)))
    c = amplitudes[:, line]
    if power <= 0.0 or float(np.mean(np.abs(c) ** 2)) < 2.0 * _LEAST_SHARE * power:
        return period
    points = 8 * int(2 ** np.ceil(np.log2(count)))
    turn = float(np.fft.fftfreq(points)[np.argmax(np.abs(np.fft.fft(c, points)))]) * 2.0 * np.pi
    at = np.arange(count) - 0.5 * (count - 1)
    straight = c * np.exp(-1j * turn * at)
    left = np.angle(straight * np.conj(straight.mean()))
    fine = float(at @ left / (at @ at))
    error = float(np.sqrt(np.sum((left - left.mean() - fine * at) ** 2) / max(count - 2, 1) / (at @ at)))
    turn += fine
    if not refine and (abs(turn) * count < _LEAST_TURN or abs(turn) < _LEAST_ERRORS * error):
        return period
    return period / (1.0 + turn / (2.0 * np.pi * (line + 1)))
