"""Drag of every body: the values in the file plus the sum of its drag parts.

The torque of a drag part is a mean torque on both its bodies against their relative rotation. The slope of the torque
over speed is a damping: of the body if the part acts against the housing, and an element (``Model.elements``) if the
part acts between two bodies. Along a sweep the torques are tables over the reference speed, straight lines between
``POINTS`` speeds; slopes are those at the middle of the sweep.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.model import GROUND, Model
from gearrattle.model.drag_points import DragPoint, drag_points, has_drag_parts, points_at
from gearrattle.model.excitation import Sweep
from gearrattle.model.over_speed import AtSpeed

POINTS = 33
"""Number of speeds in a table along a sweep."""


@kept
def drag_torques(model: Model) -> tuple[float, ...]:
    """Mean torque against the rotation of every inertia [N m]; negative where other bodies drive it by drag.

    Along a sweep, or if the file has a table, it is a table over the reference speed.
    """
    parts = part_torques(model)
    return tuple(_sum(inertia.drag_torque, part) for inertia, part in zip(model.inertias, parts, strict=True))


@kept
def part_torques(model: Model) -> tuple[float, ...]:
    """What the drag parts alone have of ``drag_torques`` [N m]."""
    if not has_drag_parts(model):
        return (0.0,) * len(model.inertias)
    sweep = model.excitation.sweep
    if sweep is None or sweep.begin == sweep.end:
        return tuple(torques_of(model, drag_points(model)).tolist())
    speeds = sweep_speeds(sweep)
    torques = np.array([torques_of(model, points_at(model, speed)) for speed in speeds])
    at_start = torques[0 if sweep.begin < sweep.end else -1].tolist()
    return tuple(
        AtSpeed(start, speeds, tuple(column)) if any(column) else 0.0
        for start, column in zip(at_start, torques.T.tolist(), strict=True)
    )


def sweep_speeds(sweep: Sweep) -> tuple[float, ...]:
    """Reference speeds of the tables along a sweep, ascending [rad/s]."""
    low, high = sorted((sweep.begin, sweep.end))
    inner = np.linspace(low, high, POINTS)[1:-1].tolist()
    return (low, *inner, high)


def viscous_drags(model: Model) -> list[float]:
    """Damping of the fluctuation of every inertia against the housing [N m s/rad]."""
    return [inertia.drag + part for inertia, part in zip(model.inertias, part_drags(model), strict=True)]


def part_drags(model: Model) -> list[float]:
    """What the drag parts alone have of ``viscous_drags`` [N m s/rad]."""
    return drags_of(model, drag_points(model))


def drags_of(model: Model, points: Sequence[DragPoint]) -> list[float]:
    """Damping of the fluctuation of every inertia by drag parts that act on the housing [N m s/rad]."""
    index = {inertia.name: i for i, inertia in enumerate(model.inertias)}
    drags = [0.0] * len(model.inertias)
    for point in points:
        if point.on == GROUND:
            drags[index[point.body]] += point.slope
    return drags


def torques_of(model: Model, points: Sequence[DragPoint]) -> NDArray[np.float64]:
    """(n,) torques of drag parts against the rotation of every inertia [N m]."""
    index = {inertia.name: i for i, inertia in enumerate(model.inertias)}
    torques = np.zeros(len(model.inertias))
    for point in points:
        torques[index[point.body]] += point.against
        if point.on != GROUND:
            torques[index[point.on]] -= point.against
    return torques


def _sum(own: float, parts: float) -> float:
    """The sum of two numbers that may be tables over speed; if both are, the sum is a table over the sweep."""
    if not isinstance(parts, AtSpeed):
        return own if not parts else float(own) + parts
    if not isinstance(own, AtSpeed):
        return AtSpeed(own + float(parts), parts.speeds, tuple(own + value for value in parts.values))
    low = parts.speeds[0]
    high = parts.speeds[-1]
    speeds = tuple(sorted({*parts.speeds, *(speed for speed in own.speeds if low < speed < high)}))
    return AtSpeed(float(own) + float(parts), speeds, tuple(own.at(speed) + parts.at(speed) for speed in speeds))
