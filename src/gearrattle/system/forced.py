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


def integral(rows: Array, frequency: Array) -> Array:
    """(., U) Q with (Q u)' = rows u for all but the constant input, whose column is zero."""
    count = frequency.size
    out = np.zeros_like(rows)
    out[:, 1 : 1 + count] = -rows[:, 1 + count :] / frequency
    out[:, 1 + count :] = rows[:, 1 : 1 + count] / frequency
    return out


def largest(rows: Array, amplitude: Array) -> Array:
    """(., H) largest value over all phases of each harmonic's part of rows u; ``amplitude`` (1 + H,)."""
    count = amplitude.size - 1
    return np.asarray(np.hypot(rows[:, 1 : 1 + count], rows[:, 1 + count :]) * amplitude[1:])


def split_inputs(
    free: Array, driven: Array, frequency: Array, *, amplitude: Array, watched: Array, typical: float
) -> Split:
    """Solve for P, input by input, and keep those whose particular solution is too large.

    Args:
        free, driven: (N, N) A and (N, U) G.
        frequency: (H,) radians a period.
        amplitude: (1 + H,) constant amplitudes in u.
        watched: (K, N) deflections by state, in corner scales.
        typical: size of the states in an ordinary motion.
    """
    count = frequency.size
    particular, kept = np.zeros(driven.shape), np.zeros(driven.shape[1], dtype=bool)
    for j, solution in enumerate(responses(free, driven, frequency)):
        size = np.abs(solution) * amplitude[j]
        seen = np.abs(watched @ solution) * amplitude[j]
        if not (size.max() <= LARGEST * typical and seen.max(initial=0.0) <= LARGEST):
            kept[[0] if j == 0 else [j, j + count]] = True
        elif j == 0:
            particular[:, 0] = solution.real
        else:
            particular[:, j], particular[:, j + count] = solution.real, -solution.imag
    return Split(particular, np.flatnonzero(kept))


def responses(free: Array, driven: Array, frequency: Array) -> list[NDArray[np.complex128]]:
    """(N,) complex response to the constant, then to each cosine - i sine; nan where there is none."""
    count = frequency.size
    forces = [driven[:, 0] + 0j] + [driven[:, j] - 1j * driven[:, j + count] for j in range(1, 1 + count)]
    return [
        _solve(free, w, force.astype(np.complex128)) if np.any(force) else np.zeros(len(free), dtype=np.complex128)
        for w, force in zip([0.0, *frequency.tolist()], forces, strict=True)
    ]


def _solve(matrix: Array, frequency: float, force: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """(i w - A)^-1 g, refined once with a residual in the longest floats there are; nan where it does not exist."""
    system = 1j * frequency * np.eye(len(matrix)) - matrix
    nothing = np.full(force.shape, np.nan + 0j)
    try:
        solution = np.linalg.solve(system, force)
        residual = force.astype(np.clongdouble) - system.astype(np.clongdouble) @ solution.astype(np.clongdouble)
        solution = solution + np.linalg.solve(system, residual.astype(np.complex128))
    except np.linalg.LinAlgError:
        return nothing
    left = np.abs(force - system @ solution).max()  # a singular matrix may pass for a regular one
    return np.asarray(solution if left <= _SOLVED * np.abs(force).max() else nothing)
