"""Random drivelines to be reduced: chains and trees of 4 to 12 bodies, gears of unequal size, stiffnesses 1 to 1e4."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearrattle.model import Model

Table = dict[str, Any]


def random_driveline(seed: int) -> Model:
    """Return the same driveline for the same seed."""
    rng = np.random.default_rng(seed)
    size, branched = int(rng.integers(4, 13)), bool(rng.random() < 0.5)
    names = [f"b{i}" for i in range(size)]
    bodies: list[Table] = [
        {
            "name": name,
            "J": float(10.0 ** rng.uniform(-3, -1)),
            "drag": float(rng.choice([0.0, 1e-3])),
            "drag_torque": float(rng.choice([0.0, 0.3])),
        }
        for name in names
    ]
    couplings: list[Table] = []
    meshes: list[Table] = []
    for i in range(1, size):
        ends = [names[int(rng.integers(i)) if branched else i - 1], names[i]]
        stiffness = float(1e3 * 10.0 ** rng.uniform(0, 4))
        if rng.random() < 0.4:
            meshes.append(_mesh(rng, f"mesh{i}", ends, stiffness))
        else:
            couplings.append(_coupling(rng, f"shaft{i}", ends, stiffness))
    if rng.random() < 0.25:
        ground = {"name": "mount", "between": [names[-1], "ground"], "stiffness": float(10.0 ** rng.uniform(2, 5))}
        couplings.append(ground)
    harmonics = [{"order": order, "amplitude": float(rng.uniform(1, 20)), "phase": 0.3 * order} for order in (1, 2)]
    torques: list[Table] = [
        {"on": names[0], "mean": float(rng.uniform(-5, 5)), "harmonics": harmonics},
        {"on": names[size // 2], "mean": float(rng.uniform(-5, 5))},
    ]
    tables = {"schema": 1, "inertia": bodies, "excitation": {"speed": 40.0}, "torque": torques}
    return Model.from_tables(
        {**tables, **({"coupling": couplings} if couplings else {}), **({"mesh": meshes} if meshes else {})}
    )


def _coupling(rng: np.random.Generator, name: str, ends: list[str], stiffness: float) -> Table:
    table: Table = {"name": name, "between": ends, "stiffness": stiffness, "damping": 1e-4 * stiffness}
    if rng.random() < 0.3:
        table["clearance"] = float(10.0 ** rng.uniform(-3, -1))
        if rng.random() < 0.5:
            table |= {"stiffness_ratio": float(10.0 ** rng.uniform(-3, -0.3)), "damping_ratio": 0.1}
    return table


def _mesh(rng: np.random.Generator, name: str, ends: list[str], stiffness: float) -> Table:
    radii = [float(x) for x in rng.uniform(0.02, 0.1, 2)]
    linear = stiffness / (radii[0] * radii[1])
    table: Table = {"name": name, "between": ends, "radii": radii, "stiffness": linear, "damping": 1e-5 * linear}
    if rng.random() < 0.4:
        table["backlash"] = 1e-4
    return table
