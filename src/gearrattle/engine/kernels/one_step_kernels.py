"""One step from y(t) to y(t + h) with an error estimate, by an explicit Runge-Kutta method or by extrapolation.

Extrapolation is Gragg's modified midpoint rule with n = 2, 4, 6 ... substeps, extrapolated in (h / n)^2 by Aitken and
Neville (R. Bulirsch, J. Stoer, Numer. Math. 8 (1966) 1; W. B. Gragg, SIAM J. Numer. Anal. 2 (1965) 384); the
choice of the last column and of the next step follows P. Deuflhard, Numer. Math. 41 (1983) 399, as described in
E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, sec. II.9.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, separate
from gearrattle.engine.kernels.arrays import Matrix, Vector
from gearrattle.engine.kernels.equation_of_motion import derivative

RUNGE_KUTTA = 0
EXTRAPOLATION = 1
COLUMNS = 9
"""Most columns of the extrapolation table."""
FIRST_COLUMN = 4  # target column of the first step
_SAFETY = 0.94  # factor on the next step
_AIM = 0.65  # error that the next step should have, over the tolerance
_REJECTED = 1e30  # error of a step with a state that is not finite
_WORK = np.array([1.0 + (j + 1) * (j + 2) for j in range(COLUMNS)])
"""Evaluations of y' for columns 0 ... j, of 2, 4, 6 ... substeps, including the slope at the start."""
_LEAST = np.array([0.02 ** (1.0 / (2 * j + 1)) for j in range(COLUMNS)])
"""Limits of the next step by column: a quarter of this and the reciprocal of this, times the present step."""


class Method(NamedTuple):
    """Coefficients of a one-step method."""

    kind: int  # RUNGE_KUTTA or EXTRAPOLATION
    a: Matrix  # (s, s) tableau
    b: Vector  # (s,)
    c: Vector  # (s,)
    error: Vector  # (s,) weights of the error estimate; zeros: none
    order: int  # the error estimate is proportional to h^order


class Control(NamedTuple):
    """Control of the step length."""

    fixed: bool  # every step has the length `step`
    held: bool  # the elements keep their pieces during a step, and a step ends at a corner
    step: float  # the fixed step, or the first trial step
    shortest: float  # a step shorter than this has failed
    tolerance: float
    size: Vector  # (N,) least sizes of the N states that feed back: errors are relative to these or to the state


class StepBuffers(NamedTuple):
    """Scratch: S states, m elements."""

    wave: Vector  # (2 H,)
    at: Any  # four arrays (m,): deflection, rate, piece, force of the elements at the last evaluation
    stages: Matrix  # (stages, S) slopes y' at the stages; the first is the slope at the start of the step
    trial: Vector  # (S,)
    before: Vector  # (S,)
    table: Matrix  # (COLUMNS, S) one diagonal of the extrapolation table
    error: Vector  # (S,)
    longest: Vector  # (COLUMNS,) next step that every column would allow


@separate
def look(field, t, y, held, at, wave, out):
    """Write y' to ``out``; write deflections, rates, pieces and forces to ``at``; if ``held``, the pieces are read."""
    derivative(field, t, y, wave, at[0], at[1], at[2], at[3], out, held)


@kernel
def error_of(control, y, after, error):
    """Largest error of the states that feed back, relative to tolerance and size; _REJECTED if one is not finite."""
    worst = 0.0
    for i in range(control.size.size):
        scale = max(control.size[i], abs(y[i]), abs(after[i]))
        worst = max(worst, abs(error[i]) / scale)
        if not np.isfinite(after[i]):
            return _REJECTED
    return worst / control.tolerance


@kernel
def runge_kutta(field, method, held, t, h, y, buffers, after):
    """Take one step; buffers.stages[0] holds the slope at its start, buffers.error receives the error estimate."""
    stages = method.b.size
    size = y.size
    slopes = buffers.stages
    trial = buffers.trial
    at = buffers.at
    for s in range(1, stages):
        for i in range(size):
            total = 0.0
            for j in range(s):
                total += method.a[s, j] * slopes[j, i]
            trial[i] = y[i] + h * total
        derivative(field, t + method.c[s] * h, trial, buffers.wave, at[0], at[1], at[2], at[3], slopes[s], held)
    for i in range(size):
        total = 0.0
        error = 0.0
        for s in range(stages):
            total += method.b[s] * slopes[s, i]
            error += method.error[s] * slopes[s, i]
        after[i] = y[i] + h * total
        buffers.error[i] = h * error


@separate
def _midpoint(field, held, t, h, y, count, buffers, out):
    """Gragg's modified midpoint rule with ``count`` substeps and his smoothing."""
    size = y.size
    d = h / count
    before = buffers.before
    now = buffers.trial
    slope = buffers.stages[1]
    at = buffers.at
    for i in range(size):
        before[i] = y[i]
        now[i] = y[i] + d * buffers.stages[0, i]
    for j in range(1, count + 1):
        derivative(field, t + j * d, now, buffers.wave, at[0], at[1], at[2], at[3], slope, held)
        if j == count:
            break
        for i in range(size):
            following = before[i] + 2.0 * d * slope[i]
            before[i] = now[i]
            now[i] = following
    for i in range(size):
        out[i] = 0.5 * (now[i] + before[i] + d * slope[i])


@separate
def extrapolate(field, control, t, h, y, target, sure, buffers, after):
    """Extrapolate until a column at or next to the target passes the error test; if ``sure``, compute all columns.

    Returns (error, column, calls): error <= 1 if accepted; the last column; the number of evaluations of y'
        without the slope at the start. ``buffers.longest[1 ... column]`` are the next steps that they would allow.
    """
    size = y.size
    table = buffers.table
    calls = 0
    error = _REJECTED
    last = min(target + 1, COLUMNS - 1)
    for j in range(last + 1):
        # the next row of the table: the modified midpoint rule with more steps
        _midpoint(field, control.held, t, h, y, 2 * (j + 1), buffers, after)
        calls += 2 * (j + 1)
        # Richardson's extrapolation in h^2 through all columns
        for i in range(size):
            below = table[0, i]
            table[0, i] = after[i]
            for k in range(1, j + 1):
                ratio = (j + 1.0) / (j + 1.0 - k)
                step = (table[k - 1, i] - below) / (ratio * ratio - 1.0)
                below = table[k, i]
                table[k, i] = table[k - 1, i] + step
        if j == 0:
            continue
        # error: the difference of the last two columns; then the next step that this column would allow
        for i in range(size):
            after[i] = table[j, i]
            buffers.error[i] = table[j, i] - table[j - 1, i]
        error = error_of(control, y, after, buffers.error)
        factor = _SAFETY * (_AIM / max(error, 1e-10)) ** (1.0 / (2 * j + 1))
        buffers.longest[j] = h * min(max(factor, _LEAST[j] / 4.0), 1.0 / _LEAST[j])
        if sure or j < target - 1:
            continue
        # the column is accepted, or no later column can be accepted
        if error <= 1.0:
            return error, j, calls
        hopeless = (j + 2.0) * (j + 3.0) if j < target else j + 2.0
        if j <= target and error > hopeless * hopeless:
            return error, j, calls
    return error, last, calls


@kernel
def next_of_extrapolation(buffers, column, target, accepted):
    """(step, target column) of the next step: the column with the least number of evaluations per unit of time."""
    reached = max(column, 1)
    best = min(reached, COLUMNS - 2)
    if reached > 1:
        here = _WORK[reached] / buffers.longest[reached]
        below = _WORK[reached - 1] / buffers.longest[reached - 1]
        if reached > 2 and below < 0.8 * here:
            best = reached - 1
        elif accepted and best == reached and here < 0.9 * below:
            best = min(reached + 1, COLUMNS - 2)
    if not accepted:
        best = min(best, target)
    best = max(best, 2)
    if best <= reached:
        return buffers.longest[best], best
    return buffers.longest[reached] * _WORK[best] / _WORK[reached], best
