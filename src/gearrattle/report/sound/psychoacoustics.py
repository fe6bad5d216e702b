"""Loudness, sharpness, roughness and impulsiveness of a sound pressure, the first three by MoSQITo.

Loudness after ISO 532-1:2017 (Zwicker), stationary and, for what changes in time, the value passed 5 % of the time;
sharpness after DIN 45692:2009; roughness after P. Daniel and R. Weber, Psychoacoustical Roughness: Implementation of an
Optimized Model, Acustica 83, 1997, pp. 113-123. By MoSQITo (extra ``sound``), which is imported here and nowhere else.
They are levels of an ear: without a measured path they compare designs and tell no product's sound.

Impulsiveness is the predicted prominence after Nordtest NT ACOU 112:2002. An onset is a rise of the A-weighted level
with time weighting F (a running mean square of 125 ms) by more than 10 dB/s; of its level difference LD and its onset
rate OR, the slope of the straight line through it,

    P = 3 lg(OR / (dB/s)) + 2 lg(LD / dB),      K_I = 1.8 (P - 5) dB  for P > 5,

and the onset of the largest P counts. 125 ms merge the impacts of idle rattle, some twenty a second and more, into one
level: P says how rattle that comes and goes stands out, and nothing of its single impacts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, NotInstalled, Problem
from gearrattle.report.sound.resample import resampled

Array = NDArray[np.float64]

RATE = 48_000.0  # Hz
SHORTEST = 0.5
"""Seconds that a sound must last."""
STEP = 0.01
"""Seconds between samples of a level; NT ACOU 112 asks for 10 to 25 ms."""
_ONSET = 10.0  # dB/s, beyond which a level rises suddenly
_FAST = 0.125  # seconds, time constant F
_A_POLES = (20.598997, 107.65265, 737.86223, 12194.217)  # Hz, IEC 61672-1
_REFERENCE = 2e-5  # Pa


class Quality(NamedTuple):
    """Psychoacoustic values of a sound.

    Attributes
    ----------
    loudness
        loudness as of a stationary sound [sone].
    loudness_5
        loudness exceeded for 5 % of the time [sone].
    sharpness
        [acum]; NaN for silence.
    roughness
        mean over time [asper].
    prominence
        predicted, of the most prominent onset [1]; NaN where the level never rises by more than 10 dB/s.
    adjustment
        K_I, by which prominent impulses raise the level that annoys as much without them [dB].
    """

    loudness: float
    loudness_5: float
    sharpness: float
    roughness: float
    prominence: float
    adjustment: float


def quality(pressure: Array, rate: float) -> Quality:
    """Return loudness, sharpness and roughness of a sound.

    Parameters
    ----------
    pressure
        (N,) [Pa], free field.
    rate
        samples per second [Hz].

    Raises
    ------
    NotInstalled
        MoSQITo is not installed.
    ModelError
        the sound is shorter than half a second.
    """
    mosqito = _mosqito()
    if pressure.size < SHORTEST * rate:
        rule = f"loudness and roughness need a sound of at least {SHORTEST:g} s"
        raise ModelError(Problem("run", f"{pressure.size / rate:.3g} s", rule, "simulate more cycles"))
    signal = resampled(pressure, rate, RATE, "sound")
    if not np.any(signal):
        return Quality(0.0, 0.0, float("nan"), 0.0, float("nan"), 0.0)
    loudness = float(mosqito.loudness_zwst(signal, RATE)[0])
    over_time = np.asarray(mosqito.loudness_zwtv(signal, RATE)[0])
    sharpness = float(mosqito.sharpness_din_st(signal, RATE)) if loudness > 0.0 else float("nan")
    roughness = float(np.mean(mosqito.roughness_dw(signal, RATE)[0]))
    prominent = largest_prominence(fast_level(signal, RATE))
    return Quality(
        loudness, float(np.quantile(over_time, 0.95)), sharpness, roughness, prominent, adjustment_of(prominent)
    )


def prominence(rate: float, difference: float) -> float:
    """Return the predicted prominence of an onset, of its rate [dB/s] and its level difference [dB]."""
    return float(3.0 * np.log10(rate) + 2.0 * np.log10(difference))


def adjustment_of(prominent: float) -> float:
    """Return the adjustment K_I of a prominence [dB]; 0 without an onset (NaN)."""
    return 1.8 * (prominent - 5.0) if prominent > 5.0 else 0.0


def fast_level(pressure: Array, rate: float) -> Array:
    """Return the A-weighted level with time weighting F [dB re 20 uPa], sampled every 10 ms, not below 0 dB.

    The running mean begins with the mean square of the whole sound: its begin is no onset.
    """
    from scipy.signal import lfilter

    # A-weighting of IEC 61672-1 by its poles, in the frequency domain
    s = 2j * np.pi * np.fft.rfftfreq(2 * pressure.size, 1.0 / rate)
    p1, p2, p3, p4 = 2.0 * np.pi * np.array(_A_POLES)
    weighting = 10.0**0.1 * (s * p4) ** 2 / ((s + p1) ** 2 * (s + p4) ** 2) * s**2 / ((s + p2) * (s + p3))
    weighted = np.fft.irfft(weighting * np.fft.rfft(pressure, 2 * pressure.size))[: pressure.size]
    # running mean square of 125 ms
    kept = np.exp(-1.0 / (rate * _FAST))
    squares = weighted**2
    mean = lfilter([1.0 - kept], [1.0, -kept], squares, zi=[kept * squares.mean()])[0]
    step = round(rate * STEP)
    return np.asarray(10.0 * np.log10(np.maximum(mean[step - 1 :: step] / _REFERENCE**2, 1.0)))


def largest_prominence(level: Array) -> float:
    """Return the prominence of the most prominent onset of a level (N,) in steps of ``STEP``; NaN without any."""
    rises = np.diff(level) > _ONSET * STEP
    edges = np.diff(np.pad(rises.astype(np.int8), 1))
    largest = np.nan
    for begin, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        onset = level[begin : end + 1]
        slope = float(np.polyfit(STEP * np.arange(onset.size), onset, 1)[0])
        largest = np.fmax(largest, prominence(slope, float(onset[-1] - onset[0])))
    return float(largest)


def _mosqito() -> Any:
    try:
        import mosqito
    except ImportError:
        rule = "loudness, sharpness and roughness need MoSQITo, an optional extra"
        raise NotInstalled.of("sound", "quality", "", rule) from None
    return mosqito
