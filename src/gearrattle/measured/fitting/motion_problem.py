"""The least-squares problem of a recorded motion: one simulation a point, derivatives by central differences.

How smooth the residuals are is measured, not assumed (J. J. More, S. M. Wild 2011, SIAM J. Sci. Comput. 33, 1292): the
second difference of the residuals over a step of 1e-7 is rounding where the motion settles, and of the size of the
simulated scatter where it is chaotic. With that jitter e and residuals that bend as much as they are large, S, the
central difference is best at the step h = (3 e / S)^(1/3).

The residuals come from ``recorded`` (lines of a mean cycle) or from ``run_up_residuals`` (orders over speed).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.measured.fitting.covariance import Covariance, chance, spread
from gearrattle.measured.fitting.measured_motion import Compared, Measured, Samples
from gearrattle.measured.identification.data_problem import DataProblem, Residual
from gearrattle.measured.identification.free_parameters import Parameters
from gearrattle.measured.identification.identifiability import Combination
from gearrattle.model import Model

Array = NDArray[np.float64]

ROUGH = 0.05
"""Jitter of the residuals, in standard errors, from which on they are not smooth."""
STEPS = 1e-4, 0.1
"""Smallest and largest step of the logarithms."""
_TINY = 1e-7  # step of the logarithms over which jitter shows
_NOTHING = 1e-6  # of the longest row of a Jacobian: shorter is rounding
_NEIGHBOURS = 8
_ROUNDING = 1e-10  # of a row
_BENT = 0.5  # standard errors of the data
_FAR = 0.5  # standard error of a logarithm above which no straight line is expected
_SURE = 1.6  # times the value by noise alone


class Simulates(Protocol):
    """Simulation of a model's motion, and its reading."""

    def samples(self, model: Model) -> Samples:
        """Return the part of a model's motion that is kept."""

    def motion_of(self, samples: Samples, /) -> Compared:
        """Return the compared values of kept samples."""

    def remarks(self, samples: Samples, /) -> list[str]:
        """Return notes on the simulated motion."""


@dataclass(frozen=True)
class MotionProblem:
    """A recorded motion and a model that is fitted to it.

    ``prior`` is the standard deviation of every ln(parameter / start); None: no prior.
    """

    recorded: Measured
    simulator: Simulates
    model: Model
    parameters: Parameters
    prior: float | None = None
    counted: Callable[[], None] = lambda: None
    _kept: dict[bytes, Compared] = field(default_factory=dict, repr=False)

    def samples(self, x: Array) -> Samples:
        """Return the kept samples of the motion at logarithms x; ConvergenceError without such a model or motion."""
        try:
            return self.simulator.samples(self.parameters.fitted(self.model, x))
        except ModelError as error:
            raise ConvergenceError(f"no motion with these values: {error}", remedy="narrower bounds") from None
        finally:
            self.counted()

    def motion(self, x: Array) -> Compared:
        """Return the compared values of the motion at logarithms x."""
        key = x.tobytes()
        if key not in self._kept:
            self._kept[key] = self.simulator.motion_of(self.samples(x))
        return self._kept[key]

    def rows(self, x: Array) -> Array:
        """(N,) residuals of the data."""
        return self.recorded.rows(self.motion(x))

    def judged_at(self, x: Array) -> MotionProblem:
        """Return the problem with lines and errors chosen by the motion at x."""
        return replace(self, recorded=self.recorded.judged_by(self.motion(x)))

    def scattering(self, x: Array, seed: int) -> MotionProblem:
        """Return the problem with the scatter of the simulated motion at x in its standard errors."""
        return replace(self, recorded=self.recorded.with_scatter_of(self.samples(x), seed))

    def remarks(self, x: Array) -> list[str]:
        """Return notes on the motion at x and on the comparison."""
        samples = self.samples(x)
        return [*self.simulator.remarks(samples), *self.recorded.remarks(self.simulator.motion_of(samples))]

    def chi_square(self, x: Array) -> float:
        """Sum of squares of the residuals, a prior's included."""
        rows = self.rows(x)
        return float(rows @ rows) + (0.0 if self.prior is None else float(x @ x) / self.prior**2)

    @cached_property
    def slope(self) -> float:
        """Rough change of a row for a change of the logarithm by one: the motion over its standard error."""
        return float(np.sqrt(np.mean((self.recorded.own_values / self.recorded.errors) ** 2)))

    def _next(self, x: Array) -> tuple[Array, Array]:
        """Return points to either side of x at a step near rounding."""
        away = np.random.default_rng(0).standard_normal(x.size)
        away *= _TINY / np.linalg.norm(away)
        return x + away, x - away

    def jitter(self, x: Array) -> float:
        """Return the jump of the residuals over a step near rounding, in standard errors."""
        ahead, behind = (self.rows(point) for point in self._next(x))
        return float(np.sqrt(np.mean((ahead - 2.0 * self.rows(x) + behind) ** 2) / 6.0))

    def scatter(self, x: Array) -> float:
        """Return the scatter of the residuals over runs at neighbouring points, in standard errors."""
        away = _TINY * np.random.default_rng(1).standard_normal((_NEIGHBOURS, x.size))
        return float(np.sqrt(np.mean(np.var([self.rows(x + step) for step in away], axis=0, ddof=1))))

    def level(self, x: Array) -> float:
        """Return chi-square at x, the mean over three runs at neighbouring points."""
        return float(np.mean([self.chi_square(point) for point in (x, *self._next(x))]))

    def step(self, jitter: float) -> float:
        """Return the step of a central difference."""
        return float(np.clip((3.0 * jitter / self.slope) ** (1.0 / 3.0), *STEPS))

    def differences(self, jitter: float) -> Differences:
        """Return the problem with derivatives, for residuals that jump by ``jitter`` standard errors."""
        return Differences(self, jitter, self.step(jitter))


@dataclass(frozen=True)
class Judged(DataProblem):
    """A motion problem with derivatives, for a search and for standard errors."""

    of: MotionProblem

    @property
    def count(self) -> int:
        """Number of parameters P."""
        return len(self.of.parameters.paths)

    @property
    def prior(self) -> float | None:
        """Standard deviation of every ln(parameter / start); None: no prior."""
        return self.of.prior

    @property
    def scales(self) -> int:
        """Number of delays between the clocks that are fitted as well."""
        return self.of.recorded.delays

    def covariance_of_rows(self, _x: Array) -> Covariance:
        """Return the covariance of the residuals."""
        return self.of.recorded.covariance

    def covariance_for_values(self, _x: Array) -> Covariance:
        """Return the covariance of the residuals for intervals: scatter from few samples is widened."""
        return self.of.recorded.covariance_for_values

    def residuals_of(self, x: Array) -> tuple[Residual, ...]:
        """Every datum beside its fitted value."""
        return self.of.recorded.records(self.data_residuals(x)[0])

    def covariance(self, x: Array, free: NDArray[np.bool_]) -> Array:
        """(F, F) covariance of the free x, the others held."""
        return spread(self.residuals(x)[1][:, free], self.covariance_for_values(x))

    def chance(self, x: Array, freedom: int) -> float:
        """Probability of a chi-square of the data this large or larger."""
        return chance(self.data_residuals(x), self.covariance_of_rows(x), (freedom, self.of.recorded.freedom))


@dataclass(frozen=True)
class Differences(Judged):
    """A motion problem with central differences, and the jitter of its residuals in standard errors."""

    jitter: float
    step: float
    _kept: dict[bytes, Array] = field(default_factory=dict, repr=False)

    def data_residuals(self, x: Array) -> tuple[Array, Array]:
        """(N,) residuals of the data and (N, P) Jacobian."""
        key = x.tobytes()
        if key not in self._kept:
            self._kept[key] = seen(self._differences(x), self._noise)
        return self.of.rows(x), self._kept[key]

    @property
    def _noise(self) -> Array:
        """(1, 1) standard error of an entry of the Jacobian."""
        return np.full((1, 1), max(self.jitter, _ROUNDING * self.of.slope) / (self.step * math.sqrt(2.0)))

    def _differences(self, x: Array) -> Array:
        columns = []
        for p in range(self.count):
            away = np.zeros(self.count)
            away[p] = self.step
            columns.append((self.of.rows(x + away) - self.of.rows(x - away)) / (2.0 * self.step))
        return np.column_stack(columns)

    def remarks(self, x: Array, _open_ones: Sequence[Combination], /) -> list[str]:
        """Return notes: where the motion has not settled, and where the residuals bend within a standard error."""
        said = self.of.remarks(x)
        bent = [
            f"{path} (by {off:.2g} of the data's)"
            for path, off in zip(self.of.parameters.paths, self._bent(x), strict=True)
            if off > _BENT
        ]
        if bent:
            said.append(
                f"over one standard error the residuals leave a straight line: {', '.join(bent)}. The motion jumps or "
                "bends there, at a grazing or a fold; take standard errors as rough, and look at a profile."
            )
        return said

    def _bent(self, x: Array) -> list[float]:
        """Return the deviation of the residuals from a straight line over a standard error of every parameter, rms."""
        rows, jacobian = self.data_residuals(x)
        errors = np.sqrt(np.diag(self.covariance(x, np.ones(x.size, dtype=np.bool_))))
        off = []
        for p, error in enumerate(errors.tolist()):
            if not _ROUNDING < error < _FAR or not jacobian[:, p].any():
                off.append(0.0)
                continue
            away = np.zeros(x.size)
            away[p] = error
            ends = [self.of.rows(x + side * away) - rows - side * error * jacobian[:, p] for side in (-1.0, 1.0)]
            off.append(float(np.sqrt(np.mean(np.square(ends)))))
        return off


def seen(jacobian: Array, noise: Array) -> Array:
    """Return a Jacobian (N, P) without the directions that are lost in its noise.

    The noise is the standard error of its entries, (N, 1) or (1, 1), above zero.
    """
    _, values, right = np.linalg.svd(jacobian / noise, full_matrices=False)
    there = values > _SURE * np.sqrt(len(jacobian))
    if there.all():
        return jacobian
    kept = jacobian @ right[there].T @ right[there]
    length = np.linalg.norm(kept, axis=1)
    return np.where((length > _NOTHING * length.max(initial=0.0))[:, None], kept, 0.0)
