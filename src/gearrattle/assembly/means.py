"""Mean torques of a model, as used by the static start and all linear analyses.

All other modules take means from here, because the file may state "balance" instead of a number
(``assembly.mean_balance``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.drag_torques import drag_torques
from gearrattle.assembly.mean_balance import balances_of, check_freedoms
from gearrattle.assembly.records import mean
from gearrattle.assembly.sideways import weights
from gearrattle.derived_values import kept
from gearrattle.model import Model, Torque
from gearrattle.model.over_speed import AtSpeed


def own_mean(model: Model, index: int) -> float:
    """The mean of a torque by its index, without the mean of its record [N m]; it may be a table over speed."""
    own = model.torques[index].mean
    return balancing_means(model)[index] if isinstance(own, str) else own


def mean_torque(model: Model, index: int) -> float:
    """The mean of a torque by its index, the mean of its record included [N m]."""
    return own_mean(model, index) + _recorded(model.torques[index])


def mean_torques(model: Model) -> NDArray[np.float64]:
    """(n,) mean torque on every inertia minus its drag torque [N m]."""
    means = np.array(_loads(model, None))
    for balance in balances_of(model):
        means[balance.body] = balance.total(means.tolist())
    return means


def mean_loads(model: Model) -> NDArray[np.float64]:
    """(n + p,) mean torque on every inertia [N m], then the weight along every direction [N]."""
    return np.concatenate([mean_torques(model), weights(model)])


@kept
def balancing_means(model: Model) -> dict[int, float]:
    """The mean torques that the file gives as "balance" [N m], by the index of the torque.

    Along a sweep a mean is a table over speed. ModelError for a train that cannot be balanced by one torque.
    """
    means: dict[int, float] = {}
    for balance in balances_of(model):
        loads = _loads(model, None)
        check_freedoms(model, balance, loads)
        own = balance.total(loads) - loads[balance.body]
        if speeds := _table_speeds(model):
            values = []
            for speed in speeds:
                loads = _loads(model, speed)
                check_freedoms(model, balance, loads)
                values.append(balance.total(loads) - loads[balance.body])
            own = AtSpeed(own, speeds, tuple(values))
        means[balance.torque] = own
    return means


def _recorded(torque: Torque) -> float:
    """The mean of a torque's record [N m]; 0 without one."""
    signal = torque.signal
    if signal is None:
        return 0.0
    return mean(signal) if signal.static is None else signal.static


def _loads(model: Model, speed: float | None) -> list[float]:
    """Sum of drag torques and means on every inertia at a speed, without the means given as "balance" [N m].

    None is the speed of the model.
    """
    names = [inertia.name for inertia in model.inertias]
    loads = [-_at(torque, speed) for torque in drag_torques(model)]
    for torque in model.torques:
        own = 0.0 if isinstance(torque.mean, str) else _at(torque.mean, speed)
        loads[names.index(torque.on)] += own + _recorded(torque)
    return loads


def _at(number: float, speed: float | None) -> float:
    """Value at a speed of a number, which may have a table over speed."""
    return number.at(speed) if isinstance(number, AtSpeed) and speed is not None else float(number)


def _table_speeds(model: Model) -> tuple[float, ...]:
    """Speeds for the table of a balancing mean along a sweep, ascending [rad/s]: its ends and, between them, the speeds
    at which a mean or a drag torque changes its slope. Empty without a sweep or without tables.
    """
    sweep = model.excitation.sweep
    numbers = [*drag_torques(model), *(torque.mean for torque in model.torques)]
    tables = [number.speeds for number in numbers if isinstance(number, AtSpeed)]
    if sweep is None or sweep.begin == sweep.end or not tables:
        return ()
    ends = sorted((sweep.begin, sweep.end))
    between = {speed for speeds in tables for speed in speeds if ends[0] < speed < ends[1]}
    return (ends[0], *sorted(between), ends[1])
