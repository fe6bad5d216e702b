"""Particular solutions: the response of a linear region to the inputs without its free motion.

In a region x' = A x + G u, u' = S u with u = (1, cos w_j s, sin w_j s). In general x = w + P u with

    A P + G = P S,    w' = A w:

the inputs are *split off*, and w is a free motion. For an input in resonance with a mode, and for a mean torque on a
free body, P does not exist or is far larger than the motion, and adding and subtracting it would lose digits. Such
inputs are *kept*: they remain states after w, and resonance and drift need no special case.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Split:
    """Inputs split off and inputs kept."""

    particular: Array  # (N, U) P, with zero columns for the inputs kept
    kept: IntArray  # indices into u, ascending: the constant, cosines, sines; a cosine and its sine go together


def oscillation(frequency: Array) -> Array:
    """(U, U) S of u' = S u for frequencies (H,), radians per period."""
    count = frequency.size
    out = np.zeros((1 + 2 * count, 1 + 2 * count))
    cosine = np.arange(1, 1 + count)
    out[cosine, cosine + count] = -frequency
    out[cosine + count, cosine] = frequency
    return out
