"""The motion that a driveline shows from its own start, where none that repeats is found: by an exact run.

Takes a Model; gives a SettledMotion, or the Orbit in which the run has settled after all.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

from gearrattle.assembly import assemble
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model
from gearrattle.model.value_kinds import checked
from gearrattle.orbits.attractors import settled_orbit
from gearrattle.orbits.balanced import balanced
from gearrattle.orbits.exact_runs import BLOCKS, ExactRun, exact_run, map_of_one_period
from gearrattle.orbits.orbit import Orbit
from gearrattle.orbits.settling_limits import WITHIN
from gearrattle.orbits.start_states import check_repeats, initial_of, state_of
from gearrattle.result import Result
from gearrattle.time_limits import OutOfTime, TimeLimit, limited
from gearrattle.wording import counted

_LONG = 4  # times as many blocks as a run of a sweep has


@dataclass(frozen=True)
class SettledMotion(Result):
    """What a driveline does after a while, where it repeats or not.

    Attributes
    ----------
    model
        the driveline.
    run
        the exact run.
    notes
        what the user must know.

    Examples
    --------
    >>> from gearrattle.orbits.settled_motion import settled_motion
    >>> settled_motion(gr.example("rattle_oscillator"), within=20.0).cycles
    1
    """

    kind: ClassVar[str] = "settled motion"
    model: Model = field(repr=False, compare=False)
    run: ExactRun = field(repr=False, compare=False)
    notes: tuple[str, ...] = ()

    @property
    def clearance_names(self) -> tuple[str, ...]:
        """Of what is measured."""
        return assemble(self.model).layout.clearance_names

    @property
    def begun_there(self) -> Model:
        """The driveline with a simulation that begins where the run ends; sliders begin unloaded."""
        initial = initial_of(self.model, map_of_one_period(self.model), self.run.end)
        return self.model.with_simulation({"initial": initial})


def settled_motion(model: Model, *, within: float | str, why: str = "") -> SettledMotion | Orbit:
    """Follow a driveline from its own start until its motion repeats, or for long.

    Parameters
    ----------
    model
        the driveline; its inputs repeat.
    within
        time that it may take [s].
    why
        why no motion that repeats was found, in words.

    Returns
    -------
    SettledMotion or Orbit
        The periodic motion in which it settles, where it is found; else what the run shows.

    Raises
    ------
    ModelError
        inputs that do not repeat, or no clearance.
    ConvergenceError
        the motion could not be followed.
    OutOfTime
        the time was over before anything was known.
    """
    check_model(model)
    limit = TimeLimit(checked(WITHIN, within, "within", dimensionless=False))
    model = balanced(model)
    check_repeats(model)
    if not assemble(model).layout.clearance_names:
        rule = "the driveline has no clearance: it has one motion, and linear analysis tells it"
        raise ModelError(Problem("model", model.name or "driveline", rule, "gr.modes"))
    period_map = map_of_one_period(model)
    with limited(limit):
        start = state_of(model, period_map, None)
        run = exact_run(model, period_map, start, model.excitation.omega, blocks=_LONG * BLOCKS)
    orbit = None
    if run.cycles:
        try:
            with limited(limit):
                orbit = settled_orbit(model, run.end, run.cycles)
        except OutOfTime:
            orbit = None
    if orbit is not None:
        note = f"A simulation settles in this motion, which repeats after {counted(orbit.cycles, 'period')}."
        return replace(orbit, notes=(*orbit.notes, note))
    return SettledMotion(model, run, (f"No motion that repeats: {why}.",) if why else ())
