"""Random error of an average over cycles, by the circular block bootstrap.

Cycles of a vibration resemble their neighbours, so they are drawn in blocks that wrap around (D. N. Politis,
J. P. Romano 1992, in LePage & Billard, Exploring the Limits of Bootstrap, 263-270). A block is as long as the cycles'
levels and the sizes of their strong lines are correlated, and no shorter than N^(1/3). Block means of N cycles scatter
too little by the factor 1 - L/N; standard errors are widened by it, and intervals take Student's t with N/L - 1 degrees
of freedom, combined over two records after Welch and Satterthwaite (B. L. Welch 1947, Biometrika 34, 28-35).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array

REPLICATES = 500
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Draws:
    """Bootstrap replicates of the mean over N cycles.

    Attributes
    ----------
    weights
        (R, N) of the cycles in each replicate; a row adds up to 1.
    block
        L [cycles].
    """

    weights: Array
    block: int

    @property
    def freedom(self) -> float:
        """Degrees of freedom of a standard error."""
        return max(float(self.weights.shape[1]) / self.block - 1.0, 1.0)

    def means(self, values: NDArray[Any]) -> NDArray[Any]:
        """(R, ...) means of (N, ...) values in every replicate."""
        flat = self.weights @ values.reshape(len(values), -1)
        return np.asarray(flat.reshape(-1, *values.shape[1:]))

    def error(self, replicates: Array) -> Array:
        """(...) standard errors from (R, ...) replicates of a statistic."""
        widened = 1.0 / np.sqrt(1.0 - self.block / self.weights.shape[1])
        return np.asarray(widened * np.std(replicates, axis=0))

    def error_of_parts(self, replicates: NDArray[np.complex128]) -> Array:
        """(...) standard error of either part of a complex statistic: the root of the mean of both squares."""
        return np.asarray(np.sqrt(0.5 * (self.error(replicates.real) ** 2 + self.error(replicates.imag) ** 2)))


def block_length(levels: Array, lines: Array | None = None) -> int:
    """Return the cycles of a block: as long as levels, and lines on average, are correlated.

    Parameters
    ----------
    levels
        (N, C) a level of every cycle and channel.
    lines
        (N, L) sizes of strong lines in every cycle.
    """
    count = len(levels)
    longest = max(1, count // 4)
    length = int(np.ceil(count ** (1.0 / 3.0)))
    for lag in range(length, longest):
        by_level = _related(levels, lag)
        by_line = _related(lines, lag) if lines is not None else np.zeros(0)
        one = np.any(by_level > 2.0 / np.sqrt(count))
        many = by_line.sum() > by_line.size / np.sqrt(count)
        if not (one or many):
            break
        length = lag + 1
    return min(length, longest)


def _related(values: Array, lag: int) -> Array:
    """Correlation of every column that moves with itself ``lag`` cycles later."""
    away = values - values.mean(axis=0)
    power = np.sum(away**2, axis=0)
    moving = power > 1e-18 * len(values) * np.max(np.abs(values), axis=0) ** 2
    return np.asarray(np.sum(away[lag:] * away[:-lag], axis=0)[moving] / power[moving])


def draws(
    levels: Array, generator: np.random.Generator, replicates: int = REPLICATES, *, lines: Array | None = None
) -> Draws:
    """Return replicates for a record.

    Parameters
    ----------
    levels
        (N, C) a level of every cycle and channel, from which the block is chosen; N >= 8.
    lines
        (N, L) sizes of strong lines in every cycle, likewise.
    """
    count = len(levels)
    block = block_length(levels, lines)
    starts = generator.integers(0, count, (replicates, -(-count // block)))
    drawn = ((starts[:, :, None] + np.arange(block)) % count).reshape(replicates, -1)[:, :count]
    weights = np.zeros((replicates, count))
    np.add.at(weights, (np.arange(replicates)[:, None], drawn), 1.0 / count)
    return Draws(weights, block)


def factor(errors: tuple[Array, Array], freedoms: tuple[float, float]) -> Array:
    """Return the factor of a 95 % interval on the root of the sum of two squared standard errors.

    The errors (...) are those of two independent records.
    """
    from scipy.stats import t

    first = errors[0] ** 2
    second = errors[1] ** 2
    below = first**2 / freedoms[0] + second**2 / freedoms[1]
    freedom = np.where(below > 0.0, (first + second) ** 2 / np.where(below > 0.0, below, 1.0), sum(freedoms))
    return np.asarray(t.ppf(0.5 + 0.5 * CONFIDENCE, freedom))
