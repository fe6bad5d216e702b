"""Characteristic quantities and the dimensionless coefficients they make.

Time is counted in 1/w, angles in psi_c = x_c / R_c, lengths on a line of action in x_c, radii in R_c, inertias in J_c
(Padmanabhan, Barlow, Rook, Singh, ASME J. Mech. Des. 117 (1995) 185, sec. 5; J_c plays no part in its coefficients).
Body i and element k are numbered from 1 in their order; l_k = R_c for a mesh, 1 for a coupling, w_ki the element's row:

    xi_ii     = D_i / (J_i w)                            eq. (15)
    eta_ki    = l_k |w_ki| C_k / (J_i w)                 eqs. (16), (17)
    Omega2_ki = l_k |w_ki| K_k / (J_i w^2)               eqs. (18), (19)
    T_mi, T_ai_j = torque / (J_i w^2 psi_c)              eqs. (20), (21); j is the order
    epsilon_k_j  = transmission error / x_c              eq. (22)
    Omega_e   = reference speed / w

and, for a symmetric two-stage law, alpha_k, beta_k and b_k in psi_c or x_c, eqs. (9), (10). The paper prints the drag
terms of eqs. (11)-(14) as -xi theta'; eqs. (1)-(4) make it +xi theta', and so it is here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scales:
    """The characteristic quantities."""

    frequency: float  # w [rad/s]
    angle: float  # psi_c [rad]
    radius: float  # R_c [m]
    inertia: float  # J_c [kg m^2]

    @property
    def length(self) -> float:
        """Return x_c = R_c psi_c [m]."""
        return self.radius * self.angle

    def units(self) -> dict[str, float]:
        """Return the unit of every kind of quantity [SI]."""
        stiffness = self.inertia * self.frequency**2
        damping = self.inertia * self.frequency
        return {
            "time": 1.0 / self.frequency,
            "speed": self.frequency,
            "angle": self.angle,
            "velocity": self.angle * self.frequency,
            "acceleration": self.angle * self.frequency**2,
            "radius": self.radius,
            "length": self.length,
            "line_speed": self.length * self.frequency,
            "line_acceleration": self.length * self.frequency**2,
            "inertia": self.inertia,
            "mass": self.inertia / self.radius**2,
            "torque": stiffness * self.angle,
            "force": stiffness * self.angle / self.radius,
            "energy": stiffness * self.angle**2,
            "torsional_stiffness": stiffness,
            "torsional_damping": damping,
            "linear_stiffness": stiffness / self.radius**2,
            "linear_damping": damping / self.radius**2,
        }


def characteristic(
    system: PiecewiseSystem,
    is_mesh: NDArray[np.bool_],
    frequency: float,
    length: float | None = None,
    radius: float | None = None,
) -> Scales:
    """Return the scales of a system as the paper chooses them, where they are not given.

    R_c is the first gear's radius, x_c the half-backlash of the first mesh that has one; without such a mesh psi_c is
    the smallest corner of a coupling, or 1 rad. J_c is the first body's inertia.

    is_mesh: (m,) which elements are meshes.
    frequency: w [rad/s].
    length: x_c [m].
    radius: R_c [m].
    """
    meshes = [k for k in range(len(system.laws)) if is_mesh[k]]
    if radius is None:
        radius = _first_radius(system.rows[meshes[0]]) if meshes else 1.0
    if length is None:
        gaps = [float(np.abs(system.laws[k].corners).max()) for k in meshes if system.laws[k].corners.size]
        angles = [abs(c) for law in system.laws for c in law.corners.tolist() if c != 0.0]
        length = gaps[0] if gaps else radius * min(angles, default=1.0)
    return Scales(frequency, length / radius, radius, float(system.inertia[0]))


def _first_radius(row: Array) -> float:
    """The radius of a mesh's first gear; of its second where the first is no degree of freedom."""
    first = row[row > 0.0]
    return float(first[0]) if first.size else float(np.abs(row).max())


def coefficients(
    system: PiecewiseSystem,
    is_mesh: NDArray[np.bool_],
    orders: Array,
    omega: float,
    scales: Scales,
    *,
    turning: int | None = None,
) -> dict[str, float]:
    """Return the coefficients of eqs. (9)-(22) by their names; zero drags, loads and errors are left out.

    Indices above 9 are set apart by an underscore: xi_10_10.

    is_mesh: (m,) which elements are meshes.
    orders: (H,) orders of the inputs.
    omega: reference speed [rad/s].
    scales: what counts as one.
    turning: how many of the coordinates are angles, the first ones; None: all. Of displacements l_k = 1.
    """
    # drag
    w = scales.frequency
    named_values = dict[str, float]()
    inertia = system.inertia
    for i, drag in enumerate(system.drag.tolist()):
        if drag:
            named_values[_name("xi", i, i)] = drag / (inertia[i] * w)
    # damping and stiffness of the last stages, by lever over inertia
    arm = np.abs(system.rows)
    arm[is_mesh, :turning] *= scales.radius
    lever = arm / inertia
    for symbol, values, unit in (
        ("eta", [law.damping[-1] for law in system.laws], w),
        ("Omega2", [law.stiffness[-1] for law in system.laws], w**2),
    ):
        for k, i in np.argwhere(lever).tolist():
            named_values[_name(symbol, k, i)] = lever[k, i] * values[k] / unit
    named_values["Omega_e"] = omega / w
    deflection = np.where(is_mesh, scales.length, scales.angle)
    for k, law in enumerate(system.laws):
        named_values |= _stages(k, law, float(deflection[k]))
    inputs = system.inputs
    torque = inertia * w**2 * scales.angle
    amplitude = np.hypot(inputs.torque_sine, inputs.torque_cosine) / torque[:, None]
    error = np.hypot(inputs.error_sine, inputs.error_cosine) / deflection[:, None]
    named_values |= {f"T_m{i + 1}": mean / torque[i] for i, mean in enumerate(inputs.mean.tolist()) if mean}
    named_values |= {f"T_a{i + 1}_{orders[j]:g}": amplitude[i, j] for i, j in np.argwhere(amplitude).tolist()}
    named_values |= {f"epsilon_{k + 1}_{orders[j]:g}": error[k, j] for k, j in np.argwhere(error).tolist()}
    return {name: float(value) for name, value in named_values.items()}


def _name(symbol: str, first: int, second: int) -> str:
    """Return a symbol with its two indices, counted from 1."""
    between = "_" if max(first, second) >= 9 else ""
    return f"{symbol}_{first + 1}{between}{second + 1}"


def _stages(element: int, law: PiecewiseLaw, unit: float) -> dict[str, float]:
    """Return alpha, beta and b of a symmetric two-stage law; nothing of another."""
    if law.corners.size != 2 or law.corners[0] != -law.corners[1] or law.stiffness[-1] == 0.0:
        return {}
    values = {f"alpha_{element + 1}": law.stiffness[1] / law.stiffness[-1], f"b_{element + 1}": law.corners[1] / unit}
    return values | ({f"beta_{element + 1}": law.damping[1] / law.damping[-1]} if law.damping[-1] else {})
