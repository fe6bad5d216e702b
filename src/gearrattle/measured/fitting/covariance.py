"""Covariance of residuals that are not independent, and the errors of least squares with it.

The covariance of N residuals is stored as a sum of two parts: a block tridiagonal matrix, because residuals of a block
of k correlate with each other and with those of the next block; and F' F with few rows F, for errors common to many
residuals (a calibration, the runs of a simulation).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.identifiability import gain
from gearrattle.measured.validation.block_bootstrap import CONFIDENCE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Covariance:
    """(N, N) covariance of residuals in b blocks of k, N = b k.

    Attributes
    ----------
    within
        (b, k, k) covariance within every block.
    neighbour
        (b - 1, k, k) covariance of every block (rows) with the next block (columns).
    factor
        (f, N) F.
    """

    within: Array
    neighbour: Array
    factor: Array

    @classmethod
    def dense(cls, matrix: Array, factor: Array | None = None) -> Covariance:
        """Return the covariance of one block, and F' F."""
        size = len(matrix)
        none = np.zeros((0, size))
        return cls(matrix[None], np.zeros((0, size, size)), none if factor is None else factor)

    def plus(self, factor: Array) -> Covariance:
        """Return this covariance with F' F added."""
        return replace(self, factor=np.vstack([self.factor, factor]))

    def weighted(self, weight: Array) -> Covariance:
        """Return the covariance of residuals that are multiplied by (N,) weights."""
        by_block = weight.reshape(len(self.within), -1)
        within = self.within * by_block[:, :, None] * by_block[:, None, :]
        neighbour = self.neighbour * by_block[:-1, :, None] * by_block[1:, None, :]
        return Covariance(within, neighbour, self.factor * weight)

    def times(self, columns: Array) -> Array:
        """(N, p) product with columns."""
        count = len(self.within)
        blocks = columns.reshape(count, len(columns) // count, columns.shape[1])
        product = self.within @ blocks
        product[:-1] += self.neighbour @ blocks[1:]
        product[1:] += np.swapaxes(self.neighbour, 1, 2) @ blocks[:-1]
        return np.asarray(product.reshape(columns.shape) + self.factor.T @ (self.factor @ columns))

    def of(self, columns: Array) -> Array:
        """(p, p) covariance of the sums A' r, A the columns."""
        return np.asarray(columns.T @ self.times(columns))

    @property
    def trace(self) -> float:
        """Sum of the variances."""
        return float(np.einsum("bii->", self.within) + np.sum(self.factor**2))

    @property
    def trace_of_square(self) -> float:
        """Sum of the squares of all entries."""
        blocks = float(np.sum(self.within**2) + 2.0 * np.sum(self.neighbour**2))
        alone = replace(self, factor=self.factor[:0])
        mixed = float(np.sum(alone.times(self.factor.T) * self.factor.T))
        return blocks + 2.0 * mixed + float(np.sum((self.factor @ self.factor.T) ** 2))


def spread(jacobian: Array, covariance: Covariance) -> Array:
    """(P, P) covariance of the least-squares estimate from residuals that are not independent.

    With G = (J' J)^+ J' it is G C G' (H. White 1980, Econometrica 48, 817); rows beyond those of C, of a prior, are
    independent.

    Parameters
    ----------
    jacobian
        (M, P).
    covariance
        of the first N rows.
    """
    by_row = gain(jacobian)
    n = covariance.factor.shape[1]
    return np.asarray(covariance.of(by_row[:, :n].T) + by_row[:, n:] @ by_row[:, n:].T)


def widening(freedom: float) -> float:
    """Return the factor on a variance from few samples with which 1.96 roots hold 95 %, as by Student's t."""
    from scipy.stats import norm, t

    within = 0.5 + 0.5 * CONFIDENCE
    return float(t.ppf(within, freedom) / norm.ppf(within)) ** 2


def chance(data: tuple[Array, Array], covariance: Covariance, freedom: tuple[int, float]) -> float:
    """Return the probability of a sum of squares this large or larger, of residuals that are not independent.

    The sum is taken for a multiple of chi-square with its mean and variance (F. E. Satterthwaite 1946), over one of
    the freedom that the covariance was estimated with.

    Parameters
    ----------
    data
        (N,) residuals and (N, P) Jacobian.
    freedom
        rows less values fitted; of the covariance.
    """
    from scipy.stats import f

    rows, jacobian = data
    left, values, _ = np.linalg.svd(jacobian, full_matrices=False)
    basis = left[:, values > 1e-12 * values.max(initial=0.0)]
    # traces of M = (I - B B') C (I - B B') and of its square, B the basis of what the parameters explain
    product = covariance.times(basis)
    explained = basis.T @ product
    trace = covariance.trace - float(np.trace(explained))
    of_square = covariance.trace_of_square - 2.0 * float(np.sum(product**2)) + float(np.sum(explained**2))
    mean = trace * freedom[0] / max(rows.size - basis.shape[1], 1)
    return float(f.sf(rows @ rows / mean, trace**2 / of_square, freedom[1]))
