"""One region of a driveline as a plain linear system in which every deflection is a state.

z = (delta, q', u) with the deflections of all m elements, dependent or not, and the inputs u = (1, cos, sin, ...):

    delta' = W q' - e',    J q'' = T - D q' - W^T (k delta + c delta' + f),

so no basis is chosen and no angle enters. Steps of ``h`` are a sixteenth of the period of the fastest rate. All
comes from the derivatives M^j z: the inside of a step, what is left of a stride, and the step's own matrix, whose
squares make longer strides. ``scipy.linalg.expm`` must agree with it (it errs by rounding of the largest entry, the sum
of derivatives by that of each entry, which is why the sum is used).

``size`` is the same matrix with every sum taken over absolute values: eps times it is the rounding a rate suffers.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm, matrix_balance

from tests.dense.case import Case

EPS = float(np.finfo(float).eps)
PER_TURN = 16
"""Steps in one period of the fastest rate."""
TERMS = 20
"""Derivatives kept; (2 pi / 16)^20 / 20! is 3e-27."""


@dataclass
class Region:
    """Matrices of one region; ``disagreement`` is the largest of |expm - sum| relative to the largest entry.

    Attributes
    ----------
    matrix, size
        (Z, Z) M, and its absolute terms.
    h
        step. radius: estimate of the largest rate.
    strides
        exp(M h 2^i), grown as needed.
    taylor
        (TERMS + 1, Z, Z) (M h)^j / j!.
    watch
        (4, K, Z) rows of the clearances' deflections (of what is watched) and their first three derivatives.
    series
        (K, TERMS + 1, Z) Taylor coefficients of the same over a step.
    lower, upper
        (K,) corners around the region.
    """

    matrix: np.ndarray
    size: np.ndarray
    radius: float
    h: float
    strides: list[np.ndarray]
    taylor: np.ndarray
    watch: np.ndarray
    series: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    disagreement: float = field(default=0.0)

    def stride(self, i: int) -> np.ndarray:
        """exp(M h 2^i)."""
        while len(self.strides) <= i:
            self.strides.append(self.strides[-1] @ self.strides[-1])
        return self.strides[i]

    def partial(self, r: float) -> np.ndarray:
        """exp(M r) for 0 <= r <= h."""
        return np.tensordot((r / self.h) ** np.arange(TERMS + 1), self.taylor, axes=1)


def matrices(case: Case, pieces: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """M and the same with absolute terms, (Z, Z) each."""
    k, c, f = (
        np.array([getattr(law, name)[p] for law, p in zip(case.laws, pieces, strict=True)])
        for name in ("stiffness", "damping", "offset")
    )
    most = np.array([np.abs(law.offset).max() for law in case.laws])  # offsets are sums that begin at zero deflection
    m, n = case.rows.shape
    one = m + n
    cos = one + 1 + 2 * np.arange(case.cycles.size)
    omega = 2 * np.pi * case.cycles / case.period
    width = one + 1 + 2 * case.cycles.size
    M, size = np.zeros((width, width)), np.zeros((width, width))
    W, J = case.rows, case.inertia[:, None]
    for out, signs in ((M, False), (size, True)):
        a = np.abs if signs else np.asarray
        minus = 1.0 if signs else -1.0
        out[:m, m:one] = a(W)
        out[:m, cos] = minus * a(case.error_sine) * omega
        out[:m, cos + 1] = a(case.error_cosine) * omega
        out[m:one, :m] = minus * a(W.T) * k / J
        out[m:one, m:one] = minus * (np.diag(case.drag) + (a(W.T) * c) @ a(W)) / J
        out[m:one, one] = (a(case.mean) + minus * a(W.T) @ (most if signs else f)) / case.inertia
        out[m:one, cos] = (a(case.torque_cosine) + (a(W.T) * c) @ (a(case.error_sine) * omega)) / J
        out[m:one, cos + 1] = (a(case.torque_sine) + minus * (a(W.T) * c) @ (a(case.error_cosine) * omega)) / J
        out[cos, cos + 1] = minus * omega
        out[cos + 1, cos] = omega
    return M, size


def spectral_radius(matrix: np.ndarray) -> float:
    """Upper estimate of the largest rate of a balanced matrix: |M^8|^(1/8)."""
    norm = float(np.abs(matrix).max())
    if norm == 0.0:
        return 0.0
    power = np.linalg.matrix_power(matrix / norm, 8)
    return norm * float(np.linalg.norm(power, 1)) ** 0.125


def region_of(case: Case, pieces: tuple[int, ...]) -> Region:
    """Everything the replay needs of one region."""
    M, size = matrices(case, pieces)
    rows = list(case.clearances)
    bounds = [np.concatenate([[-np.inf], case.laws[k].corners, [np.inf]])[pieces[k] : pieces[k] + 2] for k in rows]
    lower, upper = np.array(bounds).reshape(-1, 2).T
    return region_between(M, size, np.eye(len(M))[rows], lower=lower, upper=upper, slowest=2 * np.pi / case.period)


def region_between(
    M: np.ndarray, size: np.ndarray, probes: np.ndarray, *, lower: np.ndarray, upper: np.ndarray, slowest: float
) -> Region:
    """A region in which K quantities stay between bounds.

    Parameters
    ----------
    M, size
        (Z, Z) the matrix, and its absolute terms.
    probes
        (K, Z) rows of the quantities watched. lower, upper: (K,) their bounds.
    slowest
        rate below which no step is made longer.
    """
    balanced, (scale, _) = matrix_balance(M, permute=False, separate=True)
    radius = max(spectral_radius(balanced), slowest)
    h = 2 * np.pi / radius / PER_TURN
    undo = scale[:, None] / scale[None, :]
    taylor = np.empty((TERMS + 1, *M.shape))
    taylor[0] = np.eye(len(M))
    for j in range(1, TERMS + 1):
        taylor[j] = (balanced * (h / j)) @ taylor[j - 1]
    step = expm(balanced * h)
    disagreement = float(np.abs(step - taylor.sum(axis=0)).max()) / max(1.0, float(np.abs(step).max()))
    taylor *= undo
    step = taylor[::-1].sum(axis=0)
    series = probes @ taylor
    factor = np.array([1.0, 1.0, 2.0, 6.0])[:, None, None] / h ** np.arange(4)[:, None, None]
    return Region(
        M,
        size,
        radius,
        h,
        [step],
        taylor,
        series[:4] * factor,
        series.transpose(1, 0, 2),
        lower,
        upper,
        disagreement,
    )
