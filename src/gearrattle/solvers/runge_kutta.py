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
from gearrattle.solvers.start import starting_pieces
from gearrattle.solvers.tableaus import Tableau
from gearrattle.system.field import field_of
from gearrattle.system.flow import Flow, flow_of

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
        self.task, self.tableau = task, tableau
        self.flow = flow_of(task.system)
        self.field = field_of(task.system, self.flow.coordinates)
        coordinates, elements = self.flow.coordinates, len(task.system.laws)
        deflection = coordinates.basis @ task.angle
        references = list(coordinates.references)
        y = np.concatenate([deflection, task.velocity, task.angle[references], np.zeros(elements)])
        scaled = np.concatenate(
            [
                deflection * self.flow.scaling.deflection,
                task.velocity * self.flow.scaling.velocity,
                self.flow.inputs_at(np.zeros(1), np.zeros(1))[0],
            ]
        )
        self.start = starting_pieces(self.flow, scaled, task.angle)[0]
        self.step = task.step if task.step is not None else default_step(self.flow, self.start)
        samples = task.cycles * task.samples_per_cycle + 1
        self.stepper = Stepper(
            y, np.zeros(4, np.int64), np.zeros((samples, y.size)), np.zeros(_FIRST_LOG), np.zeros(_FIRST_LOG, np.int64),
            np.zeros((_FIRST_LOG, 2), np.int64), np.zeros(_FIRST_LOG), np.zeros(_FIRST_LOG),
        )  # fmt: skip

    def advance(self) -> Outcome:
        """Take one slice of steps; grow the log where the kernel asks for it."""
        most = int(sum(law.pieces for law in self.task.system.laws))
        outcome = Outcome(
            self._step_on(
                self.field, *self.tableau.arrays(), self.stepper, self.step, self.task.samples_per_cycle, most, _BUDGET
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
        clearances, count = list(self.task.system.clearances), int(self.stepper.counts[2])
        deflection = self.field.combination[clearances] @ self.stepper.y[: len(self.flow.coordinates.elements)]
        last = clearances.index(int(self.stepper.event_element[count - 1])) if count else None
        return Place(float(self.stepper.counts[0] * self.step), deflection, last)

    def motion(self) -> Motion:
        """Samples from the interpolant, accelerations and forces from the equation of motion at them."""
        from gearrattle.kernels.sampling import element_samples

        task, system, coordinates = self.task, self.task.system, self.flow.coordinates
        states, r, n = self.stepper.states, len(coordinates.elements), system.size
        clearances = list(system.clearances)
        time = np.arange(states.shape[0]) * (system.inputs.period / task.samples_per_cycle)
        acceleration, deflection, piece, force = element_samples(self.field, time, states)
        references = states[:, r + n : r + n + len(coordinates.references)]
        steps = int(self.stepper.counts[0])
        crossings = self._crossings()
        return Motion(
            angle=states[:, :r] @ coordinates.angle_from_basis.T + references @ coordinates.angle_from_reference.T,
            velocity=states[:, r : r + n].copy(),
            acceleration=acceleration,
            deflection=deflection[:, clearances],
            force=force,
            piece=piece[:, clearances],
            crossings=crossings,
            initial_piece=np.array([self.start[k] for k in clearances], dtype=np.int64),
            final_force_integral=states[-1, r + n + len(coordinates.references) :][clearances],
            steps=steps,
            function_calls=int(self.stepper.counts[3]),
            average_step=time[-1] / max(steps, 1),
            average_trial_step=time[-1] / max(steps, 1),
            notes=self._stability_notes(crossings),
        )

    def _crossings(self) -> Crossings:
        s = self.stepper
        count = int(s.counts[2])
        row_of = {k: i for i, k in enumerate(self.task.system.clearances)}
        return Crossings(
            time=s.event_time[:count].copy(),
            clearance=np.array([row_of[int(k)] for k in s.event_element[:count]], dtype=np.int64),
            from_piece=s.event_pieces[:count, 0].copy(),
            to_piece=s.event_pieces[:count, 1].copy(),
            velocity=s.event_rate[:count].copy(),
            force_integral=s.event_integral[:count].copy(),
        )

    def _stability_notes(self, crossings: Crossings) -> tuple[str, ...]:
        """A note if the step lies outside the stability region in any region visited."""
        clearances = self.task.system.clearances
        pieces = list(self.start)
        visited = {tuple(pieces)}
        for clearance, target in zip(crossings.clearance, crossings.to_piece, strict=True):
            pieces[clearances[clearance]] = int(target)
            visited.add(tuple(pieces))
        growth = {
            region: float(self.tableau.growth(self.step * eigenvalues(self.flow, region)).max()) for region in visited
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
