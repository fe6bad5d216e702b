"""Ports of a driveline in a co-simulation: inertias that take a torque or a speed from outside, values that may change.

A body whose speed comes from outside is no degree of freedom, as a body of prescribed motion: it gets a motion of
amplitude zero, to which the co-simulation adds the angle, and the torques of the model on it are left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import coordinate_names, period_of, prescribed_indices, rows_of, unsteady_problems
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean
from gearrattle.wording import listed

Array = NDArray[np.float64]


class Ports(NamedTuple):
    """What comes from outside.

    Attributes
    ----------
    torques, speeds
        names of inertias.
    paths
        of values of the model that may change.
    """

    torques: tuple[str, ...] = ()
    speeds: tuple[str, ...] = ()
    paths: tuple[str, ...] = ()

    @property
    def channels(self) -> int:
        """Number of torques and speeds."""
        return len(self.torques) + len(self.speeds)


def check_ports(model: Model, ports: Ports) -> None:
    """Refuse a model with inputs over time, and ports that it does not have; the ModelError names every one."""
    remedy = "leave it out here, and let the host give it as a torque or a speed"
    problems = unsteady_problems(model, "in a co-simulation, what changes over time comes from the host", remedy)
    problems += _wrong_bodies(model, ports)
    problems += _wrong_paths(model, ports)
    if problems:
        raise ModelError(problems)


def _wrong_bodies(model: Model, ports: Ports) -> Iterator[Problem]:
    names = [inertia.name for inertia in model.inertias]
    moved = [motion.on for motion in model.motions]
    seen: set[str] = set()
    for argument, bodies in (("torques", ports.torques), ("speeds", ports.speeds)):
        for name in bodies:
            if name not in names:
                rule = f"no inertia has this name; there are {listed(names)}"
                yield Problem(argument, f'"{name}"', rule, did_you_mean(name, names))
            elif name in moved:
                yield Problem(argument, f'"{name}"', "its motion is prescribed by the model", "remove its [[motion]]")
            elif name in seen:
                yield Problem(argument, f'"{name}"', "takes a torque or a speed, once", "name it once")
            seen.add(name)
    if names and len(ports.speeds) + len(moved) >= len(names):
        yield Problem("speeds", listed(list(ports.speeds)), "at least one inertia must be free to move", "name fewer")


def _wrong_paths(model: Model, ports: Ports) -> Iterator[Problem]:
    for path in ports.paths:
        value = model[path]
        if isinstance(value, bool | str) or not isinstance(value, float | int):
            yield Problem("parameters", f'"{path}"', "must be the path of a number", "gr.Model.paths lists all paths")
        elif path.startswith(("simulation.", "schema", "criteria.")):
            yield Problem("parameters", f'"{path}"', "is a setting and no value of the driveline", "leave it out")


def with_turned(model: Model, speeds: tuple[str, ...]) -> Model:
    """Return the model in which bodies turn as prescribed, by nothing yet; without speeds the model itself."""
    if not speeds:
        return model
    tables: dict[str, Any] = dict(model.to_tables())
    orders = period_of(model).orders
    still = {"order": float(orders[orders > 0.0][0]) if (orders > 0.0).any() else 1.0, "amplitude": 0.0}
    tables["torque"] = [row for row in tables.get("torque", ()) if row["on"] not in speeds]
    tables["motion"] = [*tables.get("motion", ()), *({"on": name, "harmonics": [still]} for name in speeds)]
    return Model.from_tables(tables)


def channels_of(model: Model, ports: Ports) -> tuple[Array, Array]:
    """Return (N, C) torques on the coordinates and (m, C) errors of the elements by a unit of every channel.

    model: from ``with_turned``, its last motions those of ``ports.speeds``.
    """
    names = coordinate_names(model)
    torque = np.zeros((len(names), ports.channels))
    error = np.zeros((len(model.elements), ports.channels))
    for c, name in enumerate(ports.torques):
        torque[names.index(name), c] = 1.0
    for c, body in enumerate(prescribed_indices(model)[len(model.motions) - len(ports.speeds) :].tolist()):
        error[:, len(ports.torques) + c] = -rows_of(model)[:, body]
    return torque, error
