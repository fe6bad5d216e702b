"""Recordings for the tests."""

from __future__ import annotations

import numpy as np

from gearrattle.recording import Channel, Recording

RATE = 48_000.0
COUNT = 1200


def rig(first: float = 0.25) -> Recording:
    """Return three channels of noise, sampled at 48 kHz: an interval that no decimal number is."""
    random = np.random.default_rng(7)
    time = first + np.arange(COUNT) / RATE
    return Recording(
        time,
        (
            Channel("n_engine", "velocity", "flywheel", "rad/s", 80.0 * random.standard_normal(COUNT)),
            Channel("T-shaft", "torque", "hub", "N*m", 1e3 * random.standard_normal(COUNT)),
            Channel("mic", "sound pressure", "", "Pa", 1e-3 * random.standard_normal(COUNT)),
        ),
        "rig",
    )
