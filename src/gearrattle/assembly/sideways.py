"""Sideways motion of bodies: a *direction* is one more coordinate, a displacement with the mass of its body.

The system's coordinates are the angles of the free inertias, then all directions. A body with a mass has two, NAME.x
and NAME.y, or one, NAME.u, if all bearings on it hold the same direction alone: it moves along that.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.model import GROUND, Model

Array = NDArray[np.float64]
_ROUNDING = 1e-15


class Direction(NamedTuple):
    """A direction in which a body moves.

    Attributes
    ----------
    body
        index of the inertia.
    x, y
        unit vector.
    """

    body: int
    name: str
    x: float
    y: float


@kept
def directions_of(model: Model) -> tuple[Direction, ...]:
    """Every direction of every body with a mass, in file order."""
    directions = []
    for i, inertia in enumerate(model.inertias):
        if inertia.mass is None:
            continue
        only = {bearing.direction for bearing in model.bearings if bearing.on == inertia.name}
        angle = only.pop() if len(only) == 1 else None
        if angle is None:
            directions += [Direction(i, f"{inertia.name}.x", 1.0, 0.0), Direction(i, f"{inertia.name}.y", 0.0, 1.0)]
        else:
            directions.append(Direction(i, f"{inertia.name}.u", cos(angle), sin(angle)))
    return tuple(directions)


def mass_of(model: Model) -> Array:
    """(p,) mass of the body of every direction [kg]."""
    return np.array([model.inertias[direction.body].mass for direction in directions_of(model)], dtype=float)


def weights(model: Model) -> Array:
    """(p,) weight of the bodies along every direction [N]; zero without gravity."""
    gravity = model.gravity
    if gravity is None:
        return np.zeros(len(directions_of(model)))
    down = np.array([cos(gravity.direction), sin(gravity.direction)])
    down[np.abs(down) < _ROUNDING] = 0.0  # -90 deg is no exact number of radians, and nothing may hold sideways
    along = np.array([[direction.x, direction.y] for direction in directions_of(model)])
    return np.asarray(mass_of(model) * gravity.acceleration * (along @ down))


def beside_directions(model: Model, of_inertias: Array) -> Array:
    """(n + p, ...) loads on all inertias, and none in any direction."""
    none = np.zeros((len(directions_of(model)), *of_inertias.shape[1:]))
    return np.concatenate([of_inertias, none])


def push_rows(model: Model) -> Array:
    """(m, p) W over the directions: how every element sees displacements."""
    rows = np.zeros((len(model.elements), len(directions_of(model))))
    names = [inertia.name for inertia in model.inertias]
    for row, element in zip(rows, model.elements, strict=True):
        for push in element.pushes:
            for j, direction in enumerate(directions_of(model)):
                if names[direction.body] == push.body:
                    row[j] += push.x * direction.x + push.y * direction.y
    return rows


def bearing_rows(model: Model) -> Array:
    """(2 B, m) force of every bearing on the body that it holds, along x and along y, by the forces of the elements."""
    bearings = {f"bearing.{bearing.name}": b for b, bearing in enumerate(model.bearings)}
    rows = np.zeros((2 * len(bearings), len(model.elements)))
    for k, element in enumerate(model.elements):
        if element.path in bearings:
            first = 2 * bearings[element.path]
            held = element.pushes[0]
            rows[first : first + 2, k] = -held.x, -held.y
    return rows


def casing_rows(model: Model) -> Array:
    """(2, m) force on the casing, along x and along y, by the forces of the elements; no bearing around a body adds."""
    in_housing = [bearing.around == GROUND for bearing in model.bearings for _ in "xy"]
    rows = bearing_rows(model)[np.array(in_housing, dtype=bool)]
    return -np.stack([rows[axis::2].sum(axis=0) for axis in (0, 1)])


def bearing_names(model: Model) -> tuple[str, ...]:
    """Names of the forces of all bearings on the bodies that they hold: NAME.x, NAME.y."""
    return tuple(f"{bearing.name}.{axis}" for bearing in model.bearings for axis in "xy")
