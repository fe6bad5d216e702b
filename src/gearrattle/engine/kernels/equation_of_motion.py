"""The right-hand side y' = f(t, y) from the equation of motion, without regions and matrices.

    x' = X v,    v' = J^-1 (T(t) - D v - W^T F(delta, delta')),    r' = v[references],    I' = F

with delta = B x - e(t), delta' = W v - e'(t), and F from the law of every element. The state is y = (x, v, r, I) in SI
units: basis deflections, velocities, reference angles, force integrals. This code checks the exact engine: the two
share only the laws.
"""

from __future__ import annotations

from math import factorial, floor, pi
from typing import NamedTuple

from gearrattle.engine.kernels._jit import inlined, kernel
from gearrattle.engine.kernels.arrays import IntVector, Matrix, Vector
from gearrattle.engine.kernels.laws import Laws

_SINE = tuple((-1) ** i / factorial(2 * i + 1) for i in range(9))
_COSINE = tuple((-1) ** i / factorial(2 * i) for i in range(10))


class Field(NamedTuple):
    """The system as plain arrays: n inertias, m elements, r basis deflections, H harmonics."""

    inertia: Vector  # (n,)
    drag: Vector  # (n,)
    rows: Matrix  # (m, n) W
    basis: Matrix  # (r, n) X
    combination: Matrix  # (m, r) B
    references: IntVector  # (R,)
    mean: Vector  # (n,)
    torque_sine: Matrix  # (n, H)
    torque_cosine: Matrix  # (n, H)
    error_sine: Matrix  # (m, H)
    error_cosine: Matrix  # (m, H)
    cycles: Vector  # (H,)
    laws: Laws
    period: float


@inlined
def sine_cosine(turn):
    """(sin, cos) of 2 pi turn, by Taylor series about the nearest quarter turn; errors are below rounding.

    Both are computed at once and without branches: the two library calls would take more time than the rest of a
    right-hand side.
    """
    quarter = floor(4.0 * turn + 0.5)
    a = 2.0 * pi * (turn - 0.25 * quarter)
    q = a * a
    sine = _SINE[8]
    cosine = _COSINE[9]
    for i in range(7, -1, -1):
        sine = sine * q + _SINE[i]
    for i in range(8, -1, -1):
        cosine = cosine * q + _COSINE[i]
    sine *= a
    rest = quarter - 4.0 * floor(0.25 * quarter)
    odd = rest - 2.0 * floor(0.5 * rest) == 1.0
    back = rest >= 2.0
    s, c = (cosine, -sine) if odd else (sine, cosine)
    return (-s, -c) if back else (s, c)


@kernel
def element_states(field, time, y, wave, deflection, rate, piece, force, held=False):
    """Deflection, rate, piece and force of every element; ``wave`` receives sines, then cosines of the harmonics.

    A piece follows from the deflection; if ``held``, the pieces in ``piece`` are used.
    """
    count = field.cycles.size
    laws = field.laws
    elements, size = field.rows.shape
    r = field.basis.shape[0]
    # sines and cosines of the harmonics
    turns = time / field.period
    unit = 2.0 * pi / field.period
    for j in range(count):
        wave[j], wave[count + j] = sine_cosine(field.cycles[j] * turns)
    for k in range(elements):
        # deflection and rate, minus the transmission error
        d = 0.0
        v = 0.0
        for i in range(r):
            d += field.combination[k, i] * y[i]
        for i in range(size):
            v += field.rows[k, i] * y[r + i]
        for j in range(count):
            omega = unit * field.cycles[j]
            d -= field.error_sine[k, j] * wave[j] + field.error_cosine[k, j] * wave[count + j]
            v -= omega * (field.error_sine[k, j] * wave[count + j] - field.error_cosine[k, j] * wave[j])
        # the piece, and the force in it
        p = laws.first[k]
        if held:
            p += int(piece[k])
        else:
            while d > laws.upper[p]:
                p += 1
        deflection[k] = d
        rate[k] = v
        piece[k] = p - laws.first[k]
        force[k] = laws.stiffness[p] * d + laws.damping[p] * v + laws.offset[p]


@kernel
def derivative(field, time, y, wave, deflection, rate, piece, force, out, held=False):
    """Write y' to out; the work arrays keep the elements' states at (time, y)."""
    element_states(field, time, y, wave, deflection, rate, piece, force, held)
    elements, size = field.rows.shape
    r = field.basis.shape[0]
    count = field.cycles.size
    # x' = X v
    for i in range(r):
        total = 0.0
        for j in range(size):
            total += field.basis[i, j] * y[r + j]
        out[i] = total
    # v' from the balance of torques
    for i in range(size):
        total = field.mean[i] - field.drag[i] * y[r + i]
        for j in range(count):
            total += field.torque_sine[i, j] * wave[j] + field.torque_cosine[i, j] * wave[count + j]
        for k in range(elements):
            total -= field.rows[k, i] * force[k]
        out[r + i] = total / field.inertia[i]
    # reference angles and force integrals
    at = r + size
    for i in range(field.references.size):
        out[at + i] = y[r + field.references[i]]
    at += field.references.size
    for k in range(elements):
        out[at + k] = force[k]
