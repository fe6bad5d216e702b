"""Solvers that compute every step from the state before it: Runge-Kutta of fixed and variable step, extrapolation.

The kernel integrates the equation of motion as written (``kernels.equation_of_motion``): the independent second opinion
on ``exact``. With variable steps the error estimate of every deflection and velocity must stay below the tolerance
times the larger of its own size and its size in an ordinary motion; angles and force integrals do not feed back and are
left out.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.one_step_kernels import EXTRAPOLATION, RUNGE_KUTTA, Control, Method
from gearrattle.engine.kernels.step_loop import (
    CALLS,
    EVENTS,
    NOW,
    REJECTED,
    SAMPLE,
    SMALLEST,
    STEP,
    TRIED,
    Stepper,
    step_on,
)
from gearrattle.engine.solvers.samples_in_si import MOST_CHOSEN, StepLimit
from gearrattle.engine.solvers.solver import Marching, Motion, Position, Task
from gearrattle.engine.solvers.step_stability import default_step, regions_visited, stability_notes
from gearrattle.engine.solvers.tableaus import Tableau
from gearrattle.engine.solvers.vector_field import FieldProblem
from gearrattle.errors import ModelError, Problem
from gearrattle.outcome import Outcome

Array = NDArray[np.float64]

TOLERANCE = 1e-6
"""Tolerance of a step where the caller gives none."""
MOST_STEPS = 1e9
"""Fixed steps in a run; a run of more is refused: it takes hours."""
_BUDGET = 5_000
_PRODUCTS = 10_000_000  # the same, of large drivelines in products
_CALLS_A_STEP = 8  # of Runge-Kutta methods with variable steps
_CALLS_OF_EXTRAPOLATION = 100  # the same, of a long step, so that Ctrl-C works
_FIRST_LOG = 4096
_SHORTEST = 1e-14  # of a period


class StepMarch:
    """A run under way (see ``solver.Marching``).

    task: what to integrate; its ``step`` is the step, or the first one tried.
    tableau: the Runge-Kutta method; None: extrapolation.
    fixed: whether every step is the same.
    held: whether to restart at every corner.
    """

    def __init__(self, task: Task, tableau: Tableau | None, *, fixed: bool, held: bool) -> None:
        # the method and the problem
        self._step_on = vectorised(step_on)
        self.task = task
        self.tableau = tableau
        self.fixed = fixed
        self.problem = FieldProblem.of(task)
        # the step, and limits on their number
        self.step = _first_step(self.problem)
        self._limit = StepLimit(task.system, a_period=MOST_CHOSEN)
        if fixed:
            _check_count(task, self.step)
        slice_steps = min(_BUDGET, _PRODUCTS // (self.problem.field.rows.size + 1))
        self._steps = max(10, slice_steps if tableau is not None else slice_steps // _CALLS_OF_EXTRAPOLATION)
        self.control = self._control(held)
        self.method = _method(tableau)
        # the stepper at the start, with room for samples and crossings
        y = self.problem.initial
        start = np.array(self.problem.start, dtype=float)
        self.stepper = Stepper(
            y=y.copy(),
            clock=np.array([0.0, self.step, 0.0, np.inf]),
            counts=np.zeros(8, np.int64),
            piece=start,
            states=np.zeros((len(self.problem.sample_times), y.size)),
            event_time=np.zeros(_FIRST_LOG),
            event_element=np.zeros(_FIRST_LOG, np.int64),
            event_pieces=np.zeros((_FIRST_LOG, 2), np.int64),
            event_rate=np.zeros(_FIRST_LOG),
            event_integral=np.zeros(_FIRST_LOG),
        )

    def _control(self, held: bool) -> object:
        tolerance = self.task.tolerance if self.task.tolerance is not None else TOLERANCE
        shortest = _SHORTEST * self.task.system.inputs.period
        return Control(self.fixed, held, float(self.step), shortest, float(tolerance), self.problem.size)

    def advance(self, steps: int | None = None) -> Outcome:
        """Take at most so many steps; grow the log where the kernel asks for it."""
        steps = self._steps if steps is None else steps
        s = self.stepper
        most = int(sum(law.pieces for law in self.task.system.laws))
        outcome = Outcome(
            self._step_on(self.problem.field, self.method, self.control, s, self.task.samples_per_cycle, most, steps)
        )
        if outcome is Outcome.SLICE_SPENT and not self.fixed and self._is_stuck():
            return Outcome.NO_PROGRESS
        if outcome is Outcome.LOG_FULL:
            log = {name: array for name, array in s._asdict().items() if name.startswith("event")}
            self.stepper = s._replace(**{name: np.concatenate([a, np.zeros_like(a)]) for name, a in log.items()})
            return Outcome.SLICE_SPENT
        return outcome

    def _is_stuck(self) -> bool:
        """Whether variable steps make hardly any progress; one of extrapolation counts as several, by its calls."""
        now = float(self.stepper.clock[NOW]) / self.task.system.inputs.period
        return self._limit.is_exceeded(int(self.stepper.counts[CALLS]) // _CALLS_A_STEP, now)

    def fraction(self) -> float:
        """Samples stored, as a fraction of all."""
        return float(self.stepper.counts[SAMPLE] / self.stepper.states.shape[0])

    def position(self) -> Position:
        """Time, deflections (transmission errors left out) and the last element crossed."""
        count = int(self.stepper.counts[EVENTS])
        last = int(self.stepper.event_element[count - 1]) if count else None
        return self.problem.position(float(self.stepper.clock[NOW]), self.stepper.y, last, self._limit.average)

    def motion(self) -> Motion:
        """Samples by the method's own shorter steps, accelerations and forces from the equation of motion at them."""
        # counts and the log of crossings
        s = self.stepper
        steps = int(s.counts[STEP])
        rejected = int(s.counts[REJECTED])
        count = int(s.counts[EVENTS])
        crossings = self.problem.crossings(
            s.event_time[:count],
            s.event_element[:count],
            s.event_pieces[:count],
            s.event_rate[:count],
            s.event_integral[:count],
        )
        # with a fixed step: the modes for which it is not stable, in the regions visited
        notes: tuple[str, ...] = ()
        begin = time.perf_counter()
        if self.fixed and self.tableau is not None:
            visited = regions_visited(self.problem.flow, self.problem.start, crossings.clearance, crossings.to_piece)
            notes = stability_notes(self.tableau, self.step, self.problem.flow, *visited)
        aside = time.perf_counter() - begin
        # samples, counts and notes
        return self.problem.motion(
            s.states,
            crossings,
            steps=steps,
            function_calls=int(s.counts[CALLS]),
            average_step=float(self.problem.sample_times[-1]) / max(steps, 1),
            average_trial_step=float(s.clock[TRIED]) / max(steps + rejected, 1),
            rejected_steps=rejected,
            smallest_step=float(s.clock[SMALLEST]),
            notes=notes,
            aside=aside,
        )


def _check_count(task: Task, step: float) -> None:
    """Refuse a step that divides the run into more than a thousand million steps (ModelError)."""
    length = task.cycles * task.system.inputs.period
    if length / step <= MOST_STEPS:
        return
    rule = (
        f"a run of {length:.6g} s would take {length / step:.3g} steps of this length; at most {MOST_STEPS:g} are taken"
    )
    remedy = f"a step of {length / MOST_STEPS:.3g} s or longer, fewer cycles, or algorithm = 'exact'"
    chosen = "" if task.step is not None else ", the default for the fastest mode"
    raise ModelError(Problem("simulation.step", f"{step:.6g} s{chosen}", rule, remedy))


def _first_step(problem: FieldProblem) -> float:
    """The step of a run, or the first it tries [s]."""
    step = problem.task.step
    return step if step is not None else default_step(problem.flow, problem.start)


def _method(tableau: Tableau | None) -> object:
    if tableau is None:
        return Method(EXTRAPOLATION, np.zeros((1, 1)), np.ones(1), np.zeros(1), np.zeros(1), 0)
    return Method(RUNGE_KUTTA, *tableau.arrays(), tableau.error, min(tableau.order, tableau.estimator_order) + 1)


@dataclass(frozen=True)
class FixedStep:
    """A solver of fixed step from a tableau; its growth factor of a mode in a step is known beforehand."""

    tableau: Tableau

    def __call__(self, task: Task) -> Marching:
        """Start a run."""
        return StepMarch(task, self.tableau, fixed=True, held=False)

    def step_of(self, task: Task) -> float:
        """The step a run takes [s]."""
        return _first_step(FieldProblem.of(task))


@dataclass(frozen=True)
class ChosenStep:
    """A solver that chooses its steps by the tableau's embedded solution."""

    tableau: Tableau
    # whether it is restarted at every corner, so that no step contains one; else it is blind to them
    at_corners: bool = False

    def __call__(self, task: Task) -> Marching:
        """Start a run."""
        return StepMarch(task, self.tableau, fixed=False, held=self.at_corners)


def extrapolation(task: Task) -> Marching:
    """The solver of Bulirsch and Stoer, blind to corners."""
    return StepMarch(task, None, fixed=False, held=False)
