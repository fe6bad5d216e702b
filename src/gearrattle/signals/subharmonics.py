"""Super- and sub-harmonics: lines of a response at orders that nothing excites.

Let g be the order of the common period T (g = 2 pi / (Omega T)). A motion of period T has lines at k g only, one of
period q T also at p g / q. *Super-harmonics* are lines at k g above the lowest excited order that are not excited
themselves; *sub-harmonics* are lines at p g / q (p, q without a common factor, q from 2 to 8), and lines at k g below
the lowest excited order (Nayfeh and Mook 1979, Nonlinear Oscillations, ch. 4).

A chaotic response has a continuous spectrum, so some amplitude at every bin; a line must stand out. A line is
*present* if its amplitude is at least 1 % of the largest line at k g, and at least 5 times the median amplitude of the
bins around it (Gaussian noise does so by chance in one of 30 million bins, if many surround it). The amplitudes are
those of the discrete Fourier transform over whole multiples of q T, without a taper. At least eight of those multiples
must be there, or there are no bins to compare with: a shorter signal shows no line of that kind.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array, IntArray

LARGEST_DENOMINATOR = 8
SMALLEST_SHARE = 0.01
ABOVE_FLOOR = 5.0
FEWEST_PERIODS = 8


@dataclass(frozen=True)
class Line:
    """A line of a spectrum: its order (multiple of Omega) and its amplitude in the unit of the signal."""

    order: float
    amplitude: float


def strongest(lines: Iterable[Line]) -> Line | None:
    """Return the line of largest amplitude, or None if there is none."""
    return max(lines, key=lambda line: line.amplitude, default=None)


def _amplitudes(signal: Array) -> Array:
    return np.asarray(2.0 * np.abs(np.fft.rfft(signal - np.mean(signal))) / signal.size, dtype=np.float64)


def _standing_out(amplitudes: Array, bins: IntArray, spacing: int, reference: float) -> NDArray[np.bool_]:
    """Return the mask of bins that hold a line, where candidate lines are ``spacing`` bins apart."""
    reach = (spacing - 1) // 2
    offsets = np.concatenate([np.arange(-reach, 0), np.arange(1, reach + 1)])
    height = amplitudes[bins]
    present = np.asarray(height >= max(SMALLEST_SHARE * reference, np.finfo(np.float64).tiny), dtype=np.bool_)
    high = bins[present]
    floor = np.median(amplitudes[high[:, None] + offsets], axis=1)  # half a spacing never leaves the spectrum
    present[present] = height[present] >= ABOVE_FLOOR * floor
    return present


@cache
def _numerators(highest: int, divisor: int) -> IntArray:
    """Return the numbers up to the highest that have no factor in common with the divisor."""
    numbers = np.arange(1, highest + 1)
    return np.asarray(numbers[np.gcd(numbers, divisor) == 1], dtype=np.int64)


def _lines(
    signal: Array, samples_per_cycle: int, divisor: int, known: dict[int, Array]
) -> tuple[IntArray, Array, float]:
    """Return the numerators p (with gcd(p, divisor) = 1), amplitudes of the lines present at p/divisor; the largest.

    The signal's last multiples of ``divisor`` periods are used; an odd count of them is shortened by one where that
    lets a motion of twice the period fall on bins as well. ``known`` keeps amplitudes by the number of samples.
    """
    groups = signal.size // (samples_per_cycle * divisor)
    groups -= groups % 2
    if groups < FEWEST_PERIODS:
        return np.empty(0, dtype=np.int64), np.empty(0), 0.0
    used = groups * divisor * samples_per_cycle
    amplitudes = known[used] if used in known else known.setdefault(used, _amplitudes(signal[-used:]))
    multiples = amplitudes[groups * divisor : -1 : groups * divisor]
    largest = float(np.max(multiples, initial=0.0))
    highest = (samples_per_cycle * divisor - 1) // 2
    numerators = _numerators(highest, divisor)
    if numerators.size == 0:
        return numerators, np.empty(0), largest
    bins = numerators * groups
    present = _standing_out(amplitudes, bins, groups, largest)
    return numerators[present], amplitudes[bins[present]], largest


def super_harmonics(
    signal: Array,
    samples_per_cycle: int,
    fundamental: float,
    orders: Array,
    amplitudes: dict[int, Array] | None = None,
) -> tuple[Line, ...]:
    """Return the super-harmonics present, by ascending order.

    Parameters
    ----------
    signal
        (N,) samples of whole common periods T, each phase once.
    fundamental
        g, the order whose period is T.
    orders
        (o,) excited orders; none excited, none found.
    amplitudes
        of the same signal's bins by the number of its last samples that were taken; more are put there.
    """
    known = {} if amplitudes is None else amplitudes
    lines = _unexcited(signal, samples_per_cycle, fundamental, orders, known)
    return tuple(line for line in lines if line.order > min(orders))


def sub_harmonics(
    signal: Array,
    samples_per_cycle: int,
    fundamental: float,
    orders: Array,
    amplitudes: dict[int, Array] | None = None,
) -> tuple[Line, ...]:
    """Return the sub-harmonics present, by ascending order; arguments as ``super_harmonics``."""
    if np.size(orders) == 0:
        return ()
    known = {} if amplitudes is None else amplitudes
    lines = _unexcited(signal, samples_per_cycle, fundamental, orders, known)
    selected = [line for line in lines if line.order < min(orders)]
    for divisor in range(2, LARGEST_DENOMINATOR + 1):
        numerators, heights, _ = _lines(signal, samples_per_cycle, divisor, known)
        selected += [
            Line(fundamental * p / divisor, float(a)) for p, a in zip(numerators.tolist(), heights, strict=True)
        ]
    return tuple(sorted(selected, key=lambda line: line.order))


def _unexcited(
    signal: Array, samples_per_cycle: int, fundamental: float, orders: Array, known: dict[int, Array]
) -> list[Line]:
    """Return the lines present at k g that are no excited orders."""
    if np.size(orders) == 0:
        return []
    numerators, amplitudes, _ = _lines(signal, samples_per_cycle, 1, known)
    excited = np.asarray(orders, dtype=np.float64) / fundamental
    return [
        Line(fundamental * k, float(a))
        for k, a in zip(numerators.tolist(), amplitudes, strict=True)
        if np.min(np.abs(excited - k)) > 1e-6
    ]
