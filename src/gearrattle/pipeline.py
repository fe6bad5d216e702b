"""The whole procedure on one page: from a driveline to a rattle verdict.

This is Fig. 1 of C. Padmanabhan, R. C. Barlow, T. E. Rook, R. Singh, "Computational Issues Associated with Gear Rattle
Analysis", ASME J. Mech. Design 117 (1995) 185-192, as a program: linear eigensolution, pre-processing, nonlinear
simulation, evaluation. The engineer then changes the model and runs the procedure again.

    1. static equilibrium       equilibrium: static deflections, and which clearances are closed
    2. linear vibration         modes: about the equilibrium, and with every clearance closed
    3. forecasts                advise: lumping, scaling, stiffness, regimes, algorithm, cost
    4. motion                   simulate: every crossing of every corner
    5. evaluation               criteria: a verdict with its rule, worst part first
    6. check of the forecasts   scores: every forecast against the run
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from gearrattle.advice.advise import advice_on
from gearrattle.analysis.statics import equilibrium, modes
from gearrattle.assembly import unsteady_inputs
from gearrattle.causes import Cause, cause_of
from gearrattle.errors import ConvergenceError
from gearrattle.model.value_kinds import CALLBACK, check_arguments
from gearrattle.quantities.criteria import check_negligible, criteria
from gearrattle.quantities.metrics import metrics_of_run
from gearrattle.result import Result
from gearrattle.simulation.simulate import simulate

if TYPE_CHECKING:
    from gearrattle.advice import Advice, Score
    from gearrattle.analysis.statics import Equilibrium, Modes
    from gearrattle.model import Model
    from gearrattle.quantities.quantity import Row
    from gearrattle.quantities.verdict import Verdict
    from gearrattle.results import Run


@dataclass(frozen=True)
class Findings(Result):
    """All results of one pass through the procedure; ``gearrattle.run`` returns them.

    Attributes
    ----------
    model
        the driveline.
    equilibrium
        static equilibrium under the mean loads.
    modes
        natural frequencies and shapes about the equilibrium, each clearance in its region at the equilibrium.
    modes_contact
        the same with every clearance in full contact.
    motion
        the motion, its events, notes and cost.
    verdict
        the verdict on the motion.
    advice
        the advice before the run; None if the pilot run of the advice failed, and under records or a sweep.
    scores
        comparison of the forecasts in the advice with the run.

    Examples
    --------
    >>> gr.run(gr.example("case3"), cycles=20, discard=10).verdict.verdict
    'double-sided'
    """

    kind: ClassVar[str] = "run"
    model: Model
    equilibrium: Equilibrium
    modes: Modes
    modes_contact: Modes
    motion: Run
    verdict: Verdict
    advice: Advice | None = None
    scores: tuple[Score, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes of the advice, the run, the equilibrium and the criteria, without repetitions."""
        advised = () if self.advice is None else self.advice.notes
        return tuple(dict.fromkeys([*advised, *self.motion.notes, *self.equilibrium.notes, *self.verdict.notes]))

    @cached_property
    def cause(self) -> Cause | None:
        """The orders of the excitation that accelerate the driver of the rattling parts; None as ``gr.cause``.

        Estimated when it is first shown.
        """
        return cause_of(self.motion, [part.name for part in self.verdict.parts if part.rattles])

    @cached_property
    def metrics(self) -> tuple[Row, ...]:
        """Every rattle metric of the run, measured once for all pages and files."""
        return metrics_of_run(self.motion)


def run(
    model: Model,
    *,
    algorithm: str | None = None,
    cycles: int | None = None,
    samples_per_cycle: int | None = None,
    discard: int | None = None,
    tolerance: float | None = None,
    step: float | str | None = None,
    initial: str | Mapping[str, Sequence[float]] | None = None,
    negligible: Mapping[str, float | str] | None = None,
    progress: Callable[[float], None] | None = None,
    phase: Callable[[str], None] | None = None,
) -> Findings:
    """Carry out the whole procedure: check, rest, modes, advice, motion, verdict.

    Parameters
    ----------
    model
        the driveline.
    algorithm, cycles, samples_per_cycle, discard, tolerance, step, initial
        settings as of ``simulate``; None takes the value in the model file, or else the default.
    negligible
        sizes below which an impact is a touch, as ``[criteria] negligible`` of a model file; sizes left out are those
        of the model.
    progress
        called repeatedly with the finished share of the simulation, 0 to 1; may raise to cancel.
    phase
        called with the name of every part of the procedure when this part begins.

    Returns
    -------
    Findings
        The findings: ``verdict``, ``motion`` (a ``Run``), ``advice``, ``modes`` and more; ``save`` writes the report.

    Raises
    ------
    ModelError
        a setting out of range, or a driveline without equilibrium under its mean loads.
    ConvergenceError
        the algorithm failed or went unstable.

    Examples
    --------
    >>> import gearrattle as gr
    >>> findings = gr.run(gr.example("case3"), cycles=20)
    >>> findings.verdict.verdict
    'double-sided'
    >>> page = findings.save("case3-results")
    """
    # check the arguments
    check_arguments(progress=(CALLBACK, progress), phase=(CALLBACK, phase))
    check_negligible(negligible)
    model = model.with_negligible(negligible) if negligible else model
    # rest and modes
    if phase is not None:
        phase("static rest and modes")
    linear = _linear(model)
    # advice before the run
    settings: dict[str, Any] = {
        "algorithm": algorithm,
        "cycles": cycles,
        "samples_per_cycle": samples_per_cycle,
        "discard": discard,
        "tolerance": tolerance,
        "step": step,
        "initial": initial,
    }
    if phase is not None:
        phase("advising")
    advice = _advice(model, settings, progress)
    # motion
    if phase is not None:
        phase("simulating")
    motion = simulate(model, **settings, progress=progress)
    # verdict, and scores of the advice
    if phase is not None:
        phase("judging")
    if advice is not None:
        motion.variation.follow(progress)
    scores = () if advice is None else advice.scores(motion)
    return Findings(model, *linear, motion, criteria(motion), advice, scores)


def judged(motion: Run) -> Findings:
    """Carry out the procedure, without advice, for a motion that is already simulated or opened from a file."""
    return Findings(motion.model, *_linear(motion.model), motion, criteria(motion))


def _linear(model: Model) -> tuple[Equilibrium, Modes, Modes]:
    """Static equilibrium, modes about it, and modes with every clearance closed."""
    rest = equilibrium(model)
    in_contact = modes(model, contact_ratio=dict.fromkeys(rest.region, 1.0))
    return rest, modes(model, region=rest.region), in_contact


def _advice(model: Model, settings: dict[str, Any], progress: Callable[[float], None] | None) -> Advice | None:
    """Advice on the planned run; None for a model without one constant speed, and if the pilot run of the advice fails
    (the run itself may still succeed).
    """
    if unsteady_inputs(model):
        return None
    try:
        return advice_on(model, settings, is_asked=False, progress=progress)
    except ConvergenceError:
        return None
