"""Free-interface modes with residual attachment: modes of the parts between clearances, and what the rest adds.

With the kept clearances taken out the driveline falls into parts. The basis holds their modes up to margin x up_to,
rigid motions included, and for every clearance and driven inertia the static shape that all modes left out would give,

    T = [Phi | sum_left_out phi_j phi_j^T f / omega_j^2],     f = w_k^T of a clearance, or a unit torque

(MacNeal, Computers & Structures 1 (1971) 581; Rubin, AIAA J. 13 (1975) 995). Clearances open and close on exact static
flexibility; coordinates are amplitudes, not angles.
"""

from __future__ import annotations

import numpy as np

from gearrattle.reductions.reduction_request import Request, Subspace

_INDEPENDENT = 1e-9  # of the largest: below it a residual shape adds nothing


def subspace(request: Request) -> Subspace:
    """Take the modes up to margin x up_to, and the residual shapes of clearances and torques."""
    linear = request.without_clearances()
    omega, shapes = linear.natural()
    inside = omega <= request.margin * request.up_to
    left = shapes[:, ~inside]
    rates = omega[~inside]
    ends = np.abs(request.system.rows[list(request.clearances)]) > 0.0
    at = sorted({*np.flatnonzero(ends.any(axis=0)).tolist(), *request.driven})
    participation = left[at].T / rates[:, None] ** 2
    vectors, values = np.linalg.svd(participation, full_matrices=False)[:2]
    new = values > _INDEPENDENT * values.max(initial=0.0)
    basis = np.hstack([shapes[:, inside], left @ vectors[:, new]])
    return Subspace(basis, (-1,) * basis.shape[1])
