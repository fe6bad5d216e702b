"""Levels of a sampled signal: root mean square and peak to peak.

x_rms = [ (1/T) integral_0^T x^2 dt ]^(1/2), by the trapezoidal rule over whole periods (which for a periodic signal is
exact up to aliasing), and x_pp = max x - min x over the samples: Padmanabhan et al. 1995, eqs. (23)-(25). The mean is
*not* removed: an acceleration is taken as it is.

Time runs along the first axis of every array.
"""

from __future__ import annotations

import numpy as np

from gearrattle.trajectory import Array


def rms(signal: Array) -> Array:
    """Return the root mean square over uniform samples that span whole periods, both bounds included.

    Parameters
    ----------
    signal
        (N, ...) with N >= 2; the first and the last sample are the same phase of a period.

    Returns
    -------
    Array
        (...) in the unit of the signal.
    """
    largest = np.max(np.abs(signal), axis=0)
    scale = np.where((largest > 0.0) & np.isfinite(largest), largest, 1.0)  # squares neither overflow nor vanish
    mean_square = np.trapezoid((signal / scale) ** 2, axis=0) / (signal.shape[0] - 1)
    return np.asarray(scale * np.sqrt(mean_square), dtype=np.float64)


def peak_to_peak(signal: Array) -> Array:
    """Return max - min over the first axis, in the unit of the signal."""
    return np.asarray(np.max(signal, axis=0) - np.min(signal, axis=0), dtype=np.float64)


def thinned(samples: Array) -> list[Array]:
    """Return every second sample, then every fourth sample of (N, ...), from every first sample; none if N < 8.

    Where the error falls with the sample interval, thinned samples differ from all samples by more than the error of
    all samples; so the difference bounds it.
    """
    return [samples[first::step] for step in (2, 4) for first in range(step)] if len(samples) >= 8 else []


def rms_error(signal: Array) -> Array:
    """Return (...) the estimated error of ``rms``: the largest difference between it and the rms of ``thinned``."""
    periodic = signal[:-1]
    largest = np.max(np.abs(signal), axis=0)
    scale = np.where((largest > 0.0) & np.isfinite(largest), largest, 1.0)
    levels = np.array([np.sqrt(np.mean((some / scale) ** 2, axis=0)) for some in [periodic, *thinned(periodic)]])
    return np.asarray(scale * np.max(np.abs(levels - levels[0]), axis=0), dtype=np.float64)


def extreme_errors(signal: Array) -> tuple[Array, Array]:
    """Return two estimates (...): how far the signal falls below its smallest, and rises above its largest sample.

    Each is the larger of two estimates: the error of the extreme of every fourth sample, and ``parabola_rise``. No
    estimate sees a spike that is shorter than the sample interval.
    """
    rise = parabola_rise(signal)
    count = len(signal) // 4
    if count < 2:
        return rise, rise
    parts = signal[: 4 * count].reshape(count, 4, *signal.shape[1:])  # parts[:, k]: every fourth sample, from k on
    lost_low = parts.min(axis=0).max(axis=0) - signal.min(axis=0)
    lost_high = signal.max(axis=0) - parts.max(axis=0).min(axis=0)
    return np.maximum(lost_low, rise), np.maximum(lost_high, rise)


def parabola_rise(samples: Array) -> Array:
    """Return (...,) an estimate of how far a signal passes the extremes of its samples (N + 1, ...) between them.

    A parabola through an extreme sample and its two neighbours passes that sample by at most an eighth of their second
    difference. The estimate holds where several samples lie on the peak.
    """
    if len(samples) < 3:
        return np.zeros(samples.shape[1:])
    bends = []
    for extreme in (np.argmin, np.argmax):
        middle = np.clip(extreme(samples, axis=0), 1, len(samples) - 2)[None]
        before, here, after = (np.take_along_axis(samples, middle + side, axis=0)[0] for side in (-1, 0, 1))
        bends.append(0.125 * np.abs(after - 2.0 * here + before))
    return np.asarray(np.maximum(*bends))
