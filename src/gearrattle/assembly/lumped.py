"""A driveline whose bodies have been grouped, written as a driveline again.

The mathematics says which bodies turn as one and with which ratio, theta_i = rho_i theta_A; this page writes that in
words. Inertias and drags add up with rho^2, torques, their harmonics and drag torques with rho. An element between two
groups keeps its law and sees rho_a theta_A and rho_b theta_B: a mesh's radii take the ratios up; a coupling whose ends
have the same ratio is referred to the bodies kept, its deflection divided by rho, its torque multiplied; a coupling
whose ends now stand on shafts of different speeds becomes a mesh of radii (rho_a, rho_b) x 1 m, which says the same if
its law is linear or a free gap. Other laws cannot be written so: ``must_stay_level`` names them beforehand.

Takes a model and groups; gives a model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gearrattle.assembly.elements import inertia_of
from gearrattle.model import GROUND, Coupling, Element, Mesh, Model, Planetary

Table = dict[str, Any]

_SAME = 1e-9
_RADIUS = 1.0  # [m] of a coupling written as a mesh: its deflection in m is the angle in rad of the shaft it was on


def must_stay_level(model: Model) -> frozenset[int]:
    """Elements, by index, for which no mesh can stand: couplings with stages, a sloped or damped centre, a
    preload, friction."""
    return frozenset(k for k, e in enumerate(model.elements) if not e.along_line and not _meshable(e))


def must_keep_bodies(model: Model) -> frozenset[int]:
    """Elements, by index, whose bodies must stay bodies of their own speed: of planetary sets, and Hooke joints."""
    joined = {coupling.name for coupling in model.couplings if coupling.hooke is not None}
    sets = {element.name for planetary in model.planetaries for element in planetary.elements()}
    return frozenset(k for k, element in enumerate(model.elements) if element.name in joined | sets)


def lumped_model(
    model: Model, owner: Sequence[int], ratio: Sequence[float], removed: Sequence[int], name: str
) -> Model:
    """Write the grouped driveline.

    Args:
        model: the full driveline.
        owner: (n,) index of the body kept of every body's group.
        ratio: (n,) angle of every body over that of the body kept.
        removed: indices of the elements inside groups.
        name: of the new model.
    """
    names = [body.name for body in model.inertias]
    to = {names[i]: (names[o], r) for i, (o, r) in enumerate(zip(owner, ratio, strict=True))}
    to[GROUND] = (GROUND, 1.0)
    kept = sorted(set(owner))
    gone = {model.elements[k].name for k in removed}
    written = [_coupling(coupling, to) for coupling in model.couplings if coupling.name not in gone]
    written += [_mesh(mesh, to) for mesh in model.meshes if mesh.name not in gone]
    written += [_planetary(planetary, to) for planetary in model.planetaries]
    tables = {**model.to_tables(at_speed=True), "name": name}
    tables["inertia"] = [_body(model, i, owner, ratio) for i in kept]
    for kind in ("coupling", "mesh", "planetary"):
        tables.pop(kind, None)
        if rows := [table for is_kind, table in written if is_kind == kind]:
            tables[kind] = rows
    for row in tables.get("torque", []):
        row["on"], factor = to[row["on"]]
        _scale(row, {"mean": factor})
        for harmonic in row.get("harmonics", []):
            harmonic["amplitude"] *= factor
        if signal := row.get("signal"):
            signal["scale"] = factor * signal.get("scale", 1.0)
            _scale(signal, {"static": factor})
    initial = tables.get("simulation", {}).get("initial")
    if isinstance(initial, Mapping):
        tables["simulation"]["initial"] = _initial(model, initial, owner, ratio, kept)
    return Model.from_tables(tables)


def _body(model: Model, kept: int, owner: Sequence[int], ratio: Sequence[float]) -> Table:
    """One body for a group."""
    members = [(model.inertias[i], r) for i, (o, r) in enumerate(zip(owner, ratio, strict=True)) if o == kept]
    inertia = inertia_of(model)
    J = sum(r * r * inertia[i] for i, (o, r) in enumerate(zip(owner, ratio, strict=True)) if o == kept)
    table: Table = {"name": model.inertias[kept].name, "J": float(J)}
    drag, torque = sum(r * r * b.drag for b, r in members), sum(r * b.drag_torque for b, r in members)
    return {**table, **({"drag": drag} if drag else {}), **({"drag_torque": torque} if torque else {})}


def _mesh(mesh: Mesh, to: Mapping[str, tuple[str, float]]) -> tuple[str, Table]:
    """Write a mesh between the bodies kept."""
    (a, rho_a), (b, rho_b) = (to[end] for end in mesh.between)
    radii = [mesh.radii[0] * rho_a, mesh.radii[1] * rho_b]
    return "mesh", {**mesh.to_plain(at_speed=True), "between": [a, b], "radii": radii}


def _planetary(planetary: Planetary, to: Mapping[str, tuple[str, float]]) -> tuple[str, Table]:
    """Write a planetary set between the bodies kept, whose J holds the planets' masses."""
    table = planetary.to_plain(at_speed=True)
    table |= {key: to[table[key]][0] for key in ("sun", "ring", "carrier")}
    table["planets"] = [to[planet][0] for planet in table["planets"]]
    return "planetary", {key: value for key, value in table.items() if key not in ("planet_mass", "centre_distance")}


def _coupling(coupling: Coupling, to: Mapping[str, tuple[str, float]]) -> tuple[str, Table]:
    """Write a coupling between the bodies kept; between shafts of different speeds it becomes a mesh."""
    (a, rho_a), (b, rho_b) = (to[end] for end in coupling.between)
    table = {**coupling.to_plain(at_speed=True), "between": [a, b]}
    if GROUND in (a, b):
        return "coupling", _referred(table, rho_b if a == GROUND else rho_a)
    if abs(rho_a - rho_b) <= _SAME * rho_a:
        return "coupling", _referred(table, rho_a)
    first, piece = coupling.drive_pieces[0], coupling.drive_pieces[-1]
    mesh: Table = {"name": coupling.name, "between": [a, b], "radii": [rho_a * _RADIUS, rho_b * _RADIUS]}
    mesh |= {"stiffness": piece.stiffness / _RADIUS**2, "damping": piece.damping / _RADIUS**2}
    if coupling.kinematic_error:
        mesh["transmission_error"] = table["kinematic_error"]
        _scale_all(mesh["transmission_error"], {"amplitude": _RADIUS})
    if first.until is not None:
        mesh |= {"backlash": 2.0 * first.until * _RADIUS, "contact_damping": coupling.contact_damping}
    return "mesh", mesh


def _meshable(element: Element) -> bool:
    """Whether a law is linear, or a free gap of equal sides."""
    if element.preload or element.rubs or element.drive != element.coast:
        return False
    *inner, _ = element.drive
    return not inner or (len(inner) == 1 and inner[0].stiffness == 0.0 and inner[0].damping == 0.0)


def _referred(table: Table, ratio: float) -> Table:
    """Refer a coupling to a shaft that turns 1/ratio times as fast: delta' = delta / ratio, T' = ratio T."""
    if ratio == 1.0:
        return table
    friction = {"hysteresis": ratio, "stick_stiffness": ratio**2}
    _scale(table, {"stiffness": ratio**2, "damping": ratio**2, "clearance": 1.0 / ratio, "preload": ratio, **friction})
    for key in ("stages", "coast_stages"):
        _scale_all(table.get(key), {"stiffness": ratio**2, "damping": ratio**2, "until": 1.0 / ratio, **friction})
    _scale_all(table.get("kinematic_error"), {"amplitude": 1.0 / ratio})
    return table


def _scale_all(rows: list[Table] | None, factors: Mapping[str, float]) -> None:
    """Multiply what is there in every row."""
    for row in rows or []:
        _scale(row, factors)


def _scale(table: Table, factors: Mapping[str, float]) -> None:
    """Multiply what is there."""
    for key, factor in factors.items():
        if table.get(key) is not None:
            table[key] *= factor


def _initial(
    model: Model, initial: Mapping[str, Any], owner: Sequence[int], ratio: Sequence[float], kept: Sequence[int]
) -> Table:
    """A start state of the bodies kept: means over each group, weighted by inertia, so that momentum is kept."""
    J = inertia_of(model)

    def mean(values: Sequence[float], body: int) -> float:
        members = [i for i, o in enumerate(owner) if o == body]
        turning = sum(J[i] * ratio[i] * values[i] for i in members)
        return float(turning / sum(J[i] * ratio[i] ** 2 for i in members))

    return {key: [mean(initial[key], body) for body in kept] for key in ("angle", "velocity")}
