"""Angle of a shaft from the pulses of its toothed wheel.

A pulse counts where the signal rises through the threshold, provided that it has been below threshold minus hysteresis
since the last one: noise smaller than the hysteresis adds no pulse. Its time lies on the straight line between the
samples on both sides, so an analogue signal gives far more than its sample interval, a square wave just that.

After k teeth the shaft has turned 2 pi k / z, z the teeth of a full wheel; ``wheel`` says which tooth a pulse is.
Between pulses the angle is the cubic spline through these points, its derivative the speed; for pulses h apart it is
within 5/384 h^4 max|d^4 phi / dt^4| (C. de Boor, A Practical Guide to Splines, ch. V). Before the first pulse and after
the last nothing is known.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def levels(values: Array) -> tuple[float, float]:
    """Return a threshold and a hysteresis for a pulse signal (N,): half-way up, and a fifth of its height."""
    low, high = np.quantile(values, [0.01, 0.99]) if values.size > 1000 else (values.min(), values.max())
    if not high > low:
        low = values.min()
        high = values.max()
    return float(0.5 * (low + high)), float(0.2 * (high - low))


def pulse_times(time: Array, values: Array, threshold: float, hysteresis: float, rising: bool = True) -> Array:
    """Return when pulses begin.

    Parameters
    ----------
    time
        (N,) strictly ascending [s].
    values
        (N,) the signal in any unit.
    hysteresis
        how far below the threshold the signal must have been, at least 0.

    Returns
    -------
    Array
        (P,) ascending [s].
    """
    height = values - threshold if rising else threshold - values
    state = np.where(height >= 0.0, 1, np.where(height < -hysteresis, -1, 0))
    decided = np.flatnonzero(state)  # samples that settle whether the signal is up or down
    settled = state[decided]
    up = decided[1:][(settled[1:] == 1) & (settled[:-1] == -1)]
    below = height[up - 1]
    above = height[up]
    return np.asarray(time[up - 1] + (time[up] - time[up - 1]) * below / (below - above), dtype=np.float64)


def shaft(times: Array, angles: Array, wanted: Array) -> tuple[Array, Array]:
    """Return angle [rad] and speed [rad/s] of a shaft between its pulses.

    Parameters
    ----------
    times
        (P,) ascending [s], P >= 4.
    angles
        (P,) at the pulses [rad].
    wanted
        (M,) times from the first pulse to the last [s].
    """
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(times, angles)
    return np.asarray(spline(wanted), dtype=np.float64), np.asarray(spline(wanted, 1), dtype=np.float64)
