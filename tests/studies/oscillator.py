"""A gear loose between two flanks with motions that coexist, and its closed forms (Mason et al. 2009, see examples)."""

from __future__ import annotations

from math import pi

import numpy as np

import gearrattle as gr
from tests.architecture.places import EXAMPLES

AMPLITUDE = "torque.0.harmonics.0.amplitude"
DRAG = 0.6
STIFFNESS = 200.0
GAP = 0.6
MEAN = 4.0 * pi * 0.6
RESPONSE = 1.0 / (STIFFNESS - 4.0 * pi**2 + 2.0j * pi * DRAG)  # of x to exp(2 pi i t) in contact
LIMIT = MEAN / (STIFFNESS * abs(RESPONSE))
"""Largest amplitude under which the flanks stay together: the spring's force never changes sign."""


def model(amplitude: float = 3.9658009, **settings: int) -> gr.Model:
    """Return the example under another forcing."""
    actual = gr.load(EXAMPLES / "rattle_oscillator.toml").with_({AMPLITUDE: amplitude})
    return actual.with_({f"simulation.{key}": value for key, value in settings.items()})


def quiet(amplitude: float, phase: float) -> tuple[float, float]:
    """Deflection and rate of the quiet motion at a phase of the period: F sin(2 pi t + p) through the response."""
    turn = amplitude * np.exp(1j * (2.0 * pi * phase - 1.6660006)) * RESPONSE
    return GAP + MEAN / STIFFNESS + turn.imag, 2.0 * pi * turn.real


def from_quiet(amplitude: float) -> gr.Model:
    """Return the example begun with its quiet motion."""
    deflection, rate = quiet(amplitude, 0.0)
    return model(amplitude).with_({"simulation.initial": {"angle": [deflection], "velocity": [rate]}})
