"""Perturbations along a known sequence of regions by Taylor series of sparse products, without tables of regions.

A train with many clearances hardly ever returns to a region, so tables would not be used again; and the generators are
sparse. A few perturbations are carried through the crossings at about the cost of the motion, in constant memory.
"""

from __future__ import annotations

from typing import NamedTuple

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels.arrays import BoolMatrix, IntVector, Matrix, Vector

_NORM = 4.0  # largest norm |h A| of a step: in longer steps the terms of the series cancel
_MOST_TERMS = 60  # of the Taylor series
_NEGLIGIBLE = 1e-17  # share of the largest entry below which the next term is rounding


class Sparse(NamedTuple):
    """A matrix by rows: entries ``start[i]`` to ``start[i + 1]`` of ``column`` and ``value`` are those of row i."""

    start: IntVector
    column: IntVector
    value: Vector


class Driveline(NamedTuple):
    """Rows that do not depend on the region, in scaled states: r deflections x, n velocities v, S memories."""

    turning: Sparse  # (r, n) x' per v
    deflection: Sparse  # (m, r) deflections of the elements per x [SI]
    rate: Sparse  # (m, n) rates of the deflections per v [SI]
    push: Sparse  # (n, m) v' per force of the elements [SI]
    drag: Vector  # (n,) decay rate of every velocity by drag
    element: IntVector  # (S,) the element to whose auxiliary a memory belongs
    norm: float  # estimate of the largest norm of the generators of all regions


class Regions(NamedTuple):
    """The regions along the path."""

    stiffness: Matrix  # (regions, m) of every element with its auxiliaries [SI]
    damping: Matrix  # (regions, m) of every element with its auxiliaries [SI]
    memory: Matrix  # (regions, S) force per unit of a memory
    moves: Matrix  # (regions, S) rate of a memory per unit of the rate of its element


class Intervals(NamedTuple):
    """Intervals between crossings and ends of segments."""

    region: IntVector  # (I,) the region in every interval
    duration: Vector  # (I,) its length in periods
    crossed: IntVector  # (I,) element crossed at its end; -1: none
    kick: Matrix  # (I, n) change of the velocities per unit of the crossed element's deflection, by a jump of damping
    engaged: Matrix  # (I, S) change of the memories per unit of that deflection
    reset: BoolMatrix  # (I, S) whether a memory does not depend on what was before the crossing


@kernel
def add_rows(matrix, i, source, first, weight, out, at):
    """out[at] += weight times row i of a sparse matrix times the rows of ``source`` from ``first`` on."""
    for entry in range(matrix.start[i], matrix.start[i + 1]):
        factor = weight * matrix.value[entry]
        j = first + matrix.column[entry]
        for p in range(source.shape[1]):
            out[at, p] += factor * source[j, p]


@kernel
def rates(plan, regions, region, y, force, out):
    """out = A y in one region for every column of y (N, P); ``force`` (m, P) is scratch."""
    r = plan.turning.start.size - 1
    n = plan.drag.size
    m = plan.rate.start.size - 1
    for k in range(m):
        # forces of the elements, by stiffness and damping
        for p in range(y.shape[1]):
            force[k, p] = 0.0
        add_rows(plan.deflection, k, y, 0, regions.stiffness[region, k], force, k)
        add_rows(plan.rate, k, y, r, regions.damping[region, k], force, k)
    # memories of auxiliaries
    for i in range(y.shape[0]):
        for p in range(y.shape[1]):
            out[i, p] = 0.0
    for s in range(plan.element.size):
        k = plan.element[s]
        for p in range(y.shape[1]):
            force[k, p] += regions.memory[region, s] * y[r + n + s, p]
        add_rows(plan.rate, k, y, r, regions.moves[region, s], out, r + n + s)
    # rates of the deflections from the velocities, and of the velocities from forces and drag
    for i in range(r):
        add_rows(plan.turning, i, y, r, 1.0, out, i)
    for i in range(n):
        add_rows(plan.push, i, force, 0, 1.0, out, r + i)
        for p in range(y.shape[1]):
            out[r + i, p] -= plan.drag[i] * y[r + i, p]


@kernel
def flow_on(plan, regions, region, h, y, term, made, force):
    """y <- exp(A h) y by Taylor series, in equal steps of |h A| <= ``_NORM``."""
    steps = int(plan.norm * h / _NORM) + 1
    for _ in range(steps):
        size = 0.0
        for i in range(y.shape[0]):
            for p in range(y.shape[1]):
                term[i, p] = y[i, p]
                size = max(size, abs(y[i, p]))
        for m in range(1, _MOST_TERMS + 1):
            rates(plan, regions, region, term, force, made)
            largest = 0.0
            factor = h / steps / m
            for i in range(y.shape[0]):
                for p in range(y.shape[1]):
                    term[i, p] = factor * made[i, p]
                    y[i, p] += term[i, p]
                    largest = max(largest, abs(term[i, p]))
            if largest <= _NEGLIGIBLE * size:
                break


@kernel
def carry(plan, regions, path, first, last, y, term, made, force, deflected):
    """Carry perturbations (N, P) through the intervals ``first`` to ``last`` - 1 and the crossings at their ends.

    y: (N, P) perturbations, scaled; overwritten.
    term, made: (N, P) scratch.
    force, deflected: (m, P) and (1, P) scratch.
    """
    r = plan.turning.start.size - 1
    n = plan.drag.size
    columns = y.shape[1]
    for i in range(first, last):
        if path.duration[i] > 0.0:
            flow_on(plan, regions, path.region[i], path.duration[i], y, term, made, force)
        k = path.crossed[i]
        for p in range(columns):
            deflected[0, p] = 0.0
        if k >= 0:
            add_rows(plan.deflection, k, y, 0, 1.0, deflected, 0)
        for s in range(plan.element.size):
            for p in range(columns):
                if path.reset[i, s]:
                    y[r + n + s, p] = 0.0
                y[r + n + s, p] += path.engaged[i, s] * deflected[0, p]
        if k >= 0:
            for j in range(n):
                if path.kick[i, j] != 0.0:
                    for p in range(columns):
                        y[r + j, p] += path.kick[i, j] * deflected[0, p]
