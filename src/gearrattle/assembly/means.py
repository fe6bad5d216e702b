"""Mean torques: what the static start and everything linear takes the torques for.

Takes a Model; gives arrays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.records import mean
from gearrattle.model import Model, Torque


def mean_torque(torque: Torque) -> float:
    """The mean of one torque, of its record as well [N m]."""
    signal = torque.signal
    if signal is None:
        return torque.mean
    return torque.mean + (mean(signal) if signal.static is None else signal.static)


def mean_torques(model: Model) -> NDArray[np.float64]:
    """(n,) mean torque on every inertia, less its drag torque [N m]."""
    names = [inertia.name for inertia in model.inertias]
    means = np.array([-inertia.drag_torque for inertia in model.inertias])
    for torque in model.torques:
        means[names.index(torque.on)] += mean_torque(torque)
    return means
