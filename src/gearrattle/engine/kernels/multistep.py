"""The march over CVODE's steps: samples and corner crossings from CVODE's interpolant, restarts at corners.

CVODE is called by address (``Library``), one step at a time. A step returns its end; within it CVodeGetDky evaluates
the polynomial of CVODE's predictor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels._llvm import call_code
from gearrattle.engine.kernels.arrays import Int32Vector, IntMatrix, IntVector, Matrix, Vector
from gearrattle.engine.kernels.equation_of_motion import Field, element_states
from gearrattle.engine.kernels.outcomes import CHATTER, DONE, LOG_FULL, NO_CONVERGENCE, NON_FINITE, SLICE_SPENT
from gearrattle.engine.kernels.strip_products import copy

ONE_STEP = 2
ROOT_FOUND = 2
RHS_FAILED = (-8, -11)  # CV_RHSFUNC_FAIL ... CV_UNREC_RHSFUNC_ERR
LARGEST = 1e150  # largest scaled state: beyond, the motion diverges
PATIENCE = 1000  # most successive steps or crossings without progress in time

SAMPLE, EVENTS, STEPS, CALLS, ERROR_FAILS, SOLVE_FAILS, JACOBIANS, IDLE = range(8)
"""Indices into ``March.counts``; STEPS to JACOBIANS are sums up to the last restart; CVODE holds the later ones."""
TIME, SMALLEST, TRIED, LAST, NEXT, SPARE = range(6)
"""Indices into ``March.numbers``; TRIED is the sum of all steps tried."""


class Library(NamedTuple):
    """Addresses of CVODE's memory, of two of its vectors and of its functions."""

    memory: int
    vector: int  # holds March.z
    between: int  # holds March.point
    step: int  # CVode
    interpolate: int  # CVodeGetDky
    statistics: int  # CVodeGetIntegratorStats
    solve_fails: int  # CVodeGetNumStepSolveFails
    jacobians: int  # CVodeGetNumJacEvals
    roots: int  # CVodeGetRootInfo
    restart: int  # CVodeReInit
    stop: int  # CVodeSetStopTime
    first: int  # CVodeSetInitStep
    newton: bool  # whether CVODE solves with a Jacobian


class March(NamedTuple):
    """Arrays of a run that change; S states, K clearances, m elements."""

    z: Vector  # (S,) scaled state
    point: Vector  # (S,) scaled state within the last step
    counts: IntVector  # (8,)
    numbers: Vector  # (6,)
    current: IntVector  # (8,) CVODE's own counts
    roots: Int32Vector  # (2 K,) int32, CVODE's roots at lower and upper corners
    piece: IntVector  # (m,) int64
    deflection: Vector  # (m,) at the end of the last step
    times: Vector  # (samples,) output grid
    states: Matrix  # (samples, S) output
    event_time: Vector  # (capacity,)
    event_element: IntVector  # (capacity,)
    event_pieces: IntMatrix  # (capacity, 2) from, to
    event_rate: Vector  # (capacity,)
    event_integral: Vector  # (capacity,)


class Held(NamedTuple):
    """The pieces that are held between corners; in ``field`` every element has one piece."""

    on: bool  # False: pieces are not held
    field: Field
    bounds: Matrix  # (K, 2) lower and upper corners of the pieces
    clearances: IntVector  # (K,)


class Scratch(NamedTuple):
    """The elements' states at one instant."""

    y: Vector
    wave: Vector
    deflection: Vector
    rate: Vector
    piece: Vector
    force: Vector


@kernel
def _look(field, size, time, z, s):
    """Write the elements' states at a scaled state to the scratch."""
    for i in range(z.size):
        s.y[i] = z[i] * size[i]
    element_states(field, time, s.y, s.wave, s.deflection, s.rate, s.piece, s.force)


@kernel
def _between(library, time):
    """Write the scaled state at a time within the last step to ``March.point``."""
    call_code(library.interpolate, (library.memory, time, 0, library.between))


@kernel
def _log(m, s, begin, time, k, piece, target):
    """Log a crossing with the rate and integral in the scratch, in order of time among the crossings of this step."""
    i = m.counts[EVENTS]
    while i > begin and m.event_time[i - 1] > time:
        m.event_time[i] = m.event_time[i - 1]
        m.event_element[i] = m.event_element[i - 1]
        m.event_pieces[i] = m.event_pieces[i - 1]
        m.event_rate[i] = m.event_rate[i - 1]
        m.event_integral[i] = m.event_integral[i - 1]
        i -= 1
    m.event_time[i] = time
    m.event_element[i] = k
    m.event_pieces[i, 0] = piece
    m.event_pieces[i, 1] = target
    m.event_rate[i] = s.rate[k]
    m.event_integral[i] = s.y[s.y.size - s.force.size + k]
    m.counts[EVENTS] += 1


@kernel
def _locate(field, size, library, m, s, k, corner, begin, end, low, high):
    """When deflection k, low and high from the corner at begin and end (opposite signs), passes it.

    Regula falsi by the Illinois rule (Dowell, Jarratt, BIT 11 (1971) 168), every fourth time a bisection; the scratch
    keeps the elements' states there.
    """
    a = begin
    b = end
    rises = high > low
    side = 0
    last = end
    for i in range(100):
        # the next instant, and the distance from the corner there
        at = b - high * (b - a) / (high - low) if i % 4 != 3 else 0.5 * (a + b)
        if not a < at < b:
            at = 0.5 * (a + b)
        _between(library, at)
        _look(field, size, at, m.point, s)
        value = s.deflection[k] - corner
        if value == 0.0 or abs(at - last) <= 4e-16 * abs(at) or b - a <= 4e-16 * abs(b):
            return at
        # the half in which the sign changes; an end that stays twice counts half
        last = at
        if (value > 0.0) == rises:
            low = 0.5 * low if side == 1 else low
            b = at
            high = value
            side = 1
        else:
            high = 0.5 * high if side == -1 else high
            a = at
            low = value
            side = -1
    return last


@kernel
def _pass_corners(field, size, library, m, s, after, begin, end):
    """Log every corner between the pieces at the beginning and the end of a step."""
    first = m.counts[EVENTS]
    for k in range(m.piece.size):
        piece = m.piece[k]
        target = int(after.piece[k])
        while piece != target:
            up = 1 if target > piece else -1
            p = field.laws.first[k] + piece
            corner = field.laws.upper[p] if up > 0 else field.laws.lower[p]
            low = m.deflection[k] - corner
            high = after.deflection[k] - corner
            at = _locate(field, size, library, m, s, k, corner, begin, end, low, high)
            _log(m, s, first, at, k, piece, piece + up)
            piece += up
        m.piece[k] = piece


@kernel
def hold(field, held, i, piece):
    """Hold clearance i in a piece: write the law and the corners of that piece."""
    k = held.clearances[i]
    laws = field.laws
    law = held.field.laws
    p = laws.first[k] + piece
    law.stiffness[k] = laws.stiffness[p]
    law.damping[k] = laws.damping[p]
    law.offset[k] = laws.offset[p]
    held.bounds[i, 0] = laws.lower[p]
    held.bounds[i, 1] = laws.upper[p]


@kernel
def _leave(field, held, library, m, after, root):
    """Change the pieces that are left here, by CVODE's roots or else by the deflections; return how many changed."""
    if root:
        call_code(library.roots, (library.memory, m.roots.ctypes.data))
    changed = 0
    first = m.counts[EVENTS]
    time = m.numbers[TIME]
    for i in range(held.clearances.size):
        k = held.clearances[i]
        way = 0
        if root:
            way = int(m.roots[2 * i + 1] != 0) - int(m.roots[2 * i] != 0)
        elif after.deflection[k] < held.bounds[i, 0]:  # back over the corner that it had just crossed
            way = -1
        elif after.deflection[k] > held.bounds[i, 1]:
            way = 1
        if way != 0:
            _log(m, after, first, time, k, m.piece[k], m.piece[k] + way)
            m.piece[k] += way
            hold(field, held, i, m.piece[k])
            changed += 1
    return changed


@kernel
def _count(library, m):
    """Read CVODE's counts; update smallest, last and next step, and the sum of the trial steps.

    If several trials of one step are rejected, CVODE reports the length of the first; the others are counted with the
    length of the accepted step.
    """
    # counts and step sizes, read through the addresses of our arrays
    c = m.current
    f = m.numbers
    memory = library.memory
    failed = c[ERROR_FAILS] + c[SOLVE_FAILS]
    at = c.ctypes.data
    width = 8
    spare = f[SPARE:].ctypes.data
    real = f.ctypes.data
    first = f[NEXT]
    call_code(
        library.statistics,
        (
            memory,
            at + width * STEPS,
            at + width * CALLS,
            at,
            at + width * ERROR_FAILS,
            at,
            at,
            spare,
            real + width * LAST,
            real + width * NEXT,
            spare,
        ),
    )
    call_code(library.solve_fails, (memory, at + width * SOLVE_FAILS))
    if library.newton:
        call_code(library.jacobians, (memory, at + width * JACOBIANS))
    # rejected trials since the last reading, and the sum of the trial steps
    failed = c[ERROR_FAILS] + c[SOLVE_FAILS] - failed
    h = f[LAST]
    f[SMALLEST] = min(f[SMALLEST], h)
    f[TRIED] += h + (max(first, h) + (failed - 1) * h if failed > 0 else 0.0)


@kernel
def _restart(library, m, end):
    """Restart CVODE at the present state; add its counts to the sums."""
    m.counts[STEPS : JACOBIANS + 1] += m.current[STEPS : JACOBIANS + 1]
    m.current[:] = 0
    m.numbers[NEXT] = 0.0
    flag = call_code(library.restart, (library.memory, m.numbers[TIME], library.vector))
    call_code(library.first, (library.memory, 0.0))  # CVODE chooses its step
    return min(flag, call_code(library.stop, (library.memory, end)))


@kernel
def _store(library, m, size, through):
    """Store the samples up to a time; samples at or after ``TIME`` get the present state."""
    i = m.counts[SAMPLE]
    while i < m.times.size and m.times[i] <= through:
        if m.times[i] < m.numbers[TIME]:
            _between(library, m.times[i])
            for j in range(size.size):
                m.states[i, j] = m.point[j] * size[j]
        else:
            for j in range(size.size):
                m.states[i, j] = m.z[j] * size[j]
        i += 1
    m.counts[SAMPLE] = i


@kernel
def settle(field, size, held, m, s):
    """Compute the elements' states at the start; hold the pieces of the start, if pieces are held."""
    _look(field, size, m.numbers[TIME], m.z, s)
    copy(s.deflection, m.deflection.size, m.deflection)
    if held.on:
        for i in range(held.clearances.size):
            hold(field, held, i, m.piece[held.clearances[i]])


@kernel
def march_on(field, size, held, library, m, s, after, most_events, budget):
    """Take CVODE's steps until all samples are stored; ``s`` and ``after`` are scratch. Returns an ``Outcome`` code."""
    end = m.times[m.times.size - 1]
    for _ in range(budget):
        # stop where the caller must act
        if m.counts[SAMPLE] >= m.times.size:
            return DONE
        if m.counts[EVENTS] + most_events > m.event_time.size:
            return LOG_FULL
        # one step of CVODE
        begin = m.numbers[TIME]
        if end - begin <= 1e-14 * end:  # too short for a step after a restart
            _store(library, m, size, end)
            return DONE
        flag = call_code(library.step, (library.memory, end, library.vector, m.numbers[TIME:].ctypes.data, ONE_STEP))
        if not np.abs(m.z).max() <= LARGEST or RHS_FAILED[1] <= flag <= RHS_FAILED[0]:
            return NON_FINITE
        if flag < 0:
            return NO_CONVERGENCE
        # counts, the elements' state behind the step, and the samples in it
        _count(library, m)
        time = m.numbers[TIME]
        m.counts[IDLE] = 0 if time > begin else m.counts[IDLE] + 1
        _look(field, size, time, m.z, after)
        _store(library, m, size, time)
        # crossings: located behind the step, or at the root that ended it
        if not held.on:
            _pass_corners(field, size, library, m, s, after, begin, time)
        elif _leave(field, held, library, m, after, flag == ROOT_FOUND) > 0 and _restart(library, m, end) < 0:
            return NO_CONVERGENCE
        copy(after.deflection, m.deflection.size, m.deflection)
        if m.counts[IDLE] > PATIENCE:
            return CHATTER if held.on else NO_CONVERGENCE
    return SLICE_SPENT
