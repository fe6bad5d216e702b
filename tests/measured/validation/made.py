"""A driveline whose motion is known in closed form, and records of it made from that form alone.

One inertia, free, J = 2 kg m^2, driven at orders 1 and 3 of 20 Hz: its acceleration is

    a(t) = sum_o A_o / J sin(o W t + phi_o)

from the first moment on. A record is written down from this, with a gain, a delay, noise and an order of its own.
"""

from __future__ import annotations

import functools

import numpy as np

import gearrattle as gr
from gearrattle.recording import Channel, Recording

PERIOD = 0.05
INERTIA = 2.0
LINES = {1: (10.0, 0.0), 3: (4.0, 0.7)}
"""Order: torque [N m] and phase [rad]."""
MODEL = """
schema = 1
name = "wheel"
[[inertia]]
name = "wheel"
J = 2.0
[excitation]
frequency = "20 Hz"
[[torque]]
on = "wheel"
harmonics = [ { order = 1, amplitude = 10.0 }, { order = 3, amplitude = 4.0, phase = 0.7 } ]
[simulation]
cycles = 40
discard = 4
samples_per_cycle = 64
"""


@functools.cache
def run() -> gr.Run:
    return gr.simulate(gr.loads(MODEL))


def acceleration(time: np.ndarray) -> np.ndarray:
    w = 2.0 * np.pi / PERIOD
    return sum(size / INERTIA * np.sin(o * w * time + phase) for o, (size, phase) in LINES.items())


def record(
    *,
    gain: float = 1.0,
    delay: float = 0.0,
    noise: float = 0.0,
    second: float = 0.0,
    rate: float = 2048.0,
    seconds: float = 2.5,
    slow: float = 1.0,
    seed: int = 0,
) -> Recording:
    """A record whose clock is ``delay`` behind the model's; ``second`` [rad/s^2] is the amplitude of order 2 added."""
    time = np.arange(int(seconds * rate)) / rate
    at = time / slow + delay
    values = gain * acceleration(at) + second * np.sin(4.0 * np.pi / PERIOD * at)
    values = values + noise * np.random.default_rng(seed).standard_normal(time.size)
    return Recording(time, (Channel("a", "acceleration", "wheel", "rad/s^2", values),), "rig")
