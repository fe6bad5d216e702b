"""Standard errors of a fitted loop: by the curvature of the least squares, and by resampled blocks as a check.

With the Jacobian A of the torque in all coefficients, breaks and logarithms of reaches, residual variance s^2 and the
integrated autocorrelation time tau of the residuals,

    covariance = tau s^2 (A' A)^-1,      tau = 1 + 2 (rho_1 + rho_2 + ...), up to the first rho that is not positive

(Y. Bard, Nonlinear Parameter Estimation, 1974, ch. 7; A. Sokal, Monte Carlo Methods in Statistical Mechanics, 1997,
sec. 3). The jump of the torque where friction is let go has no derivative and is left out of A: errors of breaks that
have one are on the safe side. The bootstrap (H. R. Kunsch, The Jackknife and the Bootstrap for General Stationary
Observations, Annals of Statistics 17, 1989, pp. 1217-1241) sees jumps: it adds blocks of residuals to the fitted torque
and fits again, with the same stages.

Takes a ``Solved`` law and its search; gives the parameters' vector, covariance and samples.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.identification.loop_data import Loop
from gearrattle.identification.loop_law import COAST, DRIVE, Regression, Shape, Solved
from gearrattle.identification.loop_search import Search

Array = NDArray[np.float64]

_STEP = 1e-7  # of the range, and of a logarithm


class Spread(NamedTuple):
    """How far a law is known.

    Attributes:
        covariance: (C + B + R, C + B + R) of coefficients, breaks (drive, then coast), logarithms of reaches; inf on
            the diagonal of what no sample tells.
        sliders: the R sliders in the order of their reaches.
        residual: (N,) measured less fitted torque [N m].
        tau: integrated autocorrelation time of the residuals, in samples.
    """

    covariance: Array
    sliders: tuple[tuple[str, int], ...]
    residual: Array
    tau: float


def free_sliders(found: Solved, fixed: frozenset[tuple[str, int]]) -> tuple[tuple[str, int], ...]:
    """Sliders with a height whose reaches are free."""
    pairs = zip(found.labels, found.coefficients, strict=True)
    mine = [(side, index) for (kind, side, index), value in pairs if kind == "slider" and value > 0.0]
    return tuple(slider for slider in mine if slider not in fixed)


def spread(regression: Regression, found: Solved, fixed: frozenset[tuple[str, int]]) -> Spread:
    """Return the covariance of a law over every sample.

    Args:
        regression: over single samples.
        found: the law.
        fixed: sliders whose reach was not fitted.
    """
    sliders = free_sliders(found, fixed)
    table = regression.table(found.shape, found.labels)
    residual = regression.torque - table @ found.coefficients
    low, high = regression.loop.ends
    columns = [*table.T]
    for side in (DRIVE, COAST):
        for i, value in enumerate(found.shape.breaks(side)):
            step = _STEP * (high - low)
            up, down = (found.shape.with_break(side, i, value + way * step) for way in (1.0, -1.0))
            columns.append(_smooth(regression, found, up, down, step))
    for slider in sliders:
        here = found.shape.reach_of(slider, regression.reach)
        up, down = (found.shape.with_reach(slider, here * math.exp(way * _STEP)) for way in (1.0, -1.0))
        columns.append(_difference(regression, found, up, down) / (2.0 * _STEP))
    tau = autocorrelation(residual)
    return Spread(_covariance(np.stack(columns, axis=1), residual, tau), sliders, residual, tau)


def _difference(regression: Regression, found: Solved, up: Shape, down: Shape) -> Array:
    tables = [regression.table(shape, found.labels) @ found.coefficients for shape in (up, down)]
    return np.asarray(tables[0] - tables[1], dtype=np.float64)


def _smooth(regression: Regression, found: Solved, up: Shape, down: Shape, step: float) -> Array:
    """Derivative in a break, without the samples that its jump passes."""
    change = _difference(regression, found, up, down) / (2.0 * step)
    steepest = 4.0 * float(np.median(np.abs(change[change != 0.0]))) if np.any(change) else 0.0
    jumps = np.abs(change) > 100.0 * steepest
    return np.where(jumps, 0.0, change)


def _covariance(jacobian: Array, residual: Array, tau: float) -> Array:
    """Of all parameters; those whose column is empty are open."""
    number = jacobian.shape[1]
    size = np.linalg.norm(jacobian, axis=0)
    told = size > 0.0
    scaled = jacobian[:, told] / size[told]
    variance = float(residual @ residual) / max(1, residual.size - number) * tau
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=1e-14, hermitian=True)
    covariance = np.zeros((number, number))
    covariance[np.ix_(told, told)] = variance * inverse / size[told][:, None] / size[told]
    covariance[~told, ~told] = np.inf
    return covariance


def autocorrelation(residual: Array) -> float:
    """Integrated autocorrelation time in samples, at least 1."""
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return 1.0
    tau = 1.0
    for lag in range(1, residual.size // 4):
        rho = float(centred[lag:] @ centred[:-lag]) / power
        if rho <= 2.0 / math.sqrt(residual.size):
            break
        tau += 2.0 * rho
    return tau


def resampled(
    loop: Loop, found: Solved, without: frozenset[tuple[str, int]], number: int, seed: int
) -> list[tuple[Search, Solved]]:
    """Fit a law again to its own torque with blocks of residuals in another order.

    Args:
        loop: the samples.
        found: the law.
        without: sliders it has not.
        number: of fits.
        seed: of the blocks drawn.

    Returns:
        The law of every draw, with its search.
    """
    whole = Regression(loop, 0, 1e-3 * (loop.ends[1] - loop.ends[0]))
    fitted = whole.table(found.shape, found.labels) @ found.coefficients
    residual = loop.torque - fitted
    length = max(8, math.ceil(4.0 * autocorrelation(residual) * residual.size ** (1.0 / 3.0)))
    blocks = -(-residual.size // length)
    random = np.random.default_rng(seed)
    made = []
    for _ in range(number):
        starts = random.integers(0, residual.size, blocks)
        rows = (starts[:, None] + np.arange(length)).ravel()[: residual.size] % residual.size
        search = Search(loop.with_torque(fitted + residual[rows]))
        search.without = without
        made.append((search, search.refine(search.at(found.shape), 2, near=True)))
    return made
