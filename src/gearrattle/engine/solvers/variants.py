"""Variants of a driveline that differ in numbers alone, marched by ``exact`` and evaluated in one compiled loop.

The loop (``kernels.variants_march``) calls the machine code of a single run, so every variant has the same bits as in a
run by itself. The interpreter lock is released for a few hundred milliseconds at a time, so threads run in parallel.
Variants that the loop cannot do - no equilibrium, a start on a corner, a state that is not finite, chatter - are marked
and left to single runs.

On request the motion over the last cycles of every variant is available; the samples of one variant are in memory at a
time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import (
    equilibrium_kernel,
    march,
    march_arrays,
    region_stages,
    rigid_response,
    sample_notes,
    state_scaling,
    variant_common,
    variants_march,
)
from gearrattle.engine.kernels._jit import address_of, compact, is_compiling, vectorised
from gearrattle.engine.kernels._llvm import lapack_address
from gearrattle.engine.kernels.variant_arrays import (
    Coefficients,
    Frame,
    Judged,
    Scales,
    Statics,
    Tallies,
    picked,
    room_for,
)
from gearrattle.engine.kernels.variants_march import Buffers
from gearrattle.engine.solvers.exact import notes_for
from gearrattle.engine.solvers.region_slots import packed_inputs, packed_instants
from gearrattle.engine.solvers.samples_in_si import (
    StepLimit,
    chatters,
    crossings_of,
    doubled,
    empty_log,
    first_of,
    sampled_quantities,
)
from gearrattle.engine.solvers.scheme_choice import is_large
from gearrattle.engine.solvers.solver import Motion
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.equilibrium import elastic_elements, statics_of
from gearrattle.engine.system.flow import Flow, flow_of
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.plain_arrays import frame_of
from gearrattle.engine.system.region_store import Capacity, Size, Store, aligned, strips_for

Array = NDArray[np.float64]

_SLICES = 20  # slices, each of 20 000 steps or one variant, between two checks for an end
_VECTORISED = ("march_on", "store_noted_samples")  # as a single run compiles them
_LARGEST_LOG = 1 << 21  # crossings; a motion with more is left to a single run


class Kept(NamedTuple):
    """The samples that are kept of a variant: those of its last cycles."""

    per_cycle: int
    cycles: int


END = Kept(1, 0)
"""The state at the end alone."""


@dataclass(frozen=True)
class Pattern:
    """The structure that variants share, and the length of the run."""

    system: PiecewiseSystem  # one of them
    start: int  # ``kernels.variants_march.AS_GIVEN``, ``STATIC`` or ``STEADY``
    cycles: int  # length of the run in periods
    judged: Judged  # which pieces of the clearances are their centres

    def can_march(self) -> bool:
        """Whether the loop marches them: there is one, and clearances whose crossings it counts."""
        return has_loop(self.system) and bool(self.system.clearances)

    def frame(self) -> Frame:
        """The structure for compiled code."""
        return frame_of(self.system, relative_coordinates(self.system))

    def statics(self) -> Statics:
        """The structure for the equilibrium, for compiled code."""
        elastic = elastic_elements(self.system)
        return statics_of(elastic, relative_coordinates(self.system, elastic))


def is_supported(system: PiecewiseSystem) -> bool:
    """Whether the compiled loop can march a system.

    It cannot march inputs over time, friction, clipped damping or alternation, and nothing without a compiler.
    """
    return is_compiling() and system.is_plain


def has_loop(system: PiecewiseSystem) -> bool:
    """Whether the compiled loop is the way to march variants of a system; the sweep suits large systems better."""
    return is_supported(system) and not is_large(system)


def march_variants(
    pattern: Pattern,
    numbers: Coefficients,
    start: tuple[Array, Array],
    window: Array,
    progress: Callable[[float], None] | None = None,
) -> tuple[Tallies, NDArray[np.bool_]]:
    """March all variants and judge them.

    numbers: V variants.
    start: (V, n) angles [rad], for a start as given, and (V, n) velocities [rad/s].
    window: (V, 3) begin and end of the steady part [s], and the period.
    progress: called now and then with the finished share; what it raises ends the work.
    Returns Tallies with a leading axis, and (V,) which variants are judged.
    """
    cursor = Batch(pattern, numbers, start, window)
    while cursor.go_on():
        if progress is not None:
            progress(cursor.done / len(window))
    return cursor.out, cursor.is_followed


def follow_variants(
    pattern: Pattern, numbers: Coefficients, start: tuple[Array, Array], window: Array, kept: Kept
) -> Iterator[tuple[int, Batch]]:
    """March all variants and judge them; yield each that was followed to its end, before the next one begins.

    pattern, numbers, start, window: as of ``march_variants``.
    kept: what ``Batch.motion`` of the variant yielded is made of.
    """
    cursor = Batch(pattern, numbers, start, window, kept=kept)
    is_more = True
    while is_more:
        variant = cursor.done
        is_more = cursor.go_on(1)
        if cursor.done > variant and cursor.is_followed[variant]:
            yield variant, cursor


class Batch:
    """All arrays that the loop of one thread works on.

    pattern, numbers, start, window: as of ``march_variants``.
    evaluation: entry kernel for a motion at its end, and what it writes; None: ``sum_crossings`` of the loop and
        ``Tallies``.
    kept: samples of every variant; they are there until the next one begins.
    """

    def __init__(
        self,
        pattern: Pattern,
        numbers: Coefficients,
        start: tuple[Array, Array],
        window: Array,
        evaluation: tuple[Callable[..., Any], Any] | None = None,
        *,
        kept: Kept = END,
    ) -> None:
        # regions and log, which grow on demand
        count = len(window)
        flow = flow_of(pattern.system)
        size = Size.of(flow)
        longest = size.states + size.inputs
        self.store = Store(flow, Capacity(4, 64, longest, longest))
        self.log = empty_log()
        self.outcome = np.zeros(count, np.int64)
        self.cursor = np.zeros(variants_march.CURSOR, np.int64)
        # the variants
        angle, velocity = (np.array(part, dtype=float) for part in start)
        shared = pattern.frame(), pattern.statics(), pattern.judged
        how = np.array([pattern.start])
        self.cases = variants_march.Cases(numbers, *shared, angle, velocity, window, how, self.outcome)
        # a march, its samples and notes, and the inputs in the scales of each variant
        self.buffers = _buffers(flow, self.cases)
        self.march = _march(size)
        self.samples = _room(flow, size, pattern.cycles, kept)
        self.inputs = packed_inputs(flow)
        self.notes = notes_for(size, kept.per_cycle)
        self.inputs = self.inputs._replace(scale=self.inputs.scale.copy())
        self.instants = packed_instants(flow, self.march.counts, pattern.cycles)
        # what is written of a finished motion, and the addresses of the kernels called
        self.out: Any
        entry, self.out = evaluation or (compact(variants_march.sum_crossings), room_for(count, self.cases.judged))
        self.entries = self._entries(entry)
        self.limit = StepLimit(pattern.system)

    @property
    def done(self) -> int:
        """Variants that are through."""
        return int(self.cursor[variants_march.AT])

    @property
    def is_followed(self) -> NDArray[np.bool_]:
        """(V,) whether a variant is through, and not left out."""
        return np.asarray(self.outcome == variants_march.FOLLOWED)

    def go_on(self, slices: int = _SLICES) -> bool:
        """Do some slices of work, enlarge arrays where they are full; returns whether there is more to do."""
        # some slices of the compiled loop
        counts = self.march.counts
        thread = variants_march.Thread(
            workspace=self.store.builder.words,
            buffers=self.buffers,
            inputs=self.inputs,
            instants=self.instants,
            regions=self.store.packed,
            march=self.march,
            samples=self.samples,
            notes=self.notes,
            log=self.log,
            cursor=self.cursor,
        )
        answer = variants_march.march_many(self.entries, self.cases, thread, self.out, slices)
        # room for regions or crossings
        if answer == variants_march.MORE_ROOM:
            self.store.grow()
        elif answer == variants_march.MORE_LOG:
            self.log = doubled(self.log)
        # a variant that goes on without end is left to the general way
        now = float(counts[march_arrays.CYCLE] + self.march.clock[:2].sum())
        events = int(counts[march_arrays.EVENTS])
        is_lost = self.limit.is_exceeded(int(counts[march_arrays.STEPS]), now)
        is_lost = is_lost or self.log.cycle.size > _LARGEST_LOG or chatters(self.log, events, now)
        if self.cursor[variants_march.UNDER_WAY] and is_lost:
            self.outcome[self.done] = variants_march.LEFT
            self.cursor[variants_march.AT] = self.done + 1
            self.cursor[variants_march.UNDER_WAY] = 0
        return self.done < self.outcome.size

    def motion(self, flow: Flow) -> Motion | None:
        """The motion of the variant that was finished last, over the cycles whose samples are kept.

        None where a crossing coincides with the first sample, so that it is unknown which side the motion begins on.
        """
        # crossings behind the first sample, and the pieces there
        samples = self.samples
        counts = self.march.counts
        log = first_of(self.log, int(counts[march_arrays.EVENTS]))
        ahead = (log.cycle - samples.first // samples.per_cycle) + log.fraction > 0.0
        initial = self.buffers.initial.copy()
        passed = np.flatnonzero(~ahead)
        initial[log.clearance[passed]] = log.piece[passed] + 2 * log.upward[passed] - 1
        if not np.array_equal(initial, samples.pieces[0]):
            return None
        # samples in SI units
        sampled, _ = sampled_quantities(flow, samples)
        steps = int(counts[march_arrays.STEPS])
        period = flow.system.inputs.period
        cycles = (samples.first + len(samples.states) - 1) // samples.per_cycle
        return Motion(
            **sampled,
            crossings=crossings_of(flow, type(log)._make(part[ahead] for part in log)),
            initial_piece=initial,
            final_force_integral=samples.states[-1, -self.buffers.final.size :].copy(),
            steps=steps,
            function_calls=steps + int(counts[march_arrays.EXPANSIONS]),
            average_step=cycles * period / max(steps, 1),
            average_trial_step=float(self.march.tried[0]) / max(int(counts[march_arrays.TRIALS]), 1) * period,
        )

    def _entries(self, evaluate: Callable[..., Any]) -> Any:
        """Addresses of the kernels that the loop calls, compiled for arguments of these types, as for a single run."""

        # arguments of the types that the kernels are called with
        cases = self.cases
        buffers = self.buffers
        regions = self.store.packed
        workspace = self.store.builder.words
        stages = region_stages.stages()
        zgees = lapack_address("zgees")
        counts = self.march.counts
        system = picked(cases.numbers, 0)
        frame = cases.frame
        acceleration = buffers.acceleration
        solution = cases.statics, buffers.sought, buffers.rest
        response = system, frame, cases.statics, buffers.rest, buffers.angle, buffers.velocity
        marched = regions, self.inputs, self.instants, self.march, self.samples, self.notes, self.log, 0
        noted = regions, self.inputs, self.notes, self.samples, counts
        finished = workspace, cases, buffers, regions, self.march, self.samples, self.log, self.cursor, self.out
        # kernels by the names in ``variants_march.Entries``
        calls: dict[str, tuple[Callable[..., Any], tuple[Any, ...]]] = {
            "scale": (state_scaling.scale, (system, frame, buffers.scales)),
            "lay_out": (variant_common.lay_out, (workspace, system, frame, buffers.scales)),
            "limit_states": (region_stages.limit_states, (stages, workspace)),
            "build_region": (region_stages.build_region, (stages, zgees, workspace)),
            "pack": (region_stages.pack, (stages, workspace, regions, 0, 0)),
            "accelerate_rigidly": (equilibrium_kernel.accelerate_rigidly, (system, cases.statics.motion, acceleration)),
            "rest": (
                equilibrium_kernel.rest,
                (system, frame.label, cases.statics, acceleration, buffers.sought, buffers.travel),
            ),
            "is_loose": (equilibrium_kernel.is_loose, (system.laws, cases.statics, buffers.sought)),
            "angles_from_deflections": (equilibrium_kernel.angles_from_deflections, solution),
            "respond_rigidly": (rigid_response.respond_rigidly, response),
            "march_on": (march.march_on, marched),
            "store_noted_samples": (sample_notes.store_noted_samples, noted),
        }
        # compiled, as for a single run
        addresses = {
            name: address_of((vectorised if name in _VECTORISED else compact)(entry), *arguments)
            for name, (entry, arguments) in calls.items()
        }
        return variants_march.Entries(**addresses, evaluate=address_of(evaluate, *finished), zgees=zgees, stages=stages)


def _buffers(flow: Flow, cases: Any) -> Any:

    deflections = len(flow.coordinates.elements)
    inertias = flow.system.size
    clearances = len(flow.system.clearances)
    scales = Scales(*map(np.empty, (deflections, inertias, 1 + flow.frequency.size, clearances)))
    statics = cases.statics
    return Buffers(
        scales=scales,
        deflection=np.empty(deflections),
        angle=np.empty(inertias),
        velocity=np.empty(inertias),
        rest=np.empty(inertias),
        acceleration=np.empty(inertias),
        sought=np.empty(statics.at.size),
        travel=np.empty(statics.elastic.size),
        initial=np.zeros(clearances, np.int64),
        final=np.empty(clearances),
    )


def _march(size: Size) -> march_arrays.March:
    """An empty march."""
    y = aligned(4 * strips_for(size.states + size.inputs))
    carried = aligned(4 * strips_for(size.carried))
    bound = aligned(4 * strips_for(3 * size.clearances))
    counts = np.zeros(march_arrays.COUNTS, np.int64)
    side = np.zeros(size.clearances, np.int64)
    return march_arrays.March(y, carried, np.zeros(size.inputs), np.zeros(4), counts, np.zeros(1), bound, side)


def _room(flow: Flow, size: Size, cycles: int, kept: Kept) -> march_arrays.Samples:
    """Capacity for the samples of the last cycles, both ends included."""
    first = (cycles - kept.cycles) * kept.per_cycle
    rows = kept.cycles * kept.per_cycle + 1
    states = np.zeros((rows, size.states + size.carried))
    pieces = np.zeros((rows, size.clearances), np.int64)
    return march_arrays.Samples(kept.per_cycle, first, states, pieces, flow.waves(kept.per_cycle))
