"""Auxiliaries and clock of meshes whose stiffness alternates with the tooth pairs in contact.

In a cycle of the mesh, psi = order phi + phase, all pairs are in contact during the first ``share`` of a turn of psi,
and one pair less during the remainder. So the stiffness changes at every whole turn, and ``share`` of a turn later.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.friction_sliders import WORDS, Named
from gearrattle.assembly.input_signals import end_of_run
from gearrattle.assembly.period import CommonPeriod, period_of
from gearrattle.assembly.sines import ramp_of
from gearrattle.engine.system.auxiliary import alternation
from gearrattle.engine.system.clock import Clock
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.run_up_phase import Ramp
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Alternation, Element, Model

Array = NDArray[np.float64]

_WHOLE = 1e-9  # cycles; a number of cycles this close to a whole number is whole
_MOST = 1_000_000
"""Largest number of mesh cycles, in a common period or along a sweep, whose changes are listed."""


def alternating(index: int, mesh: Element, table: Alternation, law: PiecewiseLaw) -> Named:
    """Auxiliary for the part of a mesh's stiffness that is missing while one tooth pair less is in contact."""
    begins = turn_at_start(table) >= table.share
    made = alternation(index, law, 1.0 - table.fewer, begins_lacking=begins)
    words = WORDS[:-3:-1] if begins else WORDS[-2:]
    return Named(made, pairs_name(mesh), tuple(word for word in words for _ in range(law.pieces)))


def pairs_name(mesh: Element) -> str:
    """Name of the auxiliary of a mesh with alternating stiffness."""
    return f"{mesh.name}.pairs"


def turn_at_start(table: Alternation) -> float:
    """Fraction of a mesh cycle that has passed at t = 0."""
    return float(table.phase / (2.0 * pi) % 1.0 % 1.0)  # the first remainder may be 1, by rounding


def clock_of(model: Model, of: Sequence[tuple[int, Element, Alternation]]) -> Clock | None:
    """Return the times at which the stiffness of meshes alternates, over one common period or along a sweep.

    ModelError for an order without a whole number of cycles in the period, or for too many changes.
    """
    if not of:
        return None
    ramp = ramp_of(model)
    times = []
    which = []
    for auxiliary, mesh, table in of:
        if ramp is not None:
            instants = _along(ramp, mesh, table, end_of_run(model))
        else:
            instants = _repeating(period_of(model), mesh, table, model.excitation.omega)
        times.append(instants)
        which.append(np.full(instants.size, auxiliary))
    time = np.concatenate(times)
    auxiliaries = np.concatenate(which)
    order = np.argsort(time, kind="stable")
    return Clock(time[order], auxiliaries[order], repeats=ramp is None)


def _begins(table: Alternation) -> Array:
    """(2,) turns of psi from t = 0 to the first two changes, both in (0, 1]."""
    turns = np.array([1.0, 1.0 + table.share]) - turn_at_start(table)
    return np.sort(np.where(turns > 1.0, turns - 1.0, turns))


def _repeating(common: CommonPeriod, mesh: Element, table: Alternation, omega: float) -> Array:
    """Times of the changes in one common period [s]."""
    cycle = 2.0 * pi / (table.order * omega)
    count = common.period / cycle
    _check_count(mesh, table.order, count, "a common period")
    if abs(count - round(count)) > _WHOLE * count:
        rule = "the mesh must turn through whole cycles in the common period of all orders"
        location = f"{mesh.path}.alternation.order"
        raise ModelError(Problem(location, f"{table.order:g}", rule, "choose an order p/q with a small q"))
    return np.asarray((np.add.outer(np.arange(round(count)), _begins(table)) * cycle).ravel())


def _along(ramp: Ramp, mesh: Element, table: Alternation, until: float) -> Array:
    """Times of the changes along a sweep [s], from phi(t) = Omega_0 t + rate t^2 / 2, and Omega_1 after the ramp."""
    turned = 0.5 * (ramp.begin + ramp.end) * ramp.over
    whole = turned + max(0.0, until - ramp.over) * ramp.end
    count = table.order * whole / (2.0 * pi)
    _check_count(mesh, table.order, count, "the sweep")
    turns = np.add.outer(np.arange(int(count) + 2), _begins(table)).ravel()
    angle = turns * 2.0 * pi / table.order
    within = np.minimum(angle, turned)
    rising = 2.0 * within / (ramp.begin + np.sqrt(ramp.begin**2 + 2.0 * ramp.rate * within))
    time = np.where(angle <= turned, rising, ramp.over + (angle - turned) / ramp.end)
    return np.asarray(time[time <= until])


def _check_count(mesh: Element, order: float, count: float, over: str) -> None:
    """Refuse more changes than ``_MOST``; the ModelError names the order and the largest order that is accepted."""
    if count > _MOST:
        rule = f"the mesh would turn through {count:.3g} cycles in {over}; at most {_MOST} are followed"
        most = f"{order * _MOST / count:.3g} or less: teeth times the ratio of speeds"
        raise ModelError(Problem(f"{mesh.path}.alternation.order", f"{order:g}", rule, most))
