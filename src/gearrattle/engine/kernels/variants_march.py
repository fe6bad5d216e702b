"""Variants of a driveline in one compiled loop: each is laid out, started, marched and evaluated in turn.

Large kernels are called by their addresses (``_jit.address_of``). They are the machine code of a single run: so the
bits are the same, and no kernel is compiled twice. If the log is full, or the arrays have no slot for another region,
the loop returns a code; the caller enlarges the arrays and calls again, and the loop continues at the same variant and
step.
"""

from __future__ import annotations

from typing import NamedTuple

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels._llvm import call_count, call_real, call_silent, call_truth
from gearrattle.engine.kernels.arrays import IntVector, Matrix, Vector
from gearrattle.engine.kernels.equilibrium_kernel import FOUND
from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.kernels.march_arrays import (
    EVENTS,
    EXPANSIONS,
    LEVEL,
    NOTED,
    PENDING,
    SAMPLE,
    SLOT,
    STEPS,
    Inputs,
    Instants,
    Log,
    March,
    Notes,
    Regions,
    Samples,
)
from gearrattle.engine.kernels.memory_addresses import bounds_at, common_at, free_at, region_at
from gearrattle.engine.kernels.outcomes import DONE, LOG_FULL, NEEDS_REGION, NOTES_FULL, SLICE_SPENT
from gearrattle.engine.kernels.region_stages import Stages
from gearrattle.engine.kernels.start_pieces import choose_pieces, put_at_start
from gearrattle.engine.kernels.tallies import tally
from gearrattle.engine.kernels.variant_arrays import Coefficients, Frame, Judged, Scales, Statics
from gearrattle.engine.kernels.workspace import BUILT

# Codes that the loop and its parts return; those that may be returned in place of a slot are negative.
READY = 2
"""The region of the present state is built: the march can continue."""
FINISHED = 1
"""The variant has reached its end; from ``march_many``: all variants are done."""
SPENT = 0
"""The slice is spent; from ``march_many``: all slices are spent; call again."""
MORE_ROOM = -1
"""The arrays in ``regions`` have no slot for the next region: enlarge them and call again."""
IMPOSSIBLE = -2
"""This loop cannot do the variant (start on a corner, no equilibrium, a state that is not finite, chatter)."""
MORE_LOG = -3
"""The log of crossings is full: enlarge it and call again."""

FOLLOWED = 1
LEFT = 2
"""Outcomes of a variant: marched to its end and evaluated; not done here, so that it must be run by itself."""
AT, UNDER_WAY, SLOTS, TABLES, CURSOR = range(5)
"""Entries of the cursor: index of the present variant; 1 once it has started; slots and tables in use."""
AS_GIVEN, STATIC, STEADY = range(3)
"""Starts of variants: specified angles and velocities; static equilibrium and specified velocities; the same with the
rigid response of the free trains added."""


class Entries(NamedTuple):
    """Addresses of the kernels that the loop calls, and of the stages of a region."""

    scale: int
    lay_out: int
    limit_states: int
    build_region: int
    pack: int
    accelerate_rigidly: int
    rest: int
    is_loose: int
    angles_from_deflections: int
    respond_rigidly: int
    evaluate: int  # at the end of a motion: ``sum_crossings``, or ``whole_periods.differentiate``
    march_on: int
    store_noted_samples: int
    zgees: int
    stages: Stages


_BUDGET = 20_000  # steps per slice


class Cases(NamedTuple):
    """V variants of one structure."""

    numbers: Coefficients  # every entry with a leading axis (V,)
    frame: Frame
    statics: Statics
    judged: Judged
    angle: Matrix  # (V, n) at the start, used for AS_GIVEN
    velocity: Matrix  # (V, n)
    window: Matrix  # (V, 3) begin and end of the steady part, and period [s]
    start: IntVector  # (1,) AS_GIVEN, STATIC or STEADY
    outcome: IntVector  # (V,) FOLLOWED or LEFT, written


class Buffers(NamedTuple):
    """Scales, start and end of the present variant."""

    scales: Scales
    deflection: Vector  # (r,)
    angle: Vector  # (n,) at the start
    velocity: Vector  # (n,)
    rest: Vector  # (n,) angles of the equilibrium
    acceleration: Vector  # (n,)
    sought: Vector  # unknown deflections of the search for the equilibrium
    travel: Vector  # (E,) its last direction
    initial: IntVector  # (K,) pieces at the start
    final: Vector  # (K,) force integrals at the end


class Thread(NamedTuple):
    """The arrays of one thread: those of the present variant, and the state of the loop."""

    workspace: IntVector  # words of ``memory_addresses``: one region while it is built
    buffers: Buffers
    inputs: Inputs  # of the structure, scaled for the present variant
    instants: Instants | None
    regions: Regions  # visited so far
    march: March
    samples: Samples  # from the first sample that is kept
    notes: Notes
    log: Log
    cursor: IntVector  # (4,) see ``CURSOR``


@strict
def numbers_of(numbers, v):
    """The numbers of one variant."""
    own = numbers.laws
    laws = Laws(own.first[v], own.stiffness[v], own.damping[v], own.offset[v], own.lower[v], own.upper[v])
    return Coefficients(
        numbers.inertia[v],
        numbers.drag[v],
        numbers.mean[v],
        numbers.torque_sine[v],
        numbers.torque_cosine[v],
        numbers.error_sine[v],
        numbers.error_cosine[v],
        numbers.period[v],
        laws,
    )


@strict
def _slot_of(entries, thread):
    """The slot of the region of ``Region.pieces``, built if it is new; else MORE_ROOM or IMPOSSIBLE."""
    workspace = thread.workspace
    regions = thread.regions
    cursor = thread.cursor
    clearances = common_at(workspace).clearances
    pieces = region_at(workspace).pieces
    free = free_at(workspace)
    # a region that has been visited
    for slot in range(cursor[SLOTS]):
        is_same = True
        for i in range(clearances.size):
            is_same = is_same and regions.piece[slot, i] == pieces[clearances[i]]
        if is_same:
            return slot
    # a new one: build it up to its tables
    if call_count(entries.build_region, (entries.stages, entries.zgees, workspace)) != BUILT:
        return IMPOSSIBLE
    # is there a slot, and are there enough tables?
    slot = cursor[SLOTS]
    tables = free.fine[0] + 1
    has_room = slot < regions.fine.size and cursor[TABLES] + tables <= regions.tables.shape[0]
    has_room = has_room and bounds_at(workspace).used[0] <= regions.weights.shape[2]
    if not has_room or free.width[0] > regions.probe.shape[2]:
        return MORE_ROOM
    # write it into the next slot
    call_silent(entries.pack, (entries.stages, workspace, regions, slot, cursor[TABLES]))
    cursor[SLOTS] += 1
    cursor[TABLES] += tables
    return slot


@strict
def _find_equilibrium(entries, system, cases, buffers):
    """Write the angles of the static equilibrium; return False if there is none, or it is not unique."""
    acceleration = buffers.acceleration
    x = buffers.sought
    travel = buffers.travel
    call_silent(entries.accelerate_rigidly, (system, cases.statics.motion, acceleration))
    if call_count(entries.rest, (system, cases.frame.label, cases.statics, acceleration, x, travel)) != FOUND:
        return False
    if call_truth(entries.is_loose, (system.laws, cases.statics, x)):
        return False
    call_silent(entries.angles_from_deflections, (cases.statics, x, buffers.rest))
    return True


@strict
def _find_start(entries, system, cases, buffers, v):
    """Write angles and velocities of the start; return False if the equilibrium for it does not exist."""
    angle = buffers.angle
    velocity = buffers.velocity
    rest = buffers.rest
    start = cases.start[0]
    # angles of the static equilibrium
    if start != AS_GIVEN and not _find_equilibrium(entries, system, cases, buffers):
        return False
    # the rigid response of free trains, added to the equilibrium
    if start == STEADY:
        call_silent(entries.respond_rigidly, (system, cases.frame, cases.statics, rest, angle, velocity))
    # angles and velocities of the requested start
    for i in range(angle.size):
        if start == AS_GIVEN:
            angle[i] = cases.angle[v, i]
            velocity[i] = cases.velocity[v, i]
        elif start == STATIC:
            angle[i] = rest[i]
            velocity[i] = cases.velocity[v, i]
        else:
            angle[i] = rest[i] + angle[i]
            velocity[i] = cases.velocity[v, i] + velocity[i]
    return True


@strict
def _begin(entries, cases, thread):
    """Lay a variant out and put it at its start; return READY, MORE_ROOM or IMPOSSIBLE."""
    # angles and velocities at the start
    workspace = thread.workspace
    buffers = thread.buffers
    march = thread.march
    cursor = thread.cursor
    v = cursor[AT]
    clearances = common_at(workspace).clearances
    pieces = region_at(workspace).pieces
    system = numbers_of(cases.numbers, v)
    scales = buffers.scales
    if not _find_start(entries, system, cases, buffers, v):
        return IMPOSSIBLE
    # scales, the arrays that all regions share, and the largest states that are split off
    call_silent(entries.scale, (system, cases.frame, scales))
    call_silent(entries.lay_out, (workspace, system, cases.frame, scales))
    call_real(entries.limit_states, (entries.stages, workspace))
    for h in range(thread.inputs.scale.size):
        thread.inputs.scale[h] = scales.inputs[h]
    # the state in these scales, and its pieces
    put_at_start(cases.frame, scales, buffers.angle, buffers.velocity, buffers.deflection, march)
    if not choose_pieces(workspace, cases.frame, buffers.angle, march):
        return IMPOSSIBLE
    # the region of the start
    cursor[SLOTS] = 0
    cursor[TABLES] = 0
    for i in range(buffers.initial.size):
        buffers.initial[i] = pieces[clearances[i]]
    slot = _slot_of(entries, thread)
    if slot < 0:
        return slot
    march.counts[SLOT] = slot
    march.counts[LEVEL] = thread.regions.fine[slot]
    return READY


@strict
def _cross(entries, thread):
    """Enter the region beyond a corner; return READY, MORE_ROOM or IMPOSSIBLE."""
    workspace = thread.workspace
    regions = thread.regions
    counts = thread.march.counts
    clearances = common_at(workspace).clearances
    pieces = region_at(workspace).pieces
    # the pieces beyond the corner
    here = counts[SLOT]
    k = counts[PENDING] // 2
    upward = counts[PENDING] % 2
    for i in range(clearances.size):
        pieces[clearances[i]] = regions.piece[here, i]
    pieces[clearances[k]] += 1 if upward else -1
    # the region of these pieces; both regions are neighbours of each other
    slot = _slot_of(entries, thread)
    if slot < 0:
        return slot
    regions.neighbour[here, k, upward] = slot
    regions.neighbour[slot, k, 1 - upward] = here
    counts[SLOT] = slot
    counts[PENDING] = -1
    return READY


@strict
def _march_slice(entries, cases, thread):
    """March a slice of one variant; return FINISHED, SPENT, MORE_ROOM, MORE_LOG or IMPOSSIBLE."""
    regions = thread.regions
    inputs = thread.inputs
    march = thread.march
    samples = thread.samples
    counts = march.counts
    notes = thread.notes
    code = READY
    # a variant that has not started: lay it out, and build its first region
    if not thread.cursor[UNDER_WAY]:
        code = _begin(entries, cases, thread)
        if code != READY:
            return code
        counts[SAMPLE] = samples.first
        thread.cursor[UNDER_WAY] = 1
    while code == READY:
        # march until the caller must act, and store the samples that were noted
        marched = regions, inputs, thread.instants, march, samples, notes, thread.log, _BUDGET
        answer = call_count(entries.march_on, marched)
        if counts[NOTED]:
            call_silent(entries.store_noted_samples, (regions, inputs, notes, samples, counts))
        # the march needs a larger log, the region beyond a corner, or the next slice
        if answer == LOG_FULL:
            return MORE_LOG
        if answer == NEEDS_REGION:
            code = _cross(entries, thread)
        elif answer == DONE:
            return FINISHED
        elif answer == SLICE_SPENT:
            return SPENT
        elif answer != NOTES_FULL:
            return IMPOSSIBLE
    return code


@strict_entry
def sum_crossings(_workspace, cases, buffers, _regions, march, samples, log, cursor, out):
    """Write the sums over the crossings of a motion that was marched to its end; see ``march_many``."""
    v = cursor[AT]
    counts = march.counts
    integrals = samples.states.shape[1] - buffers.final.size
    # force integrals at the end: open contacts end there
    for k in range(buffers.final.size):
        buffers.final[k] = samples.states[samples.states.shape[0] - 1, integrals + k]
    # sums over the crossings in the window
    window = cases.window[v]
    initial = buffers.initial
    final = buffers.final
    tally(cases.judged, log, counts[EVENTS], window, initial, final, buffers.scales, v, out)
    out.calls[v, 0] = counts[STEPS] + counts[EXPANSIONS]


@strict_entry
def march_many(entries, cases, thread, out, slices):
    """March variants from the position of the cursor on, for ``slices`` slices, and evaluate each at its end.

    out: where ``entries.evaluate`` writes: ``sum_crossings`` to ``variant_arrays.Tallies``,
        ``whole_periods.differentiate`` to a ``Map``.
    slices: their number, each of ``_BUDGET`` steps.
    Returns FINISHED, SPENT, MORE_LOG or MORE_ROOM.
    """
    cursor = thread.cursor
    buffers = thread.buffers
    march = thread.march
    samples = thread.samples
    while cursor[AT] < cases.outcome.size:
        v = cursor[AT]
        # a slice of the present variant
        if slices <= 0:
            return SPENT
        slices -= 1
        code = _march_slice(entries, cases, thread)
        # arrays must be enlarged before the march continues
        if code in (MORE_ROOM, MORE_LOG):
            return code
        if code == SPENT:
            continue
        # the variant has ended, or cannot be done here: evaluate it, and go to the next
        if code == FINISHED:
            finished = thread.workspace, cases, buffers, thread.regions, march, samples, thread.log, cursor, out
            call_silent(entries.evaluate, finished)
        cases.outcome[v] = FOLLOWED if code == FINISHED else LEFT
        cursor[AT] = v + 1
        cursor[UNDER_WAY] = 0
    return FINISHED
