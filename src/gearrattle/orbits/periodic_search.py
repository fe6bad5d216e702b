"""``periodic``: motions of a model that repeat, one or all of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Literal, overload

from gearrattle.assembly import assemble
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model, check_model
from gearrattle.model.table import shown
from gearrattle.model.value_kinds import CALLBACK, FLAG, argument_problems, checked
from gearrattle.orbits.all_motions import every_orbit
from gearrattle.orbits.attractors import NEAR_SLOWLY, Attractor
from gearrattle.orbits.balanced import balanced
from gearrattle.orbits.known_motions import check_repeats_elsewhere, orbit_of_returns
from gearrattle.orbits.orbit import ATTEMPTS, CYCLES, SETTLING, Orbit, linear_state, orbit_of, settled_state
from gearrattle.orbits.settling_limits import WITHIN
from gearrattle.orbits.start_states import Start, check_inertias, check_repeats, has_same_sliders, initial_of, state_of
from gearrattle.orbits.value_family import is_compiled
from gearrattle.time_limits import OutOfTime, TimeLimit, limited
from gearrattle.wording import counted

LINEAR = "linear"
"""A start: the motion that grows out of the rest as all harmonics grow from nothing to what they are."""
_LONGER = 256  # periods after which a simulation is compared with the motion once more


@overload
def periodic(
    model: Model,
    cycles: int = 1,
    start: Start | Orbit | None = None,
    *,
    every: Literal[False] = False,
    within: float | str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Orbit: ...


@overload
def periodic(
    model: Model,
    cycles: int = 1,
    start: Start | Orbit | None = None,
    *,
    every: Literal[True],
    within: float | str | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Orbit]: ...


def periodic(
    model: Model,
    cycles: int = 1,
    start: Start | Orbit | None = None,
    *,
    every: bool = False,
    within: float | str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Orbit | list[Orbit]:
    """Find a motion that repeats, or all of them.

    Parameters
    ----------
    model
        the driveline.
    cycles
        periods T of all orders after which the motion repeats.
    start
        a state near the motion: "steady", "static", "zero", {"angle": [...], "velocity": [...]} of all inertias
        [rad, rad/s], a run (its end) or an orbit. "linear": the motion that grows out of the rest as all harmonics grow
        from zero to their full size. None: the model's own start is followed for 32 periods or more, so that the
        motion is one that a simulation shows if it has settled by then. Where it does not settle, one that it nearly
        repeats, mostly unstable; without that, "linear". Neither where friction or alternation would make that take
        minutes.
    every
        whether all motions that repeat after ``cycles`` periods are sought.
    within
        time that the search may take [s], or as text, such as "60s"; None for no limit. With ``every`` the motions that
        are known by then are the result, each with a note, and so they are where ``progress`` raises ``Cancelled``.
    progress
        called with the finished share of the search for all of them; an exception from it ends the work.

    Returns
    -------
    Orbit or list of Orbit
        The motion; with ``every`` a list, those with the largest swings last.

    Raises
    ------
    ModelError
        inputs that do not repeat, mean torques that do not balance, a bad argument.
    ConvergenceError
        none was found from there, or within the time.

    Examples
    --------
    >>> orbit = gr.periodic(gr.example("rattle_oscillator"), start={"angle": [-0.3], "velocity": [-3.9]})
    >>> orbit.verdict.verdict
    'double-sided'
    """
    check_model(model)
    rules = {"cycles": (CYCLES, cycles), "every": (FLAG, every), "progress": (CALLBACK, progress)}
    if problems := argument_problems(rules):
        raise ModelError(problems)
    seconds = math.inf if within is None else checked(WITHIN, within, "within", dimensionless=False)
    model = balanced(model)
    check_repeats(model)
    if every and start is not None:
        rule = "is not used by every=True, which begins from many states"
        remedy = "leave out one of them"
        raise ModelError(Problem("start", shown(start), rule, remedy))
    if every:
        return every_orbit(model, cycles, progress, None if within is None else TimeLimit(seconds))
    limit = TimeLimit(seconds)
    try:
        with limited(limit):
            return _from_start(model, cycles, start)
    except OutOfTime:
        if limit.left:  # the limit of a caller
            raise
        message = f"no motion that repeats after {counted(cycles, 'period')} was found within {seconds:.3g} s"
        raise ConvergenceError(message, remedy="more time, or a start near one") from None


def _from_start(model: Model, cycles: int, start: Start | Orbit | None) -> Orbit:
    """The motion that a start leads to."""
    period_map = PeriodMap(assemble(model).system, cycles)
    if start is None:
        return _of_own_start(model, period_map)
    if isinstance(start, str) and start == LINEAR:
        state = linear_state(period_map, state_of(model, period_map, "static"))
    elif isinstance(start, Orbit):
        check_inertias(model, start.model, repr(start))
        state = start.motion.start
        if not has_same_sliders(model, start.model):
            state = state_of(model, period_map, initial_of(start.model, start.period_map, state))
    else:
        state = state_of(model, period_map, start)
    return orbit_of(model, period_map, shooting.shoot(period_map, state))


def _of_own_start(model: Model, period_map: PeriodMap) -> Orbit:
    """The motion that the model's own start leads to, with a note where a simulation does not come near to it."""
    state = settled_state(model, period_map)
    orbit = orbit_of(model, period_map, _settled(model, period_map, state))
    motion = Attractor(orbit)
    if not orbit.stable or motion.is_near(state, NEAR_SLOWLY):
        return orbit
    state = period_map.later(state, -(-_LONGER // period_map.cycles))
    if motion.is_near(state, NEAR_SLOWLY):
        return orbit
    note = (
        f"A simulation from the model's own start is not near this motion after about {SETTLING + _LONGER} periods: "
        "it may show another."
    )
    return replace(orbit, notes=(*orbit.notes, note))


def _settled(model: Model, period_map: PeriodMap, state: State) -> shooting.Orbit:
    """The motion to which a state of the model leads.

    Where it does not settle, one that the motion nearly repeats; without that, the one that "linear" gives.
    """
    try:
        return shooting.shoot(period_map, state, settle=ATTEMPTS)
    except ConvergenceError:
        if not is_compiled(period_map.system):  # its returns would take minutes
            check_repeats_elsewhere(period_map, state)
            raise
    try:
        return orbit_of_returns(period_map, state)
    except ConvergenceError as error:
        with suppress(ConvergenceError):
            return shooting.shoot(period_map, linear_state(period_map, state_of(model, period_map, "static")))
        raise error from None
