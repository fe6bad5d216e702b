"""The period map: the state n periods later as a function of the state, and its gradient.

The state at t = 0 determines the motion: y = (x, v, e), independent deflections, velocities and memories of
auxiliaries, and the pieces of the auxiliaries. The angles through which a free train turns as a whole are not part of
the state; they are stored separately. Vectors and matrices are in SI units; norms are norms of scale * y, the engine's
scaled coordinates (``system.energy_scaling``), and are roots of energies.

The map is ``exact``'s: crossings certified, its gradient by exponentials and saltations
(``system.perturbation_growth``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import march_arrays
from gearrattle.engine.periodic.motion import DECIDED, Pass, State
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.region_slots import Slots, slots_of
from gearrattle.engine.solvers.samples_in_si import passages_of
from gearrattle.engine.solvers.scheme_choice import is_large_for_periods
from gearrattle.engine.solvers.solver import Marching, Task
from gearrattle.engine.solvers.start_region import starting_pieces
from gearrattle.engine.solvers.window_solver import SweepMarch
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.deflection_levels import deflection_levels
from gearrattle.engine.system.flow import Pieces, flow_of
from gearrattle.engine.system.perturbation_growth import variation
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ConvergenceError
from gearrattle.outcome import Outcome
from gearrattle.time_limits import check_time

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
_PERIODIC = 1e-9
"""Largest difference of the cycles per period from whole numbers."""


class Marched(NamedTuple):
    """A march that has ended."""

    samples: march_arrays.Samples
    initial: IntArray  # (W,) pieces of the watched quantities at the start
    log: march_arrays.Log
    cycles: int


class PeriodMap:
    """The map of one driveline over n of its periods.

    system: the driveline; its inputs repeat.
    ValueError: inputs that must repeat do not: signals over time, or orders without a common period.
    """

    def __init__(self, system: PiecewiseSystem, cycles: int = 1, *, repeats: bool = True) -> None:
        wave = system.inputs.cycles
        if repeats and (system.signals is not None or np.any(np.abs(wave - np.round(wave)) > _PERIODIC)):
            raise ValueError("inputs that do not repeat")
        self.system = system
        self.cycles = cycles
        self.flow = flow_of(system)
        self._slots: Slots | None = None
        scaling = self.flow.scaling
        self.scale: Array = np.concatenate([scaling.deflection, scaling.velocity, self.flow.memory])
        self._parts = np.cumsum([scaling.deflection.size, scaling.velocity.size])

    @property
    def length(self) -> float:
        """Duration of n periods [s]."""
        return self.cycles * self.system.inputs.period

    @property
    def regions(self) -> int:
        """Number of regions that are built, by marches of this map or of earlier maps of the same system."""
        return 0 if self._slots is None else len(self._slots.pieces)

    @property
    def repeats_one_period(self) -> bool:
        """Whether it is the map over one period, applied several times."""
        return self.cycles > 1

    @property
    def size(self) -> float:
        """The largest corner of the basis elements in balanced coordinates, the unit of norms; 1 without corners."""
        corners = [float(np.abs(law.corners).max(initial=0.0)) for law in self.system.laws]
        basis = self.flow.coordinates.elements
        sizes = [corners[k] * scale for k, scale in zip(basis, self.flow.scaling.deflection, strict=True)]
        return max(sizes, default=0.0) or 1.0

    def state_of(self, angle: Array, velocity: Array) -> State:
        """Return the state at (n,) angles [rad] and velocities [rad/s], no memory loaded."""
        deflection = self.flow.coordinates.basis @ angle
        memory = np.zeros(self.flow.memory.size)
        return State(np.concatenate([deflection, velocity, memory]))

    def task(self, state: State, cycles: int, samples_per_cycle: int = 1) -> Task:
        """Return the task of ``exact`` from a state, reference inertias at zero."""
        deflection, velocity, memory = np.split(state.y, self._parts)
        angle = self.flow.coordinates.angle_from_basis @ deflection
        return Task(
            system=self.system,
            angle=angle,
            velocity=velocity,
            cycles=cycles,
            samples_per_cycle=samples_per_cycle,
            tolerance=None,
            step=None,
            audit=False,
            memory=memory,
            auxiliary_pieces=state.auxiliary_pieces,
        )

    def __call__(self, state: State) -> Pass:
        """Follow a state over n periods."""
        march = self.marched(state)
        crossings = self.passages(march)
        gradient = self.gradient_along(march, crossings)
        turned = self.turned(march, -1)
        start = self._consistent(state, march)
        end = self.sampled(march, -1)
        return Pass(start, end, gradient, turned, crossings, self.system.inputs.period, self.cycles)

    def _consistent(self, state: State, march: Marched) -> State:
        """A start with pieces that its region allows, and the values of memories that are known in these pieces."""
        memories = self.flow.memory.size
        if not memories:
            return state
        own = state.y[-memories:]
        begun = self.sampled(march, 0)
        is_kept = (
            own * self.scale[-memories:] == march.samples.states[0, self.flow.states - memories : self.flow.states]
        )
        memory = np.where(is_kept, own, begun.y[-memories:])
        return State(np.append(state.y[:-memories], memory), begun.auxiliary_pieces)

    def gradient_along(self, march: Marched, crossings: Passages) -> Array:
        """Return the gradient (N, N) [SI] of a march that is done, over the length of the map, from its crossings."""
        return variation(self.flow, self.pieces_of(march.initial), crossings, end=self.length).gradient()

    def pieces_of(self, watched: IntArray) -> Pieces:
        """Return the pieces of laws and auxiliaries, from those (W,) of all that may cross."""
        pieces = [0] * (len(self.system.laws) + len(self.system.auxiliaries))
        for k, piece in zip(self.system.places, watched.tolist(), strict=True):
            pieces[k] = piece
        return tuple(pieces)

    def turned(self, march: Marched, row: int) -> Array:
        """Return the angles (R,) [rad] through which the reference inertias have turned, up to a sample of a march."""
        angles = slice(self.flow.states, self.flow.states + len(self.flow.coordinates.references))
        return np.asarray(march.samples.states[row, angles] - march.samples.states[0, angles])

    def levels(self, motion: Pass) -> Array:
        """Return (3, K) lowest, highest and mean deflection of every clearance along a motion [SI]."""
        return deflection_levels(self.flow, *self.along(motion))

    def along(self, motion: Pass) -> tuple[Pieces, Array, Passages, float]:
        """Return what a motion is followed by: pieces and balanced states at its start, crossings, length [s]."""
        task = self.task(motion.start, 1)
        y = motion.start.y * self.scale
        z = np.concatenate([y, self.flow.inputs_at(np.zeros(1), np.zeros(1))[0]])
        pieces, _ = starting_pieces(self.flow, z, task.angle, task.auxiliary_pieces)
        return pieces, y, motion.crossings, self.length

    def later(self, state: State, passes: int = 1) -> State:
        """Return the state after some passes of n periods, without the gradient. Errors as in a call."""
        return self.sampled(self.marched(state, passes), -1)

    def sampled(self, march: Marched, row: int) -> State:
        """Return the state at a sample of a march that is done."""
        clearances = len(self.system.clearances)
        states = march.samples.states[row, : self.flow.states] / self.scale
        return State(states, self.kept_pieces(march.samples.pieces[row, clearances:]))

    def kept_pieces(self, pieces: IntArray) -> IntArray:
        """Return (C,) pieces of auxiliaries with ``DECIDED`` for those without a memory."""
        remembers = np.array([auxiliary.remembers for auxiliary in self.system.auxiliaries], dtype=np.bool_)
        return np.where(remembers, pieces, DECIDED).astype(np.int64)

    def passages(self, march: Marched) -> Passages:
        """Return the crossings of a finished march, with every change by the clock after its start, up to its end.

        A change at the very end is of this motion; at its start nothing changes, for it begins behind that.
        """
        path = passages_of(self.flow, march.log)
        clock = self.system.clock
        clearances = len(self.system.clearances)
        if clock is None or not clock.repeats:
            return path
        by_clock = np.flatnonzero(np.isin(path.watch - clearances, clock.auxiliary))
        count = march.cycles * len(clock.time)
        if len(by_clock) > count:
            return path.where(np.delete(np.arange(len(path.time)), by_clock[count:]))
        left = clock.auxiliary[np.arange(len(by_clock), count) % len(clock.time)]  # at the end, except for rounding
        return path.and_later(march.cycles * self.system.inputs.period, left + clearances)

    def marched(self, state: State, passes: int = 1, samples_per_cycle: int = 1) -> Marched:
        """Return the finished march from a state over some passes of n periods. Errors as in a call."""
        task = self.task(state, passes * self.cycles, samples_per_cycle)
        if is_large_for_periods(self.system):  # building its regions would take most of the time
            sweep = SweepMarch(task)
            self._finish(sweep)
            return Marched(sweep.stored(), sweep.initial, sweep.logged(), task.cycles)
        march = ExactMarch(task, slots_of(self.system) if self._slots is None else self._slots)
        self._finish(march)
        self._slots = march.slots
        return Marched(march.samples, march.initial, march.logged(), task.cycles)

    def _finish(self, march: Marching) -> None:
        check_time()
        while (outcome := march.advance()) is not Outcome.DONE:
            check_time()
            if outcome is not Outcome.SLICE_SPENT:
                now = march.position().time
                raise ConvergenceError(f"exact: {outcome.name} at t = {now:.9g} s", time=now, remedy=outcome.advice)
