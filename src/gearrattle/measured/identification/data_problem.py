"""A least-squares problem of any data - modes, responses, a motion - at logarithms x = ln(p / start) of parameters.

Residuals are in standard errors, with their Jacobian by x. A prior adds the rows r = x / spread, as if every start had
been measured.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.identifiability import Combination, gain

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Residual:
    """One datum with its fitted value.

    Attributes
    ----------
    label
        what it is, e.g. ``"mode 2: frequency"``.
    unit
        SI unit; empty for amplitudes of a shape.
    measured, fitted
        values; of a shape the fitted one is scaled to the measured one.
    standard_error
        of the measured value.
    residual
        (fitted - measured) / standard_error.
    """

    label: str
    unit: str
    measured: float
    fitted: float
    standard_error: float
    residual: float


class DataProblem(ABC):
    """Data against a model at logarithms x of its P parameters."""

    @property
    @abstractmethod
    def prior(self) -> float | None:
        """Standard deviation of every x, as if the start had been measured; None: no prior."""

    @property
    @abstractmethod
    def scales(self) -> int:
        """Number of values that are fitted besides the parameters: each costs a degree of freedom."""

    @property
    def assumed(self) -> Sequence[str]:
        """Data without a standard error of their own, in words."""
        return ()

    @abstractmethod
    def data_residuals(self, x: Array) -> tuple[Array, Array]:
        """(N,) residuals of the data and (N, P) Jacobian."""

    @abstractmethod
    def residuals_of(self, x: Array) -> tuple[Residual, ...]:
        """Every datum with its fitted value."""

    @abstractmethod
    def remarks(self, x: Array, open_ones: Sequence[Combination], /) -> list[str]:
        """Notes on these data alone."""

    def residuals(self, x: Array) -> tuple[Array, Array]:
        """(N,) residuals and (N, P) Jacobian, the prior's rows last."""
        rows, jacobian = self.data_residuals(x)
        if self.prior is None:
            return rows, jacobian
        return np.concatenate([rows, x / self.prior]), np.vstack([jacobian, np.eye(x.size) / self.prior])

    def independent(self, x: Array, free: NDArray[np.bool_]) -> Array:
        """(F, F) covariance of the free x, the others held, by independent residuals of size one."""
        by_row = gain(self.residuals(x)[1][:, free])
        return np.asarray(by_row @ by_row.T)

    def covariance(self, x: Array, free: NDArray[np.bool_]) -> Array:
        """(F, F) covariance of the free x, the others held."""
        return self.independent(x, free)

    def chance(self, x: Array, freedom: int) -> float:
        """Probability of a chi-square of the data this large or larger."""
        from scipy.stats import chi2

        rows = self.data_residuals(x)[0]
        return float(chi2.sf(rows @ rows, freedom))
