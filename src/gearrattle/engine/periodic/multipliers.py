"""Multipliers of a periodic motion: the eigenvalues of the gradient of its period map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def multipliers_of(gradient: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues of a gradient (N, N), the largest modulus first."""
    return sorted_by_modulus(np.linalg.eigvals(gradient))


def sorted_by_modulus(eigenvalues: NDArray[np.generic]) -> NDArray[np.complex128]:
    """Return eigenvalues, the largest modulus first; of a pair the one with the positive imaginary part first."""
    values = eigenvalues.astype(np.complex128)
    return np.asarray(values[np.lexsort((-values.imag, -np.round(np.abs(values), 12)))])
