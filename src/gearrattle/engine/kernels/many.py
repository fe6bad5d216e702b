"""Many variants of a driveline, one after the other, without the interpreter: laid out, started, marched, judged.

Everything large is called where it lies (``_jit.address_of``), with the machine code that a single run uses: the same
bits, and nothing is compiled twice. What grows - logs, room for regions - is grown above: the loop hands back an answer
and goes on where it stood when it is called again.

Arrays: ``bench`` (work, waves, laws, marks), ``packed`` (regions, march, samples, notes, log), ``variants``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from gearrattle.engine.kernels._jit import (
    call_code,
    call_count,
    call_real,
    call_silent,
    call_truth,
    strict,
    strict_entry,
)
from gearrattle.engine.kernels.bench import (
    AMPLITUDE,
    CALM,
    CLEARANCES,
    COLUMN,
    CORNER_SCALE,
    CORNERED,
    FINE,
    FIRST_PIECE,
    FLOWING,
    FORCED,
    FOUND,
    INTEGRAL,
    LIMITS,
    LOWER,
    MODES,
    MOST,
    MOST_SEEN,
    OFFSETS,
    PARTICULAR,
    PIECES,
    PIVOTS,
    POWERS,
    REFERENCE_COUNT,
    SIZES,
    STATES,
    UPPER,
    VECTORS,
    WATCHED,
    WATCHED_COUNT,
    WEIGHTS,
    WIDTH,
)
from gearrattle.engine.kernels.corners import DONE, LOG_FULL, NEEDS_REGION, NOTES_FULL, SLICE_SPENT
from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.kernels.packed import BAND, EVENTS, EXPANSIONS, LEVEL, NOTED, PENDING, SAMPLE, SLOT, STEPS
from gearrattle.engine.kernels.start import choose, stand
from gearrattle.engine.kernels.strips import step
from gearrattle.engine.kernels.variants import Coefficients

FINISHED, SPENT, MORE_LOG, MORE_ROOM = range(4)
"""Answers: all are done; a slice is spent; the log is full; another region needs room."""
JUDGED, LEFT = 1, 2
"""What became of a variant: judged; left to the general way (on a corner, no equilibrium, not finite, chatter)."""
AT, UNDER_WAY, SLOTS, TABLES, BOOKS = range(5)
"""Where the loop stands: variant; whether it is under way; slots and tables used."""

STAGES = (
    "scale", "lay_out", "stiffest", "accelerate", "typical", "look", "split_inputs", "generate", "split_off",
    "transpose_states", "triangular_form", "block_diagonalise", "weigh", "gather", "finish_bounds", "finest_level",
    "fill", "fill_in_turn", "fill_bounds", "fill_tables", "fill_powers", "fill_series", "fill_forced",
    "accelerate_rigidly", "rest", "is_loose", "turn", "tally", "march_on", "work_out", "zgees",
)  # fmt: skip
"""What is called, in the order of its addresses."""
(
    SCALE, LAY_OUT, STIFFEST, ACCELERATE, TYPICAL, LOOK, SPLIT_INPUTS, GENERATE, SPLIT_OFF,
    TRANSPOSE, TRIANGULAR, DIAGONALISE, WEIGH, GATHER, FINISH, FINEST,
    FILL, FILL_IN_TURN, FILL_BOUNDS, FILL_TABLES, FILL_POWERS, FILL_SERIES, FILL_FORCED,
    RIGIDLY, REST, IS_LOOSE, TURN, TALLY, MARCH_ON, WORK_OUT, ZGEES,
) = range(31)  # fmt: skip

_BUDGET = 20_000  # steps a slice


class Shop(NamedTuple):
    """Where regions are worked out, see ``bench``; integers of LAPACK, and the addresses of its arguments."""

    work: Any
    waves: Any
    laws: Any
    marks: Any
    integers: Any
    arguments: Any


class Cases(NamedTuple):
    """V variants of one structure."""

    numbers: Any  # Coefficients with a leading axis
    frame: Any  # Frame
    statics: Any  # Statics
    judged: Any  # variants.Judged
    angle: Any  # (V, n) at the start; written where the equilibrium is sought
    velocity: Any  # (V, n)
    window: Any  # (V, 3) steady part [s], begin and end; period
    is_static: Any  # (1,) whether the start is the equilibrium
    outcome: Any  # (V,) JUDGED or LEFT, written


class Desk(NamedTuple):
    """Room of one thread that does not depend on the number of regions."""

    scales: Any
    deflection: Any  # (r,)
    acceleration: Any  # (n,)
    sought: Any  # deflections of the elements with stiffness
    travel: Any  # (E,)
    initial: Any  # (K,) pieces at the start
    final: Any  # (K,) force integrals at the end
    bound: Any  # (1,) the largest entry of an elimination between blocks


@strict
def _one(numbers, v):
    """The numbers of one variant."""
    own = numbers.laws
    laws = Laws(own.first[v], own.stiffness[v], own.damping[v], own.offset[v], own.lower[v], own.upper[v])
    return Coefficients(
        numbers.inertia[v], numbers.drag[v], numbers.mean[v], numbers.torque_sine[v], numbers.torque_cosine[v],
        numbers.error_sine[v], numbers.error_cosine[v], numbers.period[v], laws,
    )  # fmt: skip


@strict
def _work_region_out(at, shop, largest):
    """Work out the region of the pieces in ``marks``; False where its rates or its eigenvalues are not finite."""
    work, waves, laws, marks, p = shop.work, shop.waves, shop.laws, shop.marks, shop.arguments
    if not call_truth(at[ACCELERATE], (work, laws, marks)):
        return False
    call_silent(at[LOOK], (work, laws, marks))
    call_silent(at[SPLIT_INPUTS], (work, waves, marks))
    call_silent(at[GENERATE], (work, marks))
    call_silent(at[SPLIT_OFF], (work, marks))
    call_silent(at[TRANSPOSE], (work, waves, marks))
    call_code(
        at[ZGEES], (p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11], p[12], p[13], p[14])
    )
    if shop.integers[4] != 0:
        return False
    call_silent(at[TRIANGULAR], (work, waves, marks))
    blocks = call_count(at[DIAGONALISE], (waves, marks, largest))
    for block in range(blocks):
        call_silent(at[WEIGH], (work, waves, marks, marks[PIVOTS, block], marks[PIVOTS, block + 1]))
    call_silent(at[GATHER], (work, waves, marks))
    call_silent(at[FINISH], (work, marks))
    marks[SIZES, FINE] = call_count(at[FINEST], (work, marks))
    return True


@strict
def _pack(at, shop, regions, slot, first):
    """Write the region worked out into a slot, its tables from ``first`` on; see ``system.building.Bench.pack``."""
    work, waves, laws, marks, a = shop.work, shop.waves, shop.laws, shop.marks, regions
    width, modes, fine = marks[SIZES, WIDTH], marks[SIZES, MODES], marks[SIZES, FINE]
    k, states = marks[SIZES, WATCHED_COUNT], marks[SIZES, STATES]
    c, u, h = marks[SIZES, REFERENCE_COUNT] + k, a.kept.shape[1], step(fine)
    a.width[slot], a.modes[slot], a.fine[slot], a.first_table[slot] = width, modes, fine, first
    for j in range(states, width):
        a.kept[slot, j - states] = marks[COLUMN, j] - states
    call_silent(at[FILL_TABLES], (a.tables, first, work, c, width, fine))
    call_silent(at[FILL_POWERS], (a.powers, POWERS * slot, POWERS, work, c, width, h))
    strip = call_count(at[FILL], (a.particular, slot, 0, work, INTEGRAL, 0, c, u))
    call_count(at[FILL], (a.particular, slot, strip, work, PARTICULAR, 0, states, u))
    call_silent(at[FILL_IN_TURN], (a.probe, slot, work, WATCHED, k, width))
    call_silent(at[FILL_IN_TURN], (a.calm, slot, work, CALM, k, width))
    call_silent(at[FILL_IN_TURN], (a.forced, slot, work, FORCED, k, u))
    call_count(at[FILL], (a.weights, slot, 0, work, WEIGHTS, 0, 3 * k, modes))
    call_silent(at[FILL_BOUNDS], (a.bounds, slot, waves, modes, width))
    call_silent(at[FILL_SERIES], (a.series, slot, work, marks, h))
    a.forced_strips[slot] = call_count(at[FILL_FORCED], (a.forced_series, slot, work, marks, h))
    for i in range(c):
        a.drift[slot, i] = work[FLOWING, i, 0] * work[VECTORS, AMPLITUDE, 0]
    for i in range(3 * k):
        a.constant[slot, i] = work[FOUND, OFFSETS, i]
    for i in range(k):
        element = marks[CLEARANCES, i]
        piece = marks[PIECES, element]
        p, unit = marks[FIRST_PIECE, element] + piece, work[VECTORS, CORNER_SCALE, i]
        a.lower[slot, i], a.upper[slot, i] = laws[LOWER, p] / unit, laws[UPPER, p] / unit
        a.piece[slot, i] = piece
        a.band[slot, i] = BAND if marks[CORNERED, i] else 0.0
        a.neighbour[slot, i, 0] = a.neighbour[slot, i, 1] = -1


@strict
def _slot_of(at, shop, regions, books, largest):
    """The slot of the region of the pieces in ``marks``, built if it is new; -1: needs room; -2: cannot be built."""
    marks = shop.marks
    for slot in range(books[SLOTS]):
        is_same = True
        for i in range(marks[SIZES, WATCHED_COUNT]):
            is_same = is_same and regions.piece[slot, i] == marks[PIECES, marks[CLEARANCES, i]]
        if is_same:
            return slot
    if not _work_region_out(at, shop, largest):
        return -2
    slot, tables = books[SLOTS], marks[SIZES, FINE] + 1
    has_room = slot < regions.fine.size and books[TABLES] + tables <= regions.tables.shape[0]
    if not has_room or marks[SIZES, MODES] > regions.weights.shape[2] or marks[SIZES, WIDTH] > regions.probe.shape[2]:
        return -1
    _pack(at, shop, regions, slot, books[TABLES])
    books[SLOTS] += 1
    books[TABLES] += tables
    return slot


@strict
def _find_start(at, system, cases, desk, v):
    """Write the angles of the static equilibrium; False where they cannot be told here."""
    acceleration, x, travel = desk.acceleration, desk.sought, desk.travel
    call_silent(at[RIGIDLY], (system, cases.statics.motion, acceleration))
    if call_count(at[REST], (system, cases.frame.label, cases.statics, acceleration, x, travel)) != 0:
        return False
    if call_truth(at[IS_LOOSE], (system.laws, cases.statics, x)):
        return False
    call_silent(at[TURN], (cases.statics, x, cases.angle[v]))
    return True


@strict
def _begin(at, shop, cases, desk, inputs, regions, march, books):
    """Lay a variant out and put it at its start: 0; -1: needs room; -2: cannot be done here."""
    v, work, laws, marks = books[AT], shop.work, shop.laws, shop.marks
    system, scales = _one(cases.numbers, v), desk.scales
    if cases.is_static[0] and not _find_start(at, system, cases, desk, v):
        return -2
    call_silent(at[SCALE], (system, cases.frame, scales))
    call_silent(at[LAY_OUT], (system, cases.frame, scales, work, laws, marks))
    call_silent(at[STIFFEST], (laws, marks))
    call_truth(at[ACCELERATE], (work, laws, marks))
    typical = call_real(at[TYPICAL], (work, shop.waves, marks))
    work[VECTORS, LIMITS, MOST] = work[VECTORS, LIMITS, MOST_SEEN] * typical
    for h in range(inputs.scale.size):
        inputs.scale[h] = scales.inputs[h]
    stand(cases.frame, scales, cases.angle[v], cases.velocity[v], desk.deflection, march)
    if not choose(work, laws, marks, cases.frame, cases.angle[v], march):
        return -2
    books[SLOTS] = books[TABLES] = 0
    for i in range(desk.initial.size):
        desk.initial[i] = marks[PIECES, marks[CLEARANCES, i]]
    slot = _slot_of(at, shop, regions, books, desk.bound[0])
    if slot >= 0:
        march.counts[SLOT], march.counts[LEVEL] = slot, regions.fine[slot]
    return min(slot, 0)


@strict
def _cross(at, shop, desk, regions, march, books):
    """Go on into the region beyond a corner: 0; -1: needs room; -2: cannot be done here."""
    marks, counts = shop.marks, march.counts
    here, k, upward = counts[SLOT], counts[PENDING] // 2, counts[PENDING] % 2
    for i in range(desk.initial.size):
        marks[PIECES, marks[CLEARANCES, i]] = regions.piece[here, i]
    marks[PIECES, marks[CLEARANCES, k]] += 1 if upward else -1
    slot = _slot_of(at, shop, regions, books, desk.bound[0])
    if slot >= 0:
        regions.neighbour[here, k, upward], regions.neighbour[slot, k, 1 - upward] = slot, here
        counts[SLOT], counts[PENDING] = slot, -1
    return min(slot, 0)


@strict_entry
def march_many(at, shop, cases, desk, driven, regions, march, samples, notes, log, out, books, slices):
    """March and judge variants from where the books stand, for so many slices.

    Args:
        at: addresses of ``STAGES``.
        shop, cases, desk: see there.
        driven: inputs and instants, see ``packed``.
        regions, march, samples, notes, log: see ``packed``; samples begin with the first one that is kept.
        out: ``variants.Tallies``.
        books: see ``BOOKS``; the loop is over once ``AT`` is the number of variants.
        slices: how many of ``_BUDGET`` steps each.

    Returns:
        FINISHED, SPENT, MORE_LOG or MORE_ROOM.
    """
    counts, integrals = march.counts, samples.states.shape[1] - desk.final.size
    inputs, instants = driven
    while books[AT] < cases.outcome.size:
        v, code = books[AT], 0
        if slices <= 0:
            return SPENT
        slices -= 1
        if not books[UNDER_WAY]:
            code = _begin(at, shop, cases, desk, inputs, regions, march, books)
            if code == 0:
                counts[SAMPLE], books[UNDER_WAY] = samples.first, 1
        while code == 0:
            answer = call_count(at[MARCH_ON], (regions, inputs, instants, march, samples, notes, log, _BUDGET))
            if counts[NOTED]:
                call_silent(at[WORK_OUT], (regions, inputs, notes, samples, counts))
            if answer == LOG_FULL:
                return MORE_LOG
            if answer == NEEDS_REGION:
                code = _cross(at, shop, desk, regions, march, books)
            elif answer == DONE:
                code = 1
            elif answer != NOTES_FULL:
                code = 2 if answer == SLICE_SPENT else -2
        if code == -1:
            return MORE_ROOM
        if code == 2:
            continue
        if code == 1:
            for k in range(desk.final.size):
                desk.final[k] = samples.states[samples.states.shape[0] - 1, integrals + k]
            call_silent(
                at[TALLY],
                (cases.judged, log, counts[EVENTS], cases.window[v], desk.initial, desk.final, desk.scales, v, out),
            )
            out.calls[v, 0] = counts[STEPS] + counts[EXPANSIONS]
        cases.outcome[v] = JUDGED if code == 1 else LEFT
        books[AT], books[UNDER_WAY] = v + 1, 0
    return FINISHED
