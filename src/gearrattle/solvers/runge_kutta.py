"""Fixed-step explicit Runge-Kutta: the independent second opinion, with its stability margin told.

The kernel integrates the equation of motion as written (``kernels.vector_field``). After the run every region it came
through is asked whether the step lies inside the method's stability region there: |R(h lambda)| <= 1 for every
eigenvalue. A step outside is a note with the growth factor, because such a run invents motion (the 1995 paper's RK4
step does).
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil

import numpy as np
from numpy.typing import NDArray

from gearrattle.outcome import Outcome
from gearrattle.solvers.base import Crossings, Marching, Motion, Place, Task
from gearrattle.solvers.tableaus import Tableau
from gearrattle.solvers.vector_field import FieldProblem
from gearrattle.system.flow import Flow

Array = NDArray[np.float64]

_BUDGET = 20_000
_FIRST_LOG = 4096
_STEP_OVER_FASTEST = 0.25
_ROUNDING = 1e-9


def eigenvalues(flow: Flow, pieces: tuple[int, ...]) -> NDArray[np.complex128]:
    """(N,) eigenvalues of one region in relative coordinates [1/s]."""
    n = flow.states
    return np.linalg.eigvals(flow.generator(pieces)[:n, :n] / flow.system.inputs.period).astype(complex)


def default_step(flow: Flow, start: tuple[int, ...]) -> float:
    """0.25 / max |lambda| over the region at start and that with all elements in contact, down to T / integer [s]."""
    contact = tuple(law.pieces - 1 for law in flow.system.laws)
    fastest = max(float(np.abs(eigenvalues(flow, pieces)).max()) for pieces in (start, contact))
    period = flow.system.inputs.period
    return period / max(1, ceil(period * fastest / _STEP_OVER_FASTEST * (1.0 - _ROUNDING)))


class FixedStepMarch:
    """A fixed-step run under way (see ``base.Marching``)."""

    def __init__(self, task: Task, tableau: Tableau) -> None:
        from gearrattle.kernels._jit import vectorised
        from gearrattle.kernels.runge_kutta import Stepper, step_on

        self._step_on = vectorised(step_on)
        self.task, self.tableau, self.problem = task, tableau, FieldProblem.of(task)
        self.step = task.step if task.step is not None else default_step(self.problem.flow, self.problem.start)
        samples, y = len(self.problem.sample_times), self.problem.initial
        self.stepper = Stepper(
            y.copy(), np.zeros(4, np.int64), np.zeros((samples, y.size)), np.zeros(_FIRST_LOG),
            np.zeros(_FIRST_LOG, np.int64), np.zeros((_FIRST_LOG, 2), np.int64), np.zeros(_FIRST_LOG), np.zeros(_FIRST_LOG),
        )  # fmt: skip

    def advance(self) -> Outcome:
        """Take one slice of steps; grow the log where the kernel asks for it."""
        most = int(sum(law.pieces for law in self.task.system.laws))
        outcome = Outcome(
            self._step_on(
                self.problem.field,
                *self.tableau.arrays(),
                self.stepper,
                self.step,
                self.task.samples_per_cycle,
                most,
                _BUDGET,
            )
        )
        if outcome is Outcome.LOG_FULL:
            s = self.stepper
            doubled = [np.concatenate([a, np.zeros_like(a)]) for a in s[3:]]
            self.stepper = s._replace(**dict(zip(s._fields[3:], doubled, strict=True)))
            return Outcome.SLICE_SPENT
        return outcome

    def fraction(self) -> float:
        """Samples stored, as a fraction of all."""
        return float(self.stepper.counts[1] / self.stepper.states.shape[0])

    def place(self) -> Place:
        """Time, deflections (transmission errors left out) and the last clearance crossed."""
        count = int(self.stepper.counts[2])
        last = int(self.stepper.event_element[count - 1]) if count else None
        return self.problem.place(float(self.stepper.counts[0] * self.step), self.stepper.y, last)

    def motion(self) -> Motion:
        """Samples from the interpolant, accelerations and forces from the equation of motion at them."""
        s, steps = self.stepper, int(self.stepper.counts[0])
        count, end = int(s.counts[2]), float(self.problem.sample_times[-1])
        log = (a[:count] for a in (s.event_time, s.event_element, s.event_pieces, s.event_rate, s.event_integral))
        crossings = self.problem.crossings(*log)
        return self.problem.motion(
            s.states,
            crossings,
            steps=steps,
            function_calls=int(s.counts[3]),
            average_step=end / max(steps, 1),
            average_trial_step=end / max(steps, 1),
            smallest_step=self.step,
            notes=self._stability_notes(crossings),
        )

    def _stability_notes(self, crossings: Crossings) -> tuple[str, ...]:
        """A note if the step lies outside the stability region in any region visited."""
        clearances = self.task.system.clearances
        pieces = list(self.problem.start)
        visited = {tuple(pieces)}
        for clearance, target in zip(crossings.clearance, crossings.to_piece, strict=True):
            pieces[clearances[clearance]] = int(target)
            visited.add(tuple(pieces))
        growth = {
            region: float(self.tableau.growth(self.step * eigenvalues(self.problem.flow, region)).max())
            for region in visited
        }
        region, worst = max(growth.items(), key=lambda item: item[1])
        if worst <= 1.0 + _ROUNDING:
            return ()
        labels = [region[k] + self.task.system.laws[k].first_label for k in clearances]
        return (
            f"{self.tableau.name}: the step {self.step:.6g} s is unstable in region {labels}: a mode grows by "
            f"{worst:.4g} a step there; what follows may be invented by the algorithm. Use a smaller step or 'exact'.",
        )


def fixed_step(tableau: Tableau) -> Callable[[Task], Marching]:
    """A solver from a tableau."""
    return lambda task: FixedStepMarch(task, tableau)
