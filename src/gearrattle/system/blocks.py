"""Block diagonalisation of a matrix with well-conditioned transformations (Bavely and Stewart, SIAM J. Numer. Anal. 16
(1979) 359).

Eigenvectors of a driveline are useless where eigenvalues meet: rigid and free-flying parts (0 and -drag/J, a Jordan
block without drag), critical damping, an order on an undamped mode. Here invariant subspaces are split only as long
as the splitting transformation stays small; what cannot be split stays together in one upper-triangular block.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Block:
    """One invariant subspace of M: rows of V^-1, columns of V, and the upper-triangular block between them."""

    triangle: ComplexArray
    left: ComplexArray
    right: ComplexArray


def block_diagonalise(triangle: ComplexArray, vectors: ComplexArray, largest: float) -> list[Block]:
    """Split M = V T V^H (T upper triangular, V unitary) into blocks.

    Args:
        triangle: (Z, Z) T.
        vectors: (Z, Z) V.
        largest: bound on the entries of every elimination; larger means more, but worse conditioned, blocks.

    Returns:
        Blocks with M = sum right @ triangle @ left, left_i right_j = identity if i = j, else 0.
    """
    size = triangle.shape[0]
    t, v = np.asfortranarray(triangle), np.asfortranarray(vectors)
    bounds = [0]
    while bounds[-1] < size:
        begin, end = bounds[-1], bounds[-1] + 1
        while end < size and np.any(t[begin:end, end:]):
            coupling, scale, _ = lapack.ztrsyl(t[begin:end, begin:end], t[end:, end:], -t[begin:end, end:], isgn=-1)
            if np.abs(coupling).max() <= largest * scale:
                elimination = coupling / scale
                v[:, end:] += v[:, begin:end] @ elimination
                t[begin:end, end:] = 0.0
                break
            centre = np.diagonal(t)[begin:end].mean()
            nearest = end + int(np.argmin(np.abs(np.diagonal(t)[end:] - centre)))
            if (
                nearest > end
            ):  # the columns from `begin` on are decoupled from all earlier ones, so the swap stays inside
                inner, rotation, _ = lapack.ztrexc(
                    np.asfortranarray(t[begin:, begin:]), np.eye(size - begin, dtype=complex, order="F"),
                    nearest - begin + 1, end - begin + 1,
                )  # fmt: skip
                t[begin:, begin:] = inner
                v[:, begin:] = v[:, begin:] @ rotation
            end += 1
        bounds.append(end)
    inverse: ComplexArray = np.linalg.inv(v).astype(np.complex128)
    return [Block(t[a:b, a:b].copy(), inverse[a:b].copy(), v[:, a:b].copy()) for a, b in pairwise(bounds)]
