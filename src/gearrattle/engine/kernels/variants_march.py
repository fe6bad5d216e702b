"""Many variants of a driveline, one after the other, without the interpreter: laid out, started, marched, finished.

Large kernels are called by their addresses (``_jit.address_of``), with the machine code that a single run uses: the
same bits, and nothing is compiled twice. Logs and room for regions are enlarged by the caller: the loop returns a code,
and goes on where it stood when it is called again.

Arrays: ``located`` (workspace), ``packed`` (regions, march, samples, notes, log), ``variants``.
"""

from __future__ import annotations

from typing import NamedTuple

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels._llvm import call_count, call_real, call_silent, call_truth
from gearrattle.engine.kernels.arrays import IntVector, Matrix, Vector
from gearrattle.engine.kernels.corner_log import DONE, LOG_FULL, NEEDS_REGION, NOTES_FULL, SLICE_SPENT
from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.kernels.memory_addresses import bounds_at, common_at, free_at, region_at
from gearrattle.engine.kernels.packed import EVENTS, EXPANSIONS, LEVEL, NOTED, PENDING, SAMPLE, SLOT, STEPS
from gearrattle.engine.kernels.region_stages import Stages
from gearrattle.engine.kernels.start_pieces import choose, stand
from gearrattle.engine.kernels.tallies import tally
from gearrattle.engine.kernels.variant_arrays import Coefficients, Frame, Judged, Scales, Statics
from gearrattle.engine.kernels.workspace import BUILT

FINISHED, SPENT, MORE_LOG, MORE_ROOM = range(4)
"""Answers: all are done; a slice is spent; the log is full; another region needs room."""
FOLLOWED, LEFT = 1, 2
"""Outcomes of a variant: followed to its end and finished; left to the general way (on a corner, no equilibrium, not
finite, chatter)."""
AT, UNDER_WAY, SLOTS, TABLES, CURSOR = range(5)
"""Entries of the cursor: variant; whether it is under way; slots and tables used."""
AS_GIVEN, STATIC, STEADY = range(3)
"""Starts of variants: with the angles and velocities given; in their equilibrium with the velocities given; there, with
the rigid response of their free trains added."""


class Entries(NamedTuple):
    """Addresses of the kernels called, and the stages of a region."""

    scale: int
    lay_out: int
    settle: int
    work_out: int
    pack: int
    accelerate_rigidly: int
    rest: int
    is_loose: int
    turn: int
    respond_rigidly: int
    finish: int
    march_on: int
    work_out_samples: int
    zgees: int
    stages: Stages


_BUDGET = 20_000  # steps a slice


class Cases(NamedTuple):
    """V variants of one structure."""

    numbers: Coefficients  # every entry with a leading axis (V,)
    frame: Frame
    statics: Statics
    judged: Judged
    angle: Matrix  # (V, n) at the start, where it is given
    velocity: Matrix  # (V, n)
    window: Matrix  # (V, 3) steady part [s], begin and end; period
    start: IntVector  # (1,) AS_GIVEN, STATIC or STEADY
    outcome: IntVector  # (V,) FOLLOWED or LEFT, written


class Buffers(NamedTuple):
    """Room of one thread that does not depend on the number of regions."""

    scales: Scales
    deflection: Vector  # (r,)
    angle: Vector  # (n,) at the start
    velocity: Vector  # (n,)
    rest: Vector  # (n,) angles of the equilibrium
    acceleration: Vector  # (n,)
    sought: Vector  # deflections of the elements with stiffness
    travel: Vector  # (E,)
    initial: IntVector  # (K,) pieces at the start
    final: Vector  # (K,) force integrals at the end


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
def _slot_of(at, workspace, regions, cursor):
    """The slot of the region of ``region.pieces``, built if it is new; -1: needs room; -2: cannot be built."""
    clearances, pieces, free = common_at(workspace).clearances, region_at(workspace).pieces, free_at(workspace)
    # a region that was met before
    for slot in range(cursor[SLOTS]):
        is_same = True
        for i in range(clearances.size):
            is_same = is_same and regions.piece[slot, i] == pieces[clearances[i]]
        if is_same:
            return slot
    # a new one: build it up to its tables
    if call_count(at.work_out, (at.stages, at.zgees, workspace)) != BUILT:
        return -2
    # whether there is room for it
    slot, tables = cursor[SLOTS], free.fine[0] + 1
    has_room = slot < regions.fine.size and cursor[TABLES] + tables <= regions.tables.shape[0]
    has_room = has_room and bounds_at(workspace).used[0] <= regions.weights.shape[2]
    if not has_room or free.width[0] > regions.probe.shape[2]:
        return -1
    # write it into the next slot
    call_silent(at.pack, (at.stages, workspace, regions, slot, cursor[TABLES]))
    cursor[SLOTS] += 1
    cursor[TABLES] += tables
    return slot


@strict
def _rest(at, system, cases, buffers):
    """Write the angles of the static equilibrium; False where the general way must find them."""
    acceleration, x, travel = buffers.acceleration, buffers.sought, buffers.travel
    call_silent(at.accelerate_rigidly, (system, cases.statics.motion, acceleration))
    if call_count(at.rest, (system, cases.frame.label, cases.statics, acceleration, x, travel)) != 0:
        return False
    if call_truth(at.is_loose, (system.laws, cases.statics, x)):
        return False
    call_silent(at.turn, (cases.statics, x, buffers.rest))
    return True


@strict
def _find_start(at, system, cases, buffers, v):
    """Write angles and velocities of the start; False where the general way must find them."""
    angle, velocity, rest, start = buffers.angle, buffers.velocity, buffers.rest, cases.start[0]
    # angles of the static equilibrium
    if start != AS_GIVEN and not _rest(at, system, cases, buffers):
        return False
    # the rigid response of free trains, added to the equilibrium
    if start == STEADY:
        call_silent(at.respond_rigidly, (system, cases.frame, cases.statics, rest, angle, velocity))
    # angles and velocities as asked for
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
def _begin(at, workspace, cases, buffers, inputs, regions, march, cursor):
    """Lay a variant out and put it at its start: 0; -1: needs room; -2: cannot be done here."""
    # angles and velocities at the start
    v, clearances, pieces = cursor[AT], common_at(workspace).clearances, region_at(workspace).pieces
    system, scales = numbers_of(cases.numbers, v), buffers.scales
    if not _find_start(at, system, cases, buffers, v):
        return -2
    # scales, the arrays that all regions share, and the size of an ordinary motion
    call_silent(at.scale, (system, cases.frame, scales))
    call_silent(at.lay_out, (workspace, system, cases.frame, scales))
    call_real(at.settle, (at.stages, workspace))
    for h in range(inputs.scale.size):
        inputs.scale[h] = scales.inputs[h]
    # the state in these scales, and the pieces it lies in
    stand(cases.frame, scales, buffers.angle, buffers.velocity, buffers.deflection, march)
    if not choose(workspace, cases.frame, buffers.angle, march):
        return -2
    # the region of the start
    cursor[SLOTS] = cursor[TABLES] = 0
    for i in range(buffers.initial.size):
        buffers.initial[i] = pieces[clearances[i]]
    slot = _slot_of(at, workspace, regions, cursor)
    if slot >= 0:
        march.counts[SLOT], march.counts[LEVEL] = slot, regions.fine[slot]
    return min(slot, 0)


@strict
def _cross(at, workspace, buffers, regions, march, cursor):
    """Go on into the region beyond a corner: 0; -1: needs room; -2: cannot be done here."""
    clearances, pieces, counts = common_at(workspace).clearances, region_at(workspace).pieces, march.counts
    # the pieces beyond the corner
    here, k, upward = counts[SLOT], counts[PENDING] // 2, counts[PENDING] % 2
    for i in range(buffers.initial.size):
        pieces[clearances[i]] = regions.piece[here, i]
    pieces[clearances[k]] += 1 if upward else -1
    # their region, and both regions as neighbours of each other
    slot = _slot_of(at, workspace, regions, cursor)
    if slot >= 0:
        regions.neighbour[here, k, upward], regions.neighbour[slot, k, 1 - upward] = slot, here
        counts[SLOT], counts[PENDING] = slot, -1
    return min(slot, 0)


@strict
def advance_one(at, workspace, cases, buffers, driven, regions, march, samples, notes, log, cursor):
    """March a slice of one variant: 1: at its end; 0: slice spent; -1: needs room; -2: cannot be done; -3: log full."""
    counts, code = march.counts, 0
    inputs, instants = driven
    # a variant that has not begun: lay it out and find its first region
    if not cursor[UNDER_WAY]:
        code = _begin(at, workspace, cases, buffers, inputs, regions, march, cursor)
        if code != 0:
            return code
        counts[SAMPLE], cursor[UNDER_WAY] = samples.first, 1
    while code == 0:
        # march until something is needed, and store the samples noted
        answer = call_count(at.march_on, (regions, inputs, instants, march, samples, notes, log, _BUDGET))
        if counts[NOTED]:
            call_silent(at.work_out_samples, (regions, inputs, notes, samples, counts))
        # what the march asks for: a larger log, the region beyond a corner, the next slice
        if answer == LOG_FULL:
            return -3
        if answer == NEEDS_REGION:
            code = _cross(at, workspace, buffers, regions, march, cursor)
        elif answer == DONE:
            return 1
        elif answer == SLICE_SPENT:
            return 0
        elif answer != NOTES_FULL:
            return -2
    return code


@strict_entry
def judge(_workspace, cases, buffers, _regions, march, samples, log, cursor, out):
    """Write the sums over the crossings of a motion that was marched to its end; see ``march_many``."""
    v, counts, integrals = cursor[AT], march.counts, samples.states.shape[1] - buffers.final.size
    # force integrals at the end: contacts that are still open end there
    for k in range(buffers.final.size):
        buffers.final[k] = samples.states[samples.states.shape[0] - 1, integrals + k]
    # sums over the crossings in the window
    window, initial, final = cases.window[v], buffers.initial, buffers.final
    tally(cases.judged, log, counts[EVENTS], window, initial, final, buffers.scales, v, out)
    out.calls[v, 0] = counts[STEPS] + counts[EXPANSIONS]


@strict_entry
def march_many(at, workspace, cases, buffers, driven, regions, march, samples, notes, log, out, cursor, slices):
    """March variants from where the cursor stands, for so many slices, and finish each at its end.

    workspace: see ``located``.
    driven: inputs and instants, see ``packed``.
    regions, march, samples, notes, log: see ``packed``; samples begin with the first one that is kept.
    out: where ``at.finish`` writes: ``judge`` to ``variants.Tallies``, ``periods.differentiate`` to a ``Map``.
    cursor: see ``CURSOR``; the loop is over once ``AT`` is the number of variants.
    slices: how many of ``_BUDGET`` steps each.
    Returns FINISHED, SPENT, MORE_LOG or MORE_ROOM.
    """
    while cursor[AT] < cases.outcome.size:
        v = cursor[AT]
        # a slice of the present variant
        if slices <= 0:
            return SPENT
        slices -= 1
        code = advance_one(at, workspace, cases, buffers, driven, regions, march, samples, notes, log, cursor)
        # what must grow before it goes on
        if code == -1:
            return MORE_ROOM
        if code == -3:
            return MORE_LOG
        if code == 0:
            continue
        # the variant is through, or left to the general way: finish it and take the next one
        if code == 1:
            call_silent(at.finish, (workspace, cases, buffers, regions, march, samples, log, cursor, out))
        cases.outcome[v] = FOLLOWED if code == 1 else LEFT
        cursor[AT], cursor[UNDER_WAY] = v + 1, 0
    return FINISHED
