"""The drive of a region's blocks by chains of signals (the derivation is in ``system.majorant``).

The coordinates c of a block obey c' = T c + P q with the chains q, q' = N q: (N q)_j is the pace times q_(j+1). A block
*follows* a signal, c = c_free + X q with T X - X N = -P, if that makes the smaller bound; otherwise it is *pushed*.

Input: the triangular form of a region. Output: the bounds of pushed blocks, the deflections of following blocks, and
the columns of the chains in V^-1 (-X) and in T (P of pushed blocks).
"""

from __future__ import annotations

from gearrattle.engine.kernels._jit import strict
from gearrattle.engine.kernels.particular_solutions import modulus
from gearrattle.engine.kernels.workspace import CHAIN_PACE, HORIZON, SLACK

_APART = 2.0  # least product of the horizon and the eigenvalue's modulus for a block that follows


@strict
def shape(free, modes, k, i):
    """Watched quantity k of column i of V."""
    total = complex(0.0, 0.0)
    for q in range(free.chained[0]):
        total += free.watched[k, q] * modes.right[q, i]
    return total


@strict
def begin_pushes(free, bounds):
    """Initialise the sums: no block is pushed, and deflections follow chains by their direct part alone."""
    for k in range(bounds.followed.shape[0]):
        for j in range(bounds.followed.shape[1]):
            bounds.pushed[k, j] = 0.0
            bounds.followed[k, j] = free.watched[k, free.chained[0] + j]


@strict
def _follow(common, free, modes, a, b):
    """Solve T X - X N = -P for a block whose P is in the chains' columns of T; write -X to those of V^-1."""
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
    """Choose for the block [a, b) whether it follows or is pushed; ``scratch.one`` holds its exp(G horizon)."""
    n = modes.basis.shape[0]
    width = free.width[0]
    chained = free.chained[0]
    horizon = common.limits[HORIZON]
    # P of every mode, and the bound of the pushed block
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
    # X, and the bound of the following block, if its modes are fast enough; the smaller bound is taken
    if follows:
        _follow(common, free, modes, a, b)
        for i in range(a, b):
            for j in range(chained, width):
                followed += modulus(modes.left[i, j])
        follows = followed < pushed
    # the other columns are set to zero
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
    """Add P N^passed to row i of the bounds, which has been differentiated ``passed`` times before."""
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
    """Sum the weights of the chains' fourth derivatives; the same for all bounds except those on fast modes."""
    clearances, chain = bounds.followed.shape
    for k in range(clearances):
        for j in range(chain):
            total = bounds.pushed[k, j] + SLACK * abs(bounds.followed[k, j])
            bounds.pushed[k, j] = total
            bounds.pushed[k + clearances, j] = total
            bounds.pushed[k + 2 * clearances, j] = 0.0
