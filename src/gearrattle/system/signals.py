"""Inputs that are no harmonics: piecewise polynomials of time, such as splines through measured points and run-ups.

    T(t) += A p(t),    e(t) += B p(t),    p_c(t) = sum_j a_gcj (t - t_g)^j   for t_g <= t < t_(g+1)

Inside an interval p and its derivatives are states, p^(D + 1) = 0, so the exact engine moves under them exactly;
an interval's end is an instant known beforehand. Time is counted from the start of the run.

Takes arrays; gives a frozen table of polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Signals:
    """Piecewise polynomials; G intervals, C channels, degree D.

    Attributes:
        knots: (G + 1,) ascending times [s] from 0 to no less than the end of the run.
        coefficients: (G, C, D + 1) a, of ascending powers of the time since its begin [SI].
        torque: (n, C) A, torque on every inertia for a unit of every channel.
        error: (m, C) B, e of every element for a unit of every channel; its channels must be continuous, and so must be
            their first derivatives.
    """

    knots: Array
    coefficients: Array
    torque: Array
    error: Array

    @property
    def channels(self) -> int:
        """Number of channels C."""
        return int(self.coefficients.shape[1])

    @property
    def degree(self) -> int:
        """Degree D of the polynomials."""
        return int(self.coefficients.shape[2]) - 1

    def at(self, time: Array, derivative: int = 0) -> Array:
        """(t, C) value, or a derivative, of every channel at times (t,) [s]."""
        interval = np.clip(np.searchsorted(self.knots, time, side="right") - 1, 0, len(self.knots) - 2)
        since = (np.asarray(time) - self.knots[interval])[:, None]
        out = np.zeros((len(interval), self.channels))
        for j in range(self.degree, derivative - 1, -1):
            falling = float(np.prod(np.arange(j - derivative + 1, j + 1)))
            out = out * since + falling * self.coefficients[interval, :, j]
        return out
