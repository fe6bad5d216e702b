"""Procedure of advice: the steps before the integration in Fig. 1 of Padmanabhan et al. 1995.

    1. lumping          which bodies move as one in the excited band                    (sec. 3)
    2. scaling          effect of the non-dimensional form on the Jacobian              (sec. 5)
    3. stiffness        eigenvalues over the regions the motion visits                  (sec. 6)
    4. clearances       which open at this load: linear response, then a pilot run      (sec. 6, Fig. 3)
    5. contact ratios   slopes that replace them in a linear model                      (sec. 6, Fig. 4)
    6. algorithm        which to use, and the step it may take                          (sec. 8)
    7. cost             of the planned run
    8. predictability   how long the motion is predictable point by point
    9. other motions    that exist at this load, where that costs little

In the paper the user checks each decision. Here a pilot run does: a lumped model is not recommended if it moves
differently from the full one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from gearrattle.advice.advice_record import Advice
from gearrattle.advice.clearance_advice import clearances_line, contact_ratios_line, linear_forecasts
from gearrattle.advice.computing_advice import algorithm_line, cost_line, predictability_line
from gearrattle.advice.lumping_advice import lumping_line
from gearrattle.advice.other_motions_advice import others_of
from gearrattle.advice.pilot import run_pilot
from gearrattle.advice.steady_linear_check import excursions
from gearrattle.advice.stiffness_advice import scaling_line, stiffness_line
from gearrattle.analysis.statics import named_equilibrium
from gearrattle.assembly import assemble, left_out, unsteady_problems
from gearrattle.errors import ModelError
from gearrattle.model import Model, check_model
from gearrattle.model.value_kinds import CALLBACK, check_arguments
from gearrattle.reductions.reduce import band_end
from gearrattle.simulation.settings import settled

_STAGES = 7


def advise(
    model: Model,
    *,
    algorithm: str | None = None,
    cycles: int | None = None,
    discard: int | None = None,
    samples_per_cycle: int | None = None,
    tolerance: float | None = None,
    step: float | str | None = None,
    initial: str | Mapping[str, Sequence[float]] | None = None,
    up_to: float | str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Advice:
    """Say what to do before simulating, and forecast what a run will show.

    Parameters
    ----------
    model
        the driveline.
    algorithm, cycles, discard, samples_per_cycle, tolerance, step, initial
        of the planned run, as in ``gearrattle.simulate``.
    up_to
        end of the band for lumping, as in ``gearrattle.reduce``; by default the highest order of any torque.
    progress
        called with the finished share; an exception from it ends the work.

    Returns
    -------
    Advice
        Lines with their evidence, and forecasts; ``.scores(run)`` compares these with a run.

    Raises
    ------
    ModelError
        an invalid setting, a driveline without equilibrium under its mean loads, or inputs that are not harmonic.
    ConvergenceError
        the exact pilot run failed.

    Examples
    --------
    >>> print(gr.advise(gr.example("case3"), cycles=20).line("algorithm").words)
    Use exact: it has no step to choose; the alternative is rkv-events, which restarts at every corner.
    """
    check_arguments(progress=(CALLBACK, progress))
    settings = {
        "algorithm": algorithm,
        "cycles": cycles,
        "discard": discard,
        "samples_per_cycle": samples_per_cycle,
        "tolerance": tolerance,
        "step": step,
        "initial": initial,
    }
    return advice_on(model, settings, up_to=up_to, progress=progress)


def advice_on(
    model: Model,
    settings: Mapping[str, Any],
    *,
    up_to: float | str | None = None,
    is_asked: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Advice:
    """Return advice on a planned run; see ``advise``.

    A run for which the user asked no advice (``is_asked``) looks for other motions only where that is nearly free.
    """
    # check the model and the settings of the planned run
    check_model(model)
    _refuse_unsteady(model)
    planned = settled(model, dict(settings))

    def stage(number: int) -> Callable[[float], None]:
        def share(done: float) -> None:
            if progress is not None:
                progress((number + done) / _STAGES)

        return share

    if up_to is not None:
        band_end(model, up_to)
    # equilibrium, pilot run and linear response about rest
    driveline = assemble(model)
    system = driveline.system
    layout = driveline.layout
    equilibrium = named_equilibrium(driveline)[1]
    pilot = run_pilot(planned, planned.simulation.cycles or 1, stage(0))
    response = excursions(system, equilibrium)
    pilot.run.variation.follow(stage(1))
    # reduction, contact ratios, regions visited and other motions, in the order of their cost
    lumping = lumping_line(planned, pilot, up_to, stage(2))
    quiet = response.inside and not system.auxiliaries
    stage(3)(0.0)
    ratios = contact_ratios_line(model, pilot)
    pilot.treat_regions(stage(4))
    stage(5)(0.0)
    others, notes = others_of(planned, pilot, is_asked=is_asked, progress=stage(6))
    # one line per step of the procedure
    lines = (
        lumping,
        scaling_line(model),
        stiffness_line(model, pilot),
        clearances_line(layout, response, pilot, left_out(model)),
        ratios,
        algorithm_line(planned, pilot, quiet=quiet),
        cost_line(pilot),
        predictability_line(pilot),
        *others,
    )
    stage(6)(1.0)
    return Advice(model.name, lines, (*pilot.forecasts(), *linear_forecasts(layout, response)), notes)


def _refuse_unsteady(model: Model) -> None:
    """Refuse records, prescribed motions and speed sweeps: a pilot run does not represent what comes later."""
    rule = "advice rests on harmonics of one speed, and on a pilot run that shows what a longer one does"
    if problems := unsteady_problems(model, rule, "simulate it, or advise on it at one speed"):
        raise ModelError(problems)
