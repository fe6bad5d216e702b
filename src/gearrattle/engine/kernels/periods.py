"""Motions over whole periods and their gradients, in one loop: from a state to where it is at the end.

The motions are those of ``many``, which this loop begins and advances. At the end of each the gradient of its flow is
the product of exponentials of the regions' rates, with a saltation at every crossing (``system.variation``).

Arrays: ``located`` (workspace), ``packed`` (regions, march, samples, notes, log), ``variants``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict_entry
from gearrattle.engine.kernels.arrays import Array3, IntMatrix, IntVector, Matrix
from gearrattle.engine.kernels.located import common_at, laws_at, region_at
from gearrattle.engine.kernels.many import AT, FINISHED, MORE_LOG, MORE_ROOM, SLOTS, SPENT, UNDER_WAY, advance_one
from gearrattle.engine.kernels.packed import EVENTS
from gearrattle.engine.kernels.region import accelerate
from gearrattle.engine.kernels.workspace import PERIOD

REACHED, NOT_REACHED = 1, 2
"""What became of a motion: followed to its end; left to the general way."""
TERMS = 16
"""Of the Taylor series over the finest step."""
_WIDEST = 0.25  # norm of the rates times the finest step
_LEVELS = 60


class Maps(NamedTuple):
    """V motions over n periods; N states."""

    has_gradient: IntVector  # (V,) whether the gradient is wanted, 1 or 0
    end: Matrix  # (V, N) states at the end [SI]
    turned: Matrix  # (V, R) how far the reference inertia of every free train has turned [rad]
    gradient: Array3  # (V, N, N) of the end with respect to the start [SI]
    crossings: IntVector  # (V,) how many there are
    initial: IntMatrix  # (V, K) pieces at the start


@kernel
def norm_of_rows(matrix):
    """Largest sum of moduli of a row."""
    largest = 0.0
    for i in range(matrix.shape[0]):
        total = 0.0
        for j in range(matrix.shape[1]):
            total += abs(matrix[i, j])
        largest = max(largest, total)
    return largest


@kernel
def multiplied(a, b, out):
    """Write out = a b; all (N, P), a (N, N)."""
    for i in range(out.shape[0]):
        for p in range(out.shape[1]):
            out[i, p] = 0.0
        for j in range(a.shape[1]):
            weight = a[i, j]
            if weight != 0.0:
                for p in range(out.shape[1]):
                    out[i, p] += weight * b[j, p]


@kernel
def add_series(generator, h, y, term, product):
    """Write y <- exp(A h) y for |A h| below ``_WIDEST``, by its Taylor series; ``term`` and ``product`` are room."""
    for i in range(y.shape[0]):
        for p in range(y.shape[1]):
            term[i, p] = y[i, p]
    for m in range(1, TERMS + 1):
        multiplied(generator, term, product)
        factor = h / m
        for i in range(y.shape[0]):
            for p in range(y.shape[1]):
                term[i, p] = factor * product[i, p]
                y[i, p] += term[i, p]


@kernel
def exponentials(generator, levels, tables, term, product):
    """Write exp(A h) - 1 for h = 1, 1/2, ... 2^(1 - levels)."""
    size, h = generator.shape[0], 0.5 ** (levels - 1)
    increment = tables[levels - 1]
    for i in range(size):
        for j in range(size):
            term[i, j] = increment[i, j] = h * generator[i, j]
    for m in range(2, TERMS + 1):
        multiplied(generator, term, product)
        for i in range(size):
            for j in range(size):
                term[i, j] = h / m * product[i, j]
                increment[i, j] += term[i, j]
    for level in range(levels - 2, -1, -1):
        multiplied(tables[level + 1], tables[level + 1], product)
        for i in range(size):
            for j in range(size):
                tables[level, i, j] = 2.0 * tables[level + 1, i, j] + product[i, j]


@kernel
def carry(tables, generator, h, columns, term, product):
    """Write columns <- exp(A h) columns: steps of the tables, the longest first, then a Taylor series."""
    left = h
    while left >= 1.0:
        multiplied(tables[0], columns, product)
        columns += product
        left -= 1.0
    step = 1.0
    for level in range(1, tables.shape[0]):
        step *= 0.5
        if left >= step:
            multiplied(tables[level], columns, product)
            columns += product
            left -= step
    if left > 0.0:
        add_series(generator, left, columns, term, product)


@strict_entry
def write_generators(workspace, regions, slots, out):
    """Write the rates (N, N) of the states in every slot's region; the workspace then holds the last of them."""
    region, clearances = region_at(workspace), common_at(workspace).clearances
    for slot in range(slots):
        for i in range(clearances.size):
            region.pieces[clearances[i]] = regions.piece[slot, i]
        accelerate(workspace)
        for i in range(out.shape[1]):
            for j in range(out.shape[1]):
                out[slot, i, j] = region.matrix[i, j]


@kernel
def follow(workspace, regions, slots, generators, log, count, initial, end, columns):
    """Carry perturbations (N, N), balanced, along a motion of so many crossings that ends after ``end`` periods."""
    common, laws = common_at(workspace), laws_at(workspace)
    size, inertias = generators.shape[1], common.inertia.size
    moving = size - inertias
    widest = 0.0
    for slot in range(slots):
        widest = max(widest, norm_of_rows(generators[slot]))
    levels = 1
    while widest * 0.5 ** (levels - 1) > _WIDEST and levels < _LEVELS:
        levels += 1
    tables, is_written = np.empty((slots, levels, size, size)), np.zeros(slots, np.bool_)
    pieces, before = initial.copy(), 0.0
    term, product = np.empty((2, size, size))
    for i in range(count + 1):
        slot = 0
        for candidate in range(slots):
            is_same = True
            for k in range(pieces.size):
                is_same = is_same and regions.piece[candidate, k] == pieces[k]
            if is_same:
                slot = candidate
        if not is_written[slot]:
            exponentials(generators[slot], levels, tables[slot], term, product)
            is_written[slot] = True
        now = log.cycle[i] + log.fraction[i] if i < count else end
        carry(tables[slot], generators[slot], now - before, columns, term, product)
        before = now
        if i == count:
            break
        crossed = log.clearance[i]
        k = common.clearances[crossed]
        jump = -laws.damping[laws.first[k] + pieces[crossed]]
        pieces[crossed] += 1 if log.upward[i] else -1
        jump += laws.damping[laws.first[k] + pieces[crossed]]
        if jump != 0.0:
            for p in range(columns.shape[1]):
                moved = 0.0
                for j in range(size):
                    moved += common.deflection[k, j] * columns[j, p]
                for j in range(inertias):
                    kick = common.pace[j] / common.limits[PERIOD] * common.rows[k, j] / common.inertia[j]
                    columns[moving + j, p] -= kick * jump * moved


@strict_entry
def map_many(at, workspace, cases, buffers, driven, regions, march, samples, notes, log, out, cursor, slices):
    """Follow variants from where the cursor stands, for so many slices; as ``many.march_many``, but for ``out``: Maps.

    The log holds the crossings of the last one.
    """
    counts = march.counts
    r, n, references = cases.frame.elements.size, cases.angle.shape[1], cases.frame.references
    states = r + n
    scale = np.empty(states)
    while cursor[AT] < cases.outcome.size:
        v = cursor[AT]
        if slices <= 0:
            return SPENT
        slices -= 1
        code = advance_one(at, workspace, cases, buffers, driven, regions, march, samples, notes, log, cursor)
        if code == -1:
            return MORE_ROOM
        if code == -3:
            return MORE_LOG
        if code == 0:
            continue
        if code == 1:
            last = samples.states[samples.states.shape[0] - 1]
            for i in range(states):
                scale[i] = buffers.scales.deflection[i] if i < r else buffers.scales.velocity[i - r]
                out.end[v, i] = last[i] / scale[i]
            for i in range(references.size):
                out.turned[v, i] = last[states + i] - cases.angle[v, references[i]]
            out.crossings[v], out.initial[v] = counts[EVENTS], buffers.initial
            if out.has_gradient[v]:
                columns, end = np.eye(states), float(samples.first) / samples.per_cycle
                generators = np.empty((cursor[SLOTS], states, states))
                write_generators(workspace, regions, cursor[SLOTS], generators)
                follow(
                    workspace,
                    regions,
                    cursor[SLOTS],
                    generators,
                    log,
                    counts[EVENTS],
                    buffers.initial,
                    end,
                    columns,
                )
                for i in range(states):
                    for j in range(states):
                        out.gradient[v, i, j] = columns[i, j] / scale[i] * scale[j]
        cases.outcome[v] = REACHED if code == 1 else NOT_REACHED
        cursor[AT], cursor[UNDER_WAY] = v + 1, 0
    return FINISHED
