"""A signal at another sampling rate, band-limited.

A polyphase filter with the Kaiser window of ``impulse_train`` (R. E. Crochiere, L. R. Rabiner, Multirate Digital Signal
Processing, 1983, ch. 2) removes frequencies above half the lower rate, which would be aliased.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.signals.impact_sound import LONGEST

Array = NDArray[np.float64]

_LARGEST = 2000  # ratio of the rates, and its denominator


def resampled(values: Array, rate: float, wanted: float, name: str) -> Array:
    """Return a signal (N,) at another rate; rates are samples per second [Hz].

    ModelError for rates too far apart, or a signal that is too long.
    """
    if not wanted / _LARGEST <= rate <= wanted * _LARGEST:
        rule = f"must have {wanted / _LARGEST:g} to {wanted * _LARGEST:g} samples a second to be heard at {wanted:g} Hz"
        raise ModelError(Problem(name, f"{rate:.6g} Hz", rule, "check its times, or the rate in its header"))
    if values.size > LONGEST * rate:
        raise ModelError(Problem(name, f"{values.size / rate:.4g} s", f"may last {LONGEST:g} s to be heard", "cut it"))
    ratio = Fraction(wanted / rate).limit_denominator(_LARGEST)
    if ratio == 1:
        return np.asarray(values, dtype=np.float64)
    from scipy.signal import resample_poly

    out = resample_poly(values, ratio.numerator, ratio.denominator, window=("kaiser", 10.06))
    return np.asarray(out, dtype=np.float64)
