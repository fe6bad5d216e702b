"""Magnitude-squared coherence of two sampled signals at the harmonics of an excitation, and its chance level.

    gamma^2(f) = |S_xy|^2 / (S_xx S_yy),   each S averaged over n segments that do not overlap,

and kappa, its mean over the first five harmonics (Padmanabhan et al. 1995, sec. 8: 128 points, 4 ensembles). From few
segments it is far from zero even for independent signals: for Gaussian ones its density is (n - 1)(1 - x)^(n - 2)
whatever their spectra, so its mean is 1/n and its 95 % point 1 - 0.05^(1/(n - 1)) (G. C. Carter, C. H. Knapp, A. H.
Nuttall 1973, IEEE Trans. Audio Electroacoust. AU-21, 337-344). Four segments: 0.25 and 0.63. Both are given with every
value. Gain and delay do not lower a coherence: it shows a common origin, not a small error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.signals.cross_spectra import cross_spectra, cut
from gearrattle.trajectory import Array
from gearrattle.wording import counted

Taper = Literal["hann", "none"]
ENSEMBLES = 4
POINTS = 128
HARMONICS = 5  # Padmanabhan et al. 1995, sec. 8
USABLE = 0.8  # share of half the sampling rate that the anti-aliasing filter leaves as it is
_CELLS = 1000  # of the grid on which densities are folded


@dataclass(frozen=True)
class ChanceCoherence:
    """Coherence of independent Gaussian signals.

    Attributes
    ----------
    bias
        mean of gamma^2, and of kappa.
    threshold
        gamma^2 of one bin stays below it in 95 of 100 cases.
    mean_low, mean_high
        kappa lies between them in 90 of 100 cases, so above the latter in 5.
    """

    bias: float
    threshold: float
    mean_low: float
    mean_high: float


@dataclass(frozen=True)
class Coherence:
    """Coherence at the harmonics, with its settings and its chance level.

    Attributes
    ----------
    frequency
        (h,) harmonics asked for [Hz].
    bin_frequency
        (h,) bins read, the nearest [Hz].
    value
        (h,) gamma^2, 0 to 1; NaN where one of the signals has no power.
    mean
        kappa, the mean of the values that exist.
    rate
        sampling rate after decimation [Hz].
    bin_width
        [Hz].
    every
        one sample in so many was kept.
    """

    frequency: Array
    bin_frequency: Array
    value: Array
    mean: float
    chance: ChanceCoherence
    rate: float
    bin_width: float
    every: int
    anti_aliased: bool
    taper: Taper
    ensembles: int
    points: int
    notes: tuple[str, ...] = ()


def by_chance(ensembles: int, bins: int, level: float = 0.95) -> ChanceCoherence:
    """Return bias, threshold and the range of the mean over ``bins`` independent bins, for independent signals.

    The density of the mean is that of one bin, folded with itself on a grid.

    Parameters
    ----------
    ensembles
        segments averaged, at least 2; they do not overlap.
    level
        probability of staying below ``threshold`` and below ``mean_high``, and above ``mean_low``.
    """
    mass = np.diff(-((1.0 - np.linspace(0.0, 1.0, _CELLS + 1)) ** (ensembles - 1)))
    total = mass
    for _ in range(bins - 1):
        total = np.convolve(total, mass)
    ends = (np.arange(total.size) + 0.5 * (bins + 1)) / (bins * _CELLS)
    low, high = np.interp([1.0 - level, level], np.cumsum(total), ends)
    threshold = 1.0 - (1.0 - level) ** (1.0 / (ensembles - 1))
    return ChanceCoherence(1.0 / ensembles, threshold, float(low), float(high))


def decimation(samples: int, rate: float, highest: float, *, needed: int, points: int, spacing: float) -> int:
    """Return the largest ``every`` for which the harmonics lie in the band and enough samples remain.

    Where some such ``every`` puts every harmonic on a bin, the largest of those.

    Parameters
    ----------
    rate
        their rate [Hz].
    highest
        highest harmonic [Hz], to lie below ``USABLE`` of half the rate.
    spacing
        distance between harmonics [Hz].

    Raises
    ------
    ModelError
        if not even every sample suffices.
    """
    allowed = [every for every in range(1, max(1, samples // needed) + 1) if highest <= USABLE * rate / every / 2]
    if samples < needed:
        remedy = "take fewer or shorter segments, or simulate more cycles"
        raise ModelError(Problem("coherence", counted(samples, "sample"), f"its segments take {needed}", remedy))
    if not allowed:
        rule = f"{highest:g} Hz must lie below {USABLE:g} of half the rate"
        raise ModelError(Problem("coherence", f"{rate:g} samples a second", rule, "raise samples_per_cycle"))
    on_bins = [every for every in allowed if _whole(spacing * points * every / rate)]
    return max(on_bins or allowed)


def coherence_at_harmonics(
    candidate: Array,
    reference: Array,
    rate: float,
    fundamental: float,
    *,
    ensembles: int = ENSEMBLES,
    points: int = POINTS,
    harmonics: int = HARMONICS,
    every: int | None = None,
    anti_alias: bool = True,
    taper: Taper = "hann",
) -> Coherence:
    """Return the coherence of two signals at the harmonics of ``fundamental``, from their last samples.

    Parameters
    ----------
    candidate, reference
        (N,) samples.
    rate
        their rate [Hz].
    fundamental
        lowest frequency of the excitation [Hz].
    every
        keep one sample in so many; None chooses (see ``decimation``).
    anti_alias
        whether to filter before samples are left out (FIR, linear phase, shifted back).

    Raises
    ------
    ModelError
        too few samples, too few ensembles, or harmonics outside the band.
    """
    # harmonics, and the decimation that keeps enough samples
    if ensembles < 2:
        raise ModelError(Problem("ensembles", str(ensembles), "of one segment every coherence is 1", "take at least 2"))
    frequency: Array = fundamental * np.arange(1.0, harmonics + 1)
    needed = ensembles * points
    if every is None:
        every = decimation(len(candidate), rate, frequency[-1], needed=needed, points=points, spacing=fundamental)
    # samples kept, and a check that the harmonics still lie in the band
    x, y = (_thinned(signal, every, anti_alias)[-needed:] for signal in (candidate, reference))
    decimation(len(x), rate / every, frequency[-1] * USABLE, needed=needed, points=points, spacing=fundamental)
    # densities over segments that do not overlap
    segments = cut(needed, points, 0.0, {"hann": "hann", "none": "boxcar"}[taper])
    spectra = cross_spectra(x, y, rate / every, segments)
    width = float(spectra.frequency[1])
    # coherence at the bins nearest to the harmonics
    bins = np.rint(frequency / width).astype(np.int64)
    value = spectra.coherence[bins]
    shown = value[np.isfinite(value)]
    return Coherence(
        frequency=frequency,
        bin_frequency=spectra.frequency[bins],
        value=value,
        mean=float(shown.mean()) if shown.size else float("nan"),
        chance=by_chance(ensembles, max(1, shown.size)),
        rate=rate / every,
        bin_width=width,
        every=every,
        anti_aliased=anti_alias and every > 1,
        taper=taper,
        ensembles=ensembles,
        points=points,
        notes=tuple(_notes(frequency / width, value)),
    )


def _whole(number: float) -> bool:
    return abs(number - round(number)) < 1e-9 * max(1.0, number) and round(number) > 0


def _thinned(signal: Array, every: int, anti_alias: bool) -> Array:
    if every == 1:
        return signal
    if not anti_alias:
        return signal[::every]
    from scipy.signal import decimate

    level = float(np.mean(signal))
    return np.asarray(level + decimate(signal - level, every, ftype="fir", zero_phase=True), dtype=np.float64)


def _notes(position: Array, value: Array) -> Iterator[str]:
    """Return notes where the reading is doubtful; ``place`` is that of the harmonics, in bins."""
    off = np.abs(position - np.rint(position))
    if off.max() > 1e-6:
        yield f"harmonics fall between bins, by up to {off.max():.2f} of a bin; the nearest bin is read"
    bins = np.rint(position).astype(np.int64)
    if np.unique(bins).size < bins.size:
        yield "harmonics share a bin, so their values are not independent: the sampling rate is high for these points"
    elif bins.size > 1 and np.diff(bins).min() < 2:
        yield "harmonics lie on neighbouring bins, which a taper mixes"
    if bins[0] == 0:
        yield "the first harmonic falls into the bin at zero frequency, from which the mean was removed"
    dead = np.flatnonzero(~np.isfinite(value)) + 1
    if dead.size:
        yield f"no power at harmonic {', '.join(map(str, dead.tolist()))}: no coherence there"
