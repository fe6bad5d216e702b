"""Models and motions converted from SI to dimensionless units and back.

``KINDS`` states the kind of quantity of every key of the model file that has a unit; phases, ratios, orders and
relative tolerances have none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from gearrattle.assembly.negligible_thresholds import negligible_of
from gearrattle.assembly.written_out import written_out
from gearrattle.engine.system.characteristic import Scales
from gearrattle.engine.system.crossings_in_order import Auxiliaries
from gearrattle.model import Model
from gearrattle.model.components import COMPONENTS
from gearrattle.trajectory import Layout, Sideways, Trajectory

KINDS: dict[str, Any] = {
    "inertia": {
        "J": "inertia",
        "drag": "torsional_damping",
        "drag_torque": "torque",
        "mass": "mass",
        "drag_parts": {"torque": "torque", "slope": "torsional_damping", "relative_speed": "speed"},
    },
    **{kind: component.scaling for kind, component in COMPONENTS.items()},
    "gravity": {"acceleration": "line_acceleration"},
    "excitation": {"speed": "speed", "duration": "time", "sweep": {"from": "speed", "to": "speed", "over": "time"}},
    "torque": {
        "mean": "torque",
        "harmonics": {"amplitude": "torque"},
        "ramps": {"at": "time", "over": "time", "to": "torque"},
        "signal": {"time": "time", "value": "torque", "start": "time", "static": "torque"},
    },
    "motion": {
        "speed": {"time": "time", "value": "velocity", "start": "time"},
        "angle": {"time": "time", "value": "angle", "start": "time"},
        "harmonics": {"amplitude": "angle"},
        "about": "velocity",
    },
    "simulation": {
        "step": "time",
        "initial": {
            "angle": "angle",
            "velocity": "velocity",
            "displacement": "length",
            "displacement_velocity": "line_speed",
        },
    },
    "criteria": {
        "negligible": {
            "impact_energy": "energy",
            "approach_speed": "line_speed",
            "angular_approach_speed": "velocity",
        }
    },
}
"""By table and key: the kind of quantity, a key of ``Scales.units``."""


def dimensionless(model: Model, scales: Scales) -> Model:
    """Return an SI model in multiples of the scales; it states the energy below which impacts are touches."""
    model = model.with_negligible({"impact_energy": negligible_of(model).energy})
    return _converted(model, {kind: 1.0 / unit for kind, unit in scales.units().items()}, "dimensionless")


def dimensional(model: Model, scales: Scales) -> Model:
    """Return a dimensionless model in SI."""
    return _converted(model, scales.units(), "SI")


def _converted(model: Model, factor: Mapping[str, float], units: Literal["SI", "dimensionless"]) -> Model:
    """Convert the tables of a model: a frequency becomes a speed, a table over speed its value at the model's speed."""
    swept = model.excitation.sweep is not None
    tables = {**written_out(model, at_speed=not swept), "units": units}
    if not swept:
        tables["excitation"] = {"speed": model.excitation.omega, **model.excitation.stated("duration")}
    return Model.from_tables({key: _scaled(value, KINDS.get(key, {}), factor) for key, value in tables.items()})


def _scaled(value: Any, kind: Any, factor: Mapping[str, float]) -> Any:
    """Multiply every number that has a kind by its factor; in a table over speed, speeds by the factor for speeds."""
    if isinstance(value, Mapping) and isinstance(kind, str):
        kind = {"speed": "speed", "value": kind}
    if isinstance(value, Mapping):
        inner = kind if isinstance(kind, dict) else {}
        return {key: _scaled(entry, inner.get(key), factor) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_scaled(entry, kind, factor) for entry in value]
    return value * factor[kind] if isinstance(kind, str) and not isinstance(value, str) else value


def restored(trajectory: Trajectory, layout: Layout, scales: Scales) -> Trajectory:
    """Return the motion of ``dimensionless(model, scales)`` in SI, with the layout of the SI model."""
    # units of deflections and forces, by element
    unit = scales.units()
    log = trajectory.events
    cost = trajectory.cost
    is_mesh = layout.is_mesh[layout.clearance]
    deflection = np.where(is_mesh, unit["length"], unit["angle"])
    force = np.where(is_mesh, unit["force"], unit["torque"])
    # energy audit and steps of the algorithm
    energy = trajectory.energy
    if energy is not None:
        begin, end = (stored * unit["energy"] for stored in energy.stored)
        parts = {k: v * unit["energy"] for k, v in vars(energy).items() if k != "stored"}
        energy = replace(energy, **parts, stored=(begin, end))
    short = None if cost.smallest_step is None else cost.smallest_step * unit["time"]
    steps = {k: getattr(cost, k) * unit["time"] for k in ("average_step", "average_trial_step")}
    samples = trajectory.samples_per_cycle
    auxiliaries = trajectory.auxiliaries
    # displacements, and forces of bearings
    sideways = trajectory.sideways
    if sideways is not None:
        sideways = Sideways(
            sideways.displacement * unit["length"],
            sideways.velocity * unit["line_speed"],
            sideways.acceleration * (unit["line_speed"] / unit["time"]),
            sideways.bearing_force * unit["force"],
            sideways.casing_force * unit["force"],
        )
    # samples, events and force integrals in SI
    return replace(
        trajectory,
        layout=layout,
        time=(trajectory.first_cycle * samples + np.arange(trajectory.time.size)) * layout.period / samples,
        angle=trajectory.angle * unit["angle"],
        velocity=trajectory.velocity * unit["velocity"],
        acceleration=trajectory.acceleration * unit["acceleration"],
        deflection=trajectory.deflection * deflection,
        force=trajectory.force * force,
        element_torque=trajectory.element_torque * unit["torque"],
        events=replace(
            log,
            time=log.time * unit["time"],
            velocity=log.velocity * deflection[log.clearance] * unit["speed"],
            force_integral=log.force_integral * force[log.clearance] * unit["time"],
        ),
        final_force_integral=trajectory.final_force_integral * force * unit["time"],
        cost=replace(cost, smallest_step=short, **steps),
        energy=energy,
        sideways=sideways,
        auxiliaries=None if auxiliaries is None else _auxiliaries_in_si(auxiliaries, layout, scales),
        notes=(*trajectory.notes, "simulated without dimensions: quantities in its notes are dimensionless."),
    )


def _auxiliaries_in_si(auxiliaries: Auxiliaries, layout: Layout, scales: Scales) -> Auxiliaries:
    """Auxiliaries of a dimensionless motion in SI; every name begins with that of its element."""
    unit = scales.units()
    elements = dict(zip(layout.element_names, layout.is_mesh.tolist(), strict=True))
    on_mesh = np.array([elements[name.split(".")[0]] for name in layout.auxiliary_names])
    passages = auxiliaries.passages
    count = len(layout.clearance)
    velocity = passages.velocity.copy()
    own = passages.watch < count
    deflection = np.where(layout.is_mesh[layout.clearance], unit["length"], unit["angle"])
    velocity[own] *= deflection[passages.watch[own]] * unit["speed"]
    return replace(
        auxiliaries,
        force=auxiliaries.force * np.where(on_mesh, unit["force"], unit["torque"]),
        memory=auxiliaries.memory * np.where(on_mesh, unit["length"], unit["angle"]),
        passages=replace(
            passages,
            time=passages.time * unit["time"],
            velocity=velocity,
            memory=passages.memory * unit["angle"],
        ),
    )
