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

as both forces act on one linear casing; so do those of single bearings, whose sum F_x, F_y hides that two of them pull
the casing apart. With one path h for any direction, how the two pressures p_x = h * F_x and
p_y = h * F_y meet at the microphone is unknown: their sum would depend on how the axes lie, and a force along
x = -y would be silent. The energies add then, which is the mean over all phases between the two,

    <p^2> = <p_x^2> + <p_y^2>,

and no axis matters. What is heard is the pressure of the force along the direction in which that is largest, raised (by
3 dB at most) to this level.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
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
        (N, F) one column a force [N].
    is_exact
        whether they are of the exact motion; otherwise of its samples.
    """

    values: Array
    is_exact: bool


def source_of(layout: Layout) -> str:
    """Return what is heard of a driveline unless something else is asked for: the casing, if forces act on it."""
    return FROM_CASING if np.any(layout.casing_rows) else FROM_IMPACTS


def casing_force(
    motion: Trajectory, rate: float, before: int = 0, after: int = 0, *, forces: Sequence[str] = AXES
) -> CasingForce:
    """Sample forces on the casing over the steady part.

    Parameters
    ----------
    rate
        samples per second [Hz].
    before, after
        samples before the steady part, from the discarded cycles, and after its end. Beyond the motion its force is
        that at its ends.
    forces
        "x" and "y": of all bearings together; or forces of bearings such as "front.x".
    """
    from scipy.signal import upfirdn

    # the motion from as many discarded cycles as are needed
    window = steady(motion)
    samples = before + max(1, round(window.duration * rate)) + after
    cycles = math.ceil((before + HALF) / rate / motion.layout.period)
    longer = replace(motion, discard=max(0, motion.discard - cycles))
    known = steady(longer)
    values_at = _exact_values(longer, forces)
    is_exact = values_at is not None
    values_at = values_at or _splines(longer, forces)
    # values at a finer rate, then the low-pass, chunk by chunk
    taps = kernel(np.arange(-HALF * OVERSAMPLING, HALF * OVERSAMPLING + 1) / OVERSAMPLING) / OVERSAMPLING
    force = np.empty((samples, len(forces)))
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

    # forces, without their means
    reach = path.response.shape[-1] - 1 - path.lead
    force, is_exact = casing_force(motion, path.rate, reach, path.lead, forces=path.forces or AXES)
    force -= force[reach : force.shape[0] - path.lead].mean(axis=0)
    # pressures of all forces
    responses = path.response if path.forces else np.stack([path.response] * len(AXES))
    pressures = fftconvolve(force, responses.T, "valid", axes=0) / path.rate
    if path.forces:
        return np.asarray(pressures.sum(axis=1)), is_exact
    # one path: along the direction in which it is largest, at the sum of both energies
    energies, directions = np.linalg.eigh(pressures.T @ pressures)
    largest = directions[:, 1] * np.sign(directions[np.argmax(np.abs(directions[:, 1])), 1])
    raised = math.sqrt(energies.sum() / energies[1]) if energies[1] > 0.0 else 1.0
    return np.asarray(raised * (pressures @ largest)), is_exact


def _exact_values(motion: Trajectory, forces: Sequence[str]) -> Callable[[Array], Array] | None:
    """Return what gives exact forces on the casing at any time; None where nothing knows them."""
    exact = motion.exact
    signals = [(CASING_FORCE if force in AXES else "force", force) for force in forces]
    sign = np.array([1.0 if force in AXES else -1.0 for force in forces])
    begin = np.array([steady(motion).start])
    if exact is None or exact.values(motion, signals, begin) is None:
        return None

    def values(time: Array) -> Array:
        known = exact.values(motion, signals, time)
        assert known is not None
        return sign * known

    return values


def _splines(motion: Trajectory, forces: Sequence[str]) -> Callable[[Array], Array]:
    """Return cubic splines through the samples of forces on the casing."""
    from scipy.interpolate import CubicSpline

    assert motion.sideways is not None
    of_bearings = dict(zip(motion.layout.bearing_names, -motion.sideways.bearing_force.T, strict=True))
    known = of_bearings | dict(zip(AXES, motion.sideways.casing_force.T, strict=True))
    spline = CubicSpline(motion.time, np.stack([known[force] for force in forces], axis=1))
    return lambda time: np.asarray(spline(time), dtype=np.float64)
