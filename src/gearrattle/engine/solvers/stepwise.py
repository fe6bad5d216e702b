"""The march over any library's stepper: samples and crossings from its interpolant, in slices.

For libraries whose steps are made in Python, which costs far more than the work of this module. A step is taken by
``Stepper.step``; if a sample lies in it, or a clearance ends it in another piece than it began it in, the step's own
interpolant is asked for.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.sampling import elements_at
from gearrattle.engine.solvers.problem_for_c import Block
from gearrattle.engine.solvers.samples_in_si import StepLimit
from gearrattle.engine.solvers.solver import Motion, Position, Task
from gearrattle.engine.solvers.vector_field import FieldProblem
from gearrattle.outcome import Outcome

Array = NDArray[np.float64]
Interpolant = Callable[[float], Array]

LARGEST = 1e150
"""Largest state over its size in an ordinary motion: beyond it the motion diverges."""
_SLICE = 0.02  # s: length of a slice
_MOST_STEPS = 20_000  # steps after which a run is judged
_MOST_A_PERIOD = 200_000.0  # most steps in a period of the fastest input: some 20 s
_CLOSE = 4 * float(np.finfo(float).eps)  # relative error of a crossing's time


class Stepper(Protocol):
    """One step after the other, in the block's units; counts leave out what interpolants cost."""

    implicit: bool
    rejected_steps: int
    tried: float
    """Sum of the steps tried [s]."""
    notes: tuple[str, ...]

    @property
    def time(self) -> float:
        """End of the last step [s]."""

    @property
    def z(self) -> Array:
        """(S,) state there."""

    @property
    def function_calls(self) -> int:
        """Evaluations of the right-hand side so far."""

    @property
    def jacobian_calls(self) -> int:
        """Jacobians so far."""

    def step(self) -> Outcome:
        """Take one step: SLICE_SPENT, or why there is none."""

    def interpolant(self) -> Interpolant:
        """The state anywhere in the last step."""


class StepwiseMarch:
    """A run of a stepper under way (see ``solver.Marching``), blind to corners.

    start: makes the stepper of a packed problem.
    """

    def __init__(self, task: Task, start: Callable[[Block], Stepper]) -> None:
        self.task = task
        self.problem = FieldProblem.of(task)
        self.block = Block.of(self.problem)
        self.stepper = start(self.block)
        times = self.problem.sample_times
        self.states = np.zeros((len(times), self.block.states))
        self.states[0] = self.problem.initial
        self.stored = 1
        self.piece = np.array(self.problem.start, dtype=np.int64)
        self.deflection = self._elements(0.0, self.block.initial)[0]
        self.log: list[tuple[float, int, int, int, float, float]] = []
        self.steps = 0
        self.smallest = np.inf
        self._limit = StepLimit(task.system, _MOST_STEPS, _MOST_A_PERIOD)

    def advance(self) -> Outcome:
        """Take steps for one slice of time."""
        begin = time.perf_counter()
        while self.stored < len(self.states):
            outcome = self._step()
            if outcome is not Outcome.SLICE_SPENT:
                return outcome
            if time.perf_counter() - begin > _SLICE:
                now = self.stepper.time / self.task.system.inputs.period
                tried = self.steps + self.stepper.rejected_steps
                return Outcome.NO_PROGRESS if self._limit.is_exceeded(tried, now) else Outcome.SLICE_SPENT
        return Outcome.DONE

    def _step(self) -> Outcome:
        """Take one step, log its crossings, store the samples in it."""
        # one step, and the elements at its end
        begin = self.stepper.time
        outcome = self.stepper.step()
        if outcome is not Outcome.SLICE_SPENT:
            return outcome
        end = self.stepper.time
        z = self.stepper.z
        self.steps = self.steps + 1
        self.smallest = min(self.smallest, end - begin)
        deflection, _, piece = self._elements(end, z)
        times = self.problem.sample_times
        # crossings and samples within the step, by its interpolant
        changed = np.flatnonzero(piece != self.piece)
        if changed.size or times[self.stored] < end:
            between = self.stepper.interpolant()
            passed = [e for k in changed for e in self._passed(int(k), int(piece[k]), deflection[k], begin, between)]
            self.log += sorted(passed)
            while self.stored < len(times) and times[self.stored] < end:
                self.states[self.stored] = between(float(times[self.stored])) * self.block.size
                self.stored += 1
        # a sample at its end
        while self.stored < len(times) and times[self.stored] <= end:
            self.states[self.stored] = z * self.block.size
            self.stored += 1
        self.piece = piece
        self.deflection = deflection
        return outcome

    def _elements(self, at: float, z: Array) -> tuple[Array, Array, NDArray[np.int64]]:
        """(m,) deflections, rates and pieces at a state."""
        elements: tuple[Array, Array, NDArray[np.int64]] = elements_at(self.block.field, at, z * self.block.size)
        return elements

    def _passed(
        self, k: int, target: int, after: float, begin: float, between: Interpolant
    ) -> list[tuple[float, int, int, int, float, float]]:
        """Log entries of the corners of one element between the pieces at the step's ends."""
        from scipy.optimize import toms748

        entries = []
        piece = int(self.piece[k])
        end = self.stepper.time
        carried = self.block.states - len(self.block.field.rows) + k
        while piece != target:
            up = 1 if target > piece else -1
            corner = float(self.task.system.laws[k].corners[piece if up > 0 else piece - 1])
            ends = {begin: self.deflection[k] - corner, end: after - corner}

            def distance(at: float, corner: float = corner, ends: dict[float, float] = ends) -> float:
                return float(ends[at] if at in ends else self._elements(at, between(at))[0][k] - corner)

            at = end
            if ends[begin] * ends[end] < 0.0:
                at = float(toms748(distance, begin, end, xtol=1e-300, rtol=_CLOSE))
            z = between(at)
            entries.append((at, k, piece, piece + up, float(self._elements(at, z)[1][k]), float(z[carried])))
            piece += up
        return entries

    def fraction(self) -> float:
        """Samples stored, as a fraction of all."""
        return self.stored / len(self.states)

    def position(self) -> Position:
        """Time, deflections (transmission errors left out) and the last clearance crossed."""
        last = self.log[-1][1] if self.log else None
        step = None if self.stepper.implicit else self._limit.average
        return self.problem.position(self.stepper.time, self.stepper.z * self.block.size, last, step)

    def motion(self) -> Motion:
        """Samples, crossings and the stepper's counts."""
        stepper = self.stepper
        end = float(self.problem.sample_times[-1])
        log = np.array(self.log, dtype=float).reshape(-1, 6)
        pieces = log[:, 2:4].astype(np.int64)
        return self.problem.motion(
            self.states,
            self.problem.crossings(log[:, 0], log[:, 1].astype(np.int64), pieces, log[:, 4], log[:, 5]),
            steps=self.steps,
            function_calls=stepper.function_calls,
            jacobian_calls=stepper.jacobian_calls,
            rejected_steps=stepper.rejected_steps,
            smallest_step=float(self.smallest),
            average_step=end / max(self.steps, 1),
            average_trial_step=stepper.tried / max(self.steps + stepper.rejected_steps, 1),
            notes=stepper.notes,
        )
