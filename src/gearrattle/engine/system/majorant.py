"""Bounds on the deflection of every clearance that hold in a whole region.

In block-modal coordinates c_b = L_b z, c_b(s) = exp(T_b s) c_b(0), so for row r of a deflection

    delta''''(s) = sum_b (r R_b) exp(T_b s) (T_b^4 c_b(0)).

T_b is upper triangular; entry by entry |exp(T_b s)| <= exp(G_b s), G_b = diag(max(Re T_b, 0)) + |strict upper T_b|,
and exp(G_b s) has entries that never shrink with s. Hence for all 0 <= s <= horizon

    |delta''''(s)| <= sum_b w_b . |T_b^4 L_b z(0)|,      w_b = |r R_b| exp(G_b horizon).

A simple decaying mode contributes |r R| |lambda|^4 |c|, because its amplitude cannot grow. The majorant bounds the
fourth derivative itself, so Jordan blocks of free bodies contribute very little. Inputs that are not coupled to a mode
have a constant amplitude and contribute a constant.

Chains of signals q stay outside of the blocks: c_b' = T_b c_b + P_b q, q' = N q, so that

    |c_b''''(s)| <= exp(G_b horizon) (|c_b''''(0)| + horizon |P_b| S),      S >= |q''''(s)| all through the interval.

A block whose modes are fast compared with the signal *follows* it: c_b = c_free + X_b q with T_b X_b - X_b N = -P_b,
and |delta''''| takes |w + sum_b r R_b X_b| S instead, with w the direct part of q in delta.

The *calm* bound treats fast simple modes separately: their part of delta is at most |r R| |c| for any step, and only
the other modes are bounded by the fourth derivative. It is the closer bound while fast modes are small against the
gaps.

The work is done in ``kernels.deflection_bounds``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Majorant:
    """Bounds for 0 <= s <= horizon by the moduli m_j = |rows[j] . z(0)|, and the fast modes' part of delta."""

    rows: ComplexArray  # (J, Z) complex
    # (3, K, J); weights @ m bounds |delta_k''''|, the same without fast modes, the fast modes' |delta_k|
    weights: Array
    pushes: Array  # (3, K, Q); pushes @ S is what the chains' fourth derivatives, bounded by S (Q,), make of the same
    constant: Array  # (3, K) to be added
    fast: Array  # (K, Z) the fast modes' part of every deflection

    def bound(self, z: Array, fourth: Array) -> Array:
        """(3, K) bounds at the state z (Z,), with bounds on the chains' fourth derivatives (Q,)."""
        return np.asarray(self.constant + self.weights @ np.abs(self.rows @ z) + self.pushes @ fourth)
