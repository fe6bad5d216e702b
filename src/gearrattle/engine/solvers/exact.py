"""``exact``: event-driven, certified, exact between corners.

Inside a region the motion is propagated by tables of the matrix exponential. Crossings are isolated and located to
rounding (``kernels.march``, ``kernels.taylor_window.first_crossing``, ``kernels.first_exit.first_exit``). The model is
not approximated: the only error is rounding, amplified by the sensitivity of the motion. A region is built when the
motion first enters it (``system.region_store``).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import march_arrays
from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.march import march_on
from gearrattle.engine.kernels.sample_notes import store_noted_samples
from gearrattle.engine.kernels.start_pieces import deflect
from gearrattle.engine.solvers.region_slots import Slots, packed_inputs, packed_instants, slots_of
from gearrattle.engine.solvers.samples_in_si import (
    StepLimit,
    chatters,
    crossings_of,
    doubled,
    empty_log,
    fastest_of,
    first_of,
    passages_of,
    sampled_quantities,
    sampled_z,
)
from gearrattle.engine.solvers.solver import Motion, Position, Task
from gearrattle.engine.solvers.start_region import starting_pieces
from gearrattle.engine.system.crossings_in_order import Auxiliaries
from gearrattle.engine.system.energy_audit import Auditor
from gearrattle.engine.system.flow import inputs_at_start
from gearrattle.engine.system.region_store import Size, aligned, strips_for
from gearrattle.outcome import Outcome

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_BUDGET = 20_000  # most steps per slice
_PRODUCTS = 100_000_000  # most multiplications per slice, some tenths of a second: Ctrl-C takes effect between slices
_BUILDING = 2.4e11  # most regions built in a period of the fastest input, times states cubed: about an hour
_NOTES = 1024  # most notes, each for one step with samples in it, before the samples are computed
_NOTED = 1_000_000  # most notes times samples per cycle


def notes_for(size: Size, per_cycle: int) -> march_arrays.Notes:
    """Arrays for notes: fewer where a step may pass many samples, so that computing the samples takes a short time."""
    room = max(1, min(_NOTES, _NOTED // per_cycle))
    whole = 4 * strips_for(size.longest)
    carried = 4 * strips_for(size.carried)
    row, count, slot = np.empty((3, room), np.int64)
    ahead, elapsed = np.empty((2, room))
    return march_arrays.Notes(row, count, slot, ahead, elapsed, np.empty((room, whole)), np.empty((room, carried)))


class ExactMarch:
    """A run of the exact algorithm under way (see ``solver.Marching``)."""

    def __init__(self, task: Task, slots: Slots | None = None) -> None:
        # the driveline and its regions
        self._march_on = vectorised(march_on)
        self._store_noted_samples = vectorised(store_noted_samples)
        self.task = task
        self.slots = slots_of(task.system) if slots is None else slots
        self.flow = self.slots.flow
        flow = self.flow
        scaling = self.flow.scaling
        size = self.slots.size
        # the state in the scales of the flow, and the pieces it starts in
        deflection = np.empty(len(flow.coordinates.elements))
        memory = np.zeros(size.memories) if task.memory is None else task.memory * flow.memory
        deflect(np.ascontiguousarray(flow.coordinates.basis), np.ascontiguousarray(task.angle, dtype=float), deflection)
        states = np.concatenate([deflection * scaling.deflection, task.velocity * scaling.velocity, memory])
        u = self._inputs_at_start()
        pieces, side = starting_pieces(flow, np.concatenate([states, u]), task.angle, task.auxiliary_pieces)
        # memories that are known in the first region
        known = flow.known(pieces)
        memory = states[size.states - size.memories : size.states]
        memory[:] = np.where(np.isnan(known), memory, known)
        # the march begins in the first region, without bounds; large counts make the first step compute the inputs
        counts = np.zeros(march_arrays.COUNTS, np.int64)
        counts[march_arrays.SLOT] = self.slots.slot_of(pieces)
        counts[march_arrays.PENDING] = -1
        counts[march_arrays.UNANCHORED] = 1 << 20
        counts[march_arrays.LEVEL] = self.slots.store.fine(counts[march_arrays.SLOT])
        # arrays padded to strips of four
        y = aligned(4 * strips_for(size.longest))
        y[: size.states] = states
        references = task.angle[list(flow.coordinates.references)]
        carried = aligned(4 * strips_for(size.carried))
        carried[: references.size] = references
        bound = aligned(4 * strips_for(3 * size.watched))
        self.march = march_arrays.March(
            y, carried, u[: size.inputs].copy(), np.zeros(4), counts, np.zeros(1), bound, side
        )
        # notes, inputs and log
        self.notes = notes_for(size, task.samples_per_cycle)
        self.inputs = packed_inputs(flow)
        self.log = empty_log(size.memories)
        # limits: steps per slice, steps in a period of the fastest input, regions built in one
        rows = size.longest + size.carried + 12 * size.watched
        self._most_steps = max(100, _PRODUCTS // (rows * size.longest))
        self._limit = StepLimit(task.system)
        most = max(1, int(_BUILDING / max(1, size.states) ** 3))
        self._built = 0
        self._limit_of_regions = StepLimit(task.system, most, most)
        self._begin(0, task.cycles, np.concatenate([states, carried[: size.carried]]))

    def _inputs_at_start(self) -> Array:
        """(U + Q,) scaled inputs at the start."""
        return inputs_at_start(self.flow)

    def _begin(self, first_cycle: int, cycles: int, sample: Array) -> None:
        """Allocate the samples of the next cycles, store the first one, which is known, and set the counts to zero."""
        # samples of these cycles, the first one known
        counts = self.march.counts
        per_cycle = self.task.samples_per_cycle
        rows = cycles * per_cycle + 1
        pieces_now = self.slots.pieces[counts[march_arrays.SLOT]]
        self.initial = np.array([pieces_now[k] for k in self.flow.system.places], dtype=np.int64)
        states = np.zeros((rows, sample.size))
        pieces = np.zeros((rows, self.initial.size), np.int64)
        states[0] = sample
        pieces[0] = self.initial
        self.samples = march_arrays.Samples(
            per_cycle, first_cycle * per_cycle, states, pieces, self.flow.waves(per_cycle)
        )
        self.first_cycle = first_cycle
        self.cycles = cycles
        # counts from zero, and the instants known beforehand
        counts[march_arrays.SAMPLE] = self.samples.first + 1
        counts[march_arrays.EVENTS] = 0
        self.instants = packed_instants(self.flow, counts, first_cycle + cycles)
        counts[march_arrays.INSTANT] = 0
        self.before = counts.copy(), float(self.march.tried[0])
        self.auditor: Auditor | None = None

    def extend(self, cycles: int) -> None:
        """Continue for some cycles more, with new samples and an empty log (see ``solver.Extensible``)."""
        self._begin(self.first_cycle + self.cycles, cycles, self.samples.states[-1])

    def snapshot(self) -> dict[str, Array | IntArray]:
        """The arrays of the march, its last sample and cycle, and the pieces of its region (slots differ by run)."""
        arrays = {name: np.array(value) for name, value in self.march._asdict().items()}
        region = np.array(self.slots.pieces[self.march.counts[march_arrays.SLOT]], dtype=np.int64)
        cycle = np.array(self.first_cycle + self.cycles)
        arrays["counts"][march_arrays.SLOT] = 0
        return {**arrays, "sample": self.samples.states[-1].copy(), "region": region, "cycle": cycle}

    def restore(self, snapshot: Mapping[str, Array | IntArray], cycles: int) -> None:
        """Continue from a snapshot for some cycles."""
        for name, value in self.march._asdict().items():
            value[...] = snapshot[name]
        self.march.counts[march_arrays.SLOT] = self.slots.slot_of(tuple(int(piece) for piece in snapshot["region"]))
        self._begin(int(snapshot["cycle"]), cycles, np.asarray(snapshot["sample"], dtype=float))

    def advance(self) -> Outcome:
        """March one slice; once all samples are stored, audit one slice."""
        if self.auditor is not None:
            return Outcome.DONE if self.auditor.advance() else Outcome.SLICE_SPENT
        outcome = self._march()
        if outcome is Outcome.DONE and self.task.audit:
            self.auditor = self._audit()
            return Outcome.AUDIT_TOO_LONG if self.auditor.is_endless else Outcome.SLICE_SPENT
        return outcome

    def _march(self) -> Outcome:
        """March one slice; build the next region or grow the log where the kernel asks for it."""
        counts = self.march.counts
        regions = self.slots.packed
        # one slice of the compiled march, then the states at the samples that it noted
        budget = min(_BUDGET, self._most_steps)
        outcome = Outcome(
            self._march_on(regions, self.inputs, self.instants, self.march, self.samples, self.notes, self.log, budget)
        )
        if counts[march_arrays.NOTED]:
            self._store_noted_samples(regions, self.inputs, self.notes, self.samples, counts)
        # the march asks for an empty list of notes, the next region or a larger log
        if outcome is Outcome.NOTES_FULL:
            return Outcome.SLICE_SPENT
        if outcome is Outcome.NEEDS_REGION:
            return self._enter_next_region()
        if outcome is Outcome.LOG_FULL:
            self.log = doubled(self.log)
            return Outcome.SLICE_SPENT
        if outcome is Outcome.SLICE_SPENT:
            # a march that would not end
            now = self._now()
            if chatters(self.log, int(counts[march_arrays.EVENTS]), now):
                return Outcome.CHATTER
            if self._limit.is_exceeded(int(counts[march_arrays.STEPS]), now):
                return Outcome.NO_PROGRESS
        return outcome

    def _enter_next_region(self) -> Outcome:
        """Go to the region across the corner; build it if it is new."""
        counts = self.march.counts
        before = self.slots
        known = len(self.slots.pieces)
        clearance, upward = divmod(int(counts[march_arrays.PENDING]), 2)
        self.slots, counts[march_arrays.SLOT] = before.beyond(int(counts[march_arrays.SLOT]), clearance, upward)
        counts[march_arrays.PENDING] = -1
        self._built += self.slots is not before or len(self.slots.pieces) > known
        is_exceeded = self._limit_of_regions.is_exceeded(self._built, self._now())
        return Outcome.TOO_MANY_REGIONS if is_exceeded else Outcome.SLICE_SPENT

    def _now(self) -> float:
        """The time of the march in periods."""
        return float(self.march.counts[march_arrays.CYCLE] + self.march.clock[:2].sum())

    def fraction(self) -> float:
        """Samples stored as a fraction of all; with an audit, the march and the audit count half each."""
        marched = float((self.march.counts[march_arrays.SAMPLE] - self.samples.first) / len(self.samples.pieces))
        if not self.task.audit:
            return marched
        return 0.5 * marched if self.auditor is None else 0.5 + 0.5 * self.auditor.fraction()

    def position(self) -> Position:
        """Time, deflections and the last clearance crossed."""
        counts = self.march.counts
        cycle = counts[march_arrays.CYCLE]
        fraction = self.march.clock[:2].sum()
        states = self.march.y[: self.flow.states].copy()
        if counts[march_arrays.ENTERED]:
            states += self.slots.store.particular(counts[march_arrays.SLOT]) @ self.march.u
        z = np.concatenate([states, self.flow.inputs_at(np.array([cycle]), np.array([fraction]))[0]])
        deflection = self.flow.deflection[list(self.flow.system.clearances)] @ z
        time = (cycle + fraction) * self.flow.system.inputs.period
        pieces = self.slots.pieces[counts[march_arrays.SLOT]]
        return Position(float(time), deflection, self._last_crossed(), fastest_of(self.flow.system, pieces))

    def _last_crossed(self) -> int | None:
        """The clearance that was crossed last, by its own corner or by that of its auxiliary element."""
        count = int(self.march.counts[march_arrays.EVENTS])
        system = self.flow.system
        if not count:
            return None
        element = system.element_watched(int(self.log.clearance[count - 1]))
        return system.clearances.index(element) if element in system.clearances else None

    def motion(self) -> Motion:
        """Angles, accelerations and forces from the sampled states, with the region in which the sample lies."""
        flow = self.flow
        period = self.flow.system.inputs.period
        counted = self.march.counts - self.before[0]
        tried = float(self.march.tried[0]) - self.before[1]
        steps = int(counted[march_arrays.STEPS])
        sampled, (forces, memory) = sampled_quantities(flow, self.samples)
        clearances = len(flow.system.clearances)
        log = self.logged()
        auxiliaries = None
        if flow.system.auxiliaries:
            pieces = self.samples.pieces[:, clearances:]
            initial = self.initial[clearances:]
            auxiliaries = Auxiliaries(forces, memory, pieces, initial, passages_of(flow, log))
        return Motion(
            **sampled,
            crossings=crossings_of(flow, log),
            auxiliaries=auxiliaries,
            initial_piece=self.initial[:clearances],
            final_force_integral=self.samples.states[-1, flow.states + len(flow.coordinates.references) :].copy(),
            steps=steps,
            function_calls=steps + int(counted[march_arrays.EXPANSIONS]),
            average_step=self.cycles * period / max(steps, 1),
            average_trial_step=tried / max(int(counted[march_arrays.TRIALS]), 1) * period,
            energy=None if self.auditor is None else self.auditor.result(),
        )

    def sampled_z(self) -> Array:
        """(t, Z) states and inputs at the samples, once all samples are stored."""
        return sampled_z(self.flow, self.samples)

    def _audit(self) -> Auditor:
        system = self.flow.system
        log = self.logged()
        pieces = [0] * (len(system.laws) + len(system.auxiliaries))
        for k, piece in zip(system.places, self.initial, strict=True):
            pieces[k] = int(piece)
        return Auditor(
            self.flow,
            tuple(pieces),
            samples=lambda rows: sampled_z(self.flow, self.samples, rows),
            count=len(self.samples.states),
            per_cycle=self.samples.per_cycle,
            time=log.cycle + log.fraction - self.first_cycle,
            watch=log.clearance,
            upward=log.upward,
            memory=log.memory,
            first_cycle=self.first_cycle,
        )

    def logged(self) -> march_arrays.Log:
        """The crossings so far, in the order in which they came."""
        return first_of(self.log, int(self.march.counts[march_arrays.EVENTS]))
