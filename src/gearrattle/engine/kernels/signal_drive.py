"""The drive of a region's blocks by chains of signals (the derivation is in ``system.majorant``).

A block's coordinates c obey c' = T c + P q, where q are chains, q' = N q: N takes every link's next, times the pace. A
block *follows* a signal, c = c_free + X q with T X - X N = -P, where that makes the smaller bound; else it is *pushed*.

Takes the triangular form of a region; writes what is pushed and what follows, and the chains' columns of V^-1 (-X) and
of T (what still pushes).
"""

from __future__ import annotations

from gearrattle.engine.kernels._jit import strict
from gearrattle.engine.kernels.particular_solutions import modulus
from gearrattle.engine.kernels.workspace import CHAIN_PACE, HORIZON, SLACK

_APART = 2.0  # how often a mode that follows must turn or decay within the horizon


@strict
def shape(free, modes, k, i):
    """Deflection k of column i of V."""
    total = complex(0.0, 0.0)
    for q in range(free.chained[0]):
        total += free.watched[k, q] * modes.right[q, i]
    return total


@strict
def begin_pushes(free, bounds):
    """Begin the sums: nothing is pushed, and deflections follow chains by what they feel of them directly."""
    for k in range(bounds.followed.shape[0]):
        for j in range(bounds.followed.shape[1]):
            bounds.pushed[k, j] = 0.0
            bounds.followed[k, j] = free.watched[k, free.chained[0] + j]


@strict
def _follow(common, free, modes, a, b):
    """Solve T X - X N = -P for a block whose P stands in the chains' columns of T; -X goes into those of V^-1."""
    chained = free.chained[0]
    width = free.width[0]
    links = common.links[0]
    for j in range(chained, width):
        pace = common.limits[CHAIN_PACE] if (j - chained) % links > 0 else 0.0
        for i in range(b - 1, a - 1, -1):
            total = modes.triangle[i, j]
            if pace > 0.0:
                total += pace * modes.left[i, j - 1]
            for q in range(i + 1, b):
                total -= modes.triangle[i, q] * modes.left[q, j]
            modes.left[i, j] = total / modes.triangle[i, i]


@strict
def push(common, free, modes, bounds, scratch, a, b):
    """One block, [a, b), whose exp(G horizon) stands in ``scratch.one``: let it follow, or be pushed."""
    n = modes.basis.shape[0]
    width = free.width[0]
    chained = free.chained[0]
    horizon = common.limits[HORIZON]
    # what the chains push of each mode, and how large the bound by pushes becomes
    follows = True
    pushed = 0.0
    followed = 0.0
    for i in range(a, b):
        follows = follows and modulus(modes.triangle[i, i]) * horizon > _APART
        for j in range(chained, width):
            total = complex(0.0, 0.0)
            for q in range(n):
                total += modes.left[i, q] * free.generator[q, j]
            modes.triangle[i, j] = total
            modes.left[i, j] = 0.0
            for p in range(a, i + 1):
                pushed += horizon * scratch.one[p - a, i - a] * modulus(total)
    # the same by following, where the modes are far from the signal's pace; the smaller one is taken
    if follows:
        _follow(common, free, modes, a, b)
        for i in range(a, b):
            for j in range(chained, width):
                followed += modulus(modes.left[i, j])
        follows = followed < pushed
    # what is not used is zero
    for i in range(a, b):
        for j in range(chained, width):
            if follows:
                modes.triangle[i, j] = 0.0
            else:
                modes.left[i, j] = 0.0
    _weigh_pushes(common, free, modes, bounds, scratch, a, b)


@strict
def _weigh_pushes(common, free, modes, bounds, scratch, a, b):
    """Add the response of one block to the chains' fourth derivatives."""
    chained = free.chained[0]
    width = free.width[0]
    horizon = common.limits[HORIZON]
    for k in range(common.corner_scale.size):
        for i in range(a, b):
            form = shape(free, modes, k, i)
            size = SLACK * horizon * modulus(form)
            for j in range(chained, width):
                bounds.followed[k, j - chained] -= (form * modes.left[i, j]).real
                for q in range(i, b):
                    bounds.pushed[k, j - chained] += size * scratch.one[i - a, q - a] * modulus(modes.triangle[q, j])


@strict
def add_push(common, free, modes, bounds, i, passed):
    """Add P N^passed to row i of the bounds, which has been differentiated so often before."""
    chained = free.chained[0]
    width = free.width[0]
    links = common.links[0]
    factor = 1.0
    for _ in range(passed):
        factor *= common.limits[CHAIN_PACE]
    for j in range(chained, width):
        if (j - chained) % links >= passed:
            bounds.rows[i, j] += factor * modes.triangle[i, j - passed]


@strict
def finish_pushes(bounds):
    """Sum the weights of the chains' fourth derivatives: the same for all bounds but those on fast modes."""
    clearances, chain = bounds.followed.shape
    for k in range(clearances):
        for j in range(chain):
            total = bounds.pushed[k, j] + SLACK * abs(bounds.followed[k, j])
            bounds.pushed[k, j] = total
            bounds.pushed[k + clearances, j] = total
            bounds.pushed[k + 2 * clearances, j] = 0.0
