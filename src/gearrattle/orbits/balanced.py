"""Mean torques that balance except for rounding: what is left over is given to the largest of them.

The means of a file have a few digits, so those on a train that turns freely add up to some millionths and not to zero.
Such a train would run away, slowly, and no motion of it would repeat.

Takes a Model; gives one whose free trains are balanced, or the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, free_names, own_mean
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.model import Model
from gearrattle.model.balance import BALANCE

ROUNDING = 1e-6
"""Of the largest torque on a train, its mean or the amplitude of a harmonic: less that is left over is rounding."""


def balanced(model: Model, *leaving: str) -> Model:
    """Return the model with the largest mean of every free train corrected by what rounding leaves of their sum.

    Parameters
    ----------
    leaving
        paths of values that are varied: their torques stay as they are.
    """
    system = assemble(model).system
    motion = relative_coordinates(system).angle_from_reference
    names = free_names(model)
    for train in range(motion.shape[1]):
        turns = np.abs(motion[:, train])
        left = abs(float(motion[:, train] @ system.inputs.mean))
        if not left or turns @ system.drag > 0.0 or left > ROUNDING * _largest(model, turns, names):
            continue
        own = [
            (abs(own_mean(model, i)) * float(turns[names.index(torque.on)]), i)
            for i, torque in enumerate(model.torques)
            if torque.on in names and isinstance(torque.mean, float) and f"torque.{i}.mean" not in leaving
        ]
        size, largest = max(own, default=(0.0, -1))
        if size > 0.0:
            model = model.with_({f"torque.{largest}.mean": BALANCE})
    return model


def _largest(model: Model, turns: NDArray[np.float64], names: Sequence[str]) -> float:
    """The largest mean or amplitude of a torque on a train, at its reference inertia [N m]."""
    sizes = [
        float(turns[names.index(torque.on)]) * size
        for i, torque in enumerate(model.torques)
        if torque.on in names
        for size in (abs(own_mean(model, i)), *(abs(harmonic.amplitude) for harmonic in torque.harmonics))
    ]
    return max(sizes, default=0.0)
