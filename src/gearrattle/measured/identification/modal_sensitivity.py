"""Modes and frequency responses of one state, with their derivatives by the logarithms of the parameters.

Coefficients scale as k_k = k_k(start) exp(S_kp x_p), so dk_k/dx_p = S_kp k_k, and likewise J, d, c. With modal mass 1,

    d ln omega_j = phi_j^T (dK - omega_j^2 dJ) phi_j / (2 omega_j^2)
    d phi_j      = sum_{i != j} phi_i phi_i^T (dK - omega_j^2 dJ) phi_j / (omega_j^2 - omega_i^2)
                   - phi_j phi_j^T dJ phi_j / 2
    dH           = -s^r h^T (dK - omega^2 dJ + i omega dC) g,     Z g = f, Z h = v, Z symmetric, s = i omega

(Fox and Kapoor, AIAA J. 6 (1968) 2426, with all modes, so exact; Nelson, AIAA J. 14 (1976) 1201, needs one mode only.)
Modes that share a frequency have no derivatives of their own; their coupling is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.matrices import LinearSystem
from gearrattle.measured.identification.free_parameters import Coefficients

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_SAME = 1e-13  # of the frequencies' squares: below, two modes count as one


@dataclass(frozen=True)
class Spectrum:
    """A state at given parameters: x (P,) are their logarithms over their start."""

    of: Coefficients
    x: Array

    @cached_property
    def inertia(self) -> Array:
        """(n,) J."""
        return np.asarray(self.of.inertia * np.exp(self.of.of_inertia @ self.x))

    @cached_property
    def stiffness(self) -> Array:
        """(m,) slopes."""
        return np.asarray(self.of.stiffness * np.exp(self.of.of_stiffness @ self.x))

    @cached_property
    def damping(self) -> Array:
        """(m,) dampings."""
        return np.asarray(self.of.damping * np.exp(self.of.of_damping @ self.x))

    @cached_property
    def drag(self) -> Array:
        """(n,) drags."""
        return np.asarray(self.of.drag * np.exp(self.of.of_drag @ self.x))

    @cached_property
    def _natural(self) -> tuple[Array, Array]:
        elastic = np.sqrt(self.stiffness)[:, None] * self.of.rows
        linear = LinearSystem(np.diag(self.inertia), np.zeros((self.inertia.size,) * 2), elastic)
        omega, shapes = linear.within(self.of.basis).natural()
        return omega, np.asarray(self.of.basis @ shapes)

    @property
    def omega(self) -> Array:
        """(r,) natural frequencies, ascending; 0 for rigid motion."""
        return self._natural[0]

    @property
    def shapes(self) -> Array:
        """(n, r) shapes of unit modal mass, in columns."""
        return self._natural[1]

    @cached_property
    def deflections(self) -> Array:
        """(m, r) deflection of every element in every mode."""
        return np.asarray(self.of.rows @ self.shapes)

    def _coupling(self, mode: int) -> Array:
        """(r, P) phi_i^T (dK - omega_j^2 dJ) phi_j."""
        stiff = self.of.of_stiffness * (self.stiffness * self.deflections[:, mode])[:, None]
        inert = self.of.of_inertia * (self.inertia * self.shapes[:, mode])[:, None]
        return np.asarray(self.deflections.T @ stiff - self.omega[mode] ** 2 * (self.shapes.T @ inert))

    def omega_gradient(self, mode: int) -> Array:
        """(P,) d omega / dx of an elastic mode."""
        return np.asarray(self._coupling(mode)[mode] / (2.0 * self.omega[mode]))

    def shape_gradient(self, mode: int) -> Array:
        """(n, P) d phi / dx of an elastic mode."""
        square = self.omega**2
        apart = square[mode] - square
        distinct = np.abs(apart) > _SAME * max(square[mode], float(square.max()))
        weights = np.divide(1.0, apart, out=np.zeros_like(apart), where=distinct)[:, None] * self._coupling(mode)
        weights[mode] = -0.5 * (self.inertia * self.shapes[:, mode] ** 2) @ self.of.of_inertia
        return np.asarray(self.shapes @ weights)

    def response(self, at: int, on: int, derivatives: int, omega: Array) -> tuple[ComplexArray, ComplexArray]:
        """(F,) motion of inertia ``at`` by a torque on inertia ``on``, and (F, P) its derivatives by x.

        ``derivatives``: 0 the angle, 1 the velocity, 2 the acceleration.
        """
        c = self.of
        basis = self.of.basis
        rows = self.of.rows
        stiffness = (rows.T * self.stiffness) @ rows
        damping = (rows.T * self.damping) @ rows + np.diag(self.drag)
        mass, damping, stiffness = (basis.T @ m @ basis for m in (np.diag(self.inertia), damping, stiffness))
        s = 1j * omega[:, None, None]
        ends = np.broadcast_to(basis[[on, at]].T.astype(complex), (omega.size, basis.shape[1], 2))
        motion = np.linalg.solve(stiffness + s**2 * mass + s * damping, ends)
        g, h = (motion[:, :, k] @ basis.T for k in (0, 1))
        both = g * h
        across = (g @ rows.T) * (h @ rows.T)
        s = s[:, 0]
        change = (
            across @ (c.of_stiffness * self.stiffness[:, None])
            + s * (across @ (c.of_damping * self.damping[:, None]) + both @ (c.of_drag * self.drag[:, None]))
            + s**2 * (both @ (c.of_inertia * self.inertia[:, None]))
        )
        factor = s**derivatives
        return np.asarray(factor[:, 0] * g[:, at]), np.asarray(-factor * change)
