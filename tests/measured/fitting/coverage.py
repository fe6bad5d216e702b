"""How often 1.96 standard errors of fits hold the truth: ``python -m tests.measured.fitting.coverage [RECORDS]``.

Six kinds of records from known models by the exact engine, with noise of four kinds. Counts are of the values, not of
their logarithms, as a user reads them.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

import gearrattle as gr
from gearrattle.recording import Channel, Recording
from tests.measured.fitting import made

SEED = 53
OFF = 1.05
"""Start of every free value over its truth, by turns above and below."""
GAP = ("coupling.gap.stiffness", "coupling.gap.damping", "coupling.gap.clearance")
MOVED = ("inertia.gear.J", "inertia.gear.drag", "torque.0.harmonics.0.amplitude")
BOTH = ("engine", "gear")
MESH = """
schema = 1
name = "two gears"
inertia = [{ name = "pinion", J = 0.02, drag = 0.3 }, { name = "wheel", J = 0.06, drag = 0.6 }]
[[mesh]]
name = "mesh"
between = ["pinion", "wheel"]
radii = [0.04, 0.08]
stiffness = 1e6
damping = 300.0
backlash = 4e-4
[excitation]
frequency = "25 Hz"
[[torque]]
on = "pinion"
mean = 0.5
harmonics = [{ order = 1, amplitude = 20.0 }, { order = 2, amplitude = 8.0, phase = 0.4 }]
"""
GEARS = ("mesh.mesh.damping", "mesh.mesh.backlash", "inertia.wheel.J")


@dataclass(frozen=True)
class Kind:
    """One kind of record: a model, what is measured of it, over how many cycles, with what noise."""

    words: str
    free: tuple[str, ...]
    quantity: str
    names: tuple[str, ...] = BOTH
    noise: str = "white"
    size: float = 0.05
    """rms of the noise over that of the channel."""
    scatter: float = 0.0
    """Standard deviation of the size of a cycle over its mean."""
    cycles: int = 60
    samples: int = 64
    text: str = made.MODEL


KINDS = (
    Kind("velocities, white noise 5 %", GAP, "velocity"),
    Kind("acceleration of one inertia, white noise 30 %", GAP, "acceleration", ("gear",), size=0.3, samples=128),
    Kind("accelerations, 22 cycles, white noise 30 %", GAP, "acceleration", size=0.3, cycles=22, samples=128),
    Kind("velocities, pink noise 10 %", MOVED, "velocity", noise="pink", size=0.1),
    Kind("velocities, cycles that scatter by 3 %, white noise 3 %", MOVED, "velocity", size=0.03, scatter=0.03),
    Kind(
        "two gears, velocities, low-passed noise 5 %",
        GEARS,
        "velocity",
        ("pinion", "wheel"),
        "low",
        text=MESH,
    ),
)


def noise(kind: str, shape: tuple[int, int], samples: int, random: np.random.Generator) -> np.ndarray:
    """(M, C) of unit rms: white; pink from a fifth of an order on; low: first order low pass at the second order."""
    order = np.fft.rfftfreq(shape[0]) * samples
    gain = {
        "white": np.ones_like(order),
        "pink": 1.0 / np.sqrt(np.maximum(order, 0.2)),
        "low": 1.0 / np.sqrt(1.0 + (order / 2.0) ** 2),
    }[kind]
    made_of = np.fft.irfft(np.fft.rfft(random.standard_normal(shape), axis=0) * gain[:, None], shape[0], axis=0)
    return np.asarray(made_of / made_of.std(axis=0))


def truth(kind: Kind) -> gr.Model:
    settings = {"cycles": 30, "discard": 20, "samples_per_cycle": kind.samples, "initial": "static"}
    return gr.loads(kind.text).with_({f"simulation.{key}": value for key, value in settings.items()})


def record(kind: Kind, seed: int) -> Recording:
    """One record of a kind, its clock 37.7 ms ahead."""
    random = np.random.default_rng([SEED, seed])
    time, clean = made.motion(truth(kind), kind.quantity, kind.names, 20 + kind.cycles)
    size = np.repeat(1.0 + kind.scatter * random.standard_normal(kind.cycles + 1), kind.samples)[: len(clean), None]
    level = clean.mean(axis=0)
    values = level + size * (clean - level)
    values = values + kind.size * clean.std(axis=0) * noise(kind.noise, clean.shape, kind.samples, random)
    unit = made.UNITS[kind.quantity]
    channels = [Channel(n, kind.quantity, n, unit, v) for n, v in zip(kind.names, values.T, strict=True)]
    return Recording(time + 0.0377, tuple(channels), "rig")


def deviations(kind: Kind, seeds: range) -> np.ndarray:
    """(R, P) fitted less true value, in standard errors."""
    model = truth(kind)
    start = model.with_({path: value_of(model, path) * OFF ** (-1) ** p for p, path in enumerate(kind.free)})
    rows = []
    for seed in seeds:
        fit = gr.identification.fit(start, record(kind, seed), list(kind.free), starts=1)
        rows.append([(p.value - value_of(model, p.path)) / p.standard_error for p in fit.parameters])
    return np.array(rows)


def value_of(model: gr.Model, path: str) -> float:
    if path.startswith("torque"):
        return float(model.torques[0].harmonics[0].amplitude)
    return made.value(model, path)


def main(records: int) -> None:
    """Print coverage, bias and spread of every parameter of every kind, and coverage of all."""
    by_key: dict[str, list[np.ndarray]] = {}
    for kind in KINDS:
        print(kind.words, flush=True)
        for path, away in zip(kind.free, deviations(kind, range(records)).T, strict=True):
            by_key.setdefault(path.rsplit(".", 1)[-1], []).append(away)
            inside = 100.0 * np.mean(np.abs(away) < 1.96)
            print(f"  {path}: {inside:.1f} %, mean {away.mean():+.2f}, deviation {away.std():.2f}", flush=True)
    by_key["all"] = [part for parts in by_key.values() for part in parts]
    for key, deviations_of_key in by_key.items():
        away = np.concatenate(deviations_of_key)
        inside = 100.0 * np.mean(np.abs(away) < 1.96)
        print(f"{key}: {inside:.1f} % of {away.size}, mean {away.mean():+.2f}, deviation {away.std():.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 50)
