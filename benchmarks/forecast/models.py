"""Seeded drivelines for the score of forecasts: the paper's cases varied, and small trains.

*Paper*: a case of Table 2, loaded or with its loose gear, a mean of 0.02 to 0.5, every harmonic scaled by itself and
given a phase, other speeds, backlashes and clutch travels. *Trains*: chains of two to four bodies that nothing holds,
damping of 2 to 10 %, one to three clearances of half-width 1, one or two orders near the natural frequencies, a mean.

Takes a kind and a seed; gives a Model, the same on any machine.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gearrattle.model import Model
from gearrattle.reproduction.paper_cases import load_case

SEEDS = range(100, 120)
KINDS = ("paper", "train")


def model(kind: str, seed: int) -> Model:
    """A driveline of a kind."""
    return paper(seed) if kind == "paper" else train(seed)


def paper(seed: int) -> Model:
    """A case of the paper, varied."""
    rng = np.random.default_rng(1000 + seed)
    case, loaded = int(rng.integers(1, 4)), bool(rng.random() < 0.5)
    base = load_case(case, float(rng.choice([0.02, 0.05, 0.1, 0.2, 0.5])), loaded=loaded)
    size, changes = float(rng.uniform(0.3, 1.5)), {}
    for i, harmonic in enumerate(base.torques[0].harmonics):
        path = f"torque.0.harmonics.{i}"
        changes[f"{path}.amplitude"] = harmonic.amplitude * size * float(rng.uniform(0.5, 1.5))
        changes[f"{path}.phase"] = float(rng.uniform(0.0, 2.0 * np.pi))
    changes["excitation.speed"] = float(rng.uniform(100.0, 300.0))
    changes["mesh.gear.backlash"] = 1e-4 * float(rng.uniform(0.5, 2.0))
    changes["coupling.clutch.clearance"] = 0.16 * float(rng.uniform(0.3, 1.5))
    return base.with_(changes)


def train(seed: int) -> Model:
    """A small train, dimensionless."""
    rng = np.random.default_rng(2000 + seed)
    size = int(rng.integers(2, 5))
    names = [f"body{i}" for i in range(size)]
    stiffness, inertia = 10.0 ** rng.uniform(0.0, 1.0, size - 1), 10.0 ** rng.uniform(-0.5, 0.5, size)
    couplings: list[dict[str, Any]] = []
    for i, k in enumerate(stiffness.tolist()):
        damping = 2.0 * rng.uniform(0.02, 0.1) * np.sqrt(k * inertia[i : i + 2].min())
        coupling = {"name": f"link{i}", "between": names[i : i + 2], "stiffness": k, "damping": float(damping)}
        if i == 0 or rng.random() < 0.6:
            ratios = float(rng.choice([0.0, 0.05, 0.2])), float(rng.choice([0.0, 0.1, 0.3]))
            coupling |= {"clearance": 1.0, "stiffness_ratio": ratios[0], "damping_ratio": ratios[1]}
        couplings.append(coupling)
    least = float(stiffness.min())
    mean, amplitude = least * float(rng.choice([0.0, 0.1, 0.5, 1.5])), least * float(rng.uniform(0.5, 3.0))
    harmonics = [{"order": 1, "amplitude": amplitude}]
    if rng.random() < 0.5:
        second = {"amplitude": amplitude * float(rng.uniform(0.2, 0.6)), "phase": float(rng.uniform(0.0, 2.0 * np.pi))}
        harmonics.append({"order": 2, **second})
    speed = float(np.sqrt(stiffness.mean() / inertia.mean()) * rng.uniform(0.3, 2.0))
    bodies = [{"name": n, "J": j, "drag": 0.02 * j} for n, j in zip(names, inertia.tolist(), strict=True)]
    torques = [{"on": names[0], "mean": mean, "harmonics": harmonics}, {"on": names[-1], "mean": -mean}]
    return Model.from_tables(
        {
            "schema": 1,
            "name": f"Train {seed}",
            "units": "dimensionless",
            "inertia": bodies,
            "coupling": couplings,
            "excitation": {"speed": speed},
            "torque": torques,
        }
    )
