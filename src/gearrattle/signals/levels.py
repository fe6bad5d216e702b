"""Levels of a sampled signal: root mean square and peak to peak.

x_rms = [ (1/T) integral_0^T x^2 dt ]^(1/2), by the trapezoidal rule over whole periods (which for a periodic signal is
exact up to aliasing), and x_pp = max x - min x over the samples: Padmanabhan et al. 1995, eqs. (23)-(25). The mean is
*not* removed: an acceleration is taken as it is.

Takes plain arrays, time along the first axis; gives arrays to the criteria.
"""

from __future__ import annotations

import numpy as np

from gearrattle.trajectory import Array


def rms(signal: Array) -> Array:
    """Return the root mean square over uniform samples that span whole periods, both bounds included.

    Args:
        signal: (N, ...) with N >= 2; the first and the last sample are the same phase of a period.

    Returns:
        (...) in the unit of the signal.
    """
    largest = np.max(np.abs(signal), axis=0)
    scale = np.where((largest > 0.0) & np.isfinite(largest), largest, 1.0)  # squares neither overflow nor vanish
    mean_square = np.trapezoid((signal / scale) ** 2, axis=0) / (signal.shape[0] - 1)
    return np.asarray(scale * np.sqrt(mean_square), dtype=np.float64)


def peak_to_peak(signal: Array) -> Array:
    """Return max - min over the first axis, in the unit of the signal."""
    return np.asarray(np.max(signal, axis=0) - np.min(signal, axis=0), dtype=np.float64)
