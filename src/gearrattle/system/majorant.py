"""A bound on the third derivative of every clearance's deflection for as long as a region lasts.

In block-modal coordinates c_b = L_b z, c_b(s) = exp(T_b s) c_b(0), so for row r of a deflection

    delta'''(s) = sum_b (r R_b) exp(T_b s) (T_b^3 c_b(0)).

T_b is upper triangular; entry by entry |exp(T_b s)| <= exp(G_b s), G_b = diag(max(Re T_b, 0)) + |strict upper T_b|,
and exp(G_b s) has entries that never shrink with s. Hence for all 0 <= s <= horizon

    |delta'''(s)| <= sum_b w_b . |T_b^3 L_b z(0)|,      w_b = |r R_b| exp(G_b horizon).

A simple decaying mode gives plain |r R| |lambda|^3 |c|: its amplitude cannot grow. The majorant is applied to the third
derivative itself, so Jordan blocks of free-flying parts contribute next to nothing. Inputs that no mode mixes with have
constant amplitude and go into a constant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, schur

from gearrattle.system.blocks import Block, block_diagonalise

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

ELIMINATION = (
    100.0  # largest entry of an elimination between blocks; any value is rigorous, this one keeps bounds tight
)
SLACK = 1.0 + 1e-6  # covers the rounding of the decomposition itself


@dataclass(frozen=True)
class Majorant:
    """|delta_k'''(s)| <= constant[k] + sum_j weights[k, j] |rows[j] . z(0)| for 0 <= s <= horizon.

    Attributes:
        rows: (J, Z) complex.
        weights: (K, J).
        constant: (K,).
    """

    rows: ComplexArray
    weights: Array
    constant: Array

    def bound(self, z: Array) -> Array:
        """(K,) bounds at the state z (Z,)."""
        return np.asarray(self.constant + self.weights @ np.abs(self.rows @ z))


def _triangular_form(generator: Array, states: int, frequency: Array) -> tuple[ComplexArray, ComplexArray]:
    """Complex Schur form of M = [A G; 0 S]: Schur of A, and the known eigenvectors of the oscillators S."""
    width = generator.shape[0]
    inner, basis = schur(generator[:states, :states], output="complex")
    vectors = np.zeros((width, width), dtype=complex)
    vectors[:states, :states] = basis
    vectors[states, states] = 1.0
    triangle = np.zeros((width, width), dtype=complex)
    triangle[:states, :states] = np.triu(inner)
    for j, omega in enumerate(frequency):
        at = states + 1 + 2 * j
        vectors[at : at + 2, at : at + 2] = np.array([[1, 1], [-1j, 1j]]) / np.sqrt(2.0)
        triangle[at, at], triangle[at + 1, at + 1] = 1j * omega, -1j * omega
    triangle[:states, states:] = basis.conj().T @ generator[:states, states:] @ vectors[states:, states:]
    return triangle, vectors


def _mirrored(block: Block, others: list[Block]) -> bool:
    """Whether a simple mode below the real axis has its conjugate among the others: then it adds the same amount."""
    value = block.triangle[0, 0]
    return value.imag < 0 and any(
        abs(other.triangle[0, 0] - np.conj(value)) <= 1e-9 * abs(value) for other in others if other.left.shape[0] == 1
    )


def majorant(
    generator: Array, states: int, *, frequency: Array, amplitude: Array, deflection: Array, horizon: float
) -> Majorant:
    """Build the bound of one region.

    Args:
        generator: (Z, Z) M.
        states: N, how many leading entries of z are states; the rest are inputs.
        frequency: (H,) radians a period of the oscillators.
        amplitude: (1 + H,) constant amplitude of the inputs in z.
        deflection: (K, Z) rows.
        horizon: longest s the bound must hold for.
    """
    triangle, vectors = _triangular_form(generator, states, frequency)
    blocks = block_diagonalise(triangle, vectors, ELIMINATION)
    rows, weights = [], []
    constant = np.zeros(deflection.shape[0])
    for block in blocks:
        simple = block.left.shape[0] == 1
        if simple and _mirrored(block, blocks):
            continue
        factor = 2.0 if simple and block.triangle[0, 0].imag > 0 else 1.0
        third = np.linalg.matrix_power(block.triangle, 3) @ block.left
        growth = np.abs(np.triu(block.triangle, 1)) + np.diag(np.maximum(block.triangle.diagonal().real, 0.0))
        weight = SLACK * factor * np.abs(deflection @ block.right) @ expm(growth * horizon).real
        if np.any(third[:, :states]):
            rows.append(third)
            weights.append(weight)
        else:
            constant += weight @ _largest_of_inputs(third[:, states:], amplitude)
    if not rows:
        return Majorant(np.zeros((0, generator.shape[0]), complex), np.zeros((len(constant), 0)), constant)
    return Majorant(np.vstack(rows), np.hstack(weights), constant)


def _largest_of_inputs(rows: ComplexArray, amplitude: Array) -> Array:
    """Largest |row . u| over all phases, summed over harmonics; rows (J, 1 + 2 H) act on the inputs alone."""
    largest = np.abs(rows[:, 0]) * amplitude[0]
    for j in range(1, amplitude.size):
        pair = rows[:, 2 * j - 1 : 2 * j + 1]
        plane = np.stack([pair.real, pair.imag], axis=1)
        largest = largest + np.linalg.norm(plane, ord=2, axis=(1, 2)) * amplitude[j]
    return np.asarray(largest)
