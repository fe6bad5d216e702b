"""What chains of signals push in a region's blocks (the derivation is in ``system.majorant``).

A block's coordinates c obey c' = T c + P q, where q are chains, q' = N q: N takes every link's next, times the pace. A
block *follows* a signal, c = c_free + X q with T X - X N = -P, where that makes the smaller bound; else it is *pushed*.

Takes the triangular form of a region; writes pages ``PUSHED`` and ``FOLLOWED``, and the chains' columns of ``LEFT``
(-X) and ``TRIANGLE`` (what still pushes).
"""

from __future__ import annotations

from gearrattle.engine.kernels._jit import strict
from gearrattle.engine.kernels.bench import (
    BOUNDS,
    CHAIN,
    CHAIN_PACE,
    FOLLOWED,
    GENERATOR,
    HORIZON,
    LEFT,
    LIMITS,
    LINKS,
    ONE,
    PUSHED,
    RIGHT,
    SIZES,
    SLACK,
    STATES,
    TRIANGLE,
    VECTORS,
    WATCHED,
    WATCHED_COUNT,
    WIDTH,
)
from gearrattle.engine.kernels.responses import modulus

_APART = 2.0  # how often a mode that follows must turn or decay within the horizon


@strict
def shape(work, waves, k, i, chained):
    """Deflection k of column i of V."""
    total = complex(0.0, 0.0)
    for q in range(chained):
        total += work[WATCHED, k, q] * waves[RIGHT, q, i]
    return total


@strict
def begin_pushes(work, marks):
    """So far nothing is pushed, and deflections follow chains by what they feel of them directly."""
    chained, chain = marks[SIZES, WIDTH] - marks[SIZES, CHAIN], marks[SIZES, CHAIN]
    for k in range(marks[SIZES, WATCHED_COUNT]):
        for j in range(chain):
            work[PUSHED, k, j], work[FOLLOWED, k, j] = 0.0, work[WATCHED, k, chained + j]


@strict
def _follow(work, waves, marks, a, b):
    """Solve T X - X N = -P for a block whose P stands in the chains' columns of ``TRIANGLE``; -X goes into ``LEFT``."""
    chained, width, links = marks[SIZES, WIDTH] - marks[SIZES, CHAIN], marks[SIZES, WIDTH], marks[SIZES, LINKS]
    for j in range(chained, width):
        pace = work[VECTORS, LIMITS, CHAIN_PACE] if (j - chained) % links > 0 else 0.0
        for i in range(b - 1, a - 1, -1):
            total = waves[TRIANGLE, i, j]
            if pace > 0.0:
                total += pace * waves[LEFT, i, j - 1]
            for q in range(i + 1, b):
                total -= waves[TRIANGLE, i, q] * waves[LEFT, q, j]
            waves[LEFT, i, j] = total / waves[TRIANGLE, i, i]


@strict
def push(work, waves, marks, a, b):
    """One block, [a, b), whose exp(G horizon) stands on the page ``ONE``: let it follow, or be pushed."""
    n, width = marks[SIZES, STATES], marks[SIZES, WIDTH]
    chained, horizon = width - marks[SIZES, CHAIN], work[VECTORS, LIMITS, HORIZON]
    follows, pushed, followed = True, 0.0, 0.0
    for i in range(a, b):
        follows = follows and modulus(waves[TRIANGLE, i, i]) * horizon > _APART
        for j in range(chained, width):
            total = complex(0.0, 0.0)
            for q in range(n):
                total += waves[LEFT, i, q] * work[GENERATOR, q, j]
            waves[TRIANGLE, i, j], waves[LEFT, i, j] = total, 0.0
            for p in range(a, i + 1):
                pushed += horizon * work[ONE, p - a, i - a] * modulus(total)
    if follows:
        _follow(work, waves, marks, a, b)
        for i in range(a, b):
            for j in range(chained, width):
                followed += modulus(waves[LEFT, i, j])
        follows = followed < pushed
    for i in range(a, b):
        for j in range(chained, width):
            if follows:
                waves[TRIANGLE, i, j] = 0.0
            else:
                waves[LEFT, i, j] = 0.0
    _weigh_pushes(work, waves, marks, a, b)


@strict
def _weigh_pushes(work, waves, marks, a, b):
    """Add what one block makes of the chains' fourth derivatives."""
    chained, width, horizon = (
        marks[SIZES, WIDTH] - marks[SIZES, CHAIN],
        marks[SIZES, WIDTH],
        work[VECTORS, LIMITS, HORIZON],
    )
    for k in range(marks[SIZES, WATCHED_COUNT]):
        for i in range(a, b):
            form = shape(work, waves, k, i, chained)
            size = SLACK * horizon * modulus(form)
            for j in range(chained, width):
                work[FOLLOWED, k, j - chained] -= (form * waves[LEFT, i, j]).real
                for q in range(i, b):
                    work[PUSHED, k, j - chained] += size * work[ONE, i - a, q - a] * modulus(waves[TRIANGLE, q, j])


@strict
def add_push(work, waves, marks, i, passed):
    """Add P N^passed to row i of ``BOUNDS``, which has been differentiated so often before."""
    chained, width, links = marks[SIZES, WIDTH] - marks[SIZES, CHAIN], marks[SIZES, WIDTH], marks[SIZES, LINKS]
    factor = 1.0
    for _ in range(passed):
        factor *= work[VECTORS, LIMITS, CHAIN_PACE]
    for j in range(chained, width):
        if (j - chained) % links >= passed:
            waves[BOUNDS, i, j] += factor * waves[TRIANGLE, i, j - passed]


@strict
def finish_pushes(work, marks):
    """Sum up what bounds take of the chains' fourth derivatives: all of them alike, but those on fast modes."""
    clearances = marks[SIZES, WATCHED_COUNT]
    for k in range(clearances):
        for j in range(marks[SIZES, CHAIN]):
            total = work[PUSHED, k, j] + SLACK * abs(work[FOLLOWED, k, j])
            work[PUSHED, k, j] = work[PUSHED, k + clearances, j] = total
            work[PUSHED, k + 2 * clearances, j] = 0.0
