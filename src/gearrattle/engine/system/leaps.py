"""Integrals of powers over many finest steps at once, for regions whose modes are fast against the audit's intervals.

A power is a sum of products of two linear forms of the state z, P = z' Q z. Over a step h it integrates to z' G(h) z,

    G(h) = int_0^h exp(A' t) Q exp(A t) dt,    G(2 h) = G(h) + exp(A' h) G(h) exp(A h),

so doubling gives the integrals over h, 2 h, 4 h ... from the first (C. F. Van Loan, Computing integrals involving the
matrix exponential, IEEE Trans. Autom. Control 23 (1978) 395-404). No mode, however fast, makes the doubled steps less
accurate: what remains is rounding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.region import strips

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

MOST_BYTES = 256 << 20
"""Memory of all leaps; regions for which it does not suffice have none."""


class Leaps:
    """The leaps of all regions, one region after the other.

    Parameters
    ----------
    width
        length of z.
    pairs
        (P, 3) two forms, and the sum that their product goes to.
    weights
        (Q,) of the nodes of the shortest leap, in 0 ... 1.
    longest
        the longest interval, in periods.
    """

    def __init__(self, width: int, pairs: IntArray, weights: Array, longest: float) -> None:
        self._pairs, self._weights, self._longest = pairs, weights, longest
        self._sums = np.unique(pairs[:, 2])
        self._shape = -(-width // 4), width, 4
        self._bytes = 0
        self._bounds: list[tuple[int, int]] = []
        self._steps: list[float] = []
        self._moves: list[Array] = []
        self._works: list[Array] = []

    def add(self, step: float, move: Array, nodes: Array, few: int) -> None:
        """Make the next region's leaps, if an interval may take more than a few steps.

        Parameters
        ----------
        step
            the shortest leap, in periods.
        move
            (Z, Z) increments of z over it.
        nodes
            (Q, F, Z) all forms at its nodes, of z at its beginning.
        few
            steps.
        """
        first, width = len(self._steps), self._shape[1]
        count = int(np.log2(max(self._longest / step, 1.0))) + 1
        size = 8 * count * (len(self._sums) + 1) * self._shape[0] * 4 * width
        if self._longest > few * step and self._bytes + size <= MOST_BYTES:
            self._bytes += size
            work = step * self._first_work(nodes)
            for _ in range(count):
                self._steps.append(step)
                self._moves.append(strips(move))
                self._works += [strips(form) for form in work]
                half = work @ move
                work = 2.0 * work + (half + half.transpose(0, 2, 1)) + move.T @ half
                step, move = 2.0 * step, 2.0 * move + move @ move
        self._bounds.append((first, len(self._steps)))

    def _first_work(self, nodes: Array) -> Array:
        """(sums, Z, Z) symmetric forms of the shortest leap, for a step of length one."""
        width = nodes.shape[2]
        work = np.zeros((len(self._sums), width, width))
        where = np.searchsorted(self._sums, self._pairs[:, 2])
        for (one, other, _), s in zip(self._pairs, where, strict=True):
            product = np.einsum("q,qi,qj->ij", self._weights, nodes[:, one], nodes[:, other])
            work[s] += 0.5 * (product + product.T)
        return work

    def packed(self) -> tuple[NDArray[np.int64], Array, Array, Array, NDArray[np.int64]]:
        """The leaps as ``kernels.quadrature.Powers`` has them."""
        moves, works = (np.array(stack).reshape(-1, *self._shape) for stack in (self._moves, self._works))
        return np.array(self._bounds).reshape(-1, 2), np.array(self._steps), moves, works, self._sums
