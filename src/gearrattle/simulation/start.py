"""The state in which a run begins, by the words of ``simulation.initial``.

``steady``: the equilibrium under the means, and every free train turns as in its periodic rigid response
(``engine.system.rigid``), along a sweep that of the first speed. A train whose means do not balance, or that a record
drives, has no such response and begins as ``static``: in the equilibrium, with velocities zero.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.statics import named_equilibrium
from gearrattle.analysis.trains import trains
from gearrattle.assembly import Driveline, assemble, carried_along, free_names, free_of, moved, steady
from gearrattle.engine.system.equilibrium import Equilibrium
from gearrattle.engine.system.rigid import is_accelerated, rigid_response
from gearrattle.model import Initial

Array = NDArray[np.float64]
_MOST_NAMED = 3


def start_of(initial: str | Initial | None, driveline: Driveline) -> tuple[Array, Array, tuple[str, ...]]:
    """Return angles and velocities (n,) of the free inertias at t = 0, and what must be noted.

    Raises
    ------
    ModelError
        the model has no static equilibrium.
    """
    system = driveline.system
    model = driveline.model
    if isinstance(initial, Initial):
        free = free_of(model)
        return np.array(initial.angle, dtype=float)[free], np.array(initial.velocity, dtype=float)[free], ()
    if initial == "zero":
        return np.zeros(system.size), np.zeros(system.size), ()
    named, rest = named_equilibrium(driveline)
    angle = rest.angle
    velocity = np.zeros(system.size)
    notes = named.notes
    if model.motions:
        carried_angle, carried_velocity = (carried_along(model, moved(model, np.zeros(1), d)[0]) for d in (0, 1))
        angle = angle + carried_angle
        velocity = carried_velocity
    if initial == "static":
        return angle, velocity, notes
    turned, turning, more = _response(driveline, rest)
    return angle + turned, velocity + turning, (*notes, *more)


def _response(driveline: Driveline, rest: Equilibrium) -> tuple[Array, Array, tuple[str, ...]]:
    """Angles and velocities (n,) of the rigid responses at t = 0, and which trains have none."""
    model = driveline.model
    angle, velocity = rigid_response(assemble(steady(model)).system, rest)
    names = free_names(model)
    recorded = [names.index(torque.on) for torque in model.torques if torque.signal is not None]
    accelerated = is_accelerated(driveline.system)
    without: dict[str, list[str]] = {}
    for bodies, _ in trains(driveline.system):
        has_record = bool(np.isin(bodies, recorded).any())
        if has_record:
            angle[bodies] = 0.0
            velocity[bodies] = 0.0
        if has_record or accelerated[bodies].any():
            reason = "a record of a torque drives it" if has_record else "its mean torques do not balance"
            without.setdefault(reason, []).append(names[bodies[0]])
    return angle, velocity, tuple(_begins_at_rest(reason, first) for reason, first in without.items())


def _begins_at_rest(reason: str, first: list[str]) -> str:
    """Say which trains, by their first bodies, begin with velocities zero, and why."""
    more = f" and of {len(first) - _MOST_NAMED} more" if len(first) > _MOST_NAMED else ""
    train = "train" if len(first) == 1 else "trains"
    begins = "begins" if len(first) == 1 else "begin"
    return (
        f'the {train} of {", ".join(first[:_MOST_NAMED])}{more} {begins} as "static", with velocities zero: {reason}.'
    )
