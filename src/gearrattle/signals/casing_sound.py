"""The force of bearings on the casing as sound: sampled without aliasing, through a path, both directions together.

The force is continuous, with bends and steps where contacts begin and end: its spectrum has no end. Of an exact motion
its values are known at any time. They are taken at ``OVERSAMPLING`` times the rate of the sound, and the low-pass
kernel of ``impulse_train`` removes everything above half of that rate before it is thinned. What a step of the force
has beyond 8 x 48 kHz - f folds back to f: -32 dB of its own spectrum at 10 kHz, of a bend -63 dB. Other algorithms know
their samples alone: these are resampled, and what lies above half their rate has folded back already.

A constant force makes no sound, so the mean is left out. The sound is that of the steady part alone: before it, the
path has heard the discarded cycles, as far as its response reaches, so there is no switch-on.

A microphone hears F_x and F_y through two paths h_x and h_y. Where both are known, the pressures add,

    p = h_x * F_x + h_y * F_y,

as both forces act on one linear casing. With one path h for any direction, how the two pressures p_x = h * F_x and
p_y = h * F_y meet at the microphone is unknown: their sum would depend on how the axes lie, and a force along
x = -y would be silent. The energies add then, which is the mean over all phases between the two,

    <p^2> = <p_x^2> + <p_y^2>,

and no axis matters. What is heard is the pressure of the force along the direction in which that is largest, raised (by
3 dB at most) to this level.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals.impact_sound import SoundPath
from gearrattle.signals.impulse_train import HALF, kernel
from gearrattle.signals.windows import steady
from gearrattle.trajectory import AXES, CASING_FORCE, Layout, Trajectory

Array = NDArray[np.float64]

OVERSAMPLING = 8
"""Exact values of a force for one sample of its sound."""
FROM_CASING = "casing"
FROM_IMPACTS = "impacts"
SOURCES = (FROM_CASING, FROM_IMPACTS)
"""What is heard of a driveline: forces on the casing, or impacts."""
_CHUNK = 16_384  # samples of the force that are made at once


class CasingForce(NamedTuple):
    """Samples of the force on the casing, nothing in them above half their rate.

    Attributes
    ----------
    values
        (N, 2) along x and along y [N].
    is_exact
        whether they are of the exact motion; otherwise of its samples.
    """

    values: Array
    is_exact: bool


def source_of(layout: Layout) -> str:
    """Return what is heard of a driveline unless something else is asked for: the casing, if forces act on it."""
    return FROM_CASING if np.any(layout.casing_rows) else FROM_IMPACTS


def casing_force(motion: Trajectory, rate: float, before: int = 0, after: int = 0) -> CasingForce:
    """Sample the force on the casing over the steady part.

    Parameters
    ----------
    rate
        samples per second [Hz].
    before, after
        samples before the steady part, from the discarded cycles, and after its end. Beyond the motion its force is
        that at its ends.
    """
    from scipy.signal import upfirdn

    # the motion from as many discarded cycles as are needed
    window = steady(motion)
    samples = before + max(1, round(window.duration * rate)) + after
    cycles = math.ceil((before + HALF) / rate / motion.layout.period)
    longer = replace(motion, discard=max(0, motion.discard - cycles))
    known = steady(longer)
    values_at = _exact_values(longer)
    is_exact = values_at is not None
    values_at = values_at or _splines(longer)
    # values at a finer rate, then the low-pass, chunk by chunk
    taps = kernel(np.arange(-HALF * OVERSAMPLING, HALF * OVERSAMPLING + 1) / OVERSAMPLING) / OVERSAMPLING
    force = np.empty((samples, 2))
    for begin in range(0, samples, _CHUNK):
        end = min(begin + _CHUNK, samples)
        fine = np.arange((begin - HALF) * OVERSAMPLING, (end - 1 + HALF) * OVERSAMPLING + 1)
        time = window.start + (fine / OVERSAMPLING - before) / rate
        values = values_at(np.clip(time, known.start, known.end))
        force[begin:end] = upfirdn(taps, values, 1, OVERSAMPLING, axis=0)[2 * HALF : 2 * HALF + end - begin]
    return CasingForce(force, is_exact)


def casing_pressure(motion: Trajectory, path: SoundPath) -> tuple[Array, bool]:
    """Return (N,) sound pressure [Pa] of the force on the casing over the steady part, and whether it is exact."""
    from scipy.signal import fftconvolve

    # force, without its mean
    reach = path.response.shape[-1] - 1 - path.lead
    force, is_exact = casing_force(motion, path.rate, reach, path.lead)
    force -= force[reach : force.shape[0] - path.lead].mean(axis=0)
    # pressures of both directions
    responses = path.response if path.response.ndim == 2 else np.stack([path.response] * 2)
    pressures = fftconvolve(force, responses.T, "valid", axes=0) / path.rate
    if path.response.ndim == 2:
        return np.asarray(pressures.sum(axis=1)), is_exact
    # one path: along the direction in which it is largest, at the sum of both energies
    energies, directions = np.linalg.eigh(pressures.T @ pressures)
    largest = directions[:, 1] * np.sign(directions[np.argmax(np.abs(directions[:, 1])), 1])
    raised = math.sqrt(energies.sum() / energies[1]) if energies[1] > 0.0 else 1.0
    return np.asarray(raised * (pressures @ largest)), is_exact


def _exact_values(motion: Trajectory) -> Callable[[Array], Array] | None:
    """Return what gives the exact force at any time; None where nothing knows it."""
    exact = motion.exact
    signals = [(CASING_FORCE, axis) for axis in AXES]
    begin = np.array([steady(motion).start])
    if exact is None or exact.values(motion, signals, begin) is None:
        return None

    def values(time: Array) -> Array:
        known = exact.values(motion, signals, time)
        assert known is not None
        return known

    return values


def _splines(motion: Trajectory) -> Callable[[Array], Array]:
    """Return cubic splines through the samples."""
    from scipy.interpolate import CubicSpline

    assert motion.sideways is not None
    return CubicSpline(motion.time, motion.sideways.casing_force)
