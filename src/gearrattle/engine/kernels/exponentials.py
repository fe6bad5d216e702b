"""Perturbations of a motion over a region: exponentials of its rates, and their derivatives by a parameter.

With z' = Z(p) z, z = (x, u), perturbations of the start obey v' = A v, with A the block of the states x. The
derivative s = dx/dp for a fixed start obeys s' = A s + B z with B = d[A, G]/dp, so that over an interval h

    s(h) = exp(A h) s(0) + D(h) z(0),    exp([[A, B], [0, Z]] h) = [[exp(A h), D(h)], [0, exp(Z h)]]

D is the derivative of the exponential in the direction of B. It follows by the same doublings as the exponential:
D(2 h) = exp(A h) D(h) + D(h) exp(Z h).

N. J. Higham, Functions of Matrices, SIAM 2008, section 3.2 and theorem 3.6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, loose, strict
from gearrattle.engine.kernels.arrays import Array4, IntVector, Matrix, Vector
from gearrattle.engine.kernels.motion_levels import norm_of_square
from gearrattle.engine.kernels.workspace import PERIOD

_TERMS = 7  # of the Taylor series over the finest step
_WIDEST = 1.0 / 64.0  # norm of the rates times the finest step: the first omitted term is below 1e-16
_LEVELS = 60  # most steps of a slot


class Steps(NamedTuple):
    """Tables of all slots over the steps h = 1, 1/2, 1/4 ...; a slot has the steps ``first`` to ``levels`` - 1."""

    increment: Array4  # (S, levels, P, P) exp(Z h) - 1
    moved: Array4  # (S, levels, N, P) D(h)
    levels: IntVector  # (S,) one beyond the index of the finest step of a slot
    first: IntVector  # (S,) index of the longest step of a slot


class Carried(NamedTuple):
    """Perturbations and state along a motion, and scratch for products."""

    columns: Matrix  # (N, N + 1) perturbations of the start, scaled; the last column is s
    z: Vector  # (P,)
    columns_term: Matrix
    z_term: Vector
    columns_product: Matrix
    z_product: Vector


@strict
def write_levels(common, rates, path, levels, first):
    """Write the steps of every slot: from its longest interval to a step over which a Taylor series is exact to
    rounding.

    levels, first: (S,) of ``Steps``, written.
    """
    states = rates.shift.shape[1]
    # the fastest input
    widest = 0.0
    for h in range(common.frequency.size):
        widest = max(widest, common.frequency[h])
    for slot in range(levels.size):
        # each slot: the norm of its rates, and its longest interval
        norm = max(widest, norm_of_square(rates.generator[slot], states))
        longest = 0.0
        for i in range(path.slot.size):
            if path.slot[i] == slot:
                longest = max(longest, path.time[i + 1] - path.time[i])
        # from the longest step within that interval down to one over which a Taylor series is exact to rounding
        levels[slot] = 1
        while norm * 0.5 ** (levels[slot] - 1) > _WIDEST and levels[slot] < _LEVELS:
            levels[slot] += 1
        first[slot] = 0
        while first[slot] < levels[slot] - 1 and 0.5 ** first[slot] > longest:
            first[slot] += 1


@strict
def write_tables(generator, shift, steps, slot):
    """Write the tables of a slot: Taylor series over the finest step, then doublings.

    The rows of the inputs, which are oscillators, are computed by sines.
    """
    # terms of the series
    states, size = shift.shape
    pairs = (size - states - 1) // 2
    finest = steps.levels[slot] - 1
    h = 0.5**finest
    term = np.zeros((2, size, size))
    moved_term = np.zeros((2, states, size))
    # rows of the inputs, by sines
    for level in range(steps.first[slot], finest + 1):
        increment = steps.increment[slot, level]
        moved = steps.moved[slot, level]
        for i in range(size):
            for j in range(size):
                increment[i, j] = 0.0
        for i in range(states):
            for j in range(size):
                moved[i, j] = 0.0
        for c in range(states + 1, states + 1 + pairs):
            angle = generator[c + pairs, c] * 0.5**level
            turned = np.sin(angle)
            half = np.sin(0.5 * angle)
            increment[c, c] = -2.0 * half * half
            increment[c + pairs, c + pairs] = increment[c, c]
            increment[c + pairs, c] = turned
            increment[c, c + pairs] = -turned
    # Taylor series over the finest step, of the exponential and of its derivative D
    increment = steps.increment[slot, finest]
    moved = steps.moved[slot, finest]
    for i in range(size):
        for j in range(size):
            term[0, i, j] = h * generator[i, j]
            if i < states:
                increment[i, j] = term[0, i, j]
                moved_term[0, i, j] = h * shift[i, j]
                moved[i, j] = moved_term[0, i, j]
    for m in range(2, _TERMS + 1):
        now = m % 2
        then = 1 - m % 2
        _multiply_term(generator, shift, h / m, term[now], moved_term[now], term[then], moved_term[then])
        for i in range(states):
            for j in range(size):
                increment[i, j] += term[then, i, j]
                moved[i, j] += moved_term[then, i, j]
    # double: E(2 h) = 2 E(h) + E(h) E(h), D(2 h) = exp(A h) D(h) + D(h) exp(Z h)
    for level in range(finest - 1, steps.first[slot] - 1, -1):
        half = steps.increment[slot, level + 1]
        half_moved = steps.moved[slot, level + 1]
        increment = steps.increment[slot, level]
        moved = steps.moved[slot, level]
        for i in range(states):
            for j in range(size):
                increment[i, j] = 2.0 * half[i, j]
                moved[i, j] = 2.0 * half_moved[i, j]
        _double(half, half_moved, states, increment, moved)


@strict
def _multiply_term(generator, shift, factor, term, moved_term, product, moved_product):
    """Write the next term of both series: factor times the rates times the last term."""
    states, size = shift.shape
    # rows of the states
    for i in range(states):
        row = product[i]
        moved_row = moved_product[i]
        for p in range(size):
            row[p] = 0.0
            moved_row[p] = 0.0
        for j in range(states):
            weight = factor * generator[i, j]
            moved_weight = factor * shift[i, j]
            other = term[j]
            other_moved = moved_term[j]
            for p in range(size):
                row[p] += weight * other[p]
                moved_row[p] += weight * other_moved[p] + moved_weight * other[p]
        for j in range(states, size):
            weight = factor * generator[i, j]
            moved_weight = factor * shift[i, j]
            for p in range(states, size):
                row[p] += weight * term[j, p]
                moved_row[p] += moved_weight * term[j, p]
    # rows of the inputs
    for i in range(states, size):
        for p in range(states, size):
            total = 0.0
            for j in range(states, size):
                total += generator[i, j] * term[j, p]
            product[i, p] = factor * total


@strict
def _double(half, half_moved, states, increment, moved):
    """Add the products in the tables of half a step to the tables of a step."""
    size = half.shape[1]
    pairs = (size - states - 1) // 2
    for i in range(states):
        # products of rows of the states: E E, and E D + D E
        row = increment[i]
        moved_row = moved[i]
        for j in range(states):
            weight = half[i, j]
            moved_weight = half_moved[i, j]
            other = half[j]
            other_moved = half_moved[j]
            for p in range(size):
                row[p] += weight * other[p]
                moved_row[p] += weight * other_moved[p] + moved_weight * other[p]
        # products with the blocks of the oscillators
        for c in range(states + 1, states + 1 + pairs):
            s = c + pairs
            row[c] += half[i, c] * half[c, c] + half[i, s] * half[s, c]
            row[s] += half[i, c] * half[c, s] + half[i, s] * half[s, s]
            moved_row[c] += half_moved[i, c] * half[c, c] + half_moved[i, s] * half[s, c]
            moved_row[s] += half_moved[i, c] * half[c, s] + half_moved[i, s] * half[s, s]


@loose
def _dot(matrix, i, z):
    """Product of a row and a vector."""
    total = 0.0
    for j in range(z.size):
        total += matrix[i, j] * z[j]
    return total


@kernel
def _multiply(rates, shift, columns, z, carried):
    """Write the products of the rates, or of the tables, with columns and z; rows of inputs have two entries."""
    states, size = shift.shape
    product = carried.columns_product
    z_product = carried.z_product
    # the states and their perturbations; the last column has the term B z
    for i in range(states):
        row = product[i]
        for p in range(states + 1):
            row[p] = 0.0
        for j in range(states):
            weight = rates[i, j]
            other = columns[j]
            for p in range(states + 1):
                row[p] += weight * other[p]
        row[states] += _dot(shift, i, z)
        z_product[i] = _dot(rates, i, z)
    # the inputs, oscillators
    pairs = (size - states - 1) // 2
    z_product[states] = 0.0
    for cosine in range(states + 1, states + 1 + pairs):
        sine = cosine + pairs
        z_product[cosine] = rates[cosine, cosine] * z[cosine] + rates[cosine, sine] * z[sine]
        z_product[sine] = rates[sine, cosine] * z[cosine] + rates[sine, sine] * z[sine]


@kernel
def _step(increment, moved, carried):
    """Carry over one step of a table."""
    columns = carried.columns
    z = carried.z
    _multiply(increment, moved, columns, z, carried)
    for i in range(columns.shape[0]):
        for p in range(columns.shape[1]):
            columns[i, p] += carried.columns_product[i, p]
    for i in range(z.size):
        z[i] += carried.z_product[i]


@kernel
def _add_series(generator, shift, h, carried):
    """Carry over a time h shorter than the finest step, by Taylor series."""
    columns = carried.columns
    z = carried.z
    term = carried.columns_term
    z_term = carried.z_term
    for i in range(columns.shape[0]):
        for p in range(columns.shape[1]):
            term[i, p] = columns[i, p]
    for i in range(z.size):
        z_term[i] = z[i]
    for m in range(1, _TERMS + 1):
        _multiply(generator, shift, term, z_term, carried)
        factor = h / m
        for i in range(columns.shape[0]):
            for p in range(columns.shape[1]):
                term[i, p] = factor * carried.columns_product[i, p]
                columns[i, p] += term[i, p]
        for i in range(z.size):
            z_term[i] = factor * carried.z_product[i]
            z[i] += z_term[i]


@kernel
def carry(steps, slot, generator, shift, h, carried):
    """Carry over an interval: steps of the tables, the longest first, then a Taylor series."""
    left = h
    length = 0.5 ** steps.first[slot]
    for level in range(steps.first[slot], steps.levels[slot]):
        while left >= length:
            _step(steps.increment[slot, level], steps.moved[slot, level], carried)
            left -= length
        length *= 0.5
    if left > 0.0:
        _add_series(generator, shift, left, carried)


@kernel
def cross(common, k, jump, corner_shift, deflection, deflection_shift, carried):
    """Apply the jump of the perturbations of the velocities where the damping of element k jumps at a corner.

    The jump is in proportion to the perturbation of the deflection (``system.perturbation_growth``). In the last
    column, s, the change of the corner with the parameter is subtracted from it.
    """
    columns = carried.columns
    z = carried.z
    states = columns.shape[0]
    inertias = common.inertia.size
    moving = states - inertias
    for p in range(states + 1):
        moved = 0.0
        for j in range(states):
            moved += deflection[j] * columns[j, p]
        if p == states:
            moved -= corner_shift
            for j in range(z.size):
                moved += deflection_shift[j] * z[j]
        for j in range(inertias):
            kick = common.pace[j] / common.limits[PERIOD] * common.rows[k, j] / common.inertia[j]
            columns[moving + j, p] -= kick * jump * moved
