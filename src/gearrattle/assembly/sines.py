"""Sums of harmonics over time, at one reference speed or along a sweep of it.

f(t) = sum_j amplitude_j sin(order_j phi(t) + phase_j),      phi' = Omega
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.run_up_phase import Ramp
from gearrattle.engine.system.run_up_signals import Tone
from gearrattle.engine.system.specified_inputs import Swept
from gearrattle.model import Harmonic, Model
from gearrattle.model.engine import SquareOfSpeed
from gearrattle.model.over_speed import AtSpeed

Array = NDArray[np.float64]


def ramp_of(model: Model) -> Ramp | None:
    """The change of the reference speed; None for a constant speed."""
    sweep = model.excitation.sweep
    return None if sweep is None else Ramp(sweep.begin, sweep.end, sweep.over)


def speeds_of(ramp: Ramp) -> tuple[float, float]:
    """The lowest and the highest speed of a ramp [rad/s]."""
    return min(ramp.begin, ramp.end), max(ramp.begin, ramp.end)


def tones_of(harmonics: Sequence[Harmonic], ramp: Ramp) -> tuple[Tone, ...]:
    """The harmonics along a ramp of the speed."""
    return tuple(tone(h.order, h.phase, h.amplitude, speeds_of(ramp)) for h in harmonics)


def tone(order: float, phase: float, amplitude: float, speeds: tuple[float, float], less: float = 0.0) -> Tone:
    """A harmonic whose amplitude may be a table over speed; ``less`` is subtracted from the amplitude."""
    if isinstance(amplitude, SquareOfSpeed):
        low = speeds[0]
        factor = amplitude.per_square
        return Tone(order, phase, np.array(speeds), factor * np.array([[low**2, 2.0 * low, 1.0]]))
    if not isinstance(amplitude, AtSpeed):
        return Tone(order, phase, np.array(speeds), np.array([[amplitude - less]]))
    corners = np.array(amplitude.speeds)
    values = np.array(amplitude.values) - less
    return Tone(order, phase, corners, np.column_stack([values[:-1], np.diff(values) / np.diff(corners)]))


def sines(model: Model, harmonics: Sequence[Harmonic], time: Array, derivative: int = 0) -> Array:
    """(t,) sum of harmonics, or its first or second derivative, at times of a run (t,) [s]; also along a sweep."""
    if (ramp := ramp_of(model)) is not None:
        return Swept(ramp, tones_of(harmonics, ramp), smooth=False).at(time, derivative=derivative)
    terms = [(h.order * model.excitation.omega, h.amplitude, h.phase) for h in harmonics]
    return sum_of(terms, time, derivative)


def sum_of(terms: Sequence[tuple[float, float, float]], time: Array, derivative: int = 0) -> Array:
    """(t,) sum of amplitude sin(rate t + phase) over terms (rate [rad/s], amplitude, phase [rad]), or its first or
    second derivative.
    """
    total = np.zeros(np.shape(time))
    for rate, amplitude, phase in terms:
        angle = rate * time + phase
        wave = np.cos(angle) if derivative == 1 else np.sin(angle)
        total += (-1.0 if derivative == 2 else 1.0) * rate**derivative * amplitude * wave
    return total
