"""Random piecewise-linear systems, seeded, for tests of the mathematics below any model."""

from __future__ import annotations

import numpy as np

from gearrattle.engine.system.law import PiecewiseLaw, Stage, staged
from gearrattle.engine.system.piecewise import Harmonics, PiecewiseSystem


def clearance(stiffness: float, damping: float, half_gap: float, alpha: float = 0.0) -> PiecewiseLaw:
    """Return a symmetric two-stage law."""
    stages = [Stage(alpha * stiffness, 0.0, half_gap), Stage(stiffness, damping, None)]
    return staged(stages, stages)


def linear(stiffness: float, damping: float = 0.0) -> PiecewiseLaw:
    """Return a law without a corner."""
    return staged([Stage(stiffness, damping, None)], [Stage(stiffness, damping, None)])


def inputs(size: int, elements: int, **values: np.ndarray) -> Harmonics:
    """Return harmonic inputs that are zero where nothing is given."""
    cycles = values.get("cycles", np.zeros(0))
    shape = {"torque": (size, len(cycles)), "error": (elements, len(cycles))}
    parts = {
        f"{kind}_{part}": values.get(f"{kind}_{part}", np.zeros(shape[kind]))
        for kind in shape
        for part in ("sine", "cosine")
    }
    return Harmonics(float(values.get("period", np.array(1.0))), cycles, values.get("mean", np.zeros(size)), **parts)


def random_chain(seed: int) -> PiecewiseSystem:
    """Return a free or grounded chain of 2 to 5 inertias with clearances, drag zero or not, and three harmonics."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 6))
    rows = [np.eye(size)[i] - np.eye(size)[i + 1] for i in range(size - 1)]
    if rng.random() < 0.3:
        rows.append(np.eye(size)[-1])
    inertia = 10.0 ** rng.uniform(-3, 0, size)
    laws = []
    for _ in rows:
        stiffness = float(10.0 ** rng.uniform(1, 6))
        damping = float(rng.choice([0.0, 0.01, 0.1]) * np.sqrt(stiffness * inertia.min()))
        alpha = float(rng.choice([0.0, 1e-3, 0.5]))
        laws.append(clearance(stiffness, damping, float(10.0 ** rng.uniform(-3, 0)), alpha))
    cycles = np.array([1.0, 2.0, 7.0])
    drive = np.zeros((size, 3))
    drive[0] = rng.normal(size=3)
    error = np.zeros((len(rows), 3))
    error[-1] = 1e-3 * rng.normal(size=3)
    return PiecewiseSystem(
        inertia,
        rng.choice([0.0, 1e-4, 1e-1], size),
        np.array(rows),
        tuple(laws),
        inputs(
            size,
            len(rows),
            cycles=cycles,
            period=np.array(0.1),
            mean=rng.normal(size=size),
            torque_sine=drive,
            error_cosine=error,
        ),
    )


def random_pieces(system: PiecewiseSystem, seed: int) -> tuple[int, ...]:
    """Return one region at random."""
    rng = np.random.default_rng(seed)
    return tuple(int(rng.integers(law.pieces)) for law in system.laws)
