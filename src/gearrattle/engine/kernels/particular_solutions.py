"""Particular solutions (i w - A) p = g for all inputs, and the choice of inputs to keep (``system.forced_response``).

A solution is refined once, with a residual in twice the working precision (Ogita, Rump and Oishi, SIAM J. Sci. Comput.
26 (2005) 1955, algorithm 5.3; products split after Veltkamp and Dekker). Arrays: see ``workspace``.
"""

from __future__ import annotations

from math import sqrt

from gearrattle.engine.kernels._jit import strict
from gearrattle.engine.kernels.dense import factorise, substitute
from gearrattle.engine.kernels.memory_addresses import common_at, laws_at, region_at, solver_at
from gearrattle.engine.kernels.workspace import LARGEST, LARGEST_STATE

_SPLITTER = 134217729.0  # 2^27 + 1
SOLVED = 1e-9
"""Largest residual of an accepted solution over its force: rounding may make a singular matrix look regular."""


@strict
def add_product(total, rest, a, b):
    """Add a b to the sum total + rest of two doubles, exact except for the rounding of ``rest``."""
    p = a * b
    t = _SPLITTER * a
    a1 = t - (t - a)
    a2 = a - a1
    t = _SPLITTER * b
    b1 = t - (t - b)
    b2 = b - b1
    e = a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)
    s = total + p
    z = s - total
    return s, rest + (((total - (s - z)) + (p - z)) + e)


@strict
def modulus(z):
    """|z| of numbers whose squares neither overflow nor vanish."""
    return sqrt(z.real * z.real + z.imag * z.imag)


@strict
def residual(region, solver, w):
    """Write the residual g - (i w - A) x; return its largest modulus."""
    largest = 0.0
    size = region.matrix.shape[0]
    for i in range(size):
        g = solver.force[i]
        x = solver.solution[i]
        re = g.real
        im = g.imag
        re_rest = 0.0
        im_rest = 0.0
        re, re_rest = add_product(re, re_rest, w, x.imag)
        im, im_rest = add_product(im, im_rest, -w, x.real)
        for j in range(size):
            a = region.matrix[i, j]
            x = solver.solution[j]
            if a != 0.0:
                re, re_rest = add_product(re, re_rest, a, x.real)
                im, im_rest = add_product(im, im_rest, a, x.imag)
        left = complex(re + re_rest, im + im_rest)
        solver.residual[i] = left
        if not modulus(left) <= largest:
            largest = modulus(left)
    return largest


@strict
def respond(region, solver, w):
    """Solve for the force at the frequency w; return False if the matrix is singular to rounding."""
    pushed = 0.0
    size = region.matrix.shape[0]
    for i in range(size):
        for j in range(size):
            solver.matrix[i, j] = complex(-region.matrix[i, j], w if i == j else 0.0)
        solver.solution[i] = solver.force[i]
        pushed = max(pushed, modulus(solver.force[i]))
    if not factorise(solver, size):
        return False
    substitute(solver, size, solver.solution)
    residual(region, solver, w)
    substitute(solver, size, solver.residual)
    for i in range(size):
        solver.solution[i] += solver.residual[i]
    return residual(region, solver, w) <= SOLVED * pushed


@strict
def push(common, region, solver, j):
    """Write the force g of input j and a zero solution; return whether the input acts on any state.

    j: 0 for the constant input, else the index of a harmonic.
    """
    size = region.matrix.shape[0]
    count = common.frequency.size
    is_pushed = False
    for i in range(size):
        sine = region.matrix[i, size + j + count] if j > 0 else 0.0
        force = complex(region.matrix[i, size + j], -sine)
        solver.force[i] = force
        solver.solution[i] = 0.0
        is_pushed = is_pushed or force != 0.0
    return is_pushed


@strict
def enter_stiffest_pieces(workspace):
    """Put every element into its stiffest piece; if several are equally stiff, into the lowest."""
    common = common_at(workspace)
    laws = laws_at(workspace)
    region = region_at(workspace)
    for k in range(common.rows.shape[0]):
        begin = laws.first[k]
        most = 0
        for p in range(laws.first[k + 1] - begin):
            if laws.stiffness[begin + p] > laws.stiffness[begin + most]:
                most = p
        region.pieces[k] = most


@strict
def typical_size(workspace):
    """The size of the scaled states in an ordinary motion, for the rates in ``region.matrix``.

    It is the largest of these motions: for every clearance the motion that fills it; for every input its particular
    solution with all elements in their stiffest pieces, or what it makes of states zero in one period if that is less.
    """
    common = common_at(workspace)
    region = region_at(workspace)
    solver = solver_at(workspace)
    size = region.matrix.shape[0]
    largest = 0.0
    width = region.matrix.shape[0] + 1 + 2 * common.frequency.size
    for j in range(1 + common.frequency.size):
        # for each input: the state it makes from zero in one period, or its particular solution if that is smaller
        w = 0.0
        reached = 0.0
        if j > 0:
            w = common.frequency[j - 1]
        for i in range(size):
            reached = max(reached, abs(region.matrix[i, size + j]))
        if not push(common, region, solver, j):
            reached = 0.0
        elif respond(region, solver, w):
            made = 0.0
            for i in range(size):
                made = max(made, modulus(solver.solution[i]))
            reached = min(reached, made)
        largest = max(largest, reached * common.amplitude[j])
    for k in range(common.clearances.size):
        # for each clearance: the motion that fills it
        moved = 0.0
        for j in range(width):
            moved = max(moved, abs(common.deflection[common.clearances[k], j]))
        if common.cornered[k]:
            largest = max(largest, common.corner_scale[k] / moved)
    return largest if largest > 0.0 else 1.0


@strict
def split_inputs(workspace):
    """Solve for the columns of P; mark the inputs whose particular solution is too large, which are kept as states."""
    common = common_at(workspace)
    region = region_at(workspace)
    solver = solver_at(workspace)
    size = region.matrix.shape[0]
    count = common.frequency.size
    largest_state = common.limits[LARGEST_STATE]
    for j in range(1 + count):
        # the particular solution of each input, if it acts on a state
        w = 0.0
        amplitude = common.amplitude[j]
        if j > 0:
            w = common.frequency[j - 1]
        keep = push(common, region, solver, j) and not respond(region, solver, w)
        # the input is kept if its states or deflections would far exceed those of an ordinary motion
        for i in range(size):
            keep = keep or not modulus(solver.solution[i]) * amplitude <= largest_state
        for k in range(common.corner_scale.size):
            seen = complex(0.0, 0.0)
            for i in range(size):
                seen += region.watched[k, i] * solver.solution[i]
            keep = keep or not modulus(seen) * amplitude <= LARGEST
        # its columns of P: a constant, or cosine and sine
        region.kept[j] = keep
        for i in range(size):
            region.particular[i, j] = 0.0 if keep else solver.solution[i].real
        if j > 0:
            region.kept[j + count] = keep
            for i in range(size):
                region.particular[i, j + count] = 0.0 if keep else -solver.solution[i].imag
