"""Particular solutions: what the inputs make of a linear region once its own modes have died out.

In a region x' = A x + G u, u' = S u with u = (1, cos w_j s, sin w_j s). Where it is well behaved, x = w + P u with

    A P + G = P S,    w' = A w:

the inputs are split off, and w moves freely. At an input that a mode resonates with, and for a mean torque on a part
that flies freely, P does not exist or is far larger than the motion ever is, and adding and subtracting it would cost
digits. Such inputs are *kept*: they stay states behind w, and resonance and drift are no special case.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

LARGEST = 2.0
"""A particular solution is used up to this many times the motion's typical size."""

_SOLVED = 1e-9  # largest residual of a solution, of its force


@dataclass(frozen=True)
class Split:
    """Inputs split off and inputs kept.

    Attributes:
        particular: (N, U) P, with zero columns for the inputs kept.
        kept: indices into u, ascending: the constant, cosines, sines; a cosine and its sine go together.
    """

    particular: Array
    kept: IntArray


def oscillation(frequency: Array) -> Array:
    """(U, U) S of u' = S u for frequencies (H,), radians a period."""
    count = frequency.size
    out = np.zeros((1 + 2 * count, 1 + 2 * count))
    cosine = np.arange(1, 1 + count)
    out[cosine, cosine + count] = -frequency
    out[cosine + count, cosine] = frequency
    return out


def responses(free: Array, driven: Array, frequency: Array) -> list[NDArray[np.complex128]]:
    """(N,) complex response to the constant, then to each cosine - i sine; nan where there is none.

    Refined once with a residual in the longest floats there are.
    """
    count, size = frequency.size, len(free)
    force = driven[:, : 1 + count].T.astype(np.complex128)
    force[1:] -= 1j * driven[:, 1 + count :].T
    waves = np.concatenate([[0.0], frequency])
    systems = 1j * waves[:, None, None] * np.eye(size) - free
    solution = _solved(systems, force)
    longer = np.einsum("hij,hj->hi", systems.astype(np.clongdouble), solution.astype(np.clongdouble))
    solution = solution + _solved(systems, (force - longer).astype(np.complex128))
    left = np.abs(force - np.einsum("hij,hj->hi", systems, solution)).max(axis=1)
    with np.errstate(invalid="ignore"):  # a singular matrix may pass for a regular one
        solution[~(left <= _SOLVED * np.abs(force).max(axis=1))] = np.nan
    solution[~np.any(force, axis=1)] = 0.0
    return list(solution)


def _solved(systems: NDArray[np.complex128], force: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Solutions (H, N) of stacked systems (H, N, N); nan where a matrix is singular."""
    try:
        return np.asarray(np.linalg.solve(systems, force[..., None])[..., 0])
    except np.linalg.LinAlgError:
        if len(systems) == 1:
            return np.full_like(force, np.nan)
        return np.concatenate([_solved(s[None], f[None]) for s, f in zip(systems, force, strict=True)])
