"""Decay of all motions of a linear driveline but the rigid ones, shown by its structure for any numbers.

Energy never grows. A motion that does not decay is an undamped mode, in which no damped element and no
body with drag moves,

    K phi = w^2 J phi,   C phi = 0,   w > 0.

In such a mode rest spreads through the driveline. A body is at rest if all its elements are, as nothing accelerates it.
An element is at rest if all its bodies are. If all elements but one at a body at rest are at rest, so is the last one,
for no other force balances its own. If all bodies but one of an element at rest are at rest, so is the last one. If all
bodies are reached there is no such mode, for any positive inertias and stiffness (zero forcing sets: AIM Group 2008,
Linear Algebra and its Applications 428, 1628-1648).
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
