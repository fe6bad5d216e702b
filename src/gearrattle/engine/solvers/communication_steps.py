"""``exact`` in communication steps of any length, under torques and errors that are known for one step at a time.

The system has ``Signals`` with one channel for every quantity that comes from outside. Their polynomials are not known
beforehand: each step brings those of its own interval, which are written into arrays of this march alone, so that
marches of one driveline share its regions and nothing else. The march ends exactly at the end of the step, and goes on
from there: the bits are those of one long run under signals with the same knots.

At the end of a step (a *communication point*) all quantities are left limits, under the inputs of this step.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from math import ceil, floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import march_arrays
from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.communication_point import state_at_point
from gearrattle.engine.kernels.sampling import Quantities, quantities_at
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.samples_in_si import forces_beside, lines_of
from gearrattle.engine.solvers.solver import Task
from gearrattle.engine.solvers.step_audit import StepAudit
from gearrattle.engine.system.energy_audit import EnergyAudit
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.piecewise_channels import shifted
from gearrattle.engine.system.piecewise_signals import Signals
from gearrattle.outcome import Outcome

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_NEVER = 1 << 50  # number of the next sample: none is taken
_BOUNDS_END = 1 << 20  # steps since the bounds were computed: they are computed at once
_ROUNDED = 1e-9  # part of a step that counts as rounding
_OWN = ("knot_cycle", "knot_fraction", "chains")  # inputs of one march alone


def with_channels(system: PiecewiseSystem, torque: Array, error: Array, step: float, degree: int) -> PiecewiseSystem:
    """Return a system without signals, with channels for a co-simulation, all zero.

    torque: (n, C) torque on every inertia for a unit of every channel.
    error: (m, C) transmission error of every element for a unit of every channel; continuous with its first derivative.
    step: usual length of a communication step, by which chains are scaled, and for which bounds hold [s].
    degree: of the polynomials, 3 at most.
    """
    coefficients = np.zeros((1, torque.shape[1], degree + 1))
    return replace(system, signals=Signals(np.array([0.0, step]), coefficients, torque, error))


class Point(NamedTuple):
    """A motion at a communication point [SI]."""

    # angle, velocity, acceleration: (n,) of the degrees of freedom
    angle: Array
    velocity: Array
    acceleration: Array
    force: Array  # (m,) of every element
    deflection: Array  # (K,) of the clearances
    piece: IntArray  # (W,) of the clearances, then of the auxiliaries
    memory: Array  # (auxiliaries,) state e of every auxiliary


class Begin(NamedTuple):
    """Where a co-simulation begins: a time in periods of the inputs, and polynomials that hold just before it."""

    cycle: int = 0
    fraction: float = 0.0
    coefficients: Array | None = None  # (C, D + 1); None for zero


FROM_ZERO = Begin()


class CommunicationSteps(ExactMarch):
    """A motion under way, from one communication point to the next."""

    def __init__(self, task: Task, begin: Begin = FROM_ZERO) -> None:
        """Begin at a state.

        task: its system has channels (``with_channels``); its cycles and samples do not count.
        """
        signals = task.system.signals
        assert signals is not None
        self._shape = signals.coefficients.shape[1:]
        self._longest = float(signals.knots[-1]) / task.system.inputs.period
        self._begins = begin
        super().__init__(replace(task, cycles=1, samples_per_cycle=1, audit=False))
        # time, and the changes by the clock that have passed
        counts = self.march.counts
        counts[march_arrays.CYCLE] = begin.cycle
        self.march.clock[0] = begin.fraction
        if (clock := task.system.clock) is not None:
            cycle, fraction, _ = clock.ticks(0, begin.cycle, task.system.inputs.period)
            counts[march_arrays.TICKS] = int(np.sum((cycle < begin.cycle) | (fraction < begin.fraction)))
        # inputs of this march alone: one interval, from the present point on
        self.at = float(begin.cycle), begin.fraction
        shared = self.inputs
        self.inputs = shared._replace(
            knot_cycle=shared.knot_cycle.copy(), knot_fraction=shared.knot_fraction.copy(), chains=shared.chains.copy()
        )
        self.inputs.knot_cycle[0], self.inputs.knot_fraction[0] = self.at
        self.inputs.chains[0, :, : self._shape[1]] = self._coefficients_at_start() * self._units
        # what a point is computed with
        flow = self.flow
        self._state_at_point = vectorised(state_at_point)
        self._quantities_at = vectorised(quantities_at)
        self._lines = lines_of(flow)
        self._state = np.zeros((1, flow.states + self.slots.size.carried))
        self._driving = np.zeros((1, flow.inputs + flow.chain.size))
        self._balance = StepAudit(flow) if task.audit else None

    def _coefficients_at_start(self) -> Array:
        """(C, D + 1) polynomials that hold just before the start."""
        known = self._begins.coefficients
        return np.zeros(self._shape) if known is None else known

    def _inputs_at_start(self) -> Array:
        cycle, fraction, _ = self._begins
        waves = self.flow.inputs_at(np.array([float(cycle)]), np.array([fraction]))[0, : self.flow.inputs]
        return np.concatenate([waves, (self._coefficients_at_start() * self._units).ravel()])

    @cached_property
    def _units(self) -> Array:
        """(C, D + 1) entries of the chains for a unit of every coefficient."""
        signals = self.task.system.signals
        assert signals is not None
        ones = replace(signals, coefficients=np.ones((1, *self._shape)))
        return np.asarray(ones.chains(self.task.system.inputs.period)[0] * self.flow.chain).reshape(self._shape)

    def _begin(self, first_cycle: int, cycles: int, sample: Array) -> None:
        """Begin without samples."""
        none = np.zeros((1, self.march.side.size), np.int64)
        waves = np.zeros((0, self.flow.inputs))
        self.samples = march_arrays.Samples(1, _NEVER, sample[None], none, waves)
        self.first_cycle = first_cycle
        self.cycles = cycles
        self.march.counts[march_arrays.SAMPLE] = _NEVER
        self.auditor = None

    def step(self, end: float, coefficients: Array) -> Outcome:
        """March on to ``end``; return DONE, or why it is not reached.

        end: the next communication point, in periods from the begin of time.
        coefficients: (C, D + 1) polynomials up to there, of ascending powers of the time since the present point [SI].
        """
        # a step that is audited
        counts = self.march.counts
        begin = self.at
        whole = floor(end)
        length = (whole - begin[0]) + (end - whole - begin[1])
        if self._balance is not None:
            here = self._here()
            pieces = self.slots.pieces[counts[march_arrays.SLOT]]
            if self._balance.ends_before(length):
                self._balance.finish(here)
        # march, in parts that are no longer than the usual step: bounds hold that long
        counts[march_arrays.EVENTS] = 0
        parts = max(1, ceil(length / self._longest * (1.0 - _ROUNDED)))
        for i in range(1, parts):
            since = length * (i - 1) / parts
            now = begin[0] + begin[1] + length * i / parts
            outcome = self._march_to(floor(now), now - floor(now), self._later(coefficients, since))
            if outcome is not Outcome.DONE:
                return outcome
        last = coefficients if parts == 1 else self._later(coefficients, length * (parts - 1) / parts)
        outcome = self._march_to(whole, end - whole, last)
        if outcome is Outcome.DONE and self._balance is not None:
            log = self.logged()
            time = (log.cycle - begin[0]) + (log.fraction - begin[1])
            self._balance.add(length, here, coefficients, pieces, log=log, time=time)
        return outcome

    def _later(self, coefficients: Array, since: float) -> Array:
        """(C, D + 1) the same polynomials about a later time, in periods."""
        return shifted(coefficients, np.full(len(coefficients), since * self.task.system.inputs.period))

    def _march_to(self, cycle: int, fraction: float, coefficients: Array) -> Outcome:
        """March on to a time under polynomials, with bounds that are computed anew."""
        counts = self.march.counts
        self.inputs.knot_cycle[0], self.inputs.knot_fraction[0] = self.at
        self.inputs.chains[0, :, : self._shape[1]] = coefficients * self._units
        counts[march_arrays.UNBOUNDED] = _BOUNDS_END
        # instants: changes by the clock, then the end
        self.instants = self._instants(cycle, fraction)
        counts[march_arrays.INSTANT] = 0
        while (outcome := self._march()) is Outcome.SLICE_SPENT:
            pass
        if outcome is Outcome.DONE:
            self.at = float(cycle), fraction
        return outcome

    def energy(self) -> EnergyAudit | None:
        """The audit of all steps so far; None without a step, or if the task has no audit."""
        if self._balance is None:
            return None
        self._balance.finish(self._here())
        return self._balance.total

    def _instants(self, cycle: int, fraction: float) -> march_arrays.Instants:
        """The changes by the clock before an end, and the end."""
        cycles = np.array([cycle, np.inf])
        fractions = np.array([fraction, 0.0])
        watch = np.array([march_arrays.LAST, -1], dtype=np.int64)
        clock = self.task.system.clock
        if clock is None:
            return march_arrays.Instants(cycles, fractions, watch)
        passed = int(self.march.counts[march_arrays.TICKS])
        whole, part, auxiliary = clock.ticks(passed, cycle, self.task.system.inputs.period)
        before = (whole < cycle) | (part < fraction)
        first = len(self.task.system.clearances)
        return march_arrays.Instants(
            np.append(whole[before], cycles),
            np.append(part[before], fractions),
            np.append(auxiliary[before] + first, watch),
        )

    def _write_state(self, regions: march_arrays.Regions) -> None:
        """Write the state and the inputs at the present point."""
        solutions = (regions.particular, regions.drift)
        self._state_at_point(*solutions, self.flow.states, self.inputs, self.march, self._state[0], self._driving[0])

    def _here(self) -> Array:
        """(N + U,) states and inputs at the present point, without chains."""
        self._write_state(self.slots.packed)
        return np.concatenate([self._state[0, : self.flow.states], self._driving[0, : self.flow.inputs]])

    def point(self) -> Point:
        """The motion at the present communication point."""
        flow = self.flow
        regions = self.slots.packed
        slot = int(self.march.counts[march_arrays.SLOT])
        self._write_state(regions)
        pieces = regions.piece[slot : slot + 1]
        # forces of auxiliaries, then all quantities
        force = np.zeros((1, len(flow.system.laws)))
        memory = np.zeros(0)
        if flow.system.auxiliaries:
            z = np.hstack([self._state[:, : flow.states], self._driving])
            of_auxiliaries, memories = forces_beside(flow, z, pieces)
            memory = memories[0]
            for c, auxiliary in enumerate(flow.system.auxiliaries):
                force[0, auxiliary.element] += of_auxiliaries[0, c]
        angle, velocity, acceleration = np.empty((3, 1, flow.system.size))
        out = Quantities(angle, velocity, acceleration, force, np.empty((len(flow.system.clearances), 1)))
        self._quantities_at(self._lines, self._state, pieces, self._driving, 0, out, 0)
        return Point(angle[0], velocity[0], acceleration[0], force[0], out.deflection[:, 0], pieces[0].copy(), memory)

    def crossed(self) -> Iterator[tuple[int, int, int, float]]:
        """Yield clearance, piece before and after, and rate of every crossing of the last step [SI]."""
        log = self.logged()
        unit = self.flow.corner_scale / self.flow.system.inputs.period
        clearances = len(self.flow.system.clearances)
        for k, piece, upward, rate in zip(
            log.clearance.tolist(), log.piece.tolist(), log.upward.tolist(), log.rate.tolist(), strict=True
        ):
            if k < clearances:
                yield k, piece, piece + 2 * upward - 1, rate * float(unit[k])

    def snapshot(self) -> dict[str, Array | IntArray]:
        """All that a march of the same driveline needs to go on from here; owns its arrays."""
        inputs = {name: getattr(self.inputs, name).copy() for name in _OWN}
        return {**super().snapshot(), **inputs, "at": np.array(self.at)}

    def restore(self, snapshot: Mapping[str, Array | IntArray], cycles: int = 1) -> None:
        """Go on from a snapshot; the cycles do not count, and an audit begins anew."""
        super().restore(snapshot, cycles)
        for name in _OWN:
            getattr(self.inputs, name)[...] = snapshot[name]
        self.at = float(snapshot["at"][0]), float(snapshot["at"][1])
        self._balance = None if self._balance is None else StepAudit(self.flow)
