"""Drivelines whose quiet is proven, and the linear motion of each, by the tools of the screening."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

import gearrattle as gr
from gearrattle.analysis.linear.response import steady_angles, turning_rates
from gearrattle.analysis.statics import named_equilibrium
from gearrattle.assembly import assemble
from gearrattle.studies.quiet import QuietProof
from gearrattle.studies.screening_models import Linear, at_rest, is_inside, reach_of

Array = NDArray[np.float64]

GEARBOX = """
schema = 1
name = "gearbox in neutral"
inertia = [
  { name = "flywheel", J = 0.14 },
  { name = "hub", J = 5e-4 },
  { name = "shaft", J = 2.5e-3, drag_torque = 1.5 },
  { name = "second", J = 1.05e-3, drag_torque = 0.9 },
  { name = "fifth", J = 2.2e-4, drag_torque = 0.35 },
]

[[torque]]
on = "flywheel"
mean = 2.366
harmonics = [{ order = 2, amplitude = 60.0 }, { order = 4, amplitude = 15.0 }]

[[coupling]]
name = "damper"
between = ["flywheel", "hub"]
stages = [{ stiffness = 70.0, until = 0.09 }, { stiffness = 450.0 }]

[[coupling]]
name = "spline"
between = ["hub", "shaft"]
stiffness = 1e4
damping = 0.1
clearance = 3.5e-3

[[mesh]]
name = "m2"
between = ["shaft", "second"]
radii = [0.0222, 0.0455]
stiffness = 3.2e8
damping = 800.0
backlash = 1.2e-4
transmission_error = [{ order = 2, amplitude = 2e-7, phase = 0.7 }]

[[mesh]]
name = "m5"
between = ["shaft", "fifth"]
radii = [0.0372, 0.0305]
stiffness = 3.2e8
damping = 800.0
backlash = 7e-5

[excitation]
speed = "780 rpm"

[simulation]
cycles = 2
discard = 0
"""


def gearbox(**changes: Any) -> gr.Model:
    return gr.loads(GEARBOX).with_({path.replace("__", "."): value for path, value in changes.items()})


def drag(low: float, high: float) -> dict[str, tuple[float, float]]:
    """Ranges of all drags by factors, the mean with them."""
    values = {"inertia.shaft.drag_torque": 1.5, "inertia.second.drag_torque": 0.9, "inertia.fifth.drag_torque": 0.35}
    mean = 1.5 + 0.9 * 0.0222 / 0.0455 + 0.35 * 0.0372 / 0.0305
    return {path: (low * value, high * value) for path, value in {**values, "torque.0.mean": mean}.items()}


BOX: dict[str, Any] = {
    "drag": drag(0.3, 1.3),
    "excitation.speed": ("740 rpm", "900 rpm"),
    "mesh.m5.stiffness": (2.5e8, 4e8),
}
"""Part of it is proven, part refuted, and part leaves the first stage of the damper."""


def points_of(proof: QuietProof, status: int, count: int, seed: int) -> list[dict[str, float]]:
    """Random values by path, uniform over the volume of all boxes of a status."""
    chosen = [part for part in proof.parts if part.status == status]
    shares = np.array([part.share for part in chosen])
    random = np.random.default_rng(seed)
    points = []
    for index in random.choice(len(chosen), count, p=shares / shares.sum()):
        part = chosen[index]
        at = part.low + random.random(part.low.size) * (part.high - part.low)
        values: dict[str, float] = {}
        for edge, share in zip(proof.edges, (0.5 + 0.5 * at).tolist(), strict=True):
            values |= edge.at(share)
        points.append(values)
    return points


def stuck(model: gr.Model) -> Linear:
    """The linear driveline in its state of rest, with friction that sticks."""
    driveline = assemble(model)
    system = driveline.system
    rest = named_equilibrium(driveline)[1]
    linear = at_rest(system, rest)
    for part in system.auxiliaries:
        if part.kind == "slider" and part.follow[rest.pieces[part.element], 0] == 0:
            linear.stiffness[part.element] += part.memory[0]
    return linear


def stays(model: gr.Model) -> bool:
    """Whether the linear motion stays in the pieces of rest, by samples of a period."""
    driveline = assemble(model)
    rest = named_equilibrium(driveline)[1]
    return is_inside(driveline.system, rest, reach_of(driveline.system, stuck(model)))


def on_quiet_motion(model: gr.Model, changes: Mapping[str, float]) -> gr.Model:
    """The model with these values, beginning on its quiet motion."""
    changed = model.with_(dict(changes))
    driveline = assemble(changed)
    system = driveline.system
    linear = stuck(changed)
    rest = named_equilibrium(driveline)[1]
    amplitudes = steady_angles(system, linear.stiffness, linear.damping)
    angle = rest.angle + amplitudes.real.sum(axis=1)
    velocity = (1j * turning_rates(system) * amplitudes).real.sum(axis=1)
    return changed.with_({"simulation.initial": {"angle": angle.tolist(), "velocity": velocity.tolist()}})
