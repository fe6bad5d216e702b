"""Equivalent gain from spectra, the first route of Padmanabhan et al. 1995, sec. 6.

From the cross and auto densities of deflection d and elastic force F, each averaged over n segments without overlap:

    H1 = S_dF / S_dd,    H2 = S_FF / S_Fd,    |Hv| = sqrt(S_FF / S_dd) with the phase of S_dF,

least squares of F on d, of d on F, and of both with noise in proportion to their powers (J. S. Bendat, A. G. Piersol,
Random Data, 4th ed. 2010, secs. 6.1, 9.2; G. T. Rocklin, J. Crowley, H. Vold 1985, Proc. 3rd IMAC, 272-278).
Normalised random error of a gain in one bin: sqrt(1 - gamma^2) / (|gamma| sqrt(2 n)) (Bendat and Piersol, sec. 9.2).

It takes what is left of F for noise independent of d; behind a clearance it is distortion, made of d.

The one gain of a clearance is H1 weighted with S_dd over all bins, sum Re S_dF / sum S_dd: with no taper this is the
least-squares line over the same samples, that is the multi-harmonic describing function. It is a ratio of sums over
segments, H = sum a_i / sum b_i, so its variance is n / (n - 1) sum (a_i - H b_i)^2 / (sum b_i)^2 whatever the
residue is (W. G. Cochran, Sampling Techniques, 3rd ed. 1977, sec. 2.11), and its interval
Student's with n - 1 degrees of freedom. A motion that repeats in every segment has no random error.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.contact_ratios.base import ContactRatio, clearances, elastic, largest_slope, law_of
from gearrattle.signals import steady
from gearrattle.signals.cross_spectra import Segments, cross_spectra
from gearrattle.signals.cross_spectra import taper as window
from gearrattle.signals.spectra import CYCLES_PER_SEGMENT
from gearrattle.trajectory import Array, Trajectory

Complex = NDArray[np.complex128]
Taper = Literal["hann", "none"]

_LEVEL = 0.95
_WINDOW: dict[Taper, str] = {"hann": "hann", "none": "boxcar"}
_WANTED_SEGMENTS = 8


@dataclass(frozen=True)
class Gain:
    """Transfer function from deflection to force, and the equivalent gain averaged over it.

    Attributes
    ----------
    frequency
        (f,) [Hz].
    h1, h2, hv
        (f,) estimates [unit of force / unit of deflection]; NaN where there is no power.
    coherence
        (f,) gamma^2 of deflection and force.
    random_error
        (f,) normalised, of |h1|; NaN of a single segment.
    value
        power-weighted H1.
    deviation
        its standard deviation, from the spread of the segments; NaN of a single one.
    segments
        number n averaged, without overlap.
    """

    frequency: Array
    h1: Complex
    h2: Complex
    hv: Complex
    coherence: Array
    random_error: Array
    value: float
    deviation: float
    segments: int


def gain(deflection: Array, force: Array, rate: float, segments: int, taper: Taper = "hann") -> Gain:
    """Return the transfer function of two signals of equal length, their means removed.

    Parameters
    ----------
    deflection, force
        (N,) uniform samples.
    rate
        sampling rate [Hz].
    segments
        into how many equal parts they are cut, the remainder dropped at the start.
    taper
        "hann" or "none".
    """
    # segments of the window, means removed
    length = deflection.size // segments
    d, f = (x[x.size - segments * length :] for x in (deflection, force))
    d, f = d - d.mean(), f - f.mean()
    parts = Segments(window(_WINDOW[taper], length), length, segments, centred=False)
    # cross and auto densities, coherence
    densities = cross_spectra(d, f, rate, parts)
    power_d = densities.power_x
    power_f = densities.power_y
    across = densities.cross
    coherence = densities.coherence
    there = np.where(np.isfinite(coherence), 1.0, np.nan)
    # estimates H1, H2, Hv and their random error
    with np.errstate(divide="ignore", invalid="ignore"):
        h1: Complex = there * across / power_d
        h2 = np.asarray(there * power_f / np.conj(across), dtype=np.complex128)
        hv: Complex = there * np.sqrt(power_f / power_d) * across / np.abs(across)
        error = np.sqrt((1.0 - coherence) / (coherence * 2.0 * segments))
    frequency = densities.frequency
    # power-weighted H1, and its variance over the segments
    square = parts.window**2  # Parseval: sums over all bins are sums over time
    a, b = ((x * f).reshape(segments, length) @ square for x, f in ((d, f), (d, d)))
    value = float(a.sum() / b.sum())
    if segments == 1:
        return Gain(
            frequency=frequency,
            h1=h1,
            h2=h2,
            hv=hv,
            coherence=coherence,
            random_error=np.full_like(error, np.nan),
            value=value,
            deviation=float("nan"),
            segments=1,
        )
    variance = segments / (segments - 1.0) * float(np.sum((a - value * b) ** 2)) / float(b.sum()) ** 2
    return Gain(
        frequency=frequency,
        h1=h1,
        h2=h2,
        hv=hv,
        coherence=coherence,
        random_error=error,
        value=value,
        deviation=float(np.sqrt(variance)),
        segments=segments,
    )


def spectral(trajectory: Trajectory, taper: Taper = "hann") -> ContactRatio:
    """Return the equivalent gain of every clearance over the steady part, with its 95 % confidence interval.

    Segments of eight cycles, or as few as leave eight segments; the taper is "hann" or "none". ModelError if no cycle
    remains after the discarded ones.
    """
    from scipy.special import stdtrit

    window = steady(trajectory)
    segments = max(1, window.cycles // max(1, min(CYCLES_PER_SEGMENT, window.cycles // _WANTED_SEGMENTS)))
    student = float(stdtrit(max(1, segments - 1), 0.5 + 0.5 * _LEVEL))
    rate = trajectory.samples_per_cycle / trajectory.layout.period
    value, half = np.full((2, trajectory.layout.clearance.size), np.nan)
    for k in clearances(trajectory):
        law, deflection = law_of(trajectory.layout, k), window.periodic(trajectory.deflection[:, k])
        if np.ptp(deflection) > 1e-12 * np.abs(deflection).max():
            estimate = gain(deflection, elastic(law, deflection), rate, segments, taper)
            value[k] = estimate.value / largest_slope(law)
            half[k] = student * estimate.deviation / largest_slope(law)
    notes = ("one segment only: the random error is unknown; simulate more cycles",) if segments == 1 else ()
    return ContactRatio("spectral", "equivalent gain", value, value - half, value + half, notes)
