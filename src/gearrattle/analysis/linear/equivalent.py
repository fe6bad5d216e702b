"""Equivalent linearisation along a motion: one slope and one damping for an element that passes through pieces.

    F - mean F  =  k (delta - mean delta) + c (delta' - mean delta') + r,      mean r^2 least

(R. C. Booton 1954, IRE Trans. Circuit Theory 1, 9-18; T. K. Caughey 1963, J. Acoust. Soc. Am. 35, 1706-1711; J. B.
Roberts, P. D. Spanos, Random Vibration and Statistical Linearization, 1990). Along a sine, k and c are the describing
function of the law, friction included. Of an element that stays in one piece they are the slope and damping there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_MOVES = 1e-12  # of the deflection: less is rounding


def equivalent(deflection: Array, rate: Array, force: Array) -> tuple[float, float] | None:
    """Return slope and damping, neither below zero; None of an element that does not move.

    Deflection, rate and force are (N,) samples that stand for equal shares of time.
    """
    moved = deflection - deflection.mean()
    turned = rate - rate.mean()
    power = float(moved @ moved)
    speed = float(turned @ turned)
    size = _MOVES * float(np.abs(deflection).max(initial=0.0))
    if power <= size * size * moved.size or speed == 0.0:
        return None
    # normal equations in units of the two root mean squares; the mean of the force drops out
    units = np.sqrt([power, speed])
    common = float(moved @ turned) / float(units[0] * units[1])
    gram = np.array([[1.0, common], [common, 1.0]])
    slope, damping = np.linalg.lstsq(gram, np.array([moved @ force, turned @ force]) / units, rcond=None)[0] / units
    return max(float(slope), 0.0), max(float(damping), 0.0)
