"""Power spectral density of a sampled signal, by Welch's method over whole cycles.

Segments of whole common periods (eight, or all there are), half overlapping, mean removed, Hann window, one-sided
density: P. D. Welch 1967, IEEE Trans. Audio Electroacoust. AU-15, 70-73. Whole cycles per segment put every order on
a bin; the Hann window spreads a line of amplitude A over three bins, of which the middle one reads
A^2 / 2 / (1.5 df), df being the bin width, and whose sum times df is A^2 / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.errors import ModelError, Problem
from gearrattle.signals.cross_spectra import Segments, power_density, taper
from gearrattle.trajectory import Array
from gearrattle.wording import counted

CYCLES_PER_SEGMENT = 8


@dataclass(frozen=True)
class Spectrum:
    """A one-sided power spectral density.

    Attributes
    ----------
    frequency
        (f,) ascending from 0 to half the sampling rate [Hz].
    density
        (f,) or (f, n) [unit of the signal squared / Hz].
    """

    frequency: Array
    density: Array
    window: str
    segments: int

    @property
    def resolution(self) -> float:
        """Return the bin width df [Hz]."""
        return float(self.frequency[1] - self.frequency[0])


def psd(signal: Array, period: float, samples_per_cycle: int, cycles_per_segment: int = CYCLES_PER_SEGMENT) -> Spectrum:
    """Return the power spectral density of uniform samples over whole cycles.

    Parameters
    ----------
    signal
        (N,) or (N, n) samples over whole cycles, N a multiple of ``samples_per_cycle``: without the end point of the
        last cycle.
    period
        length of a cycle [s].
    cycles_per_segment
        whole cycles in a segment, at most as many as there are.

    Raises
    ------
    ModelError
        if a segment would hold fewer than four samples.
    """
    cycles = min(cycles_per_segment, signal.shape[0] // samples_per_cycle)
    length = cycles * samples_per_cycle
    if length < 4:
        raise ModelError(
            Problem(
                place="samples_per_cycle",
                value=f"{length} samples in {counted(cycles, 'cycle')}",
                rule="a spectrum takes at least 4 samples",
                remedy="raise samples_per_cycle, or simulate more cycles",
            )
        )
    step = length - length // 2
    segments = Segments(taper("hann", length), step, 1 + (signal.shape[0] - length) // step)
    frequency, density = power_density(signal, samples_per_cycle / period, segments)
    return Spectrum(frequency, density, window_words(cycles, segments.count), segments.count)


def window_words(cycles: int, segments: int) -> str:
    """Return in words the window, the segments and the cycles of a density."""
    parts = "1 segment" if segments == 1 else f"{segments} segments, half overlapping, averaged"
    return f"Hann, {cycles} {'cycle' if cycles == 1 else 'cycles'} a segment, {parts}, mean removed"
