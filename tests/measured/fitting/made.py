"""A driveline with a gap whose motion rattles and settles, and recordings of it by the exact engine."""

from __future__ import annotations

import functools

import numpy as np

import gearrattle as gr
from gearrattle.recording import Channel, Recording

MODEL = """
schema = 1
name = "two bodies and a gap"
[[inertia]]
name = "engine"
J = 0.2
drag = 2.0
[[inertia]]
name = "gear"
J = 0.05
drag = 0.5
[[coupling]]
name = "gap"
between = ["engine", "gear"]
stiffness = 900.0
damping = 0.8
clearance = 0.01
[excitation]
frequency = "20 Hz"
[[torque]]
on = "engine"
harmonics = [ { order = 1, amplitude = 40.0 }, { order = 2, amplitude = 15.0, phase = 0.7 } ]
[simulation]
cycles = 30
discard = 20
samples_per_cycle = 64
"""
UNITS = {"velocity": "rad/s", "acceleration": "rad/s^2"}
TRUTH = {
    "coupling.gap.stiffness": 900.0,
    "coupling.gap.clearance": 0.01,
    "inertia.gear.J": 0.05,
    "inertia.gear.drag": 0.5,
}


def model(**changes: float) -> gr.Model:
    return gr.loads(MODEL).with_(changes)


@functools.cache
def motion(source: gr.Model, quantity: str, names: tuple[str, ...], cycles: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and (M, C) values of the cycles after 20, their first as the clock's zero.

    A rig's filter keeps what jumps from folding back: the mean over 32 times as many samples, at the output's rate.
    """
    finer = 32 if quantity == "acceleration" else 1
    samples = source.simulation.samples_per_cycle
    run = gr.simulate(source, cycles=cycles, discard=20, audit=False, samples_per_cycle=finer * samples)
    values = run.data[quantity].sel(inertia=list(names)).values[20 * finer * samples :]
    if finer > 1:
        lines = np.fft.rfft(values[:-1], axis=0)[: len(values) // (2 * finer) + 1] / finer
        values = np.fft.irfft(lines, len(values) // finer, axis=0)
    time = run.trajectory.time[20 * finer * samples :: finer][: len(values)]
    return time - time[0], values


TRUE_MODEL = gr.loads(MODEL)


def recording(
    seed: int = 0,
    *,
    noise: float = 0.05,
    source: gr.Model = TRUE_MODEL,
    quantity: str = "velocity",
    names: tuple[str, ...] = ("engine", "gear"),
    gain: float = 1.0,
    cycles: int = 80,
) -> Recording:
    """A rig's record, its clock 12.3 ms behind; ``noise`` is white, a share of each channel's rms."""
    time, values = motion(source, quantity, names, cycles)
    size = noise * values.std(axis=0)
    noisy = gain * values + size * np.random.default_rng(seed).standard_normal(values.shape)
    channels = tuple(
        Channel(f"n_{name}", quantity, name, UNITS[quantity], column)
        for name, column in zip(names, noisy.T, strict=True)
    )
    return Recording(time + 0.0377, channels, "rig")


def value(source: gr.Model, path: str) -> float:
    kind, name, key = path.split(".")
    parts = {"inertia": source.inertias, "coupling": source.couplings, "mesh": source.meshes}[kind]
    return float(getattr(next(part for part in parts if part.name == name), key))
