"""What measured motions have in common: values with standard errors, and residuals against a simulated motion.

Lines of a mean cycle (``recorded``) and orders over speed (``run_up_residuals``) are such motions. Each measured
amplitude gives a row in phase with it and, where phases are compared, one in quadrature.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.fitting.covariance import Covariance, widening
from gearrattle.measured.identification.data_problem import Residual

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

Samples = Any
"""What is kept of one simulation: its cycles, or its blocks."""
Compared = Any
"""What of it is compared."""


class Measured(ABC):
    """A measured motion of N rows with their standard errors, and its residuals against a simulated one."""

    @property
    @abstractmethod
    def delays(self) -> int:
        """Number of delays between the clocks that are fitted as well."""

    @property
    @abstractmethod
    def freedom(self) -> float:
        """Degrees of freedom of the standard errors."""

    @property
    @abstractmethod
    def errors(self) -> Array:
        """(N,) standard error of every row."""

    @property
    @abstractmethod
    def own_values(self) -> Array:
        """(N,) values of the measured motion."""

    @abstractmethod
    def values(self, motion: Compared, /) -> Array:
        """(N,) values of a simulated motion."""

    @abstractmethod
    def labels(self) -> Sequence[tuple[str, str]]:
        """(N,) label and unit of every row."""

    @abstractmethod
    def with_times_scatter(self, times: float) -> Covariance:
        """Return the covariance of the rows in standard errors, that of their scatter times a factor."""

    @abstractmethod
    def judged_by(self, fitted: Compared, /) -> Measured:
        """Return this motion with the choice of lines and errors that a fitted motion gives."""

    @abstractmethod
    def with_scatter_of(self, samples: Samples, /, seed: int) -> Measured:
        """Return this motion with the scatter of a simulated one in the standard errors."""

    @abstractmethod
    def without_scatter(self) -> Measured:
        """Return this motion without the scatter of a simulated one."""

    def compares_as(self, other: Any, /) -> bool:
        """Whether another measured motion has the same compared values and standard errors."""
        return np.array_equal(self.errors, other.errors)

    def rows(self, motion: Compared, /) -> Array:
        """(N,) residuals of a simulated motion in standard errors."""
        return np.asarray((self.values(motion) - self.own_values) / self.errors)

    @cached_property
    def covariance(self) -> Covariance:
        """Covariance of the rows in standard errors."""
        return self.with_times_scatter(1.0)

    @cached_property
    def covariance_for_values(self) -> Covariance:
        """The same covariance for intervals, widened as few samples determine their scatter poorly."""
        return self.with_times_scatter(widening(self.freedom))

    def records(self, rows: Array, widened: Array | float = 1.0) -> tuple[Residual, ...]:
        """Every datum with its fitted value, from (N,) residuals and a factor on the standard errors."""
        errors = self.errors * widened
        fitted = self.own_values + rows * errors
        columns = zip(self.labels(), self.own_values, fitted, errors, rows, strict=True)
        return tuple(Residual(*label, *(float(number) for number in numbers)) for label, *numbers in columns)

    def remarks(self, _fitted: Compared, /) -> list[str]:
        """Return notes on the comparison with a fitted motion."""
        return []

    @property
    def remarks_on_scatter(self) -> list[str]:
        """Notes on a simulated motion that scatters from run to run."""
        return []


def directions(amplitude: Complex) -> Complex:
    """Unit vectors along complex amplitudes; 1 along those of zero."""
    size = np.abs(amplitude)
    return np.asarray(np.where(size > 0.0, amplitude / np.where(size > 0.0, size, 1.0), 1.0))
