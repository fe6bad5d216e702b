"""The common part of the solvers of the plain equation of motion: state vector, scales, the way to a motion.

They integrate y = (x, v, r, I): basis deflections, velocities, reference angles, force integrals
(``kernels.equation_of_motion``), stepping through corners or restarting at them; ``exact`` shares none of this.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.sampling import element_samples, elements_at
from gearrattle.engine.kernels.variant_arrays import Crossings
from gearrattle.engine.solvers.samples_in_si import rates_of
from gearrattle.engine.solvers.solver import Motion, Position, Task
from gearrattle.engine.solvers.start_region import starting_pieces
from gearrattle.engine.system.flow import Flow, flow_of
from gearrattle.engine.system.region_arrays import RegionBuilder
from gearrattle.engine.system.vector_field_arrays import field_of
from gearrattle.slices import slices

if TYPE_CHECKING:
    from gearrattle.engine.kernels.equation_of_motion import Field

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_HELD_BY_STABILITY = 0.02
"""Mean step times the rate of the fastest element: above, its stability bound, not the error, holds steps short."""


@dataclass(frozen=True)
class FieldProblem:
    """A task as an initial-value problem y' = f(t, y)."""

    task: Task
    flow: Flow
    field: Field
    start: tuple[int, ...]  # (m,) the piece of every element at t = 0

    @classmethod
    def of(cls, task: Task) -> FieldProblem:
        """Choose coordinates and write the right-hand side down."""
        flow = flow_of(task.system)
        scaled = [
            flow.coordinates.basis @ task.angle * flow.scaling.deflection,
            task.velocity * flow.scaling.velocity,
            flow.inputs_at(np.zeros(1), np.zeros(1))[0],
        ]
        start = starting_pieces(flow, np.concatenate(scaled), task.angle)[0]
        return cls(task, flow, field_of(task.system, flow.coordinates), start)

    @property
    def active(self) -> int:
        """N: x and v, which feed back into the motion; r and I behind them are integrals of it."""
        return self.flow.states

    @cached_property
    def initial(self) -> Array:
        """(S,) y at t = 0."""
        task = self.task
        coordinates = self.flow.coordinates
        deflection = coordinates.basis @ task.angle
        references = task.angle[list(coordinates.references)]
        return np.concatenate([deflection, task.velocity, references, np.zeros(len(task.system.laws))])

    @cached_property
    def size(self) -> Array:
        """(N,) size of x and v in an ordinary motion [SI]: what an error tolerance is relative to."""
        scaling = np.concatenate([self.flow.scaling.deflection, self.flow.scaling.velocity])
        return np.asarray(RegionBuilder(self.flow).typical_size / scaling)

    @cached_property
    def sample_times(self) -> Array:
        """(t,) output grid [s]."""
        rows = self.task.cycles * self.task.samples_per_cycle + 1
        return np.asarray(np.arange(rows) * (self.task.system.inputs.period / self.task.samples_per_cycle))

    def deflections(self, y: Array) -> Array:
        """(K,) deflections of the clearances at the state y, transmission errors left out [SI]."""
        clearances = list(self.task.system.clearances)
        return np.asarray(self.field.combination[clearances] @ y[: len(self.flow.coordinates.elements)])

    def position(self, time: float, y: Array, last_element: int | None, step: float | None = None) -> Position:
        """Present position of a run.

        time: [s].
        last_element: the element that crossed last.
        step: mean step of an explicit algorithm that took too many, in periods. Where the rate of the fastest element,
            and not the error, may have held it so short, the place names that element.
        """
        last = None if last_element is None else list(self.task.system.clearances).index(last_element)
        return Position(time, self.deflections(y), last, None if step is None else self._limiting(time, y, step))

    def _limiting(self, time: float, y: Array, step: float) -> int | None:
        system = self.task.system
        rates = rates_of(system, elements_at(self.field, time, y)[2])
        fastest = int(np.argmax(rates))
        return fastest if step * system.inputs.period * rates[fastest] > _HELD_BY_STABILITY else None

    def crossings(self, time: Array, element: IntArray, pieces: IntArray, rate: Array, integral: Array) -> Crossings:
        """A log by element: (E,) times, elements, (E, 2) pieces left and entered, rates and force integrals."""
        row_of = {k: i for i, k in enumerate(self.task.system.clearances)}
        clearance = np.array([row_of[int(k)] for k in element], dtype=np.int64)
        return Crossings(time.copy(), clearance, pieces[:, 0].copy(), pieces[:, 1].copy(), rate.copy(), integral.copy())

    def motion(self, states: Array, crossings: Crossings, **counted: Any) -> Motion:
        """The motion of (t, S) sampled states; accelerations and forces from the equation of motion at them.

        states: y at ``sample_times``.
        counted: the fields of ``Motion`` on cost, and its notes.
        """
        # room for all samples
        system = self.task.system
        coordinates = self.flow.coordinates
        r = len(coordinates.elements)
        n = system.size
        clearances = list(system.clearances)
        angle, velocity, acceleration = np.empty((3, len(states), n))
        force = np.empty((len(states), len(system.laws)))
        deflection = np.empty((len(clearances), len(states))).T
        pieces = np.empty((len(clearances), len(states)), np.int64).T
        # accelerations, deflections and forces from the equation of motion, part by part
        for part in slices(*states.shape):
            some = states[part]
            time = self.sample_times[part]
            acceleration[part], deflections, piece, force[part] = element_samples(self.field, time, some)
            deflection[part] = deflections[:, clearances]
            pieces[part] = piece[:, clearances]
            # angles from deflections and from the angles of the references
            references = some[:, r + n : r + n + len(coordinates.references)]
            turned = references @ coordinates.angle_from_reference.T
            angle[part] = some[:, :r] @ coordinates.angle_from_basis.T + turned
            velocity[part] = some[:, r : r + n]
        # with the pieces at the start and the force integrals at the end
        return Motion(
            angle=angle,
            velocity=velocity,
            acceleration=acceleration,
            deflection=deflection,
            force=force,
            piece=pieces,
            crossings=crossings,
            initial_piece=np.array([self.start[k] for k in clearances], dtype=np.int64),
            final_force_integral=states[-1, r + n + len(coordinates.references) :][clearances],
            **counted,
        )
