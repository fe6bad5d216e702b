"""A response surface for residuals that jump: a parabola by least squares over runs around a point.

A motion that does not settle has averages that scatter from run to run, however near the parameters. A search on them
ends at whichever of many runs happened to fit best, which may be several standard errors off. So the residuals of K
runs over a region u = (x - c) / h within -1 ... 1 are replaced by

    r(u) = r_0 + sum_p (a_p u_p + b_p u_p^2),

whose errors are known from what the parabola leaves (G. E. P. Box, K. B. Wilson 1951, J. R. Stat. Soc. B 13, 1). The
region follows the minimum and shrinks to some standard errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ConvergenceError
from gearrattle.measured.fitting.covariance import Covariance
from gearrattle.measured.fitting.motion_problem import Differences, Judged, MotionProblem, seen
from gearrattle.measured.identification.data_problem import Residual
from gearrattle.measured.identification.identifiability import Combination
from gearrattle.measured.identification.multi_start import Minimum, at_bounds, latin_hypercube, search
from gearrattle.wording import counted

Array = NDArray[np.float64]

_ROUNDS = 8
_WIDE = 4.0  # standard errors that a region reaches at least to either side
_NARROW = 0.01  # logarithms that a region reaches at least to either side
_CLEAR = 2.0  # times the scatter of all rows together: change of the residuals wanted over a region
_SHRUNK = 0.3  # of the region before, at least
_BENDS = 1.5  # times the scatter of neighbouring runs: with larger residuals the parabola bends too little
_CENTRAL = 0.4  # of a region, within which the minimum is to lie
_LEAST_STEEP = 0.1  # of a squared slope that is not its scatter
_RUNS = 6, 24  # runs a coefficient: at first, and at most where a parameter is not noticed


@dataclass(frozen=True)
class Surface(Judged):
    """A motion problem smoothed around a point.

    Attributes
    ----------
    centre, half
        (P,) of the region.
    coefficients
        (1 + 2 P, N) of the parabola in u.
    inverse
        (1 + 2 P, 1 + 2 P) of the normal matrix.
    left
        (K, N) what it leaves.
    weight
        (N,) of the rows: their standard errors hold that of the runs' mean as well.
    """

    centre: Array
    half: Array
    coefficients: Array
    inverse: Array
    left: Array
    weight: Array

    @property
    def box(self) -> tuple[Array, Array]:
        """(P,) ends of the region within the bounds."""
        low, high = self.of.parameters.box
        return np.maximum(low, self.centre - self.half), np.minimum(high, self.centre + self.half)

    @property
    def jitter(self) -> float:
        """Scatter of a run's residuals about the parabola, in standard errors."""
        return float(np.sqrt(np.sum(self.left**2) / self.left.shape[1] / self._freedom))

    @property
    def _freedom(self) -> int:
        return len(self.left) - len(self.coefficients)

    def _terms(self, x: Array) -> Array:
        u = (x - self.centre) / self.half
        return np.concatenate([[1.0], u, u**2])

    def data_residuals(self, x: Array) -> tuple[Array, Array]:
        """(N,) residuals of the data and (N, P) Jacobian."""
        rows = self._terms(x) @ self.coefficients
        first = self.coefficients[1 : 1 + self.count]
        second = self.coefficients[1 + self.count :]
        u = ((x - self.centre) / self.half)[:, None]
        jacobian = ((first + 2.0 * u * second) / self.half[:, None]).T
        error = np.sqrt(np.outer(self._scatter, self._of_slopes(x)).max(axis=1, keepdims=True))
        floor = 1e-12 * float(np.max(np.abs(jacobian), initial=1.0))
        return np.asarray(rows), seen(jacobian, np.maximum(error, floor))

    @property
    def _scatter(self) -> Array:
        """(N,) variance of a run's residuals about the parabola."""
        return np.asarray(np.sum(self.left**2, axis=0) / self._freedom)

    def _of_slopes(self, x: Array) -> Array:
        """(P,) variance of a slope over that of a run."""
        u = (x - self.centre) / self.half
        variances = []
        for p, along in enumerate(u.tolist()):
            by = np.zeros(len(self.inverse))
            by[1 + p] = 1.0
            by[1 + self.count + p] = 2.0 * along
            variances.append(float(by @ self.inverse @ by) / float(self.half[p]) ** 2)
        return np.array(variances)

    def covariance(self, x: Array, free: NDArray[np.bool_]) -> Array:
        """(F, F) covariance of the free x, the others held.

        Scatter in the slopes makes them look steeper than they are, by its sum of squares; errors are widened by it.
        """
        plain = super().covariance(x, free)
        steep = np.sum(self.residuals(x)[1] ** 2, axis=0)
        false = self._of_slopes(x) * float(np.sum(self._scatter))
        left = np.clip(1.0 - false / np.where(steep > 0.0, steep, np.inf), _LEAST_STEEP, 1.0)[free]
        return np.asarray(plain / np.outer(left, left))

    def residuals_of(self, x: Array) -> tuple[Residual, ...]:
        """Every datum with its fitted value."""
        return self.of.recorded.records(self.data_residuals(x)[0], 1.0 / self.weight)

    def covariance_of_rows(self, x: Array) -> Covariance:
        """Return the covariance of the measured motion and of the runs' mean together."""
        return self._with_runs(self.of.recorded.covariance, x)

    def covariance_for_values(self, x: Array) -> Covariance:
        """Return the same covariance, as used for intervals."""
        return self._with_runs(self.of.recorded.covariance_for_values, x)

    def _with_runs(self, measured: Covariance, x: Array) -> Covariance:
        """Add the covariance of the runs' mean."""
        terms = self._terms(x)
        share = float(terms @ self.inverse @ terms) / self._freedom
        return measured.weighted(self.weight).plus(np.sqrt(share) * self.left)

    def weighted(self) -> Surface:
        """Return the surface with the standard errors of the runs' mean in those of the rows."""
        of_mean = self.inverse[0, 0] * np.sum(self.left**2, axis=0) / self._freedom
        weight = 1.0 / np.sqrt(1.0 + of_mean)
        return replace(self, coefficients=self.coefficients * weight, left=self.left * weight, weight=weight)

    def least_from(self, x: Array) -> Minimum:
        """Return the minimum of the parabola in its region."""
        minima, _ = search(self.residuals, [np.clip(x, *self.box)], self.box)
        return minima[0]

    def remarks(self, _x: Array, _open_ones: Sequence[Combination], /) -> list[str]:
        """Return the note that the motion does not repeat itself, and how it was fitted."""
        wide = 100.0 * float(np.expm1(self.half.max()))
        return [
            "the simulated motion does not repeat itself: what is compared of it scatters from run to run, however "
            f"near the values, by {self.jitter:.2g} standard errors of the data. A parabola through "
            f"{counted(len(self.left), 'run')} over {wide:.2g} % to either side was fitted, and the runs' scatter is "
            "in the standard errors. A longer record makes both smaller.",
            *self.of.recorded.remarks_on_scatter,
        ]


def surface(problem: MotionProblem, centre: Array, half: Array, runs: int, seed: int) -> Surface:
    """Return the parabola over runs around a point; ``centre`` and ``half`` (P,) are of the region.

    ConvergenceError where the region has no room within the bounds.
    """
    low, high = problem.parameters.box
    low = np.maximum(low, centre - half)
    high = np.minimum(high, centre + half)
    if np.any(high <= low):
        raise ConvergenceError("the region around the best start has no room within the bounds")
    middle = 0.5 * (low + high)
    width = 0.5 * (high - low)
    u = 2.0 * latin_hypercube(runs, centre.size, seed) - 1.0
    design = np.column_stack([np.ones(runs), u, u**2])
    rows = np.array([problem.rows(middle + width * row) for row in u])
    inverse = np.linalg.inv(design.T @ design)
    coefficients = inverse @ design.T @ rows
    left = rows - design @ coefficients
    return Surface(problem, middle, width, coefficients, inverse, left, np.ones(rows.shape[1]))


def settle(problem: Differences, best: Minimum) -> tuple[Minimum, Surface]:
    """Return the minimum of the smoothed residuals near the best of those that jump, and its surface."""
    # the first region: the step of the differences, around the minimum of the search
    x = best.x
    half = np.full(problem.count, problem.step)
    runs = _RUNS[0] * (1 + 2 * x.size)
    jitter = problem.of.scatter(x)
    clearest: tuple[Array, Array, int, int] | None = None
    for seed in range(_ROUNDS):
        region = x, half, runs, seed
        # the parabola over runs in the region, and its minimum
        smooth = surface(problem.of, *region)
        least = smooth.least_from(x)
        # a minimum that the runs do not keep: a smaller region
        if problem.of.level(least.x) > problem.of.level(x) and np.any(half > _NARROW):
            half = np.maximum(0.5 * half, _NARROW)  # the parabola promised more than the runs keep
            continue
        # slopes at the new point: standard errors, parameters that are noticed, bends
        x = least.x
        low, high = problem.of.parameters.box
        inside = (x <= low) | (x >= high) | (np.abs(x - smooth.centre) < 0.9 * smooth.half)
        jacobian = smooth.residuals(x)[1]
        errors = np.sqrt(np.diag(smooth.covariance(x, np.ones(x.size, dtype=np.bool_))))
        noticed = np.any(jacobian != 0.0, axis=0)
        errors = np.where(noticed, errors, np.inf)
        bends = smooth.jitter > _BENDS * jitter
        # parameters that are not noticed need a wider region and more runs
        if noticed.all():
            clearest = region
        elif not bends or np.all(half < problem.step):  # a wider region and more runs show more
            half = np.minimum(2.0 * half, problem.step)
            runs = min(2 * runs, _RUNS[1] * (1 + 2 * x.size))
            continue
        # the size wanted: wide enough for the scatter, small enough for the parabola
        clear = max(_WIDE, _CLEAR * min(smooth.jitter, jitter) * np.sqrt(smooth.left.shape[1]))
        wanted = np.clip(clear * errors, _NARROW, half)  # so that the residuals change by more than they scatter
        if bends:
            tighter = np.maximum(0.5 * half, np.where(noticed, 0.5 * clear * errors, 0.0))
            wanted = np.minimum(wanted, np.maximum(tighter, _NARROW))
        # end where the minimum lies near the centre and the region need not shrink
        central = np.abs(x - smooth.centre) < _CENTRAL * smooth.half  # where slopes are known best
        if np.all(central | (x <= low) | (x >= high)) and (np.all(wanted > 0.8 * half) or not (bends or seed == 0)):
            break
        half = np.where(inside, np.maximum(wanted, _SHRUNK * half), half)
    # the final parabola, weighted by the errors of its runs
    plain = replace(problem.of, recorded=problem.of.recorded.without_scatter())  # the mean of runs scatters less
    smooth = surface(plain, *(clearest or region)).weighted()
    least = smooth.least_from(x)
    return replace(least, times=best.times, at_bound=at_bounds(least.x, plain.parameters.box)), smooth
