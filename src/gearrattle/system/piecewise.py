"""The one mathematical object: a piecewise-linear system with clearances.

    J q'' + D q' + sum_k w_k F_k(delta_k, delta_k') = T(t),      delta_k = w_k . q - e_k(t)

J and D are diagonal, w_k is row k of W, F_k a ``PiecewiseLaw``. T and the transmission errors e_k are means plus
harmonics of one reference speed. Given the piece of every element, the system is linear with constant coefficients.
No gears, clutches or units exist here; q, delta and time carry whatever consistent units the maker chose (SI).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.system.law import PiecewiseLaw

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Harmonics:
    """Periodic inputs: mean + sum_j (sine_j sin(2 pi p_j t / T) + cosine_j cos(2 pi p_j t / T)).

    Attributes:
        period: the common period T.
        cycles: (H,) p_j, oscillations a period; whole numbers where the orders are commensurate.
        mean: (n,) constant torque on every inertia.
        torque_sine, torque_cosine: (n, H) torque amplitudes.
        error_sine, error_cosine: (m, H) transmission-error amplitudes.
    """

    period: float
    cycles: Array
    mean: Array
    torque_sine: Array
    torque_cosine: Array
    error_sine: Array
    error_cosine: Array

    @property
    def count(self) -> int:
        """Number of distinct orders H."""
        return int(self.cycles.size)


@dataclass(frozen=True)
class PiecewiseSystem:
    """J q'' + D q' + W^T F(W q - e, W q' - e') = T(t), piecewise linear.

    Attributes:
        inertia, drag: (n,) diagonals of J and D (J > 0, D >= 0).
        rows: (m, n) W, one row an element.
        laws: m laws.
        inputs: T(t) and e(t).
    """

    inertia: Array
    drag: Array
    rows: Array
    laws: tuple[PiecewiseLaw, ...]
    inputs: Harmonics

    @property
    def size(self) -> int:
        """Number of degrees of freedom n."""
        return int(self.inertia.size)

    @cached_property
    def clearances(self) -> tuple[int, ...]:
        """Indices of the elements that have a corner."""
        return tuple(k for k, law in enumerate(self.laws) if law.corners.size)

    def stiffness_of(self, pieces: tuple[int, ...]) -> Array:
        """Stiffness matrix (n, n) with every element in the piece given, (m,) indices."""
        slopes = np.array([law.stiffness[p] for law, p in zip(self.laws, pieces, strict=True)])
        return np.asarray((self.rows.T * slopes) @ self.rows)

    def damping_of(self, pieces: tuple[int, ...]) -> Array:
        """Damping matrix (n, n), drag included, with every element in the piece given."""
        coefficients = np.array([law.damping[p] for law, p in zip(self.laws, pieces, strict=True)])
        return np.asarray((self.rows.T * coefficients) @ self.rows + np.diag(self.drag))
