"""Means of correlated samples and whether two of them differ, by batches.

Values that belong to consecutive cycles of a chaotic motion are not independent, so their scatter says too little about
that of their mean. Means of long *batches* are nearly independent: with k of them the standard error of the mean is
s / sqrt(k), and Student's t with k - 1 degrees of freedom gives the interval. Ten to thirty batches serve; more make
them short, fewer make t wide (B. Schmeiser 1982, Operations Research 30, 556-568). Two means are compared as those of
two samples of unequal variance (B. L. Welch 1947, Biometrika 34, 28-35).

Takes plain arrays, one value a cycle; gives means, intervals and p-values to comparisons.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.trajectory import Array

MOST_BATCHES = 20
LEVEL = 0.95
FEWEST_BATCHES = 8
DRIFT = 2.0
NOTHING = 1e-6  # scatter of batch means, relative to them, that is called none: a periodic motion


@dataclass(frozen=True)
class Mean:
    """A mean and how well it is known.

    Attributes:
        value: over all cycles.
        error: its standard error; NaN for fewer than two cycles.
        batches: number of batches behind it.
    """

    value: float
    error: float
    batches: int

    def interval(self, level: float = LEVEL) -> tuple[float, float]:
        """Return the bounds between which the true mean lies with this probability; NaN where unknown."""
        half = students(level, self.batches - 1) * self.error
        return self.value - half, self.value + half


@dataclass(frozen=True)
class Difference:
    """Two means against each other.

    Attributes:
        value: given - reference.
        reach: sampling error alone keeps the value within +-reach in 95 of 100 cases; NaN where unknown.
        p_value: how often sampling error alone gives so large a value; NaN where unknown.
    """

    value: float
    reach: float
    p_value: float


def students(level: float, freedom: float) -> float:
    """Return t such that Student's t lies within +-t with probability ``level``; NaN without a degree of freedom."""
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * level, freedom)) if freedom > 0 else float("nan")


def batches_of(cycles: int) -> int:
    """Return into how many batches so many cycles fall: of two cycles or more (one, below four), twenty at most."""
    return min(MOST_BATCHES, cycles // 2 if cycles >= 4 else cycles)


def batch_mean(per_cycle: Array) -> Mean:
    """Return the mean of one value a cycle, with its error from batches (``batches_of``).

    Args:
        per_cycle: (cycles,) in order of time.
    """
    cycles = per_cycle.size
    batches = batches_of(cycles)
    if batches < 2:
        return Mean(float(np.mean(per_cycle)) if cycles else float("nan"), float("nan"), batches)
    parts = [float(np.mean(part)) for part in np.array_split(per_cycle, batches)]
    return Mean(float(np.mean(per_cycle)), float(np.std(parts, ddof=1) / np.sqrt(batches)), batches)


def wanders(per_cycle: Array) -> bool:
    """Whether a level drifts so slowly that its batches are not independent: then none of this tells anything.

    The autocorrelation of neighbouring batch means has a standard deviation of 1 / sqrt(k) where they are independent
    (M. S. Bartlett 1946, J. R. Stat. Soc. Suppl. 8, 27-41); more than ``DRIFT`` of these is called wandering. Fewer
    batches than ``FEWEST_BATCHES`` cannot tell, and are not called so.

    Args:
        per_cycle: (cycles,) in order of time.
    """
    batches = batches_of(per_cycle.size)
    if batches < FEWEST_BATCHES:
        return False
    parts = np.array([float(np.mean(part)) for part in np.array_split(per_cycle, batches)])
    apart = parts - parts.mean()
    spread = float(np.sum(apart**2))
    if spread <= (NOTHING * float(np.mean(parts))) ** 2 * batches:
        return False
    return bool(float(np.sum(apart[1:] * apart[:-1])) / spread > DRIFT / np.sqrt(batches))


def difference(given: Mean, reference: Mean) -> Difference:
    """Return the difference of two means and what sampling error alone explains of it.

    The two are taken as independent, which motions beyond their predictability horizon are; where they still run
    together, the reach is larger than it need be.
    """
    from scipy.stats import t

    value = given.value - reference.value
    shares = np.array([given.error**2, reference.error**2])
    error = float(np.sqrt(shares.sum()))
    if not np.isfinite(error):
        return Difference(value, float("nan"), float("nan"))
    if error == 0.0:
        return Difference(value, 0.0, 1.0 if value == 0.0 else 0.0)
    shares /= shares.sum()
    freedom = float(1.0 / np.sum(shares**2 / (np.array([given.batches, reference.batches]) - 1)))
    return Difference(value, students(LEVEL, freedom) * error, float(2.0 * t.sf(abs(value) / error, freedom)))
