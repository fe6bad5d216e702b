"""``periodic``: motions of a model that repeat, one or all of them.

Takes a Model and a start; gives an Orbit, or a list of them.
"""

from __future__ import annotations

from typing import Literal, overload

from gearrattle.assembly import assemble
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ModelError
from gearrattle.model import Model, check_model
from gearrattle.model.quantity import argument_problems
from gearrattle.orbits.every import every_orbit
from gearrattle.orbits.orbit import ATTEMPTS, CYCLES, Orbit, orbit_of, settled_state
from gearrattle.orbits.state import Start, check_repeats, state_of


@overload
def periodic(
    model: Model, cycles: int = 1, start: Start | Orbit | None = None, *, every: Literal[False] = False
) -> Orbit: ...


@overload
def periodic(
    model: Model, cycles: int = 1, start: Start | Orbit | None = None, *, every: Literal[True]
) -> list[Orbit]: ...


def periodic(
    model: Model, cycles: int = 1, start: Start | Orbit | None = None, *, every: bool = False
) -> Orbit | list[Orbit]:
    """Find a motion that repeats, or all of them.

    Parameters
    ----------
    model
        the driveline.
    cycles
        periods T of all orders after which the motion repeats.
    start
        near it: "static", "zero", {"angle": [...], "velocity": [...]} of all inertias [rad, rad/s], a run (its end) or
        an orbit. None: the motion is followed from the model's own start until it has settled; what is found
        then is a motion that a simulation shows.
    every
        whether all motions that repeat after ``cycles`` periods are sought.

    Returns
    -------
    Orbit or list of Orbit
        The motion; with ``every`` a list, those with the largest swings last.

    Raises
    ------
    ModelError
        inputs that do not repeat, mean torques that do not balance, a bad argument.
    ConvergenceError
        none was found from there.

    Examples
    --------
    >>> orbit = gr.periodic(gr.example("rattle_oscillator"), start={"angle": [-0.3], "velocity": [-3.9]})
    >>> orbit.verdict.verdict
    'double-sided'
    """
    check_model(model)
    if problems := argument_problems({"cycles": (CYCLES, cycles)}):
        raise ModelError(problems)
    check_repeats(model)
    if every:
        return every_orbit(model, cycles)
    period_map = PeriodMap(assemble(model).system, cycles)
    if start is None:
        state, attempts = settled_state(model, period_map), ATTEMPTS
    elif isinstance(start, Orbit):
        state, attempts = start.motion.start, 0
    else:
        state, attempts = state_of(model, period_map, start), 0
    return orbit_of(model, period_map, shooting.shoot(period_map, state, settle=attempts))
