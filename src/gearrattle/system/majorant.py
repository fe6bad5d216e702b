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
from scipy.linalg import schur

from gearrattle.system.blocks import block_diagonalise

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
    simple = [block for block in blocks if block.left.shape[0] == 1]
    clusters = [block for block in blocks if block.left.shape[0] > 1]
    third, weights = [], []
    if simple:
        value = np.array([block.triangle[0, 0] for block in simple])
        growth = np.exp(np.maximum(value.real, 0.0) * horizon)
        third.append(value[:, None] ** 3 * np.vstack([block.left for block in simple]))
        weights.append(
            np.abs(deflection @ np.hstack([block.right for block in simple])) * growth * _multiplicity(value)
        )
    for block in clusters:
        metzler = np.abs(np.triu(block.triangle, 1)) + np.diag(np.maximum(block.triangle.diagonal().real, 0.0))
        third.append(block.triangle @ block.triangle @ block.triangle @ block.left)
        weights.append(np.abs(deflection @ block.right) @ _exponential(metzler * horizon))
    rows, weight = np.vstack(third), SLACK * np.hstack(weights)
    inputs_only = ~np.any(rows[:, :states], axis=1)
    constant = weight[:, inputs_only] @ _largest_of_inputs(rows[inputs_only, states:], amplitude)
    kept = ~inputs_only & np.any(weight > 0.0, axis=0)
    return Majorant(rows[kept], weight[:, kept], constant)


def _multiplicity(value: ComplexArray) -> Array:
    """2 for a simple mode above the real axis whose conjugate is there too, 0 for that conjugate, else 1.

    A mode within rounding of the real axis is real: it is its own conjugate and counts once.
    """
    near = 1e-9 * np.abs(value)
    oscillates = np.abs(value.imag) > near
    apart = np.abs(value[:, None] - value.conj()[None, :]) <= near[:, None]
    paired = np.any(apart, axis=1) & oscillates
    return np.where(paired, np.where(value.imag > 0.0, 2.0, 0.0), 1.0)


def _exponential(matrix: Array) -> Array:
    """exp of a matrix without negative entries: a Taylor series at norm one half, squared up; nothing cancels."""
    squarings = max(0, int(np.ceil(np.log2(max(float(matrix.sum(axis=0).max()), 1e-300)))) + 1)
    small = matrix / 2.0**squarings
    term = total = np.eye(len(matrix))
    for j in range(1, 16):
        term = term @ small / j
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return np.asarray(total)


def _largest_of_inputs(rows: ComplexArray, amplitude: Array) -> Array:
    """Largest |row . u| over all phases, summed over harmonics; rows (J, 1 + 2 H) act on the inputs alone.

    max over phi of |p cos phi + q sin phi|^2 = (|p|^2 + |q|^2 + |p^2 + q^2|) / 2.
    """
    p, q = rows[:, 1::2], rows[:, 2::2]
    largest = np.sqrt(0.5 * (np.abs(p) ** 2 + np.abs(q) ** 2 + np.abs(p * p + q * q)))
    return np.asarray(np.abs(rows[:, 0]) * amplitude[0] + largest @ amplitude[1:])
