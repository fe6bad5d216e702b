"""Sampled signals made fit for comparison: another rate, a filter that shifts nothing, trends and gaps removed.

*Another rate.* One windowed-sinc kernel limits the band and interpolates,

    y(t) = sum_k x_k h(t - t_k) / sum_k h(t - t_k),    h(t) = sinc(2 fc t) w(t f / 30),    f = min(old rate, new rate),

with fc = 0.45 f and w a Kaiser window of 86 dB (J. F. Kaiser 1974, Proc. IEEE Int. Symp. Circuits and Systems, 20-23):
what lies below 0.4 f passes within 1e-4, what lies above 0.5 f is lower by 80 dB, so nothing folds back. Any ratio of
rates will do. The kernel reaches 30 / f to either side. Beyond its ends a signal is continued by its point reflection
there, which is not the true signal: nearer to an end than this reach the errors above do not hold, and a line at 0.4 f
is wrong by up to 0.42 of its amplitude. ``reach`` returns this length.

*Filters* are digital Butterworth sections run forwards and backwards: no phase, twice the order. A low pass has
the gain

    |G(f)| = 1 / (1 + (tan(pi f / fs) / tan(pi fc / fs))^(2 n)),

one half (-6 dB) at its cutoff (A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, sec. 7.2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.files import within_limit

Array = NDArray[np.float64]

PASSED = 0.4
STOPPED = 0.5
"""Ends of the band that passes and of the transition, as parts of the lower rate."""
DECIBELS = 80.0
"""Attenuation of what would fold back; the window is designed for a little more."""
_DESIGN = DECIBELS + 6.0
REACH = 30
"""Half the width of the kernel, in intervals of the lower rate: half its main lobe is then 0.048 of that rate."""
_MOST_AT_ONCE = 2_000_000  # largest number of entries in the kernel's table
_ARRAYS = 3  # number of arrays as long as the uniform samples that exist at once


def resample(values: Array, interval: float, first: float, wanted: Array, rate: float) -> Array:
    """Return a signal at other times, with nothing folded back.

    Parameters
    ----------
    values
        (N,) or (N, C) uniform samples, N >= 2.
    interval
        between them [s].
    first
        time of the first [s].
    wanted
        (M,) times within the record [s].
    rate
        the new rate; what lies above half of it is removed [Hz].

    Returns
    -------
    Array
        (M,) or (M, C) in the unit of the signal.
    """
    from scipy.special import i0

    # reach of the kernel; the record continued beyond its ends
    lower = min(1.0 / interval, rate)
    reach = REACH / (lower * interval)  # in samples
    side = int(np.ceil(reach)) + 1
    padded = _continued(values, side)
    beta = 0.1102 * (_DESIGN - 8.7)
    # positions wanted, in samples
    position = (wanted - first) / interval + side
    offsets = np.arange(-side, side + 1)
    result = np.empty((wanted.size, *values.shape[1:]))
    columns = [(padded, result)] if values.ndim == 1 else list(zip(padded.T, result.T, strict=True))
    step = max(1, _MOST_AT_ONCE // offsets.size)
    # weighted sums with the windowed sinc, a number of them at a time
    for begin in range(0, wanted.size, step):
        at = position[begin : begin + step]
        centre = np.clip(np.rint(at).astype(np.int64), side, padded.size - 1 - side)
        index = centre[:, None] + offsets
        away = at[:, None] - index
        window = i0(beta * np.sqrt(np.clip(1.0 - (away / reach) ** 2, 0.0, None))) * (np.abs(away) < reach)
        kernel = np.sinc(2.0 * 0.5 * (PASSED + STOPPED) * lower * interval * away) * window
        weight = np.sum(kernel, axis=1)
        for column, made in columns:
            made[begin : begin + step] = np.sum(kernel * column[index], axis=1) / weight
    return result


def _continued(values: Array, side: int) -> Array:
    """Continue a signal by its point reflections at both ends; a short one by its end values after that."""
    own = min(side, values.size - 1)
    left = 2.0 * values[0] - values[own:0:-1]
    right = 2.0 * values[-1] - values[-2 : -2 - own : -1]
    beyond = [(side - own, side - own), *[(0, 0)] * (values.ndim - 1)]
    return np.pad(np.concatenate([left, values, right]), beyond, mode="edge")


def evened(time: Array, values: Array) -> tuple[float, Array]:
    """Return uniform samples of a signal whose samples are not: its cubic spline, as fine as its shortest tenth.

    Parameters
    ----------
    time
        (N,) strictly ascending [s], N >= 4.
    values
        (N,) at these times.

    Returns
    -------
    tuple[float, Array]
        The interval [s] and the samples from the first time to the last.

    Raises
    ------
    Refused
        these are too many.
    """
    from scipy.interpolate import CubicSpline

    fine = float(np.quantile(np.diff(time), 0.1))
    samples = np.ceil((time[-1] - time[0]) / fine)
    within_limit(8.0 * _ARRAYS * samples)
    count = max(int(samples), 3)
    grid = np.linspace(time[0], time[-1], count + 1)
    return float(grid[1] - grid[0]), np.asarray(CubicSpline(time, values)(grid), dtype=np.float64)


def filtered(values: Array, rate: float, kind: str, cutoff: tuple[float, ...], order: int) -> Array:
    """Return a signal filtered forwards and backwards by Butterworth sections.

    Parameters
    ----------
    values
        (N,) uniform samples.
    rate
        of the samples [Hz].
    kind
        lowpass, highpass, bandpass, bandstop.
    cutoff
        one, or two for a band, ascending, between 0 and half the rate [Hz].
    order
        of one pass.

    Returns
    -------
    Array
        (N,) in the unit of the signal.

    Raises
    ------
    ValueError
        the signal is shorter than the filter needs at its ends.
    """
    from scipy.signal import butter, sosfiltfilt

    sections = butter(order, cutoff if len(cutoff) > 1 else cutoff[0], kind, fs=rate, output="sos")
    return np.asarray(sosfiltfilt(sections, values), dtype=np.float64)


def detrended(time: Array, values: Array, degree: int) -> Array:
    """Return a signal without its least-squares polynomial.

    Parameters
    ----------
    time
        (N,) [s].
    values
        (N,).
    degree
        0 takes the mean away, 1 a straight line.
    """
    if degree == 0:
        return np.asarray(values - values.mean())
    centred = time - time.mean()
    slope = float(centred @ (values - values.mean()) / (centred @ centred))
    return np.asarray(values - values.mean() - slope * centred)


def bridged(time: Array, values: Array) -> tuple[Array, float]:
    """Return a signal with straight lines over samples that are no numbers, and the longest stretch bridged [s].

    Parameters
    ----------
    time
        (N,) ascending [s].
    values
        (N,); the first and the last sample are numbers.
    """
    good = np.isfinite(values)
    whole = np.interp(time, time[good], values[good])
    known = time[good]
    across = np.diff(np.flatnonzero(good)) > 1
    return whole, float(np.diff(known)[across].max(initial=0.0))
