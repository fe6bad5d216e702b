"""Integrals of z z' over many steps at once, from the sums of z z' at their beginnings.

Let z become E z over a step h. The integral over a step 2 h is the sum of the integrals over steps h from z and from E
z. So the integral over steps of length 2 h with the sum M of z z' at their beginnings equals the integral over steps of
length h with the sum M + E M E'. This is applied from the longest steps to the shortest, for which Gauss-Legendre
quadrature gives

    int_0^h exp(A t) M exp(A' t) dt = h sum_q w_q P_q M P_q',      P_q = exp(A x_q h),

So all integrals in a region follow from one matrix. Fast modes do not make long steps less accurate: the only error is
rounding (the same as in C. F. Van Loan, Computing integrals involving the matrix exponential, IEEE Trans.
Autom. Control 23 (1978) 395-404, read backwards).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.march_arrays import ORDER

Array = NDArray[np.float64]

DEPTH = 6
"""The shortest step is the finest one over two to this power."""
NODES = 4
NODES_WITH_SIGNALS = 7
"""Nodes that integrate z z' over the shortest step to rounding: with n of them the error is about
(n!)^4 / ((2n)!^3 (2n + 1)) (2 a)^2n of it (M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 25.4.30),
a = |(h A)^20|^(1/20) <= 1.17 / 2^DEPTH there (``strips.finest_level``): below 1e-20 by four. High derivatives of
signals may be larger than such a norm tells."""
MOST_BYTES = 256 << 20
"""Memory of all steps and their moments; regions for which it does not suffice have fewer steps."""


class Steps:
    """Steps of several lengths in every region, each twice as long as the one before.

    generators: (R, Z, Z) rates, a period.
    finest: (R,) length of the finest step, in periods.
    longest: the longest interval, in periods.
    length: (R, L) in periods.
    increments: (R, L, Z, Z) exp(A h) - 1.
    abscissas, weights: (nodes,) of the quadrature over the shortest one, and over less, in 0 ... 1.
    """

    def __init__(self, generators: Array, finest: Array, longest: float, nodes: int) -> None:
        regions, width = generators.shape[:2]
        shortest = finest / 2.0**DEPTH
        wanted = 1 + max(DEPTH, int(np.log2(max(longest / shortest.min(), 1.0))))
        most = MOST_BYTES // max(1, 16 * regions * width**2)
        self.length = shortest[:, None] * 2.0 ** np.arange(min(wanted, max(DEPTH + 1, most)))
        x, weights = np.polynomial.legendre.leggauss(nodes)
        self.abscissas = 0.5 * (x + 1.0)
        self.weights = 0.5 * weights
        self._generators = generators
        self.increments = np.zeros((regions, self.length.shape[1], width, width))
        *self._nodes, move = self._moves(shortest)
        for level in range(self.length.shape[1]):
            self.increments[:, level] = move
            move = 2.0 * move + move @ move

    def _moves(self, length: Array) -> list[Array]:
        """(R, Z, Z) each: increments to every node of lengths (R,), of the shortest step at most, and to their end."""
        at = np.append(self.abscissas, 1.0)
        matrix = self._generators * length[:, None, None]
        moves = np.zeros((at.size, *self._generators.shape))
        term = np.broadcast_to(np.eye(matrix.shape[1]), matrix.shape)
        for p in range(1, ORDER + 1):
            term = term @ matrix / p
            moves += at[:, None, None, None] ** p * term
        return [*moves]

    def integrals(self, begun: Array, whole: Array, interval: float) -> Array:
        """Return (R, Z, Z) the integral of z z' over all steps, and over whole intervals, in periods.

        begun: (R, L, Z, Z) sums of z z' at the beginnings of steps.
        whole: (R, Z, Z) the same of whole intervals.
        interval: their length, in periods.
        """
        begun = begun.copy()
        left = np.full(len(whole), interval)
        for level in range(self.length.shape[1] - 1, -1, -1):
            length = self.length[:, level]
            while (fits := left >= length).any():
                begun[fits, level] += whole[fits]
                whole = np.where(fits[:, None, None], _moved(self.increments[:, level], whole), whole)
                left = left - fits * length
        rest = left[:, None, None] * self._over(self._moves(left)[:-1], whole)
        sums = np.zeros_like(whole)
        for level in range(self.length.shape[1] - 1, -1, -1):
            move = self.increments[:, level]
            sums = begun[:, level] + sums + _moved(move, sums)
        return np.asarray(rest + self.length[:, 0, None, None] * self._over(self._nodes, sums))

    def _over(self, nodes: list[Array], sums: Array) -> Array:
        """The quadrature of sums that move on, over a length of one."""
        moved = (w * _spread(node, sums) for w, node in zip(self.weights, nodes, strict=True))
        return np.asarray(sums + sum(moved))


def _spread(move: Array, sums: Array) -> Array:
    """(1 + move) sums (1 + move)' - sums."""
    half = move @ sums
    return np.asarray(half + half.swapaxes(-1, -2) + half @ move.swapaxes(-1, -2))


def _moved(move: Array, sums: Array) -> Array:
    """(1 + move) sums (1 + move)'."""
    return sums + _spread(move, sums)
