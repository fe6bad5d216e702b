"""Angle, speed and acceleration from each other.

Between samples a signal is its cubic spline: integrals are those of the spline, from 0 at the first sample, derivatives
its derivatives. Of a signal of frequency f sampled at rate fs an integral is in error by (2 pi f / fs)^4 / 720 of
itself, a first derivative by (2 pi f / fs)^4 / 180; a derivative raises noise with the frequency, so a filter belongs
after it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def derived(time: Array, values: Array, times: int) -> Array:
    """Return a derivative of a signal, or for negative ``times`` an integral from its first sample on.

    Parameters
    ----------
    time
        (N,) strictly ascending [s], N >= 4.
    values
        (N,).
    times
        1 and 2 for derivatives, -1 and -2 for integrals.

    Returns
    -------
    Array
        (N,) in the unit times s to the power of -``times``.
    """
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(time - time[0], values)
    other = spline.derivative(times) if times > 0 else spline.antiderivative(-times)
    return np.asarray(other(time - time[0]), dtype=np.float64)
