"""A small driveline, and exact data of it computed by other means than the fit's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import gearrattle as gr

TRAIN = """
schema = 1
[[inertia]]
name = "flywheel"
J = 0.3
drag = 0.02
[[inertia]]
name = "hub"
J = 0.002
[[inertia]]
name = "wheel"
J = 0.011
drag = 0.004
[[inertia]]
name = "gear"
J = 0.0016
[[coupling]]
name = "clutch"
between = ["flywheel", "hub"]
stiffness = 1500.0
damping = 0.3
clearance = 0.16
stiffness_ratio = 0.1
damping_ratio = 0.25
[[coupling]]
name = "spline"
between = ["hub", "wheel"]
stiffness = 15000.0
damping = 0.02
[[mesh]]
name = "mesh"
between = ["wheel", "gear"]
radii = [0.05, 0.03]
stiffness = 7.2e7
damping = 900.0
backlash = 1e-4
[excitation]
speed = 150.0
"""


def train() -> gr.Model:
    return gr.loads(TRAIN)


def matrices(model: gr.Model) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """J, C, K of the closed train, written down by hand from its tables."""
    names = [inertia.name for inertia in model.inertias]
    J = np.diag([inertia.J for inertia in model.inertias])
    C, K = np.diag([inertia.drag for inertia in model.inertias]), np.zeros((len(names),) * 2)
    for element in (*model.couplings, *model.meshes):
        a, b = getattr(element, "radii", (1.0, 1.0))
        w = np.zeros(len(names))
        w[names.index(element.between[0])], w[names.index(element.between[1])] = a, -b
        K += element.stiffness * np.outer(w, w)
        C += element.damping * np.outer(w, w)
    return J, C, K


def response(model: gr.Model, at: str, on: str, omega: NDArray[Any], derivatives: int = 2) -> NDArray[Any]:
    """(F,) response by one dense solve a frequency."""
    names = [inertia.name for inertia in model.inertias]
    J, C, K = matrices(model)
    unit = np.eye(len(names))[names.index(on)]
    motion = [np.linalg.solve(K - w**2 * J + 1j * w * C, unit)[names.index(at)] for w in omega]
    return (1j * omega) ** derivatives * np.array(motion)


def mode_rows(model: gr.Model, numbers: list[int], **keys: Any) -> list[dict[str, Any]]:
    """Frequencies as ``gr.modes`` has them."""
    omega = gr.modes(model, contact_ratio=keys.get("contact_ratio")).frequencies
    return [{"number": n, "omega": float(omega[n - 1]), "relative_error": 1e-3, **keys} for n in numbers]


def shape_row(model: gr.Model, number: int, error: float = 0.01, numbered: bool = True) -> dict[str, Any]:
    """A shape as ``gr.modes`` has it, turned upside down and three times as large."""
    modes = gr.modes(model)
    shape = {n: -3.0 * float(v) for n, v in zip(modes.inertia_names, modes.shapes[:, number - 1], strict=True)}
    return {**({"number": number} if numbered else {}), "shape": shape, "shape_error": error}


def response_row(model: gr.Model, at: str, on: str, omega: NDArray[Any], derivatives: int = 2) -> dict[str, Any]:
    word = ("angle", "velocity", "acceleration")[derivatives]
    value = response(model, at, on, omega, derivatives)
    return {"at": at, "torque_on": on, "quantity": word, "omega": omega, "value": value, "relative_error": 0.02}


def off(model: gr.Model, paths: list[str], seed: int, factor: float = 2.0) -> gr.Model:
    """Return the model with parameters off by up to a factor."""
    random = np.random.default_rng(seed)
    return model.with_({path: value(model, path) * factor ** random.uniform(-1, 1) for path in paths})


def value(model: gr.Model, path: str) -> float:
    kind, name, key = path.split(".")
    parts = {"inertia": model.inertias, "coupling": model.couplings, "mesh": model.meshes}[kind]
    return float(getattr(next(part for part in parts if part.name == name), key))
