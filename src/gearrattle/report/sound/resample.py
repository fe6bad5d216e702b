"""A signal at another sampling rate, band-limited.

A polyphase filter under the Kaiser window of ``train`` (R. E. Crochiere, L. R. Rabiner, Multirate Digital Signal
Processing, 1983, ch. 2): what lies above half the lower rate is taken out before it can fold back.

Takes samples; gives samples.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LARGEST = 2000  # denominator of the ratio of the rates


def resampled(values: Array, rate: float, wanted: float) -> Array:
    """Return a signal at another rate.

    Args:
        values: (N,).
        rate, wanted: samples a second [Hz].
    """
    ratio = Fraction(wanted / rate).limit_denominator(_LARGEST)
    if ratio == 1:
        return np.asarray(values, dtype=np.float64)
    from scipy.signal import resample_poly

    out = resample_poly(values, ratio.numerator, ratio.denominator, window=("kaiser", 10.06))
    return np.asarray(out, dtype=np.float64)
