"""Bounds on every clearance's deflection for as long as a region lasts.

In block-modal coordinates c_b = L_b z, c_b(s) = exp(T_b s) c_b(0), so for row r of a deflection

    delta''''(s) = sum_b (r R_b) exp(T_b s) (T_b^4 c_b(0)).

T_b is upper triangular; entry by entry |exp(T_b s)| <= exp(G_b s), G_b = diag(max(Re T_b, 0)) + |strict upper T_b|,
and exp(G_b s) has entries that never shrink with s. Hence for all 0 <= s <= horizon

    |delta''''(s)| <= sum_b w_b . |T_b^4 L_b z(0)|,      w_b = |r R_b| exp(G_b horizon).

A simple decaying mode gives plain |r R| |lambda|^4 |c|: its amplitude cannot grow. The majorant is applied to the
fourth derivative itself, so Jordan blocks of free-flying parts contribute next to nothing. Inputs that no mode mixes
with have constant amplitude and go into a constant.

The *calm* bound treats fast simple modes apart: their part of delta is at most |r R| |c|, however long the step, and
only the rest needs the fourth derivative. It is the better one while fast modes are small against the gaps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import schur

from gearrattle.system.blocks import Block, block_diagonalise

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

ELIMINATION = (
    100.0  # largest entry of an elimination between blocks; any value is rigorous, this one keeps bounds tight
)
SLACK = 1.0 + 1e-6  # covers the rounding of the decomposition itself


@dataclass(frozen=True)
class Majorant:
    """Bounds for 0 <= s <= horizon by the moduli m_j = |rows[j] . z(0)|, and the fast modes' part of delta.

    Attributes:
        rows: (J, Z) complex.
        weights: (3, K, J); weights @ m bounds |delta_k''''|, the same without fast modes, the fast modes' |delta_k|.
        constant: (3, K) to be added.
        fast: (K, Z) the fast modes' part of every deflection.
    """

    rows: ComplexArray
    weights: Array
    constant: Array
    fast: Array

    def bound(self, z: Array) -> Array:
        """(3, K) bounds at the state z (Z,)."""
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
    cosine = np.arange(states + 1, states + 1 + frequency.size)
    sine = cosine + frequency.size
    vectors[cosine, cosine] = vectors[cosine, sine] = 1.0 / np.sqrt(2.0)
    vectors[sine, cosine], vectors[sine, sine] = -1j / np.sqrt(2.0), 1j / np.sqrt(2.0)
    triangle[cosine, cosine], triangle[sine, sine] = 1j * frequency, -1j * frequency
    triangle[:states, states:] = basis.conj().T @ generator[:states, states:] @ vectors[states:, states:]
    return triangle, vectors


def majorant(
    generator: Array, states: int, *, frequency: Array, amplitude: Array, deflection: Array, horizon: float, fast: float
) -> Majorant:
    """Build the bounds of one region.

    Args:
        generator: (Z, Z) M.
        states: N, how many leading entries of z are states; the rest are inputs.
        frequency: (H,) radians a period of the oscillators.
        amplitude: (1 + H,) constant amplitude of the inputs in z.
        deflection: (K, Z) rows.
        horizon: longest s the bounds must hold for.
        fast: modes beyond this many radians a period count as fast.
    """
    triangle, vectors = _triangular_form(generator, states, frequency)
    blocks = block_diagonalise(triangle, vectors, ELIMINATION)
    fourth, weights, swift, part = [], [], [], np.zeros(deflection.shape)
    for block in blocks:
        shape, size = deflection @ block.right, block.left.shape[0]
        if size == 1:
            value = block.triangle[0, 0]
            fourth.append(value**4 * block.left)
            weights.append(np.abs(shape) * np.exp(max(value.real, 0.0) * horizon))
            if abs(value) > fast and np.any(block.left[:, :states]):
                swift.append(1.0 / abs(value) ** 4)
                part += (shape @ block.left).real
                continue
        else:
            metzler = np.abs(np.triu(block.triangle, 1)) + np.diag(np.maximum(block.triangle.diagonal().real, 0.0))
            fourth.append(np.linalg.matrix_power(block.triangle, 4) @ block.left)
            weights.append(np.abs(shape) @ _exponential(metzler * horizon))
        swift += [0.0] * size
    rows, is_fast = np.vstack(fourth), np.array(swift)
    weight = SLACK * np.hstack(weights) * _multiplicity(blocks)
    inputs_only = ~np.any(rows[:, :states], axis=1)
    constant = weight[:, inputs_only] @ _largest_of_inputs(rows[inputs_only, states:], amplitude)
    kept = ~inputs_only & np.any(weight > 0.0, axis=0)
    return Majorant(
        rows[kept], np.stack([weight, weight * (is_fast == 0.0), weight * is_fast])[:, :, kept],
        np.stack([constant, constant, np.zeros_like(constant)]), part,
    )  # fmt: skip


def _multiplicity(blocks: list[Block]) -> Array:
    """2 for a simple mode above the real axis whose conjugate is there too, 0 for that conjugate, else 1; row by row.

    A mode within rounding of the real axis is real: it is its own conjugate and counts once.
    """
    value = np.concatenate([np.diagonal(block.triangle) for block in blocks])
    simple = np.concatenate([np.full(len(block.triangle), len(block.triangle) == 1) for block in blocks])
    near = 1e-9 * np.abs(value)
    oscillates = np.abs(value.imag) > near
    apart = (np.abs(value[:, None] - value.conj()[None, :]) <= near[:, None]) & simple[None, :]
    paired = np.any(apart, axis=1) & oscillates & simple
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
    count = amplitude.size - 1
    p, q = rows[:, 1 : 1 + count], rows[:, 1 + count :]
    largest = np.sqrt(0.5 * (np.abs(p) ** 2 + np.abs(q) ** 2 + np.abs(p * p + q * q)))
    return np.asarray(np.abs(rows[:, 0]) * amplitude[0] + largest @ amplitude[1:])
