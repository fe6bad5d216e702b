"""Impulses as band-limited samples: every impulse is a sinc function with a Kaiser window at its exact time.

An impulse I at the time t_i has the spectrum I exp(-2 pi i f t_i), whose magnitude is the same at all frequencies. If
the impulse were moved to the nearest sample, its time would have an error of up to half a sample. If its spectrum ended
sharply at half the sampling rate f_s, the signal would ring for ever. The kernel

    g(t) = 2 f_c sinc(2 f_c t) w(t / W),      f_c = 0.4375 f_s,  W = 32 / f_s,

where w is the Kaiser window with beta = 10.06, has a flat spectrum up to 3/8 of f_s (18 of 48 kHz) and an attenuation
of 100 dB above half of f_s. So aliases are 100 dB below the impulse (J. F. Kaiser, Nonrecursive Digital Filter Design
Using the I0-sinh Window Function, Proc. IEEE Int. Symp. Circuits and Systems 1974, pp. 20-23).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HALF = 32
"""Half the length of the kernel, in samples."""
PASS = 0.375
CUT = 0.4375
"""End of the flat band (``PASS``) and middle of the slope (``CUT``), over the sampling rate."""
_BETA = 10.06
_BATCH = 100_000  # impulses that are computed at once


def impulse_train(time: Array, impulse: Array, rate: float, samples: int) -> Array:
    """Samples of a train of impulses.

    Parameters
    ----------
    time
        (I,) times of the impulses [s]; the first sample is at 0.
    impulse
        (I,) impulses [N s, or the unit of the result times s].
    rate
        samples per second [Hz].

    Returns
    -------
    Array
        (samples,) force [N]. Its sum divided by the rate is the sum of all impulses at least 32 samples from the ends.
    """
    padded = np.zeros(samples + 2 * HALF + 1)
    offsets = np.arange(-HALF + 1, HALF + 1)
    for first in range(0, time.size, _BATCH):
        position = np.asarray(time[first : first + _BATCH], dtype=np.float64) * rate
        whole = np.floor(position).astype(np.int64)
        away = offsets - (position - whole)[:, None]
        rows = whole[:, None] + offsets + HALF
        values = impulse[first : first + _BATCH, None] * rate * kernel(away)
        inside = (rows >= 0) & (rows < padded.size)
        padded += np.bincount(rows[inside], values[inside], padded.size)
    return padded[HALF : HALF + samples]


def kernel(away: Array) -> Array:
    """(...) g / f_s at distances in samples (...); its sum over whole distances is 1 within 1e-5."""
    window = np.i0(_BETA * np.sqrt(np.maximum(1.0 - (away / HALF) ** 2, 0.0))) / np.i0(_BETA)
    return np.asarray(2.0 * CUT * np.sinc(2.0 * CUT * away) * window, dtype=np.float64)
