"""Craig and Bampton's component modes: static shapes of the masters, and modes with the masters held.

    q = T_Guyan q_m + Phi eta,     Phi: modes with q_m = 0 up to margin x up_to

(Craig, Bampton, AIAA J. 6 (1968) 1313). Masters, and so the ends of clearances, remain angles; the modes between them
restore the dynamics that static condensation leaves out.
"""

from __future__ import annotations

import numpy as np

from gearrattle.reductions.constraint_modes import constraint_modes, held
from gearrattle.reductions.reduction_request import Request, Subspace


def subspace(request: Request) -> Subspace:
    """Condense onto the masters and add fixed-interface modes up to margin x up_to."""
    masters = request.masters()
    linear = request.without_clearances()
    static = constraint_modes(linear, masters)
    omega, shapes, others = held(linear, masters)
    inside = (omega > 0.0) & (omega <= request.margin * request.up_to)
    dynamic = np.zeros((len(linear.mass), int(np.count_nonzero(inside))))
    dynamic[list(others)] = shapes[:, inside]
    generalised = static.shape[1] - len(masters) + dynamic.shape[1]
    return Subspace(np.hstack([static, dynamic]), (*masters, *[-1] * generalised))
