"""Densities and coherence of sampled signals that have no period: Welch's averages, with their limits.

Segments of any length, overlapping, mean removed, tapered; one-sided densities

    S_xy(f) = 2 / (fs sum w^2) mean_segments conj(X) Y          (no factor 2 at zero and at half the rate)

(P. D. Welch 1967, IEEE Trans. Audio Electroacoust. AU-15, 70-73), gamma^2 = |S_xy|^2 / (S_xx S_yy), H = S_xy / S_xx.
They are those of ``scipy.signal.welch`` and ``csd`` to rounding. Here all three densities take two transforms of a
segment, not four, and segments are added up in groups, so that memory does not grow with the record. SciPy 1.17 takes
1.7 to 8 times as long for one density, 4.5 to 14 times as long for three (512 to 4e6 samples). By Parseval's theorem
the integral of S_xx over frequency is the mean over the segments of sum (w x)^2 / sum w^2: for a stationary signal its
variance.

All densities of the package are made here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals.confidence import averages

Array = NDArray[np.float64]

NO_POWER = 1e-24  # below this share of the largest bin a power is rounding
_AT_ONCE = 1 << 20  # samples of segments transformed at once
_COSINES = {
    "hann": (0.5, 0.5),
    "flattop": (0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368),
    "boxcar": (1.0,),
}
"""Amplitudes of a taper's cosines (G. D'Antona, A. Ferrero 2006, Digital Signal Processing for Measurement Systems)."""
WINDOWS = tuple(_COSINES)
"""Tapers: Hann for densities; flat top reads a line's amplitude within 0.1 % between bins; none for whole periods."""


@dataclass(frozen=True)
class Segments:
    """Segments of a record, and their taper (L,)."""

    window: Array
    step: int
    count: int
    centred: bool = True

    @property
    def length(self) -> int:
        """Samples in a segment."""
        return int(self.window.size)

    @property
    def averages(self) -> float:
        """Number of segments without overlap that these are worth."""
        return averages(self.window, self.step, self.count)


@dataclass(frozen=True)
class CrossSpectra:
    """One-sided densities of two signals.

    Attributes
    ----------
    frequency
        (f,) from 0 to half the sampling rate [Hz].
    power_x, power_y
        (f,) densities [unit^2 / Hz].
    cross
        (f,) S_xy; its argument is the phase of y before x.
    """

    frequency: Array
    power_x: Array
    power_y: Array
    cross: NDArray[np.complex128]
    segments: Segments

    @property
    def coherence(self) -> Array:
        """(f,) gamma^2; NaN where one of the signals has no power."""
        alive = self.power_x > NO_POWER * self.power_x.max(initial=0.0)
        alive &= self.power_y > NO_POWER * self.power_y.max(initial=0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            value = np.abs(self.cross) ** 2 / (self.power_x * self.power_y)
        return np.where(alive, np.clip(value, 0.0, 1.0), np.nan)

    @property
    def response(self) -> NDArray[np.complex128]:
        """(f,) H_1 = S_xy / S_xx [unit of y / unit of x]; NaN where x has no power."""
        alive = self.power_x > NO_POWER * self.power_x.max(initial=0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(alive, self.cross / self.power_x, np.nan)


def taper(name: str, length: int) -> Array:
    """Return (L,) a periodic taper, one of ``WINDOWS``."""
    turn = np.linspace(-np.pi, np.pi, length, endpoint=False)
    return np.asarray(sum(share * np.cos(k * turn) for k, share in enumerate(_COSINES[name])))


def cut(samples: int, length: int, overlap: float, window: str) -> Segments:
    """Return the overlapping segments of a record.

    Parameters
    ----------
    length
        samples in a segment, at least 2.
    overlap
        share of a segment that the next has as well, 0 to below 1.
    """
    step = max(1, length - round(overlap * length))
    return Segments(taper(window, length), step, 1 + (samples - length) // step)


def groups(signal: Array, segments: Segments) -> Iterator[Array]:
    """Give the segments of a signal (N,) or (N, n) in groups, (g, L) or (g, n, L), not yet tapered, as views of it."""
    views = np.lib.stride_tricks.sliding_window_view(signal, segments.length, axis=0)[:: segments.step]
    size = max(1, _AT_ONCE // (segments.length * (signal.size // len(signal))))
    for begin in range(0, segments.count, size):
        yield views[begin : min(begin + size, segments.count)]


def transformed(group: Array, segments: Segments) -> NDArray[np.complex128]:
    """Return (..., f) Fourier sums of tapered segments (..., L), their means removed where ``segments.centred``."""
    if segments.centred:
        group = group - group.mean(axis=-1, keepdims=True)
    return np.asarray(np.fft.rfft(group * segments.window, axis=-1))


def frequencies(segments: Segments, rate: float) -> Array:
    """Return (f,) the frequencies of a transformed segment [Hz]."""
    return np.asarray(np.fft.rfftfreq(segments.length, 1.0 / rate), dtype=np.float64)


def one_sided(sums: Array, length: int) -> Array:
    """Double the values that stand for two sides of a spectrum; the last axis is frequency."""
    sums[..., 1 : (length + 1) // 2] *= 2.0
    return sums


def periodograms(signal: Array, rate: float, segments: Segments) -> Iterator[Array]:
    """Give the one-sided densities of every segment, in groups (g, f) or (g, n, f).

    Parameters
    ----------
    signal
        (N,) or (N, n) uniform samples.
    rate
        of the samples [Hz].
    """
    scale = _scale(rate, segments)
    for group in groups(signal, segments):
        density = _squared(transformed(group, segments))
        density *= scale
        yield density


def power_density(signal: Array, rate: float, segments: Segments) -> tuple[Array, Array]:
    """Return frequencies (f,) [Hz] and the one-sided density of a signal, (f,) or (f, n): the mean of the segments'.

    Parameters
    ----------
    signal
        (N,) or (N, n) uniform samples.
    rate
        of the samples [Hz].
    """
    total = sum(group.sum(axis=0) for group in periodograms(signal, rate, segments))
    return frequencies(segments, rate), np.asarray(total).T / segments.count


def cross_spectra(x: Array, y: Array, rate: float, segments: Segments) -> CrossSpectra:
    """Return the densities of two signals.

    Parameters
    ----------
    x, y
        (N,) uniform samples of the same times.
    rate
        of the samples [Hz].
    """
    shape = segments.length // 2 + 1
    power_x = np.zeros(shape)
    power_y = np.zeros(shape)
    cross = np.zeros(shape, np.complex128)
    for one, other in zip(groups(x, segments), groups(y, segments), strict=True):
        first = transformed(one, segments)
        second = transformed(other, segments)
        power_x += np.sum(_squared(first), axis=0)
        power_y += np.sum(_squared(second), axis=0)
        cross += np.sum(np.conj(first) * second, axis=0)
    scale = _scale(rate, segments) / segments.count
    return CrossSpectra(frequencies(segments, rate), power_x * scale, power_y * scale, cross * scale, segments)


def _scale(rate: float, segments: Segments) -> Array:
    """Return (f,) factors from a squared Fourier sum to a one-sided density."""
    sides = one_sided(np.ones(segments.length // 2 + 1), segments.length)
    return sides / (rate * float(segments.window @ segments.window))


def _squared(sums: NDArray[np.complex128]) -> Array:
    """Return squared moduli, in one array: a second one of its size would take longer than the squares."""
    modulus = np.abs(sums)
    modulus *= modulus
    return modulus
