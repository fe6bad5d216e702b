"""Gearboxes of any size as models: a flywheel, a clutch in stages, a shaft of gears, and loose gears behind backlash.

Figures are those of ``examples/manual_transmission.toml``; a longer shaft has more gears of the same kind, each a
little unlike its neighbours (golden ratio), and every loose gear its own drag. Nothing is drawn at random.
"""

from __future__ import annotations

import gearrattle as gr

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
_HEAD = """
schema = 1
name = "gearbox of {n} inertias and {clearances} clearances"
units = "SI"
[excitation]
speed = "800 rpm"
[simulation]
algorithm = "exact"
initial = "static"
cycles = {cycles}
discard = {discard}
samples_per_cycle = 256
[[torque]]
on = "flywheel"
mean = {mean!r}
harmonics = [
  {{ order = 2, amplitude = "50 N*m" }},
  {{ order = 4, amplitude = "18 N*m", phase = "35 deg" }},
  {{ order = 6, amplitude = "6 N*m", phase = "70 deg" }},
]
[[inertia]]
name = "flywheel"
J = "0.15 kg*m^2"
drag = "0.01 N*m*s/rad"
[[coupling]]
name = "clutch"
between = ["flywheel", "gear0"]
stages = [
  {{ stiffness = "0.5 N*m/deg", until = "4 deg", damping = "0.02 N*m*s/rad" }},
  {{ stiffness = "6 N*m/deg", until = "14 deg", damping = "0.10 N*m*s/rad" }},
  {{ stiffness = "40 N*m/deg", damping = "0.20 N*m*s/rad" }},
]
"""
_INERTIA = """
[[inertia]]
name = "{name}"
J = {inertia!r}
drag = {drag!r}
drag_torque = {drag_torque!r}
"""
_SHAFT = """
[[coupling]]
name = "shaft{i}"
between = ["gear{before}", "gear{i}"]
stiffness = "50 kN*m/rad"
damping = "0.5 N*m*s/rad"
"""
_MESH = """
[[mesh]]
name = "mesh{i}"
between = ["gear{on}", "loose{i}"]
radii = ["36 mm", "{radius} mm"]
stiffness = "3.2e8 N/m"
damping = "800 N*s/m"
backlash = "{backlash} mm"
"""


def unlike(i: int) -> float:
    """A number between 0.75 and 1.25, another for every i."""
    return 0.75 + 0.5 * ((i * GOLDEN) % 1.0)


def gearbox(n: int, clearances: int, cycles: int = 100) -> gr.Model:
    """Return a gearbox of n inertias, with a clutch in stages and ``clearances`` - 1 loose gears.

    Parameters
    ----------
    n
        inertias; at least ``clearances`` + 1.
    clearances
        elements with corners; the first is the clutch.
    cycles
        length of the run, half of it discarded.
    """
    loose = clearances - 1
    on_shaft = n - 1 - loose
    parts, mean = [], 0.0
    for i in range(on_shaft):
        inertia, torque = 1e-3 * unlike(i), 0.4 / on_shaft
        parts.append(_INERTIA.format(name=f"gear{i}", inertia=inertia, drag=1e-3 / on_shaft, drag_torque=torque))
        mean += torque
        if i:
            parts.append(_SHAFT.format(i=i, before=i - 1))
    for i in range(loose):
        inertia = 5e-4 * unlike(i)
        torque = 0.08 * unlike(i + loose)
        radius = 40.0 * unlike(2 * i)
        parts.append(_INERTIA.format(name=f"loose{i}", inertia=inertia, drag=1e-4, drag_torque=torque))
        parts.append(_MESH.format(i=i, on=i * on_shaft // loose, radius=radius, backlash=0.1 * unlike(3 * i)))
        mean += torque * 36.0 / radius
    head = _HEAD.format(n=n, clearances=clearances, cycles=cycles, discard=cycles // 2, mean=mean)
    return gr.loads("\n".join([head, *parts]))
