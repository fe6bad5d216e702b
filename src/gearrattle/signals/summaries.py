"""Moments and extremes of signals.

They add up over consecutive pieces of a motion, to rounding, so they can be gathered in chunks (``chunk_moments``);
means are by the trapezoidal rule.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearrattle.signals.levels import extreme_errors
from gearrattle.trajectory import Array


@dataclass(frozen=True)
class Summary:
    """Mean, central moments and extremes of a signal.

    Attributes
    ----------
    mean
        <x>.
    second, fourth
        <(x - <x>)^2>, <(x - <x>)^4>.
    miss
        estimated error of low and high between samples; 0 if these are exact.
    column
        index among the signals summed up in chunks; -1 for a signal summarised as a whole.
    """

    mean: float
    second: float
    fourth: float
    low: float
    high: float
    miss: float = 0.0
    column: int = -1

    @property
    def peak(self) -> float:
        """max |x|."""
        return max(self.high, -self.low)

    @property
    def swing(self) -> float:
        """max x - min x."""
        return self.high - self.low

    @property
    def reach(self) -> float:
        """max |x - <x>|."""
        return max(self.high - self.mean, self.mean - self.low)

    @property
    def spread(self) -> float:
        """Standard deviation."""
        return math.sqrt(max(self.second, 0.0))

    @property
    def rms(self) -> float:
        """Root mean square, the mean included."""
        return math.sqrt(max(self.second, 0.0) + self.mean**2)


def summary_of(samples: Array) -> Summary:
    """Return the summary of samples (N + 1,)."""
    scale = samples.size - 1
    mean = float(np.trapezoid(samples)) / scale
    square = (samples - mean) ** 2
    second, fourth = (float(np.trapezoid(values)) / scale for values in (square, square**2))
    return Summary(
        mean, second, fourth, float(samples.min()), float(samples.max()), float(np.max(extreme_errors(samples)))
    )
