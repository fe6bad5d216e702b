"""A model with only numbers that can be scaled: Hooke joints as sines, planet masses added to the carrier's J."""

from __future__ import annotations

from typing import Any

from gearrattle.assembly.elements import inertia_of
from gearrattle.assembly.ripple import load_ripples
from gearrattle.model import Model
from gearrattle.model.components import COMPONENTS


def written_out(model: Model, *, at_speed: bool) -> dict[str, Any]:
    """Return the tables of an equivalent model, in which such components are expressed by plain numbers; tables over
    speed by their values at the model's speed on request.
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
    return tables
