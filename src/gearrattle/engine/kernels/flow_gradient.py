"""The flow's gradient along a known sequence of regions: products of exponentials, a saltation at every crossing."""

from __future__ import annotations

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels.strip_products import copy


@kernel
def propagate(tables, generator, steps, fine, h, order, columns, term):
    """columns <- exp(A h) columns (N, P): steps of the tables, the longest first, then a Taylor series."""
    done = 0.0
    for level in range(fine + 1):
        while h - done >= steps[level]:
            columns += tables[level] @ columns
            done += steps[level]
    rest = h - done
    if rest > 0.0:
        for i in range(term.shape[0]):
            copy(columns[i], term.shape[1], term[i])
        for m in range(1, order + 1):
            made = generator @ term
            for i in range(term.shape[0]):
                for j in range(term.shape[1]):
                    term[i, j] = (rest / m) * made[i, j]
                    columns[i, j] += term[i, j]


@kernel
def gradient_segments(tables, generators, steps, fine, order, path, durations, kicks, reset, rows, out):
    """Gradient of the flow over consecutive segments.

    tables: (regions, levels, N, N) exp(A h) - 1.
    generators: (regions, N, N) A.
    steps, fine: (levels,) h, and (regions,) the finest level.
    order: terms of the Taylor series over the remainder.
    path: (I, 3) region; clearance crossed at the end of the interval, -1: none; 1 if a segment ends there, else 0.
    durations: (I,) lengths of the intervals.
    kicks: (I, N) change of the state per unit of the crossed clearance's deflection, by a jump of damping.
    reset: (I, S) whether a memory (the last S states) does not depend on the state before the crossing.
    rows: (K, N) deflections by state.
    out: (segments, N, N) results; segment i maps perturbations at its start to its end.
    """
    size = rows.shape[1]
    segment = 0
    columns = out[0]
    term = out[0].copy()
    columns[:] = 0.0
    for i in range(size):
        columns[i, i] = 1.0
    for i in range(durations.size):
        # within the interval: exp(A h)
        region = path[i, 0]
        clearance = path[i, 1]
        propagate(tables[region], generators[region], steps, fine[region], durations[i], order, columns, term)
        for p in range(size):
            # the crossing: memories that are known, and the kick by the saltation matrix
            moved = 0.0
            for j in range(size if clearance >= 0 else 0):
                moved += rows[clearance, j] * columns[j, p]
            for j in range(reset.shape[1]):
                if reset[i, j]:
                    columns[size - reset.shape[1] + j, p] = 0.0
            for j in range(size if clearance >= 0 else 0):
                columns[j, p] += kicks[i, j] * moved
        # the next segment begins with the identity
        if path[i, 2] and segment + 1 < out.shape[0]:
            segment += 1
            columns = out[segment]
            columns[:] = 0.0
            for j in range(size):
                columns[j, j] = 1.0
