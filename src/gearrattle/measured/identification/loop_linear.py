"""A linearised law: its torque's derivatives in every number, over points that stand for all samples.

With A the columns, W the weights and y the residuals, A' W A and A' W y are the normal matrix and the right side of a
step of Gauss and Newton in coefficients, breaks and logarithms of reaches.
"""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_law import Slider, Solved
from gearrattle.measured.identification.loop_moments import Moments
from gearrattle.measured.identification.loop_slopes import slopes_in

Array = NDArray[np.float64]


class Normal(NamedTuple):
    """Normal equations of a law made linear: (P, P) matrix, (P,) right side, and the coefficients, which come first."""

    matrix: Array
    right: Array
    coefficients: Array

    @property
    def free(self) -> NDArray[np.bool_]:
        """(P,) whether a parameter may give way: coefficients on their bound of zero, and unseen ones, may not."""
        free = np.diag(self.matrix) > 0.0
        free[1 : self.coefficients.size] &= self.coefficients[1:] > 0.0
        return free

    def scaled(self, rows: NDArray[np.bool_]) -> tuple[Array, Array]:
        """(F, F) matrix of some parameters with ones on its diagonal, and (F,) roots of that before."""
        size = np.sqrt(np.diag(self.matrix)[rows])
        return self.matrix[np.ix_(rows, rows)] / size[:, None] / size, size


class Linear:
    """A law and its derivatives in all parameters, over points that stand for all samples.

    Attributes
    ----------
    columns
        (M, C + B + R) derivatives in coefficients, breaks (drive, then coast), logarithms of reaches.
    residual
        (M,) of the points [N m].
    weight
        (M,) samples each stands for.
    """

    def __init__(self, moments: Moments, solution: Solved, sliders: tuple[Slider, ...]) -> None:
        self.moments = moments
        points = moments.regression(solution.shape)
        table = points.table(solution.shape, solution.labels)
        self.loop = points.loop
        self.columns = np.hstack([table, slopes_in(points.loop, solution, sliders)])
        self.residual = points.torque - table @ solution.coefficients
        self.coefficients = solution.coefficients
        self.weight = points.weight

    def normal(self) -> Normal:
        """Return the normal equations."""
        scaled = self.columns * self.weight[:, None]
        return Normal(scaled.T @ self.columns, scaled.T @ self.residual, self.coefficients)

    def with_column(self, index: int, column: Array) -> Linear:
        """Return the linear law with another column."""
        made = copy(self)
        made.columns = self.columns.copy()
        made.columns[:, index] = column
        return made
