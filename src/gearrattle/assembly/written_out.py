"""An equivalent model with only numbers that can be scaled: Hooke joints as sines, planet masses in the carrier's J."""

from __future__ import annotations

from typing import Any

from gearrattle.assembly.drag_torques import sweep_speeds
from gearrattle.assembly.elements import inertia_of
from gearrattle.assembly.ripple import load_ripples
from gearrattle.model import Model
from gearrattle.model.components import COMPONENTS
from gearrattle.model.drag_points import DragPoint, drag_points, points_at


def written_out(model: Model, *, at_speed: bool) -> dict[str, Any]:
    """Return the tables of an equivalent model, in which such components are expressed by plain numbers.

    With ``at_speed``, tables over speed are replaced by their values at the model's speed.
    """
    tables = model.to_tables(at_speed=at_speed)
    for row, inertia in zip(tables["inertia"], inertia_of(model).tolist(), strict=True):
        row["J"] = inertia
    for kind in COMPONENTS:
        if rows := tables.get(kind):
            tables[kind] = [model.components[f"{kind}.{row['name']}"].written_out(row) for row in rows]
    ripples = [
        {"on": body, "harmonics": [sine.to_plain() for sine in sines]} for body, sines in load_ripples(model).items()
    ]
    if ripples:
        tables["torque"] = [*tables.get("torque", ()), *ripples]
    tables.pop("oil", None)
    if model.gravity is not None:
        tables["gravity"]["acceleration"] = model.gravity.acceleration
    for row, inertia in zip(tables["inertia"], model.inertias, strict=True):
        if inertia.drag_parts:
            row["drag_parts"] = [
                _constant(model, point, at_speed=at_speed) for point in drag_points(model) if point.body == inertia.name
            ]
    return tables


def _constant(model: Model, point: DragPoint, *, at_speed: bool) -> dict[str, Any]:
    """Return a drag part as numbers; along a sweep its torque is a table over the reference speed."""
    torque: Any = point.torque
    sweep = model.excitation.sweep
    if sweep is not None and sweep.begin != sweep.end and not at_speed:
        speeds = sweep_speeds(sweep)
        torques = [next(p.torque for p in points_at(model, speed) if p.path == point.path) for speed in speeds]
        torque = {"speed": list(speeds), "value": torques}
    kinematic = {} if point.part.relative_speed is None else {"relative_speed": point.part.relative_speed}
    return {"kind": "constant", "on": point.on, "torque": torque, "slope": point.slope, **kinematic}
