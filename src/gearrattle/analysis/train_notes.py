"""Notes on the trains of a driveline: the unbalanced mean torque on each, and bodies that no element holds.

A free train turns as one: its bodies by phi_i q, with phi = 1 at the body named. The mean torques leave there the
resultant Q = sum_i phi_i T_i, and the train accelerates by q'' = Q / sum_i J_i phi_i^2. With a_i = phi_i q'' that is

    Q = sum_i J_i a_i^2 / q'',

so the accelerations of the equilibrium tell it. A train that turns in more than one way, such as a planetary set
without a fixed body, has no such single torque.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.equilibrium import PositionAtRest
from gearrattle.engine.system.free_trains import trains
from gearrattle.engine.system.piecewise import PiecewiseSystem

_MOST_NAMED = 3


def train_notes(system: PiecewiseSystem, names: Sequence[str], rest: PositionAtRest, *, si: bool) -> list[str]:
    """Return notes on trains that accelerate, with the unbalanced torque, and on bodies that no element holds.

    ``si`` says whether the numbers are in SI; otherwise they have no units.
    """
    notes = []
    said = list(_accelerated(system, names, rest.acceleration, si=si))
    if said:
        more = f"; so do {len(said) - _MOST_NAMED} more" if len(said) > _MOST_NAMED else ""
        notes.append(
            f"the mean torques do not balance: {'; '.join(said[:_MOST_NAMED])}{more}. "
            f"The equilibrium is that of the accelerated train{'s' if len(said) > 1 else ''}.{_remedy(system, rest)}"
        )
    if len(system.rows):
        alone = np.flatnonzero(~np.any(system.rows != 0.0, axis=0)).tolist()
        notes += [f"{names[i]}: no element connects it to another body." for i in alone]
    return notes


def _remedy(system: PiecewiseSystem, rest: PositionAtRest) -> str:
    """Advice that balances a train that turns in one way, if one accelerates."""
    is_simple = any(train.freedoms == 1 and rest.acceleration[train.bodies].any() for train in trains(system))
    return ' A torque on a train balances it with mean = "balance".' if is_simple else ""


def _accelerated(
    system: PiecewiseSystem, names: Sequence[str], acceleration: NDArray[np.float64], *, si: bool
) -> Iterator[str]:
    """Yield for every accelerating train the torque left over at its first body, and its acceleration."""
    torque, rate = (" N m", " rad/s^2") if si else ("", "")
    for train in trains(system):
        moving = train.bodies[acceleration[train.bodies] != 0.0]
        if not moving.size:
            continue
        a = acceleration[moving]
        first = names[int(moving[0])]
        if train.freedoms > 1:
            yield f"the train with {first} accelerates uniformly by up to {a[np.argmax(np.abs(a))]:.6g}{rate}"
            continue
        left = float(np.sum(system.inertia[moving] * a**2) / a[0])
        are = "left over" if left > 0.0 else "lacking"
        moves = f"which accelerates uniformly by {a[0]:.6g}{rate} with its train"
        yield f"{abs(left):.4g}{torque} are {are} at {first}, {moves}"
