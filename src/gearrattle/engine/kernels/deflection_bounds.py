"""Bounds on the watched quantities that hold in a whole region (derivation: ``system.majorant``).

Input: the generator of a region over y = (states, kept inputs) and the Schur form of the states' block. Output: rows,
weights and constants of the bounds.
"""

from __future__ import annotations

from math import ceil, exp, log2, sqrt

from gearrattle.engine.kernels._jit import strict
from gearrattle.engine.kernels.dense import TOP, copy_rows, norm_of_columns, times
from gearrattle.engine.kernels.memory_addresses import bounds_at, common_at, free_at, modes_at, region_at, scratch_at
from gearrattle.engine.kernels.particular_solutions import modulus
from gearrattle.engine.kernels.signal_drive import add_push, begin_pushes, finish_pushes, push, shape
from gearrattle.engine.kernels.workspace import FAST, FAST_ROUNDING, HORIZON, SLACK

_HALF = sqrt(0.5)
_SAME = 1e-9  # share of the modulus: eigenvalues with a smaller difference count as equal


@strict
def triangular_form(workspace):
    """Complex Schur form of M = [A G; 0 S] without chains, from the Schur form of A and the known eigenvectors of S.

    M = ``free.generator`` = V T V^-1; T, V and V^-1 are written.
    """
    region = region_at(workspace)
    free = free_at(workspace)
    modes = modes_at(workspace)
    bounds = bounds_at(workspace)
    n = region.matrix.shape[0]
    constant = region.kept[0]
    width = free.chained[0]
    # Schur form of the states, as LAPACK gives it
    for i in range(width):
        for j in range(width):
            modes.triangle[i, j] = 0.0
            modes.right[i, j] = 0.0
    for i in range(n):
        for j in range(n):
            modes.right[i, j] = modes.basis[j, i]
            if j >= i:
                modes.triangle[i, j] = modes.schur[j, i]
    # eigenvectors of the kept oscillators: S has the eigenvalues +- i w
    harmonics = (width - n - constant) // 2
    if constant:
        modes.right[n, n] = 1.0
    for h in range(harmonics):
        c = n + constant + h
        s = n + constant + harmonics + h
        w = free.generator[s, c]
        modes.right[c, c] = _HALF
        modes.right[c, s] = _HALF
        modes.right[s, c] = complex(0.0, -_HALF)
        modes.right[s, s] = complex(0.0, _HALF)
        modes.triangle[c, c] = complex(0.0, w)
        modes.triangle[s, s] = complex(0.0, -w)
    # V is unitary: its inverse is its conjugate transpose
    for i in range(width):
        for j in range(width):
            modes.left[i, j] = modes.right[j, i].conjugate()
    # the coupling of the states to the oscillators
    for k in range(n):
        for j in range(n, width):
            pushed = complex(0.0, 0.0)
            for q in range(n, width):
                pushed += free.generator[k, q] * modes.right[q, j]
            for i in range(n):
                modes.triangle[i, j] += modes.left[i, k] * pushed
    begin_pushes(free, bounds)


@strict
def exponential(scratch, size):
    """Overwrite ``scratch.one``, without negative entries, with its exponential: Taylor series, then squarings."""
    # scale to a norm of one half
    norm = norm_of_columns(scratch.one, size)
    squarings = max(0, int(ceil(log2(max(min(norm, 1e300), 1e-300)))) + 1)
    for i in range(size):
        for j in range(size):
            scratch.two[i, j] = 1.0 if i == j else 0.0
            scratch.three[i, j] = scratch.two[i, j]
    # Taylor series
    for order in range(1, 16):
        times(1.0 / (order * 2.0**squarings), scratch.two, TOP, scratch.one, size, size, scratch.four, TOP)
        copy_rows(scratch.four, TOP, size, size, scratch.two)
        for i in range(size):
            for j in range(size):
                scratch.three[i, j] += scratch.two[i, j]
    # squarings
    for _ in range(squarings):
        times(1.0, scratch.three, TOP, scratch.three, size, size, scratch.four, TOP)
        copy_rows(scratch.four, TOP, size, size, scratch.three)
    copy_rows(scratch.three, TOP, size, size, scratch.one)


@strict
def _multiplicity(modes, i, width):
    """2 for a simple eigenvalue above the real axis with a simple conjugate, 0 for that conjugate, else 1.

    An eigenvalue within rounding of the real axis is real and counts once.
    """
    value = modes.triangle[i, i]
    near = _SAME * modulus(value)
    if not modes.simple[i] or not abs(value.imag) > near:
        return 1.0
    for j in range(width):
        if modes.simple[j] and modulus(value - modes.triangle[j, j].conjugate()) <= near:
            return 2.0 if value.imag > 0.0 else 0.0
    return 1.0


@strict
def _largest_of_inputs(free, rows, i, n, constant):
    """Largest |row i . u| over all phases, summed over harmonics.

    max over phi of |p cos phi + q sin phi|^2 = (|p|^2 + |q|^2 + |p^2 + q^2|) / 2.
    """
    total = 0.0
    if constant:
        total = modulus(rows[i, n]) * free.amplitude[0]
    harmonics = (free.chained[0] - n - constant) // 2
    for h in range(harmonics):
        p = rows[i, n + constant + h]
        q = rows[i, n + constant + harmonics + h]
        squares = p.real * p.real + p.imag * p.imag + q.real * q.real + q.imag * q.imag
        total += sqrt(0.5 * (squares + modulus(p * p + q * q))) * free.amplitude[constant + h]
    return total


@strict
def weigh(workspace, a, b):
    """Write the weights |delta_k V| exp(G horizon) and the rows of the fourth derivatives for the block [a, b).

    G holds the moduli of T above the diagonal and the growth rates on it. The rows are T^4 V^-1, with the chains added.
    """
    common = common_at(workspace)
    free = free_at(workspace)
    modes = modes_at(workspace)
    bounds = bounds_at(workspace)
    scratch = scratch_at(workspace)
    clearances = common.corner_scale.size
    chained = free.chained[0]
    width = free.width[0]
    # G times the horizon, and its exponential
    for i in range(a, b):
        modes.simple[i] = b - a == 1
        for j in range(a, b):
            size = modulus(modes.triangle[i, j]) if j > i else 0.0
            if j == i:
                size = max(modes.triangle[i, i].real, 0.0)
            scratch.one[i - a, j - a] = common.limits[HORIZON] * size
    if b - a == 1:
        scratch.one[0, 0] = exp(scratch.one[0, 0])
    else:
        exponential(scratch, b - a)
    # weights of the block: |r R_b| exp(G_b h)
    for k in range(clearances):
        for j in range(a, b):
            bounds.weights[k, j] = 0.0
        for i in range(a, b):
            size = SLACK * modulus(shape(free, modes, k, i))
            if size > 0.0:
                for j in range(a, b):
                    bounds.weights[k, j] += size * scratch.one[i - a, j - a]
    # signals: the deflections follow them, or their modes are excited
    if width > chained:
        push(common, free, modes, bounds, scratch, a, b)
    # rows of the fourth derivatives: T_b four times, with the part of the chains after each time
    for i in range(a, b):
        for j in range(width):
            bounds.rows[i, j] = modes.left[i, j]
    for passed in range(4):
        for i in range(a, b):
            for j in range(width):
                made = complex(0.0, 0.0)
                for q in range(i, b):
                    made += modes.triangle[i, q] * bounds.rows[q, j]
                bounds.rows[i, j] = made
            add_push(common, free, modes, bounds, i, passed)


@strict
def _has_some(rows, i, begin, end):
    for j in range(begin, end):
        if rows[i, j] != 0.0:
            return True
    return False


@strict
def gather(workspace):
    """Write the bounds of one region from the weights of its blocks.

    Written: the weights for the three bounds of ``workspace.Bounds``, their rows, constants and number; the part of the
    fast modes in every watched quantity.
    """
    common = common_at(workspace)
    region = region_at(workspace)
    free = free_at(workspace)
    modes = modes_at(workspace)
    bounds = bounds_at(workspace)
    n = region.matrix.shape[0]
    width = free.width[0]
    chained = free.chained[0]
    constant = region.kept[0]
    fast = common.limits[FAST]
    clearances = common.corner_scale.size
    finish_pushes(bounds)
    # sums over the modes start at zero
    for k in range(clearances):
        for part in range(3):
            bounds.constant[part * clearances + k] = 0.0
        for j in range(width):
            free.fast[k, j] = 0.0
    count = 0
    for i in range(chained):
        # fast modes without excitation: their part of the deflections is bounded by their amplitude
        how_often = _multiplicity(modes, i, chained)
        speed = modulus(modes.triangle[i, i])
        swift = 0.0
        is_free = not _has_some(modes.triangle, i, chained, width)
        if modes.simple[i] and speed > fast and is_free and _has_some(modes.left, i, 0, n):
            swift = 1.0 / (speed * speed * speed * speed)
            for k in range(clearances):
                form = shape(free, modes, k, i)
                for j in range(width):
                    free.fast[k, j] += (form * modes.left[i, j]).real
        # rows of inputs alone: their largest values over all phases are constants
        if not _has_some(bounds.rows, i, 0, n) and not _has_some(bounds.rows, i, chained, width):
            largest = _largest_of_inputs(free, bounds.rows, i, n, constant)
            for k in range(clearances):
                more = how_often * bounds.weights[k, i] * largest
                bounds.constant[k] += more
                bounds.constant[clearances + k] += more
            continue
        # other rows: weights for B_4, for B_4 without fast modes, and for the bound m on the fast modes
        is_used = False
        for k in range(clearances):
            w = how_often * bounds.weights[k, i]
            is_used = is_used or w > 0.0
            bounds.weights[k, count] = w
            bounds.weights[clearances + k, count] = 0.0 if swift > 0.0 else w
            bounds.weights[2 * clearances + k, count] = w * swift
        # rows that enter no bound are omitted
        if is_used:
            for j in range(width):
                bounds.rows[count, j] = bounds.rows[i, j]
            count += 1
    bounds.used[0] = count


@strict
def finish_bounds(workspace):
    """Add the inputs split off and rounding to the constants; write the watched quantities without the fast modes."""
    common = common_at(workspace)
    region = region_at(workspace)
    free = free_at(workspace)
    bounds = bounds_at(workspace)
    count = common.frequency.size
    clearances = common.corner_scale.size
    width = free.width[0]
    for k in range(clearances):
        # the inputs split off: amplitude of their fourth derivative
        fourth = 0.0
        for h in range(count):
            c = region.forced[k, 1 + h]
            s = region.forced[k, 1 + count + h]
            w = common.frequency[h]
            fourth += w * w * w * w * sqrt(c * c + s * s) * common.amplitude[1 + h]
        bounds.constant[k] += SLACK * fourth
        bounds.constant[clearances + k] += SLACK * fourth
        # rounding of the fast modes' part; the watched quantities without that part
        bounds.constant[2 * clearances + k] += SLACK * FAST_ROUNDING
        for j in range(width):
            free.calm[k, j] = free.watched[k, j] - free.fast[k, j]
    # their derivatives: each row times the generator
    for d in range(3):
        times(1.0, free.calm, d * clearances, free.generator, clearances, width, free.calm, (d + 1) * clearances)
