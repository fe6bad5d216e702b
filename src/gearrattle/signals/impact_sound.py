"""Impacts as sound: a transfer path from an impulse in a gear mesh to sound pressure, and levels of what it makes.

    p(t) = sum of p_i h(t - t_i),      L = 10 lg( mean of p^2 / (20 uPa)^2 )  [dB]

``quantities.rattle_level`` is another level, by a calibrated gearbox. p_i is the momentum that impact i exchanges, h
the impulse response of the path [Pa/(N s)]. Without a measured response, damped modes represent the casing and its
radiation,

    h(t) = sum of g exp(-zeta omega t) sin(omega_d t),      omega_d = omega sqrt(1 - zeta^2),

built from its spectrum g omega_d / (omega^2 - w^2 + 2 i zeta omega w), so that there is no
aliasing. ``CASING`` is ASSUMED, not measured: six modes at frequencies where the casing of a car gearbox may have its
modes, with gains that give 70 dB for the rattle of ``examples/manual_transmission.toml``. Use it to compare designs,
not to predict a level.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.signals.impacts import find_impacts
from gearrattle.signals.impulse_train import impulse_train
from gearrattle.signals.windows import steady
from gearrattle.trajectory import Trajectory

Array = NDArray[np.float64]

RATE = 48_000
"""Samples per second [Hz], unless another rate is asked for."""
CASING = (
    (640.0, 0.020, 0.8),
    (1150.0, 0.018, 1.0),
    (1900.0, 0.015, 1.0),
    (2800.0, 0.015, 0.8),
    (4200.0, 0.012, 0.5),
    (6100.0, 0.012, 0.3),
)
"""Frequency [Hz], damping ratio and gain [Pa/(N s)] of the modes that represent a gearbox; assumed."""
ASSUMED = "assumed casing of six modes"
LONGEST = 600.0
"""Length of a sound, or of a response [s]."""
REFERENCE = 2e-5
"""Sound pressure that levels refer to [Pa]."""
LEAD = 64
"""Samples of a response before the impulse: a band-limited response starts a little before it."""
_QUIET = 1e-6  # largest amplitude of a mode at the end, relative to the start
_LONGEST_RINGING = 30.0  # seconds


@dataclass(frozen=True, eq=False)
class SoundPath:
    """An impulse response.

    Attributes
    ----------
    response
        (N,) of a force in any direction, or (F, N) of ``forces`` [Pa/(N s)]; the impulse is at sample ``lead``.
    rate
        sampling rate [Hz].
    lead
        samples before the impulse.
    forces
        on the casing that go through rows of the response: "x" and "y", of all bearings together, or forces of bearings
        such as "front.x"; empty for one path.
    """

    response: Array
    rate: float
    lead: int
    source: str
    forces: tuple[str, ...] = ()


def modal_path(modes: Sequence[tuple[float, float, float]], rate: float, source: str) -> SoundPath:
    """The band-limited impulse response of damped modes: frequency [Hz], damping ratio, gain [Pa/(N s)]."""
    # refuse modes out of range
    for i, (frequency, damping, gain) in enumerate(modes):
        is_valid = 0.0 < frequency < 0.5 * rate and 0.0 < damping < 1.0 and math.isfinite(gain)
        if not is_valid:
            value = f"{frequency:g} Hz, damping {damping:g}, gain {gain:g}"
            rule = f"a mode must lie between 0 and {0.5 * rate:g} Hz, its damping ratio between 0 and 1"
            raise ModelError(Problem(f"path.{i}", value, rule))
    if not modes:
        raise ModelError(Problem("path", "no modes", "must have at least one mode"))
    # length: until the slowest mode has decayed
    slowest = min(2.0 * math.pi * f * z for f, z, _ in modes)
    seconds = -math.log(_QUIET) / slowest
    if seconds > _LONGEST_RINGING:
        rule = f"a mode must decay within {_LONGEST_RINGING:g} s"
        raise ModelError(Problem("path", f"{seconds:.3g} s", rule, "increase its damping"))
    number = 2 * math.ceil(0.5 * seconds * rate) + 2 * LEAD
    # the spectrum of the damped modes, sampled
    w = 2.0 * math.pi * np.fft.rfftfreq(number, 1.0 / rate)
    spectrum = np.zeros(w.size, dtype=complex)
    for frequency, damping, gain in modes:
        omega = 2.0 * math.pi * frequency
        spectrum += gain * omega * math.sqrt(1.0 - damping**2) / (omega**2 - w**2 + 2j * damping * omega * w)
    # the impulse response, with its impulse at sample LEAD
    response = np.fft.irfft(spectrum * rate, number)
    return SoundPath(np.roll(response, LEAD), rate, LEAD, source)


def impact_pressure(motion: Trajectory, clearances: Collection[int], path: SoundPath) -> Array:
    """(N,) sound pressure [Pa] of the impacts of some clearances over the steady part.

    The path rings from the impacts before it, as far as the motion reaches back; so the level depends neither on the
    length of the response nor on that of the motion. NaN where no body at one of them is free to move: such impacts
    exchange no momentum.
    """
    from scipy.signal import fftconvolve

    # impacts that ring in the steady part
    window = steady(motion)
    samples = max(1, round(window.duration * path.rate))
    reach = path.response.size - 1 - path.lead
    start = window.start - reach / path.rate
    impacts = find_impacts(motion)
    chosen = np.isin(impacts.clearance, list(clearances)) & (impacts.time >= start)
    exchanged = impacts.exchanged[chosen]
    if not np.isfinite(exchanged).all():
        return np.full(samples, np.nan)
    # their train, through the path
    train = impulse_train(impacts.time[chosen] - start, exchanged, path.rate, reach + samples + path.lead)
    if not train.any():
        return np.zeros(samples)
    return np.asarray(fftconvolve(train, path.response, "valid") / path.rate)


def through(force: Array, path: SoundPath) -> Array:
    """(N,) pressure [Pa] of a force [N] by the path's response; it rings on after the last sample, which is kept."""
    from scipy.signal import fftconvolve

    whole = fftconvolve(force, path.response) / path.rate
    return np.asarray(whole[path.lead :], dtype=np.float64)


def pressure_level(pressure: Array) -> float:
    """Return the level of a sound pressure over its whole length [dB re 20 uPa]; -inf for silence."""
    with np.errstate(divide="ignore"):
        return float(10.0 * np.log10(np.mean(pressure**2) / REFERENCE**2))
