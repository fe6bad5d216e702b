"""Sums over the crossings of a motion: counts, sums and largest values, in the order of the log.

A run, a chunk of a long motion (``signals.crossing_sums``) and a batch of variants (``variants_march``) use this code.
``tests/signals/numpy_sums.py`` computes the same sums in NumPy for comparison.

A bearing with clearance is a *ring* of faces, and one part. It is in contact while any face is, and its crossings are
those at which contact begins or ends: from face to face a body rolls. Both sides are crossed if contact begins or ends
at two faces more than 90 deg apart.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.variant_arrays import Crossings

_SIMULTANEOUS = 4 * 2.220446049250313e-16  # periods: largest difference of simultaneous crossings


@strict
def _swap(log, i):
    """Exchange a crossing and the next."""
    j = i + 1
    log.cycle[i], log.cycle[j] = log.cycle[j], log.cycle[i]
    log.fraction[i], log.fraction[j] = log.fraction[j], log.fraction[i]
    log.clearance[i], log.clearance[j] = log.clearance[j], log.clearance[i]
    log.upward[i], log.upward[j] = log.upward[j], log.upward[i]
    log.piece[i], log.piece[j] = log.piece[j], log.piece[i]
    log.rate[i], log.rate[j] = log.rate[j], log.rate[i]
    log.integral[i], log.integral[j] = log.integral[j], log.integral[i]


@strict
def _in_order(log, events, period, time):
    """Put simultaneous crossings into element order, and write all times [s], which never fall."""
    i = 0
    while i < events - 1:
        apart = (log.cycle[i + 1] - log.cycle[i]) + (log.fraction[i + 1] - log.fraction[i])
        if apart <= _SIMULTANEOUS and log.clearance[i + 1] < log.clearance[i]:
            _swap(log, i)
            i = max(i - 1, 0)
        else:
            i += 1
    for i in range(events - 1, -1, -1):
        time[i] = (log.cycle[i] + log.fraction[i]) * period
        if i < events - 1:
            time[i] = min(time[i], time[i + 1])


@strict
def _broken(judged, crossings, pieces):
    """The first crossing that does not lead from its clearance's present piece to a neighbouring one; -1: none.

    pieces: (C,) of all clearances at the start; overwritten.
    """
    for i in range(crossings.time.size):
        k = crossings.clearance[i]
        origin = crossings.from_piece[i]
        to = crossings.to_piece[i]
        if not 0 <= k < pieces.size:
            return i
        if origin != pieces[k] or abs(to - origin) != 1 or not 0 <= to < judged.size[k]:
            return i
        pieces[k] = to
    return -1


@strict
def merge_rings(judged, crossings, initial, merged, pieces, at):
    """Write the crossings of all parts, and their pieces at the start.

    initial: (C,) pieces of the clearances at the start.
    merged: ``variant_arrays.Crossings`` with as much room as ``crossings``; the force integral of a ring is NaN.
    pieces: (K,) pieces of the parts at the start.
    at: (E,) the face at which contact of a ring begins or ends, among those of all rings; -1 for other crossings.
    Returns the number of crossings of parts.
    """
    # faces in contact at the start, and where the faces of every ring begin
    closed = np.zeros(pieces.size, np.int64)
    before = np.zeros(pieces.size + 1, np.int64)
    for p in range(pieces.size):
        before[p + 1] = before[p] + judged.faces[p]
    for k in range(initial.size):
        p = judged.part[k]
        if judged.faces[p] == 0:
            pieces[p] = initial[k]
        else:
            closed[p] += 1 if initial[k] != judged.middle[k] else 0
            pieces[p] = 1 if closed[p] > 0 else 0
    count = 0
    for i in range(crossings.time.size):
        k = crossings.clearance[i]
        p = judged.part[k]
        merged.time[count] = crossings.time[i]
        merged.clearance[count] = p
        # a clearance as it is
        if judged.faces[p] == 0:
            merged.from_piece[count] = crossings.from_piece[i]
            merged.to_piece[count] = crossings.to_piece[i]
            merged.velocity[count] = crossings.velocity[i]
            merged.force_integral[count] = crossings.force_integral[i]
            at[count] = -1
            count += 1
            continue
        # a face that opens or closes: of the ring, if it is the only one
        begins = crossings.from_piece[i] == judged.middle[k]
        ends = crossings.to_piece[i] == judged.middle[k]
        others = closed[p] - 1 if ends else closed[p]
        closed[p] = others + 1 if begins else (others if ends else closed[p])
        if others > 0 or not (begins or ends):
            continue
        outside = crossings.to_piece[i] if begins else crossings.from_piece[i]
        opposite = judged.faces[p] // 2 if outside < judged.middle[k] else 0
        merged.from_piece[count] = 0 if begins else 1
        merged.to_piece[count] = 1 if begins else 0
        merged.velocity[count] = abs(crossings.velocity[i]) if begins else -abs(crossings.velocity[i])
        merged.force_integral[count] = np.nan
        at[count] = before[p] + judged.face[k] + opposite
        count += 1
    return count


@strict_entry
def ring_crossings(judged, crossings, initial, merged, pieces, at):
    """Write the crossings of all parts, see ``merge_rings``."""
    return merge_rings(judged, crossings, initial, merged, pieces, at)


@strict
def _face(judged, crossings, at, window, v, out):
    """Mark the faces at which contact of a ring begins or ends, and both sides if they lie over 90 deg apart."""
    for i in range(crossings.time.size):
        if at[i] >= 0 and window[0] <= crossings.time[i] <= window[1]:
            out.touched[v, at[i]] = 1.0
    begin = 0
    for p in range(judged.faces.size):
        faces = judged.faces[p]
        for i in range(faces):
            for j in range(i):
                apart = min(i - j, faces - i + j)
                if 4 * apart > faces and out.touched[v, begin + i] > 0.0 and out.touched[v, begin + j] > 0.0:
                    out.sides[v, p, 1] = 1.0
        begin += faces


@strict
def _clear(judged, pieces, v, out):
    """Set all sums to zero, and the flank of the last contact to that of the first piece."""
    # sums over contacts and impacts
    for k in range(pieces.size):
        out.sides[v, k, 0] = 0.0
        out.sides[v, k, 1] = 0.0
        out.count[v, k] = 0.0
        out.drive[v, k] = 0.0
        out.speed[v, k] = 0.0
        out.top_speed[v, k] = 0.0
        out.square[v, k] = 0.0
        out.left[v, k] = 0.0
        out.top_change[v, k] = 0.0
        out.push[v, k] = 0.0
        out.top_push[v, k] = 0.0
        out.final[v, k] = 0.0
        out.lost[v, k] = 0.0
        out.kept[v, k] = 0.0
        out.moving[v, k] = 0.0
        out.held[v, k] = 0.0
        out.same[v, k] = 0.0
        out.other[v, k] = 0.0
        # the time in every piece, and the flank of the first piece
        begin = judged.pieces[k]
        piece = pieces[k]
        below = 0
        for p in range(judged.pieces[k], judged.pieces[k + 1]):
            out.dwell[v, p] = 0.0
            below += 1 if judged.inner[p] and p < begin + piece else 0
        out.flank[v, k] = 0.0 if judged.inner[begin + piece] else (1.0 if below else -1.0)
    for face in range(out.touched.shape[1]):
        out.touched[v, face] = 0.0
    # contacts that are open at a corner
    for corner in range(out.open.shape[1]):
        out.open[v, corner] = 0.0
        out.begun[v, corner] = 0.0
        out.met[v, corner] = 0.0
        out.since[v, corner] = 0.0
    out.crossings[v, 0] = 0.0


@strict
def _stay(judged, crossings, window, pieces, v, out):
    """Add the times in every piece, and mark the sides on which corners are crossed."""
    clearances = pieces.size
    since = np.empty(pieces.size)
    dwell = np.zeros(out.dwell.shape[1])
    for k in range(clearances):
        since[k] = window[0]
    for i in range(crossings.time.size):
        k = crossings.clearance[i]
        time = crossings.time[i]
        # the time in the piece that is left
        begin = judged.pieces[k]
        if window[0] <= time <= window[1]:
            dwell[begin + pieces[k]] += time - since[k]
            since[k] = time
            # a corner between inner and outer pieces: the side on which it is crossed
            lower = begin + min(crossings.from_piece[i], crossings.to_piece[i])
            last = begin
            inside = judged.inner[lower] + judged.inner[lower + 1]
            if inside == 1 or (inside == 0 and not judged.gap[k]):
                for p in range(begin, judged.pieces[k + 1]):
                    if judged.inner[p]:
                        last = p
                out.sides[v, k, 0 if lower >= last else 1] = 1.0
        if time <= window[1]:
            pieces[k] = crossings.to_piece[i]
    # the time in the last pieces
    for k in range(clearances):
        dwell[judged.pieces[k] + pieces[k]] += window[1] - since[k]
    for p in range(dwell.size):
        out.dwell[v, p] += dwell[p]


@strict
def _larger(a, b):
    """The larger of two numbers; NaN if one of them is NaN."""
    return a if b <= a or np.isnan(a) else b


@strict
def _end(out, v, k, met, left, push, held):
    """Add a contact that has ended, by its speeds at start and end, its impulse and its duration."""
    out.left[v, k] += left
    out.top_change[v, k] = _larger(out.top_change[v, k], met + left)
    out.push[v, k] += push
    out.top_push[v, k] = _larger(out.top_push[v, k], push)
    out.lost[v, k] += met * met - left * left
    out.held[v, k] += held
    if met > 0.0:
        out.kept[v, k] += left / met
        out.moving[v, k] += 1.0


@strict
def _strike(judged, crossings, window, v, out):
    """Add the impacts in the window, and contacts of earlier chunks that end in this one."""
    # for every crossing the next one of the same corner, which ends the contact
    events = crossings.time.size
    following = np.empty(events, np.int64)
    returns = np.full(out.open.shape[1], -1, np.int64)
    time = crossings.time
    rate = crossings.velocity
    integral = crossings.force_integral
    for i in range(events - 1, -1, -1):
        k = crossings.clearance[i]
        corner = judged.pieces[k] - k + min(crossings.from_piece[i], crossings.to_piece[i])
        following[i] = returns[corner]
        returns[corner] = i
    # contacts that were open at the start of the chunk
    for corner in range(returns.size):
        i = returns[corner]
        if out.open[v, corner] > 0.0 and i >= 0:
            push = abs(integral[i] - out.begun[v, corner])
            held = time[i] - out.since[v, corner]
            _end(out, v, crossings.clearance[i], out.met[v, corner], abs(rate[i]), push, held)
            out.open[v, corner] = 0.0
    for i in range(events):
        # an impact: from the central piece outwards, or outwards into another piece
        k = crossings.clearance[i]
        begin = judged.pieces[k]
        origin = crossings.from_piece[i]
        to = crossings.to_piece[i]
        outward = abs(to + judged.label[k]) > abs(origin + judged.label[k])
        if judged.inner[begin + to] or not (judged.inner[begin + origin] or outward):
            continue
        # its flank, and the flank of the contact before
        flank = 1.0 if to + judged.label[k] >= 0 else -1.0
        before = out.flank[v, k]
        out.flank[v, k] = flank
        if not window[0] <= time[i] <= window[1]:
            continue
        # impacts in the window: numbers and speeds
        speed = abs(rate[i])
        out.count[v, k] += 1.0
        out.drive[v, k] += 1.0 if flank > 0.0 else 0.0
        out.same[v, k] += 0.0 if before == -flank else 1.0
        out.other[v, k] += 1.0 if before == -flank else 0.0
        out.speed[v, k] += speed
        out.top_speed[v, k] = max(out.top_speed[v, k], speed)
        out.square[v, k] += speed * speed
        # the contact: open at the end of the chunk, or ended by a later crossing
        j = following[i]
        if j < 0:
            corner = begin - k + min(origin, to)
            out.open[v, corner] = 1.0
            out.begun[v, corner] = integral[i]
            out.met[v, corner] = speed
            out.since[v, corner] = time[i]
        else:
            _end(out, v, k, speed, abs(rate[j]), abs(integral[j] - integral[i]), time[j] - time[i])


@strict_entry
def add_crossings(judged, crossings, window, initial, final, fresh, v, out):
    """Add the next chunk of a motion.

    crossings: ``variant_arrays.Crossings`` of the chunk, by clearances.
    window: begin and end of the part of the chunk that is evaluated [s], both included.
    initial: (C,) pieces at the start of the chunk.
    final: (C,) force integrals at the end of the chunk.
    fresh: whether the chunk is the first one: sums start at zero.
    v: index of the motion.
    out: ``variant_arrays.Tallies``; its numbers of function calls are not changed.
    Returns -1, or the index of a crossing that does not start in the present piece of its clearance: then nothing is
        written.
    """
    broken = _broken(judged, crossings, initial.copy())
    if broken >= 0:
        return broken
    # crossings of the parts
    events = crossings.time.size
    room = Crossings(
        np.empty(events),
        np.empty(events, np.int64),
        np.empty(events, np.int64),
        np.empty(events, np.int64),
        np.empty(events),
        np.empty(events),
    )
    pieces = np.zeros(judged.faces.size, np.int64)
    at = np.empty(events, np.int64)
    count = merge_rings(judged, crossings, initial, room, pieces, at)
    merged = Crossings(
        room.time[:count],
        room.clearance[:count],
        room.from_piece[:count],
        room.to_piece[:count],
        room.velocity[:count],
        room.force_integral[:count],
    )
    # their sums
    if fresh:
        _clear(judged, pieces, v, out)
    _stay(judged, merged, window, pieces.copy(), v, out)
    _face(judged, merged, at, window, v, out)
    _strike(judged, merged, window, v, out)
    for k in range(initial.size):
        p = judged.part[k]
        out.final[v, p] = final[k] if judged.faces[p] == 0 else np.nan
    for i in range(events):
        out.crossings[v, 0] += 1.0 if crossings.time[i] >= window[0] else 0.0
    return -1


@strict_entry
def tally(judged, log, events, window, initial, final, scales, v, out):
    """Write the sums of one motion that was marched to its end.

    log: ``march_arrays.Log``; simultaneous crossings are put into element order.
    events: number of crossings.
    window: begin and end of the steady part, both included, and period [s].
    initial: (C,) pieces at t = 0.
    final: (C,) force integrals at the end.
    v: index of the variant.
    out: ``variant_arrays.Tallies``; its numbers of function calls are not changed.
    """
    time = np.empty(events)
    rate = np.empty(events)
    origin = np.empty(events, np.int64)
    to = np.empty(events, np.int64)
    _in_order(log, events, window[2], time)
    for i in range(events):
        origin[i] = log.piece[i]
        to[i] = log.piece[i] + 2 * log.upward[i] - 1
        rate[i] = log.rate[i] * scales.corner[log.clearance[i]] / window[2]
    crossings = Crossings(time, log.clearance[:events], origin, to, rate, log.integral[:events])
    add_crossings(judged, crossings, window, initial, final, True, v, out)
