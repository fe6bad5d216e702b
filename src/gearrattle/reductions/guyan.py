"""Guyan's static condensation: the other coordinates, the slaves, follow the masters as in static equilibrium.

    q_s = -K_ss^-1 K_sm q_m

(Guyan, AIAA J. 3 (1965) 380). Masters are the ends of kept clearances and driven inertias; kept clearances join masters
only, so that the basis is the same in every contact state. Exact at rest; the error grows with (omega / omega_s)^2,
omega_s the lowest frequency with the masters held. Slaves take part in the mass matrix, which is then full: no
driveline of lumped bodies has it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.reductions.constraint_modes import constraint_modes
from gearrattle.reductions.reduction_request import Request, Subspace

Array = NDArray[np.float64]


def subspace(request: Request) -> Subspace:
    """Condense onto the masters."""
    masters = request.masters()
    basis: Array = constraint_modes(request.without_clearances(), masters)
    free = np.flatnonzero(np.any(basis != 0.0, axis=0))
    coordinates = tuple(masters[j] if j < len(masters) else -1 for j in free)
    return Subspace(basis[:, free], coordinates)
