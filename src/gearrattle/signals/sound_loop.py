"""A short part of a sound that repeats without a click: whole periods of the excitation, its end faded into its begin.

Of a motion that repeats after a period the fade changes nothing. Of another one it joins, over 10 ms, the last samples
to those that stand before the first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RATE = 24_000
"""Samples of a loop per second [Hz]: 9 kHz are heard."""
LONGEST = 0.75
"""Length of a loop [s]."""
SAMPLES = round(RATE * LONGEST)
_FADE = 0.01  # seconds


def loop_of(pressure: Array, rate: float, period: float) -> Array:
    """Return (``SAMPLES``,) the end of a sound, as a loop at ``RATE``; NaN after its end, and of silence alone.

    Parameters
    ----------
    pressure
        (N,) at ``rate`` [Hz].
    period
        of the excitation [s].
    """
    from scipy.signal import resample_poly

    loop = np.full(SAMPLES, np.nan)
    if not (np.isfinite(pressure).all() and pressure.any()):
        return loop
    # at the rate of loops
    thinned = resample_poly(pressure, RATE, round(rate), window=("kaiser", 10.06))
    # whole periods, as many as fit
    length = min(LONGEST, thinned.size / RATE)
    whole = int(length / period * (1.0 + 1e-9))
    samples = min(SAMPLES, thinned.size, round((whole * period if whole else length) * RATE))
    begin = thinned.size - samples
    loop[:samples] = thinned[begin:]
    # the end fades into what stands before the begin
    fade = min(round(_FADE * RATE), begin, samples)
    share = (np.arange(fade) + 0.5) / max(1, fade)
    loop[samples - fade : samples] = (1.0 - share) * loop[samples - fade : samples] + share * thinned[
        begin - fade : begin
    ]
    return loop
