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
    """Return every second, then every fourth of samples (N, ...), from whichever these begin; none of fewer than 8.

    What they tell differs from what all tell, by more than the error of all where this falls with the interval.
    """
    return [samples[first::step] for step in (2, 4) for first in range(step)] if len(samples) >= 8 else []


def rms_missed(signal: Array) -> Array:
    """Return (...) the estimated error of ``rms``: its largest difference from the rms of ``thinned`` samples."""
    periodic = signal[:-1]
    largest = np.max(np.abs(signal), axis=0)
    scale = np.where((largest > 0.0) & np.isfinite(largest), largest, 1.0)
    levels = np.array([np.sqrt(np.mean((some / scale) ** 2, axis=0)) for some in [periodic, *thinned(periodic)]])
    return np.asarray(scale * np.max(np.abs(levels - levels[0]), axis=0), dtype=np.float64)


def extremes_missed(signal: Array) -> tuple[Array, Array]:
    """Return (...) by how much smallest and largest value may be passed between samples, estimated.

    The larger of what ``thinned`` samples would miss of them, and of what a parabola through an extreme and its
    neighbours rises above it. A spike shorter than a sample interval is lost to any estimate.
    """
    bent = missed(signal)
    count = len(signal) // 4
    if count < 2:
        return bent, bent
    parts = signal[: 4 * count].reshape(count, 4, *signal.shape[1:])  # every second sample holds every fourth
    lost_low = parts.min(axis=0).max(axis=0) - signal.min(axis=0)
    lost_high = signal.max(axis=0) - parts.max(axis=0).min(axis=0)
    return np.maximum(lost_low, bent), np.maximum(lost_high, bent)


def missed(samples: Array) -> Array:
    """Return (...,) by how much the extremes of samples (N + 1, ...) may be passed between two of them.

    A parabola through an extreme sample and its neighbours rises above it by at most an eighth of their second
    difference. That is an estimate, which holds where the samples resolve the peak at all.
    """
    if len(samples) < 3:
        return np.zeros(samples.shape[1:])
    bends = []
    for extreme in (np.argmin, np.argmax):
        middle = np.clip(extreme(samples, axis=0), 1, len(samples) - 2)[None]
        before, here, after = (np.take_along_axis(samples, middle + side, axis=0)[0] for side in (-1, 0, 1))
        bends.append(0.125 * np.abs(after - 2.0 * here + before))
    return np.asarray(np.maximum(*bends))
