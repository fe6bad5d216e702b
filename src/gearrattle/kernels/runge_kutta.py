"""Explicit Runge-Kutta steps of fixed size, any tableau, with corner crossings from the cubic Hermite interpolant."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gearrattle.kernels._jit import kernel
from gearrattle.kernels.vector_field import derivative

DONE, SLICE_SPENT, LOG_FULL, NON_FINITE = 0, 1, 3, 5  # outcome.Outcome
STEP, SAMPLE, EVENTS, CALLS = range(4)
"""Indices into ``Stepper.counts``."""


class Stepper(NamedTuple):
    """Everything that changes."""

    y: Any  # (S,) state
    counts: Any  # (4,)
    states: Any  # (samples, S) output
    event_time: Any  # (capacity,)
    event_element: Any  # (capacity,)
    event_pieces: Any  # (capacity, 2) from, to
    event_rate: Any  # (capacity,)
    event_integral: Any  # (capacity,)


@kernel
def _hermite(x, h, a, da, b, db):
    """Cubic Hermite interpolant on a step of length h at fraction x."""
    s = 1.0 - x
    return s * s * (1.0 + 2.0 * x) * a + x * x * (3.0 - 2.0 * x) * b + h * x * s * (s * da - x * db)


@kernel
def _crossing_fraction(h, a, da, b, db):
    """Where the Hermite interpolant from a to b (opposite signs) crosses zero, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if (_hermite(middle, h, a, da, b, db) > 0.0) == (a > 0.0):
            low = middle
        else:
            high = middle
    return high


@kernel
def _log_crossings(field, stepper, t, h, old, new):
    """Log every corner passed between two step ends, ordered by time; old, new: (deflection, rate, piece, force, I)."""
    begin = stepper.counts[EVENTS]
    for k in range(field.first_piece.size - 1):
        piece, target = int(old[2][k]), int(new[2][k])
        while piece != target:
            up = 1 if target > piece else -1
            corner = field.upper_corner[field.first_piece[k] + (piece if up > 0 else piece - 1)]
            x = _crossing_fraction(h, old[0][k] - corner, old[1][k], new[0][k] - corner, new[1][k])
            i = stepper.counts[EVENTS]
            while i > begin and stepper.event_time[i - 1] > t + x * h:
                stepper.event_time[i] = stepper.event_time[i - 1]
                stepper.event_element[i] = stepper.event_element[i - 1]
                stepper.event_pieces[i] = stepper.event_pieces[i - 1]
                stepper.event_rate[i] = stepper.event_rate[i - 1]
                stepper.event_integral[i] = stepper.event_integral[i - 1]
                i -= 1
            stepper.event_time[i], stepper.event_element[i] = t + x * h, k
            stepper.event_pieces[i, 0], stepper.event_pieces[i, 1] = piece, piece + up
            stepper.event_rate[i] = (1.0 - x) * old[1][k] + x * new[1][k]
            stepper.event_integral[i] = _hermite(x, h, old[4][k], old[3][k], new[4][k], new[3][k])
            stepper.counts[EVENTS] += 1
            piece += up


@kernel
def step_on(field, a, b, c, stepper, step, samples_per_period, most_events, budget):
    """Take fixed steps until all samples are stored; (a, b, c) is the tableau. Returns an ``Outcome`` code."""
    size, stages = stepper.y.size, b.size
    elements = field.rows.shape[0]
    wave = np.empty(2 * field.cycles.size)
    k = np.empty((stages, size))
    old = np.empty((5, elements))
    new = np.empty((5, elements))
    trial, after, slope_after = np.empty(size), np.empty(size), np.empty(size)
    t = stepper.counts[STEP] * step
    derivative(field, t, stepper.y, wave, old[0], old[1], old[2], old[3], k[0])
    for _ in range(budget):
        i = stepper.counts[SAMPLE]
        if i >= stepper.states.shape[0]:
            return DONE
        if stepper.counts[EVENTS] + most_events > stepper.event_time.size:
            return LOG_FULL
        t = stepper.counts[STEP] * step
        end = (stepper.states.shape[0] - 1) * field.period / samples_per_period
        h = min(step, end - t)  # a shorter last one
        last = end - t <= step * (1.0 + 1e-9)
        for s in range(1, stages):
            trial[:] = stepper.y
            for j in range(s):
                if a[s, j] != 0.0:
                    trial += (h * a[s, j]) * k[j]
            derivative(field, t + c[s] * h, trial, wave, new[0], new[1], new[2], new[3], k[s])
        after[:] = stepper.y
        for s in range(stages):
            after += (h * b[s]) * k[s]
        stepper.counts[CALLS] += stages
        if not np.isfinite(after).all():
            return NON_FINITE
        old[4] = stepper.y[size - elements :]
        new[4] = after[size - elements :]
        derivative(field, t + h, after, wave, new[0], new[1], new[2], new[3], slope_after)
        _log_crossings(field, stepper, t, h, old, new)
        while i < stepper.states.shape[0]:
            ahead = i * field.period / samples_per_period - t
            if ahead > h and not (last and i == stepper.states.shape[0] - 1):
                break
            x = min(ahead / h, 1.0)
            for j in range(size):
                stepper.states[i, j] = _hermite(x, h, stepper.y[j], k[0, j], after[j], slope_after[j])
            i += 1
        stepper.counts[SAMPLE] = i
        stepper.y[:] = after
        k[0] = slope_after
        old[:4] = new[:4]
        stepper.counts[STEP] += 1
    return SLICE_SPENT
