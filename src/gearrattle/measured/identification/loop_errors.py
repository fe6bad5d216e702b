"""Standard errors of a fitted loop: by the curvature of the least squares, and by resampled blocks as a check.

With the Jacobian A of the torque in all coefficients, breaks and logarithms of reaches, residual variance s^2 and the
integrated autocorrelation time tau of the residuals,

    covariance = tau s^2 (A' A)^-1,      tau = 1 + 2 (rho_1 + rho_2 + ...), up to the first rho that is not positive

(Y. Bard, Nonlinear Parameter Estimation, 1974, ch. 7; A. Sokal, Monte Carlo Methods in Statistical Mechanics, 1997,
sec. 3). At the true law, with white noise, this is the bound of Cramer and Rao. The jump of the torque where friction
is released has no derivative and is left out of A; ``loop_jumps`` tells what it adds. Reaches that were given by the
default count as unknown. The bootstrap (H. R. Kunsch, The Jackknife and the Bootstrap for General Stationary
Observations, Annals of Statistics 17, 1989, pp. 1217-1241) sees jumps: it adds blocks of residuals to the fitted torque
and fits again, with the same stages.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_law import Regression, Slider, Solved, heights_of
from gearrattle.measured.identification.loop_linear import Linear, Normal
from gearrattle.measured.identification.loop_moments import Moments
from gearrattle.measured.identification.loop_polish import Polish

Array = NDArray[np.float64]


class Spread(NamedTuple):
    """Standard errors of a law over every sample.

    Attributes
    ----------
    covariance
        (C + B + R, C + B + R) of coefficients, breaks (drive, then coast), logarithms of reaches; inf on
        the diagonal of what no sample determines.
    residual
        (N,) measured less fitted torque [N m].
    tau
        integrated autocorrelation time of the residuals, in samples.
    variance
        of the residuals, times tau [(N m)^2].
    """

    covariance: Array
    sliders: tuple[Slider, ...]
    residual: Array
    tau: float
    variance: float

    def rest(self, solution: Solved, slider: Slider) -> float:
        """Standard error of the logarithm of a slider's height when its reach is known."""
        row = next(i for i, (kind, *where) in enumerate(solution.labels) if kind == "slider" and tuple(where) == slider)
        if slider not in self.sliders:
            return 0.0
        column = self.covariance.shape[0] - len(self.sliders) + self.sliders.index(slider)
        part = self.covariance[np.ix_((row, column), (row, column))]
        if not (np.all(np.isfinite(part)) and part[1, 1] > 0.0):
            return 0.0
        left = part[0, 0] - part[0, 1] ** 2 / part[1, 1]
        return float(np.sqrt(max(left, 0.0)) / heights_of(solution)[slider])


def rubbing(solution: Solved) -> tuple[Slider, ...]:
    """Sliders with a height."""
    return tuple(slider for slider, height in heights_of(solution).items() if height > 0.0)


def spread(polish: Polish, solution: Solved) -> Spread:
    """Return the covariance of a law over every sample."""
    sliders = rubbing(solution)
    residual = Regression(polish.loop, 0, polish.moments.reach).residual(solution)
    linear = Linear(polish.moments, solution, sliders)
    tau = autocorrelation(residual)
    number = linear.columns.shape[1]
    variance = float(residual @ residual) / max(1, residual.size - number) * tau
    return Spread(_covariance(linear.normal(), variance), sliders, residual, tau, variance)


def _covariance(normal: Normal, variance: float) -> Array:
    """Covariance of all parameters; those with an empty column are open."""
    used = np.diag(normal.matrix) > 0.0
    scaled, size = normal.scaled(used)
    covariance = np.zeros(normal.matrix.shape)
    inverse = np.linalg.pinv(scaled, rcond=1e-14, hermitian=True)
    covariance[np.ix_(used, used)] = variance * inverse / size[:, None] / size
    covariance[~used, ~used] = np.inf
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


def resampled(polish: Polish, solution: Solved, number: int, seed: int) -> list[tuple[Polish, Solved]]:
    """Fit a law again to its own torque with blocks of residuals in another order."""
    loop = polish.loop
    residual = Regression(loop, 0, polish.moments.reach).residual(solution)
    fitted = loop.torque - residual
    length = max(8, math.ceil(4.0 * autocorrelation(residual) * residual.size ** (1.0 / 3.0)))
    blocks = -(-residual.size // length)
    random = np.random.default_rng(seed)
    made = []
    for _ in range(number):
        starts = random.integers(0, residual.size, blocks)
        rows = (starts[:, None] + np.arange(length)).ravel()[: residual.size] % residual.size
        own = replace(polish, moments=Moments(loop.with_torque(fitted + residual[rows]), polish.moments.reach))
        made.append((own, own.whole(own.at(solution.shape))))
    return made
