"""Common clock of two records: the delay of the measured one, and the length of a cycle by its clock.

Of a motion that repeats itself a delay is known within a period only. With z_k and x_k the lines of the measured and
the simulated mean cycle, it is where the correlation of the two,

    c(d) = Re sum_k conj(x_k) z_k exp(-i w_k d) / sqrt(sum |x_k|^2 sum |z_k|^2),

is largest: over all lines ("cycle"), or over the one line that is strongest in both ("phase"). The length of a cycle
by the measured clock follows from the turn of the strongest measured line from cycle to cycle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array

LEAST = 0.5
"""A correlation below it sets no clock."""
_FINER = 16  # grid points of a delay on the shortest wave
_TURNED = 0.01  # rad over the whole record: less is no other speed
_SURE = 5.0  # standard errors
_SHARE = 0.05  # of the power: smallest share of a line that shows the speed

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Found:
    """Delay of a clock, with its correlation.

    Attributes
    ----------
    delay
        to be added to the measured times [s].
    """

    delay: float
    agreement: float
    rival: float


def chosen_lines(x: Complex, z: Complex, method: str) -> NDArray[np.bool_]:
    """(K,) which lines set the clock: all by "cycle", the strongest common one by "phase"."""
    if method != "phase":
        return np.ones(x.size, dtype=np.bool_)
    return np.asarray(np.arange(x.size) == int(np.argmax(np.abs(x * z))))


def delay_of(x: Complex, z: Complex, period: float, lines: NDArray[np.bool_]) -> Found:
    """Return the delay within half a period either way at which two mean cycles agree best.

    Parameters
    ----------
    x, z
        (K,) lines 1 to K of the simulated and the measured one, each by its clock.
    period
        [s].
    lines
        (K,) which count.
    """
    scale = float(np.sqrt(np.sum(np.abs(x) ** 2) * np.sum(np.abs(z) ** 2)))
    if scale == 0.0:
        return Found(0.0, 0.0, 0.0)
    cross = np.asarray(np.where(lines, np.conj(x) * z, 0.0) / scale, dtype=np.complex128)
    return largest(cross, period)


def largest(cross: Complex, period: float) -> Found:
    """Return the delay within half a period either way at which the sum of products of lines is largest.

    Parameters
    ----------
    cross
        (K,) conj(x_k) z_k of lines 1 to K; zero where a line does not count.
    period
        [s].
    """
    points = _FINER * int(2 ** np.ceil(np.log2(cross.size + 1)))
    padded = np.zeros(points, dtype=np.complex128)
    padded[1 : cross.size + 1] = cross
    c = np.fft.fft(padded).real
    best = int(np.argmax(c))
    delay = best / points * period
    if np.count_nonzero(cross) == 1:  # a wave: the delay nearest to zero is meant
        line = int(np.argmax(cross != 0.0))
        delay = float(np.angle(cross[line])) / (2.0 * np.pi * (line + 1)) * period
    for _ in range(4):
        delay += float(step(cross, delay, period))
    peaks = (c >= np.roll(c, 1)) & (c >= np.roll(c, -1)) & (np.arange(points) != best)
    rival = float(np.max(c[peaks], initial=0.0))
    at = cross * np.exp(-2j * np.pi * np.arange(1, cross.size + 1) * delay / period)
    return Found(float((delay / period + 0.5) % 1.0 - 0.5) * period, float(at.sum().real), rival)


def step(cross: Complex, delay: float, period: float) -> Array:
    """(...) Newton's step [s] to the largest correlation, from products (..., K) of lines; zero where nothing bends."""
    w = 2.0 * np.pi * np.arange(1, cross.shape[-1] + 1) / period
    turned = cross * np.exp(-1j * w * delay)
    slope = (turned.imag * w).sum(axis=-1)
    bend = (turned.real * w**2).sum(axis=-1)
    return np.asarray(np.where(bend > 0.0, slope / np.where(bend > 0.0, bend, 1.0), 0.0))


def period_by_clock(amplitudes: Complex, power: float, period: float, *, refine: bool = False) -> float:
    """Return the length of a cycle by the clock of a record.

    Parameters
    ----------
    amplitudes
        (N, K) lines of every cycle of a channel, cut at ``period``.
    period
        assumed [s].

    Returns
    -------
    float
        ``period`` itself where no line tells another one: less than 5 % of the power in any, a turn of less than a
        hundredth of a radian over the record, or one within five times its standard error.
    """
    count = len(amplitudes)
    line = int(np.argmax(np.mean(np.abs(amplitudes) ** 2, axis=0)))
    c = amplitudes[:, line]
    if power <= 0.0 or float(np.mean(np.abs(c) ** 2)) < 2.0 * _SHARE * power:
        return period
    points = 8 * int(2 ** np.ceil(np.log2(count)))
    turn = float(np.fft.fftfreq(points)[np.argmax(np.abs(np.fft.fft(c, points)))]) * 2.0 * np.pi
    at = np.arange(count) - 0.5 * (count - 1)
    straight = c * np.exp(-1j * turn * at)
    left = np.angle(straight * np.conj(straight.mean()))
    fine = float(at @ left / (at @ at))
    error = float(np.sqrt(np.sum((left - left.mean() - fine * at) ** 2) / max(count - 2, 1) / (at @ at)))
    turn += fine
    if not refine and (abs(turn) * count < _TURNED or abs(turn) < _SURE * error):
        return period
    return period / (1.0 + turn / (2.0 * np.pi * (line + 1)))
