"""Drivelines for the tests of formats: a tree of 128 bodies, and what examples lack."""

from __future__ import annotations

import numpy as np

import gearrattle as gr


def tree(count: int = 128, seed: int = 3) -> gr.Model:
    """A branched driveline: shafts and gear pairs, some with a gap, each body after the first at an earlier one."""
    draw = np.random.default_rng(seed)
    inertia = [{"name": f"body_{k}", "J": float(draw.uniform(0.01, 1.0)), "drag": 0.01} for k in range(count)]
    couplings = []
    meshes = []
    for k in range(1, count):
        between = [f"body_{int(draw.integers(max(0, k - 5), k))}", f"body_{k}"]
        if k % 4:
            couplings.append({"name": f"shaft_{k}", "between": between, "stiffness": 1e4 * (1 + k % 7), "damping": 2.0})
            continue
        radii = [float(draw.uniform(0.03, 0.1)), float(draw.uniform(0.03, 0.1))]
        mesh = {"name": f"mesh_{k}", "between": between, "radii": radii, "stiffness": 1e7, "damping": 300.0}
        meshes.append(mesh | ({"backlash": 1e-4} if k % 8 else {}))
    torque = [{"on": "body_0", "harmonics": [{"order": 2, "amplitude": 5.0, "phase": 0.3}]}]
    tables = {"schema": 1, "inertia": inertia, "coupling": couplings, "mesh": meshes, "torque": torque}
    return gr.Model.from_tables({**tables, "excitation": {"speed": 60.0}})


def linear(model: gr.Model) -> gr.Model:
    """The same driveline without clearances and drag torques."""
    return model.with_(dict.fromkeys((*model.paths("*backlash*"), *model.paths("*drag_torque"))))
