"""What the criteria keep of a motion, gathered from its log without any arrays in between.

The tallies are those of ``criteria`` (regime, contact, impacts; ``signals.impact_sums``): counts, sums and largest
values, added up in the order of the log. ``tests/studies/test_batch.py`` holds both to the same bits.
"""

from __future__ import annotations

import numpy as np

from gearrattle.kernels._jit import strict, strict_entry

_SIMULTANEOUS = 4 * 2.220446049250313e-16  # periods


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
    """Put simultaneous crossings into element order, and write all times [s]; those of one instant are the same."""
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
def _stay(judged, log, events, time, window, pieces, sides, dwell):
    """Times in every region, and the sides on which corners are crossed."""
    clearances, since = pieces.size, np.empty(pieces.size)
    for k in range(clearances):
        since[k] = window[0]
        for p in range(judged.pieces[k], judged.pieces[k + 1]):
            dwell[p] = 0.0
        sides[k, 0] = sides[k, 1] = 0.0
    for i in range(events):
        k = log.clearance[i]
        begin = judged.pieces[k]
        if window[0] <= time[i] <= window[1]:
            dwell[begin + pieces[k]] += time[i] - since[k]
            since[k] = time[i]
            lower, last = begin + log.piece[i] - (0 if log.upward[i] else 1), begin
            inside = judged.inner[lower] + judged.inner[lower + 1]
            if inside == 1 or (inside == 0 and not judged.gap[k]):
                for p in range(begin, judged.pieces[k + 1]):
                    if judged.inner[p]:
                        last = p
                sides[k, 0 if lower >= last else 1] = 1.0
        if time[i] <= window[1]:
            pieces[k] = log.piece[i] + 2 * log.upward[i] - 1
    for k in range(clearances):
        dwell[judged.pieces[k] + pieces[k]] += window[1] - since[k]


@strict
def _strike(judged, log, events, time, window, scales, v, out):
    """Counts, sums and largest values of the impacts that begin in the window."""
    period, returns, following = window[2], np.full(out.open.shape[1], -1, np.int64), np.empty(events, np.int64)
    for i in range(events - 1, -1, -1):
        k = log.clearance[i]
        corner = judged.pieces[k] - k + log.piece[i] - (0 if log.upward[i] else 1)
        following[i], returns[corner] = returns[corner], i
    for i in range(events):
        k = log.clearance[i]
        begin, origin = judged.pieces[k], log.piece[i]
        to = origin + 2 * log.upward[i] - 1
        outward = abs(to + judged.label[k]) > abs(origin + judged.label[k])
        if judged.inner[begin + to] or not (judged.inner[begin + origin] or outward):
            continue
        if not window[0] <= time[i] <= window[1]:
            continue
        speed = abs(log.rate[i] * scales.corner[k] / period)
        out.count[v, k] += 1.0
        out.drive[v, k] += 1.0 if to + judged.label[k] >= 0 else 0.0
        out.speed[v, k] += speed
        out.top_speed[v, k] = max(out.top_speed[v, k], speed)
        out.square[v, k] += speed * speed
        if following[i] < 0:
            corner = begin - k + min(origin, to)
            out.open[v, corner], out.begun[v, corner], out.met[v, corner] = 1.0, log.integral[i], speed
        else:
            left = abs(log.rate[following[i]] * scales.corner[k] / period)
            out.left[v, k] += left
            out.top_change[v, k] = max(out.top_change[v, k], speed + left)
            push = abs(log.integral[following[i]] - log.integral[i])
            out.push[v, k] += push
            out.top_push[v, k] = max(out.top_push[v, k], push)


@strict_entry
def tally(judged, log, events, window, initial, final, scales, v, out):
    """Write what the criteria keep of one motion.

    Args:
        judged: ``variants.Judged``.
        log: ``packed.Log``; simultaneous crossings are put into element order.
        events: how many there are.
        window: begin and end of the steady part [s], both included, and the period.
        initial: (K,) pieces at t = 0.
        final: (K,) force integrals at the end.
        scales: ``variants.Scales``.
        v: which of the variants.
        out: ``variants.Tallies``; its counts of function calls stay as they are.
    """
    time, pieces = np.empty(events), initial.copy()
    _in_order(log, events, window[2], time)
    _stay(judged, log, events, time, window, pieces, out.sides[v], out.dwell[v])
    for k in range(initial.size):
        out.count[v, k] = out.drive[v, k] = out.speed[v, k] = out.top_speed[v, k] = 0.0
        out.square[v, k] = out.left[v, k] = out.top_change[v, k] = out.push[v, k] = out.top_push[v, k] = 0.0
        out.final[v, k] = final[k]
    for corner in range(out.open.shape[1]):
        out.open[v, corner] = out.begun[v, corner] = out.met[v, corner] = 0.0
    _strike(judged, log, events, time, window, scales, v, out)
    crossed = 0
    for i in range(events):
        if time[i] >= window[0]:
            crossed += 1
    out.crossings[v, 0] = crossed
