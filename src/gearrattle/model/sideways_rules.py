"""Rules of sideways motion: a mass needs a bearing, a bearing a mass, and a mesh of such a gear its pressure angle.

A body is held if bearings lead from it to the housing: its own, or one around a body that is held. The sun of a
planetary set with three planets and more is held by its meshes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gearrattle.model.components import COMPONENTS
from gearrattle.model.table import Breach
from gearrattle.model.value_kinds import GROUND

Rows = Sequence[Mapping[str, Any]]
_PLANETS = 3
"""Fewest planets that hold a sun: with two, both lines of action may be parallel."""
_KEYS = ("displacement", "displacement_velocity")
_MASSES = {
    "on": "a bearing holds a body with a mass; without one its axis stays where it is",
    "around": "a bearing lies around a body with a mass; one without stays where it is, as the housing does",
}


def sideways_rules(rows: Mapping[str, Rows]) -> Iterator[Breach]:
    """Yield breaches of rules between masses, bearings and meshes, each a list of rows by its key."""
    heavy = {row.get("name") for row in rows["inertia"] if row.get("mass") is not None}
    names = {row.get("name") for row in rows["inertia"]}
    held = {row.get("on") for row in rows["bearing"]}
    firm = _held_by_the_housing(rows["bearing"])
    firm |= {row.get("sun") for row in rows["planetary"] if _count(row.get("planets")) >= _PLANETS}
    for index, row in enumerate(rows["inertia"]):
        name = row.get("name")
        if row.get("mass") is None or name in firm:
            continue
        rule = "a body with a mass moves sideways, and no bearing holds this one"
        remedy = f'add a [[bearing]] with on = "{name}", or leave mass out'
        if name in held:
            rule = "a body with a mass moves sideways, and no bearings lead from this one to the housing"
            remedy = "add a [[bearing]] without around for one of the bodies around which its bearings lie"
        yield Breach(("inertia", index, "mass"), row["mass"], rule, remedy)
    for index, row in enumerate(rows["bearing"]):
        for key, rule in _MASSES.items():
            body = row.get(key)
            if isinstance(body, str) and body in names and body not in heavy:
                yield Breach(("bearing", index, key), body, rule, 'give the inertia a mass, such as mass = "0.8 kg"')
    for index, row in enumerate(rows["mesh"]):
        yield from _of_mesh(index, row, heavy)
    for index, row in enumerate(rows["planetary"]):
        yield from _of_set(index, row, heavy)


def _held_by_the_housing(bearings: Rows) -> set[Any]:
    """Names of the bodies from which bearings lead to the housing."""
    firm: set[Any] = {GROUND}
    while more := {row.get("on") for row in bearings if row.get("around", GROUND) in firm} - firm:
        firm |= more
    return firm


def _of_mesh(index: int, row: Mapping[str, Any], heavy: set[Any]) -> Iterator[Breach]:
    """Yield breaches of one mesh: of gears that move sideways without an angle, or an angle without such gears."""
    between = row.get("between")
    moving = [end for end in between if end in heavy] if isinstance(between, (list, tuple)) else []
    if moving and row.get("pressure_angle") is None:
        rule = f"{moving[0]} moves sideways: its mesh needs the direction of its line of action"
        yield Breach(("mesh", index, "pressure_angle"), ..., rule, 'such as pressure_angle = "20 deg"')
    for key in ("pressure_angle", "centre_line"):
        if row.get(key) is not None and not moving:
            rule = f"{key} says how a mesh pushes sideways, and none of its gears has a mass"
            yield Breach(("mesh", index, key), row[key], rule, f"give a gear a mass and a bearing, or leave {key} out")


def weight_rules(gravity: object, inertias: Rows) -> Iterator[Breach]:
    """Yield a breach of a weight without a body that has a mass."""
    if gravity is not None and all(row.get("mass") is None for row in inertias):
        rule = "a weight acts on bodies with a mass, and none has one"
        yield Breach(("gravity",), gravity, rule, "give a body a mass and a bearing, or leave [gravity] out")


def _of_set(index: int, row: Mapping[str, Any], heavy: set[Any]) -> Iterator[Breach]:
    """Yield breaches of a planetary set: bodies with a mass but the sun, a sun between planets that turn around it."""
    for body in COMPONENTS["planetary"].bodies(row):
        where = ("planetary", index, *body.location)
        if body.name not in heavy:
            continue
        if body.location != ("sun",):
            rule = "of a planetary set the sun alone may move sideways: the other meshes know rotation alone"
            yield Breach(where, body.name, rule, "leave the mass of this body out")
        elif row.get("carrier") != GROUND:
            rule = (
                "a sun moves sideways between planets that stand still; with a carrier that turns the lines of action "
            )
            rule += "turn too, and forces of Coriolis act"
            yield Breach(where, body.name, rule, 'leave the mass of the sun out, or carrier = "ground"')
        elif row.get("pressure_angle") is None:
            rule = f"{body.name} moves sideways: its meshes need the directions of their lines of action"
            yield Breach(("planetary", index, "pressure_angle"), ..., rule, 'such as pressure_angle = "20 deg"')
    for key in ("pressure_angle", "planet_positions"):
        if row.get(key) is not None and row.get("sun") not in heavy:
            rule = f"{key} says how the meshes push the sun sideways, and it has no mass"
            yield Breach(("planetary", index, key), row[key], rule, f"give the sun a mass, or leave {key} out")


def _count(planets: object) -> int:
    """How many planets there are."""
    return len(planets) if isinstance(planets, (list, tuple)) else 0


def start_rules(simulation: object, inertias: Rows, bearings: Rows) -> Iterator[Breach]:
    """Yield breaches of a start state that has not one displacement for each direction of a body with a mass."""
    initial = simulation.get("initial") if isinstance(simulation, Mapping) else getattr(simulation, "initial", None)
    count = sum(_directions(row.get("name"), bearings) for row in inertias if row.get("mass") is not None)
    for key in _KEYS:
        entries = initial.get(key) if isinstance(initial, Mapping) else getattr(initial, key, None)
        if isinstance(entries, (list, tuple)) and len(entries) != count:
            rule = f"must have one entry for each of the {count} directions: x and y of bodies with a mass"
            yield Breach(("simulation", "initial", key), entries, rule)


def _directions(name: object, bearings: Rows) -> int:
    """In how many directions a body moves: one if its bearings hold the same one alone."""
    only = {str(row.get("direction")) for row in bearings if row.get("on") == name and row.get("direction") is not None}
    is_plane = any(row.get("on") == name and row.get("direction") is None for row in bearings)
    return 1 if len(only) == 1 and not is_plane else 2
