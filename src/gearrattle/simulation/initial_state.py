"""Initial state of a run, as ``simulation.initial`` names it.

``steady``: the equilibrium under the mean torques, with every free train turning as in its periodic rigid response
(``engine.system.rigid_motion``); in a sweep of the speed, as at the first speed. A train whose mean torques do not
balance, or that a record drives, has no such response and begins as ``static``: in the equilibrium, with velocities
zero.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.statics import named_equilibrium
from gearrattle.assembly import (
    Driveline,
    assemble,
    carried_along,
    coordinates_at_start,
    free_names,
    prescribed_angles,
    steady,
)
from gearrattle.derived_values import kept
from gearrattle.engine.system.free_trains import trains
from gearrattle.engine.system.rigid_motion import is_accelerated, rigid_response
from gearrattle.model import Initial

Array = NDArray[np.float64]
_MOST_NAMED = 3  # most trains that a note names


def start_of(initial: str | Initial | None, driveline: Driveline) -> tuple[Array, Array, tuple[str, ...]]:
    """Return coordinates and rates (N,) of the system at t = 0, with notes; ModelError without a static
    equilibrium.
    """
    system = driveline.system
    model = driveline.model
    if isinstance(initial, Initial):
        return (*coordinates_at_start(model, initial), ())
    if initial == "zero":
        return np.zeros(system.size), np.zeros(system.size), ()
    angle, velocity, notes = _static(driveline) if initial == "static" else _steady(driveline)
    return angle.copy(), velocity.copy(), notes


@kept
def _static(driveline: Driveline) -> tuple[Array, Array, tuple[str, ...]]:
    """Angles, velocities and notes of the static start: velocities zero, except for prescribed motions."""
    model = driveline.model
    named, rest = named_equilibrium(driveline)
    if not model.motions:
        return rest.angle, np.zeros(driveline.system.size), named.notes
    angle, velocity = (carried_along(model, prescribed_angles(model, np.zeros(1), d)[0]) for d in (0, 1))
    return rest.angle + angle, velocity, named.notes


@kept
def _steady(driveline: Driveline) -> tuple[Array, Array, tuple[str, ...]]:
    """Angles, velocities and notes of the steady start; the notes name the trains without a rigid response."""
    model = driveline.model
    at_rest, at_once, notes = _static(driveline)
    _, rest = named_equilibrium(driveline)
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
    more = tuple(_begins_at_rest(reason, first) for reason, first in without.items())
    return at_rest + angle, at_once + velocity, (*notes, *more)


def _begins_at_rest(reason: str, first: list[str]) -> str:
    """Note on trains, named by their first bodies, that begin with velocities zero, and the reason."""
    more = f" and of {len(first) - _MOST_NAMED} more" if len(first) > _MOST_NAMED else ""
    train = "train" if len(first) == 1 else "trains"
    begins = "begins" if len(first) == 1 else "begin"
    return (
        f'the {train} of {", ".join(first[:_MOST_NAMED])}{more} {begins} as "static", with velocities zero: {reason}.'
    )
