"""Loudness, sharpness and roughness of a sound pressure, by MoSQITo.

Loudness after ISO 532-1:2017 (Zwicker), for stationary sound and, for sound that changes in time, the value exceeded
for 5 % of the time; sharpness after DIN 45692:2009; roughness after P. Daniel and R. Weber, Psychoacoustical Roughness:
Implementation of an Optimized Model, Acustica 83, 1997, pp. 113-123. They are computed by MoSQITo (extra ``sound``),
which only this module imports. Without a measured transfer path the values compare designs; they are not the values of
a product.
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
"""Least duration of a sound [s]."""


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
    """

    loudness: float
    loudness_5: float
    sharpness: float
    roughness: float


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
        return Quality(0.0, 0.0, float("nan"), 0.0)
    loudness = float(mosqito.loudness_zwst(signal, RATE)[0])
    over_time = np.asarray(mosqito.loudness_zwtv(signal, RATE)[0])
    sharpness = float(mosqito.sharpness_din_st(signal, RATE)) if loudness > 0.0 else float("nan")
    roughness = float(np.mean(mosqito.roughness_dw(signal, RATE)[0]))
    return Quality(loudness, float(np.quantile(over_time, 0.95)), sharpness, roughness)


def _mosqito() -> Any:
    try:
        import mosqito
    except ImportError:
        rule = "loudness, sharpness and roughness need MoSQITo, an optional extra"
        raise NotInstalled(Problem("quality", "", rule, "pip install 'gearrattle[sound]'")) from None
    return mosqito
