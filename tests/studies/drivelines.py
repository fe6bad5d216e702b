"""A small driveline for studies: two bodies, a gap, quick to simulate."""

from __future__ import annotations

import gearrattle as gr
from gearrattle.results import Run

TOML = """
schema = 1
name = "two bodies"
inertia = [ { name = "engine", J = 0.2, drag = 0.05 }, { name = "wheel", J = 0.02, drag_torque = 0.4 } ]
[[coupling]]
name = "joint"
between = ["engine", "wheel"]
stiffness = 800.0
damping = 0.2
clearance = 0.01
[excitation]
speed = 80.0
[[torque]]
on = "engine"
mean = 0.4
harmonics = [ { order = 1, amplitude = 6.0 } ]
[simulation]
cycles = 12
discard = 4
samples_per_cycle = 32
"""


def model() -> gr.Model:
    """Return it."""
    return gr.loads(TOML, "two.toml")


def loudness(run: Run) -> dict[str, float]:
    """An output of the user's: the largest speed of any inertia."""
    return {"largest speed": float(abs(run.trajectory.velocity).max())}


def silly(run: Run) -> float:
    """Not an output."""
    return 1.0
