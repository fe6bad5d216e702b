"""A run of steps: choose a step, take it, test its error, log the corners that are crossed, store the samples in it.

A state within a step, at a sample or a crossing, is computed by a shorter step from the same start: it is as accurate
as the step itself, unlike an interpolant of lower order. A method that steps *blindly* takes the pieces from the
deflections in every stage, as in the paper of 1995; it detects a crossing from the two ends of a step. A method that
*holds* the pieces integrates a smooth system up to the first corner; it ends the step there, and changes the piece.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import inlined, kernel, separate
from gearrattle.engine.kernels.arrays import IntMatrix, IntVector, Matrix, Vector
from gearrattle.engine.kernels.one_step_kernels import (
    COLUMNS,
    EXTRAPOLATION,
    FIRST_COLUMN,
    StepBuffers,
    error_of,
    extrapolate,
    look,
    next_of_extrapolation,
    runge_kutta,
)
from gearrattle.engine.kernels.outcomes import CHATTER, DONE, LOG_FULL, NO_CONVERGENCE, NON_FINITE, SLICE_SPENT

STEP, SAMPLE, EVENTS, CALLS, REJECTED, COLUMN, STALLED, BEGUN = range(8)
"""Indices into ``Stepper.counts``: steps taken, samples, crossings and calls so far, steps rejected, target column of
the extrapolation, successive crossings at one instant, 1 once the run has begun."""
NOW, NEXT, TRIED, SMALLEST = range(4)
"""Indices into ``Stepper.clock``: time, next trial step, sum of all trial steps, shortest step taken [s]."""
# States of the search for a root.
NO_END = 0
"""Neither end of its bracket has a value yet."""
ONE_END = 1
"""The beginning of its bracket has a value."""
BOTH_ENDS = 2
"""Both ends have values, of different signs: the bracket is narrowed from now on."""
AT_BEGIN = -1
"""The root is the beginning of its bracket, which has no length."""
NO_CROSSING = -2
"""There is no root: the cubic crosses the corner, the motion does not."""
_AT_END = 2.0  # fraction of a step that stands for: no crossing, the step is taken in full

ROOT = 12
"""Entries of a root: element, piece, direction, corner, bracket (2), last point, values at the bracket (2), side that
was replaced last, values at both ends of the step (2). A value is the deflection minus the corner."""
_SAFETY = 0.9  # factor on the next step
_LEAST = 0.2  # least ratio of the next step to this one
_MOST = 5.0  # largest ratio of the next step to this one
_MOST_STALLED = 100  # successive crossings at one instant
_EIGHTHS = 8  # parts of a step in which the cubic is tested for a crossing
_SETTLED = 1e-10  # share of the step: change of a root at which it is accepted
_BARELY = 1e-300  # value that only has a sign
_MOST_NARROWED = 38  # evaluations for one root


class Stepper(NamedTuple):
    """Arrays of a run that change."""

    y: Vector  # (S,) state
    clock: Vector  # (4,)
    counts: IntVector  # (8,)
    piece: Vector  # (m,) pieces held
    states: Matrix  # (samples, S) output
    event_time: Vector  # (capacity,)
    event_element: IntVector  # (capacity,)
    event_pieces: IntMatrix  # (capacity, 2) from, to
    event_rate: Vector  # (capacity,)
    event_integral: Vector  # (capacity,)


@inlined
def _four(elements):
    """Arrays for deflections, rates, pieces and forces; four vectors, because rows of a matrix cost more time."""
    return np.empty(elements), np.empty(elements), np.empty(elements), np.empty(elements)


@inlined
def _take(source, out):
    """Copy a vector."""
    for i in range(out.size):
        out[i] = source[i]


@inlined
def _differ(one, other):
    """Whether two vectors differ."""
    count = 0
    for i in range(one.size):
        count += one[i] != other[i]
    return count > 0


@inlined
def _is_finite(y):
    """Whether every entry is finite."""
    total = 0.0
    for i in range(y.size):
        total += 0.0 * y[i]
    return total == 0.0


@inlined
def hermite(x, h, a, da, b, db):
    """Cubic Hermite interpolant on a step of length h at fraction x."""
    s = 1.0 - x
    return s * s * (1.0 + 2.0 * x) * a + x * x * (3.0 - 2.0 * x) * b + h * x * s * (s * da - x * db)


@inlined
def _log(stepper, begin, time, k, piece, up, rate, integral):
    """Log a crossing in order of time among the entries from ``begin`` on, not before entry begin - 1."""
    i = stepper.counts[EVENTS]
    if begin > 0:
        time = max(time, stepper.event_time[begin - 1])
    while i > begin and stepper.event_time[i - 1] > time:
        stepper.event_time[i] = stepper.event_time[i - 1]
        stepper.event_element[i] = stepper.event_element[i - 1]
        stepper.event_pieces[i, 0] = stepper.event_pieces[i - 1, 0]
        stepper.event_pieces[i, 1] = stepper.event_pieces[i - 1, 1]
        stepper.event_rate[i] = stepper.event_rate[i - 1]
        stepper.event_integral[i] = stepper.event_integral[i - 1]
        i -= 1
    stepper.event_time[i] = time
    stepper.event_element[i] = k
    stepper.event_pieces[i, 0] = piece
    stepper.event_pieces[i, 1] = piece + up
    stepper.event_rate[i] = rate
    stepper.event_integral[i] = integral
    stepper.counts[EVENTS] += 1


@inlined
def _exit(h, gap, closing, end, end_rate, bracket):
    """Bracket the first exit of a gap over a step, by the cubic through gap and rate at both ends.

    A gap that is not positive at the start (the motion sits on the corner) must open before it can close. Return
    whether there is an exit; write the bracket in fractions of the step.
    """
    inside = gap > 0.0
    last = 0.0
    for i in range(1, _EIGHTHS + 1):
        x = i / _EIGHTHS
        value = end if i == _EIGHTHS else hermite(x, h, gap, closing, end, end_rate)
        if inside and value < 0.0:
            bracket[0] = last
            bracket[1] = x
            return True
        if value > 0.0:
            inside = True
            last = x
    if not inside and end < 0.0:
        bracket[0] = 0.0
        bracket[1] = 0.0
        return True
    return False


@kernel
def _passed(field, old, new, roots):
    """Write the corners between the two ends of a blind step to ``roots``; return their number."""
    count = 0
    for k in range(field.laws.first.size - 1):
        piece = int(old[2][k])
        target = int(new[2][k])
        while piece != target:
            up = 1 if target > piece else -1
            p = field.laws.first[k] + piece
            corner = field.laws.upper[p] if up > 0 else field.laws.lower[p]
            roots[count, 0] = k
            roots[count, 1] = piece
            roots[count, 2] = up
            roots[count, 3] = corner
            roots[count, 4] = 0.0
            roots[count, 5] = 1.0
            roots[count, 6] = 0.0
            roots[count, 9] = 0.0
            roots[count, 7] = old[0][k] - corner
            roots[count, 8] = new[0][k] - corner
            count += 1
            piece += up
    return count


@separate
def _met(field, h, piece, old, new, roots):
    """Write the corners that a step with held pieces crosses to ``roots``; return their number."""
    count = 0
    bracket = np.empty(2)
    for k in range(field.laws.first.size - 1):
        index = field.laws.first[k] + int(piece[k])
        for up in range(-1, 2, 2):
            corner = field.laws.upper[index] if up > 0 else field.laws.lower[index]
            if abs(corner) > 1e300:
                continue
            gap = up * (corner - old[0][k])
            end = up * (corner - new[0][k])
            if not _exit(h, gap, -up * old[1][k], end, -up * new[1][k], bracket):
                continue
            roots[count, 0] = k
            roots[count, 1] = piece[k]
            roots[count, 2] = up
            roots[count, 3] = corner
            roots[count, 4] = bracket[0]
            roots[count, 5] = bracket[1]
            roots[count, 6] = 0.0
            roots[count, 9] = 0.0
            roots[count, 10] = old[0][k] - corner
            roots[count, 11] = new[0][k] - corner
            count += 1
    return count


@inlined
def _next_guess(root, ends):
    """The next point of the search for a root: both ends of its bracket, then regula falsi (Illinois)."""
    if ends == NO_END:
        return root[4]
    if ends == ONE_END:
        return root[5]
    x = (root[4] * root[8] - root[5] * root[7]) / (root[8] - root[7])
    return x if root[4] < x < root[5] else 0.5 * (root[4] + root[5])


@inlined
def _widen(root, ends, x, value):
    """Store a value at an end of the bracket; if its sign is wrong, extend the bracket to that end of the step.

    Return ONE_END, BOTH_ENDS, AT_BEGIN or NO_CROSSING.
    """
    inside = value * root[2] < 0.0
    if ends == NO_END:
        root[7] = value if inside else -root[2] * _BARELY
        if inside or x <= 0.0:
            return ONE_END if root[5] > x else AT_BEGIN
        before = root[10] if root[10] * root[2] < 0.0 else -root[2] * _BARELY
        root[4] = 0.0
        root[7] = before
        root[5] = x
        root[8] = value
        return BOTH_ENDS
    root[8] = value
    if not inside:
        return BOTH_ENDS
    if root[11] * root[2] < 0.0:
        return NO_CROSSING
    root[4] = x
    root[7] = value
    root[5] = 1.0
    root[8] = root[11]
    return BOTH_ENDS


@inlined
def _narrow(root, x, value):
    """Narrow the bracket by a value inside it; return whether the root has converged."""
    last = root[6]
    root[6] = x
    if (value > 0.0) == (root[8] > 0.0):
        root[5] = x
        root[8] = value
        root[7] = 0.5 * root[7] if root[9] == 1.0 else root[7]
        root[9] = 1.0
    else:
        root[4] = x
        root[7] = value
        root[8] = 0.5 * root[8] if root[9] == -1.0 else root[8]
        root[9] = -1.0
    return value == 0.0 or abs(x - last) <= _SETTLED


@separate
def _explore(field, method, control, stepper, h, count, samples_per_period, last, scratch, roots, after):
    """Locate the ``count`` roots in a step, log them (blind) or move to the first (held), and store the samples.

    Return (x, k, up): the fraction of the step at which it must end, element, direction; x = _AT_END: no crossing.
    """
    buffers, probe, here = scratch
    counts = stepper.counts
    t = stepper.clock[NOW]
    y = stepper.y
    # the state of the search, and the first root so far
    begin = counts[EVENTS]
    rows = stepper.states.shape[0]
    base = stepper.y.size - field.rows.shape[0]
    known = NO_END if control.held else BOTH_ENDS  # a blind step has values at both ends
    first = _AT_END
    element = -1
    way = 0
    done = 0
    ends = known
    narrowed = 0
    reach = h
    while True:
        # the next point: a guess of a root, the first root, or a sample
        locating = done < count
        moving = done == count and first <= 1.0
        ahead = 0.0
        if locating:
            x = _next_guess(roots[done], ends)
        elif moving:
            x = first
            reach = first * h
            last = False
        else:
            i = counts[SAMPLE]
            if i >= rows:
                break
            ahead = i * field.period / samples_per_period - t
            if ahead > reach and not (last and i == rows - 1):
                break
            counts[SAMPLE] += 1
            if ahead >= reach or (last and i == rows - 1):
                _take(after, stepper.states[i])
                continue
            x = max(ahead, 0.0) / h
        # the state at that point, by a shorter step from the start
        if method.kind == EXTRAPOLATION:
            calls = extrapolate(field, control, t, x * h, y, counts[COLUMN], True, buffers, probe)[2]
        else:
            runge_kutta(field, method, control.held, t, x * h, y, buffers, probe)
            calls = method.b.size - 1
        # store the state at the first root, or at a sample
        if moving:
            _take(probe, after)
            done += 1
        elif not locating:
            _take(probe, stepper.states[counts[SAMPLE] - 1])
            continue
        if control.held:
            counts[CALLS] += calls
        if moving:
            continue
        # the distance of the element from its corner narrows the bracket
        k = int(roots[done, 0])
        _take(stepper.piece, here[2])
        look(field, t + x * h, probe, True, here, buffers.wave, buffers.trial)
        root = roots[done]
        value = here[0][k] - roots[done, 3]
        if ends != BOTH_ENDS:
            ends = _widen(root, ends, x, value)
            if ends in (ONE_END, BOTH_ENDS):
                continue
            root[6] = _AT_END if ends == NO_CROSSING else x
        else:
            narrowed += 1
            if not _narrow(root, x, value) and narrowed < _MOST_NARROWED:
                continue
        # the root has converged: log the crossing (blind), or keep the first root (held)
        x = roots[done, 6]
        piece = int(roots[done, 1])
        up = int(roots[done, 2])
        if not control.held:
            _log(stepper, begin, t + x * h, k, piece, up, here[1][k], probe[base + k])
        elif x < first:
            first = x
            element = k
            way = up
        done = done + 1
        ends = known
        narrowed = 0
    return first, element, way


@kernel
def _try(field, method, control, stepper, h, buffers, after):
    """Take a trial step of length h; set the next step; return the error relative to the tolerance."""
    counts = stepper.counts
    clock = stepper.clock
    clock[TRIED] += h
    if method.kind == EXTRAPOLATION:
        error, column, calls = extrapolate(
            field, control, clock[NOW], h, stepper.y, counts[COLUMN], False, buffers, after
        )
        counts[CALLS] += calls
        step, target = next_of_extrapolation(buffers, column, counts[COLUMN], error <= 1.0)
        clock[NEXT] = step
        counts[COLUMN] = target
        return error
    runge_kutta(field, method, control.held, clock[NOW], h, stepper.y, buffers, after)
    counts[CALLS] += method.b.size - 1
    if control.fixed:
        return 0.0
    error = error_of(control, stepper.y, after, buffers.error)
    factor = _SAFETY * max(error, 1e-10) ** (-1.0 / method.order)
    clock[NEXT] = h * min(max(factor, _LEAST), _MOST if error <= 1.0 else 1.0)
    return error


@kernel
def step_on(field, method, control, stepper, samples_per_period, most_events, budget):
    """Take steps until all samples are stored; every array of ``stepper`` changes. Returns an ``Outcome`` code."""
    # scratch
    size = stepper.y.size
    elements = field.rows.shape[0]
    y = stepper.y
    counts = stepper.counts
    clock = stepper.clock
    rows = stepper.states.shape[0]
    buffers = StepBuffers(
        np.empty(2 * field.cycles.size),
        _four(elements),
        np.empty((max(method.b.size, 2), size)),
        np.empty(size),
        np.empty(size),
        np.zeros((COLUMNS, size)),
        np.empty(size),
        np.zeros(COLUMNS),
    )
    old = _four(elements)
    new = _four(elements)
    here = _four(elements)
    after = np.empty(size)
    slope = np.empty(size)
    probe = np.empty(size)
    roots = np.empty((most_events, ROOT))
    # the first step, and the elements' states at its beginning
    if not counts[BEGUN]:
        counts[BEGUN] = 1
        counts[COLUMN] = FIRST_COLUMN
        clock[NEXT] = control.step
    _take(stepper.piece, old[2])
    look(field, clock[NOW], y, control.held, old, buffers.wave, slope)
    end = (rows - 1) * field.period / samples_per_period
    for _ in range(budget):
        # stop where the caller must act
        if counts[SAMPLE] >= rows:
            return DONE
        if counts[EVENTS] + most_events > stepper.event_time.size:
            return LOG_FULL
        # a trial step, up to the last sample at most
        t = clock[NOW]
        left = end - clock[NOW]
        last = left <= clock[NEXT] * (1.0 + 1e-9)
        h = left if last else clock[NEXT]
        wanted = clock[NEXT]
        _take(slope, buffers.stages[0])
        _take(stepper.piece, buffers.at[2])
        error = _try(field, method, control, stepper, h, buffers, after)
        # rejected: a shorter trial step follows
        if error > 1.0:
            counts[REJECTED] += 1
            if clock[NEXT] < control.shortest or t + clock[NEXT] == t:
                return NO_CONVERGENCE
            continue
        # accepted: the elements' states at its end
        if control.fixed and not _is_finite(after):
            return NON_FINITE
        counts[CALLS] += 1
        if last and not control.fixed:
            clock[NEXT] = max(clock[NEXT], wanted)
        _take(stepper.piece, new[2])
        then = (counts[STEP] + 1) * control.step if control.fixed and not last else t + h
        look(field, then, after, control.held, new, buffers.wave, slope)
        # crossings and samples within the step
        x = _AT_END
        k = -1
        up = 0
        count = 0
        if control.held:
            count = _met(field, h, stepper.piece, old, new, roots)
        elif _differ(old[2], new[2]):
            count = _passed(field, old, new, roots)
        if count > 0 or last or counts[SAMPLE] * field.period / samples_per_period - t <= h:
            x, k, up = _explore(
                field,
                method,
                control,
                stepper,
                h,
                count,
                samples_per_period,
                last,
                (buffers, probe, here),
                roots,
                after,
            )
        # take the step; if pieces are held, up to the first crossing
        met = x <= 1.0
        taken = x * h if met else h
        _take(after, y)
        counts[STEP] += 1
        clock[NOW] = t + taken if met else then
        clock[SMALLEST] = min(clock[SMALLEST], taken) if taken > 0.0 else clock[SMALLEST]
        # over the crossing into the next piece
        if met:
            counts[STALLED] = counts[STALLED] + 1 if taken == 0.0 else 0
            if counts[STALLED] > _MOST_STALLED:
                return CHATTER
            piece = int(stepper.piece[k])
            base = size - elements
            stepper.piece[k] += up
            _take(stepper.piece, new[2])
            look(field, clock[NOW], y, True, new, buffers.wave, slope)
            _log(stepper, counts[EVENTS], clock[NOW], k, piece, up, new[1][k], y[base + k])
        elif not control.held:
            _take(new[2], stepper.piece)
        _take(new[0], old[0])
        _take(new[1], old[1])
        _take(new[2], old[2])
    return SLICE_SPENT
