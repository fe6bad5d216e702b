"""Condition number of the Jacobian in different scalings, which leave its ratios of eigenvalues as they are.

The state is (q, q') and dy/dt = A y. A formulation measures angle i in a unit u_i and time in a unit 1/w, so that

    A -> (1/w) T A T^-1,    T = diag(1/u_i ..., 1/(u_i w) ...).

T A T^-1 is similar to A and 1/w multiplies all eigenvalues alike: R_lambda is the same in every formulation, torsional,
translational, mixed, dimensional or not. The condition number does change, the ratio of the largest to the smallest
singular value (the one zero of every rigid angle left out); implicit methods and error estimates depend on it. The best
diagonal T is near the one that balancing gives (B. N. Parlett, C. Reinsch 1969, Numer. Math. 13, 293-304).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.stiffness_ratio import rigid_motions
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]


def jacobian(system: PiecewiseSystem, stiffness: Array, damping: Array, unit: Array, frequency: float = 1.0) -> Array:
    """Return (2n, 2n) A of (q, q'), angle i in multiples of unit_i [rad], time in 1/frequency [s].

    Parameters
    ----------
    stiffness, damping
        (m,) of every element.
    unit
        (n,) what counts as 1 for every angle [rad].
    frequency
        what counts as 1 [rad/s].
    """
    n = system.size
    matrix = np.zeros((2 * n, 2 * n))
    matrix[:n, n:] = np.eye(n)
    scale = np.outer(1.0 / (unit * system.inertia), unit)
    matrix[n:, :n] = -scale * ((system.rows.T * stiffness) @ system.rows) / frequency**2
    loss = (system.rows.T * damping) @ system.rows + np.diag(system.drag)
    matrix[n:, n:] = -scale * loss / frequency
    return matrix


def condition(matrix: Array, rigid: int) -> float:
    """Return the condition number of a Jacobian (2n, 2n) with the ``rigid`` smallest singular values left out.

    Each rigid motion makes one singular value zero.
    """
    values = np.linalg.svd(matrix, compute_uv=False)
    return float(values[0] / values[-1 - rigid])


def balanced(matrix: Array) -> tuple[Array, Array]:
    """Return T A T^-1 and the diagonal of T, (2n,) powers of two, that balance rows and columns."""
    from scipy.linalg import matrix_balance

    balanced_matrix, (scale, _) = matrix_balance(matrix, permute=False, separate=True)
    return np.asarray(balanced_matrix), np.asarray(1.0 / scale)


def conditions(
    system: PiecewiseSystem, stiffness: Array, damping: Array, units: dict[str, tuple[Array, float]]
) -> dict[str, float]:
    """Return the condition number of every formulation, and of the last one balanced.

    Parameters
    ----------
    stiffness, damping
        (m,) of every element.
    units
        by name of the formulation: (n,) unit of every angle [rad], and unit of frequency [rad/s].
    """
    rigid = rigid_motions(system, stiffness)
    matrices = {name: jacobian(system, stiffness, damping, *unit) for name, unit in units.items()}
    condition_numbers = {name: condition(matrix, rigid) for name, matrix in matrices.items()}
    return {**condition_numbers, "balanced": condition(balanced(next(reversed(matrices.values())))[0], rigid)}
