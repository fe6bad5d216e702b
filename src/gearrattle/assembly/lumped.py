"""A lumped driveline: one body for every group of bodies that turn as one.

The reduction determines which bodies turn as one and with which ratio, theta_i = rho_i theta_A; this module writes the
model. Inertias and drags add up with rho^2; torques, their harmonics and drag torques add up with rho. An element
between two groups keeps its law, with the angles rho_a theta_A and rho_b theta_B at its ends:

- the radii of a mesh are multiplied by the ratios;
- a coupling whose ends have the same ratio is referred to the bodies kept: its deflection divided by rho, its torque
  multiplied by rho;
- a coupling whose ends have different ratios becomes a mesh of radii (rho_a, rho_b) x 1 m, which is equivalent if its
  law is linear or a free gap. For other laws this is not possible; ``must_stay_level`` lists these couplings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gearrattle.assembly.drag_torques import part_drags, torques_of
from gearrattle.assembly.elements import inertia_of
from gearrattle.model import GROUND, Element, Model
from gearrattle.model.balance import BALANCE
from gearrattle.model.components import COMPONENTS
from gearrattle.model.components.component import multiply
from gearrattle.model.drag_points import drag_points

Table = dict[str, Any]


def must_stay_level(model: Model) -> frozenset[int]:
    """Indices of couplings that no mesh can replace: with stages, slope or damping in the centre, preload, friction."""
    return frozenset(k for k, e in enumerate(model.elements) if not e.along_line and not _meshable(e))


def must_keep_bodies(model: Model) -> frozenset[int]:
    """Indices of elements whose bodies must keep their own speed: elements of planetary sets, Hooke joints, drag."""
    keeping = {path for path, component in model.components.items() if component.keeps_bodies}
    return frozenset(
        k for k, element in enumerate(model.elements) if element.path in keeping or element.path not in model.components
    )


def moving_sideways(model: Model) -> frozenset[int]:
    """Indices of elements at a body with a mass: its displacements stay, and so does the body."""
    heavy = {body.name for body in model.inertias if body.mass is not None}
    ends = ({body for body, _ in element.arms} | {push.body for push in element.pushes} for element in model.elements)
    return frozenset(k for k, bodies in enumerate(ends) if bodies & heavy)


def lumped_model(
    model: Model, owner: Sequence[int], ratio: Sequence[float], removed: Sequence[int], name: str
) -> Model:
    """Write the lumped driveline.

    Parameters
    ----------
    owner
        (n,) for every body, the index of the body that is kept for its group.
    ratio
        (n,) angle of every body over the angle of the body kept.
    removed
        indices of the elements inside groups.
    """
    # body kept and ratio of every body, by name
    names = [body.name for body in model.inertias]
    to = {names[i]: (names[o], r) for i, (o, r) in enumerate(zip(owner, ratio, strict=True))}
    to[GROUND] = (GROUND, 1.0)
    # bodies kept, and components between their groups
    kept = sorted(set(owner))
    gone = {model.elements[k].name for k in removed}
    written = [c.between_groups(to) for c in model.components.values() if c.name not in gone]
    tables = {**model.to_tables(at_speed=True), "name": name}
    tables.pop("oil", None)
    tables["inertia"] = [_body(model, i, owner, ratio) for i in kept]
    for kind in COMPONENTS:
        tables.pop(kind, None)
        if rows := [table for is_kind, table in written if is_kind == kind]:
            tables[kind] = rows
    # torques and their means, harmonics, ramps and records times the ratio
    for row in tables.get("torque", []):
        row["on"], factor = to[row["on"]]
        if row.get("mean") != BALANCE:
            multiply(row, {"mean": factor})
        for harmonic in row.get("harmonics", []):
            harmonic["amplitude"] *= factor
        for ramp in row.get("ramps", []):
            ramp["to"] *= factor
        if signal := row.get("signal"):
            signal["scale"] = factor * signal.get("scale", 1.0)
            multiply(signal, {"static": factor})
    # initial state of the bodies kept
    initial = tables.get("simulation", {}).get("initial")
    if isinstance(initial, Mapping):
        tables["simulation"]["initial"] = _initial(model, initial, owner, ratio, kept)
    return Model.from_tables(tables)


def _body(model: Model, kept: int, owner: Sequence[int], ratio: Sequence[float]) -> Table:
    """Table of the body that replaces a group."""
    members = [(model.inertias[i], r) for i, (o, r) in enumerate(zip(owner, ratio, strict=True)) if o == kept]
    inertia = inertia_of(model)
    J = sum(r * r * inertia[i] for i, (o, r) in enumerate(zip(owner, ratio, strict=True)) if o == kept)
    table: Table = {"name": model.inertias[kept].name, "J": float(J), **model.inertias[kept].stated("mass")}
    drag = sum(
        r * r * (b.drag + d) for (b, r), d in zip(members, _members(part_drags(model), kept, owner), strict=True)
    )
    torque = sum(
        r * (b.drag_torque + t) for (b, r), t in zip(members, _members(_on_housing(model), kept, owner), strict=True)
    )
    parts = [*_negative_drag(model, float(drag), float(torque)), *_drag_between(model, kept, owner, ratio)]
    positive = {"drag": max(drag, 0.0), "drag_torque": max(torque, 0.0), "drag_parts": parts}
    return table | {key: value for key, value in positive.items() if value}


def _negative_drag(model: Model, drag: float, torque: float) -> list[Table]:
    """What no ``drag`` and no ``drag_torque`` can be: a slope that falls, a torque that drives, as a drag part."""
    if drag >= 0.0 and torque >= 0.0:
        return []
    numbers = {"torque": max(-torque, 0.0), "slope": min(drag, 0.0)}
    return [{"kind": "constant", "relative_speed": math.copysign(model.excitation.omega, torque), **numbers}]


def _members(values: Sequence[float], kept: int, owner: Sequence[int]) -> list[float]:
    """The values of the bodies of a group."""
    return [value for value, o in zip(values, owner, strict=True) if o == kept]


def _on_housing(model: Model) -> list[float]:
    """Torques of the drag parts on the housing against the rotation of every inertia [N m]."""
    torques: list[float] = torques_of(model, [point for point in drag_points(model) if point.on == GROUND]).tolist()
    return torques


def _drag_between(model: Model, kept: int, owner: Sequence[int], ratio: Sequence[float]) -> list[Table]:
    """Drag parts between a group and other groups; within a group no body turns relative to another."""
    index = {body.name: i for i, body in enumerate(model.inertias)}
    parts = []
    for point in drag_points(model):
        body = index[point.body]
        if point.on == GROUND or owner[body] != kept or owner[index[point.on]] == kept:
            continue
        turned = ratio[body]
        numbers = {"torque": turned * point.torque, "slope": turned**2 * point.slope}
        on = model.inertias[owner[index[point.on]]].name
        parts.append({"kind": "constant", "on": on, "relative_speed": point.speed / turned, **numbers})
    return parts


def _meshable(element: Element) -> bool:
    """Whether the law of an element is linear, or a free gap with equal sides."""
    if element.preload or element.rubs or element.drive != element.coast:
        return False
    *inner, _ = element.drive
    return not inner or (len(inner) == 1 and inner[0].stiffness == 0.0 and inner[0].damping == 0.0)


def _initial(
    model: Model, initial: Mapping[str, Any], owner: Sequence[int], ratio: Sequence[float], kept: Sequence[int]
) -> Table:
    """Initial state of the bodies kept: means over every group weighted by inertia, so that momentum is conserved.

    Bodies that are displaced are groups of their own.
    """
    J = inertia_of(model)

    def mean(values: Sequence[float], body: int) -> float:
        members = [i for i, o in enumerate(owner) if o == body]
        turning = sum(J[i] * ratio[i] * values[i] for i in members)
        return float(turning / sum(J[i] * ratio[i] ** 2 for i in members))

    return {**initial, **{key: [mean(initial[key], body) for body in kept] for key in ("angle", "velocity")}}
