"""Whether every motion of a linear driveline decays, but for its rigid motion, whatever its numbers are.

Energy never grows. What does not decay is an undamped mode: it moves no element with damping and no body with drag,

    K phi = w^2 J phi,   C phi = 0,   w > 0.

What is at rest in such a mode spreads through the driveline: a body is at rest whose elements all are, for nothing
accelerates it; an element is whose bodies all are; of the elements at a body at rest the last one is, for its force has
nothing to balance it; and of the bodies of an element at rest the last one is. If all bodies are reached there is no
such mode, for any positive inertias and stiffness (zero forcing sets: AIM Group 2008, Linear Algebra and its
Applications 428, 1628-1648).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]


def all_decays(rows: NDArray[np.float64], stiff: Bools, damped: Bools, dragged: Bools) -> bool:
    """Return whether every elastic mode decays.

    Parameters
    ----------
    rows
        (m, n) W.
    stiff
        (m,) elements with a stiffness above zero; the others have none.
    damped
        (m,) elements with damping.
    dragged
        (n,) bodies with drag.
    """
    joins = rows != 0.0
    resting = damped.copy()
    still = dragged.copy()
    while True:
        before = int(resting.sum() + still.sum())
        pushing = joins & (stiff & ~resting)[:, None]  # elements that may push a body
        still |= ~pushing.any(axis=0)
        resting |= ~(joins & ~still).any(axis=1)
        pushing = joins & (stiff & ~resting)[:, None]
        last = pushing & still & (pushing.sum(axis=0) == 1)
        resting |= last.any(axis=1)
        moving = joins & ~still
        alone = moving & (resting & (moving.sum(axis=1) == 1))[:, None]
        still |= alone.any(axis=0)
        if still.all():
            return True
        if int(resting.sum() + still.sum()) == before:
            return False
