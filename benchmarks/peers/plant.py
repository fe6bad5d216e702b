"""A paper case as every peer gets it: small numbers of like size, no absolute angles, each region a linear system.

Time is tau = omega t; deflections u_k = delta_k / b_k in half gaps, transmission error included; velocities w_i in
units of ``unit`` radians a unit of tau. With every element k in a known region r

    u_k' = g_k . w - e_k'(tau),    w_i' = m_i + a_i(tau) - d_i w_i - sum_k h_ik (K_kr u_k + C_kr u_k' + f_kr),

so a peer integrates 7 states, one smooth right-hand side from corner to corner, and changes K, C, f and the corners it
watches when it meets one. That is how a careful user would set the problem up; the absolute angles of the paper's
equations cost every peer four digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

import gearrattle as gr
from gearrattle.assembly import assemble

CASES = ("case1_loaded", "case2_loaded", "case3_loaded", "case1", "case2", "case3")
CYCLES = 127
UNIT = 1e-2
"""Unit of velocity [rad a unit of tau]: brings the largest, about 0.04, near the size of the deflections."""
FAR = 1e6
"""A corner that is not there [half gaps]."""


@dataclass(frozen=True)
class Plant:
    """n inertias, m elements, H harmonics; region r of element k holds the row ``region[k][r]``.

    A row of ``region``: stiffness, damping, offset of the force law, lower corner, upper corner.
    """

    name: str
    gain: Any  # (m, n) g: velocities to deflection rates
    share: Any  # (n, m) h: forces to accelerations
    drag: Any  # (n,)
    mean: Any  # (n,)
    orders: Any  # (H,)
    torque: Any  # (n, H) amplitudes of sin(order tau)
    error: Any  # (m, H) amplitudes of sin(order tau) of the transmission error
    region: tuple[Any, ...]  # m arrays (regions, 5)
    clearances: tuple[int, ...]  # the elements with corners
    start: Any  # (m + n,) deflections, then velocities
    checked: Fraction  # where errors are measured, in cycles

    @property
    def first(self) -> tuple[int, ...]:
        """The region of every element at the start."""
        return tuple(int(np.sum(rows[:-1, 4] < u)) for rows, u in zip(self.region, self.start, strict=False))


def load(name: str) -> gr.Model:
    """Load a case from the examples."""
    return gr.load(Path(__file__).resolve().parents[2] / "examples" / "paper" / f"{name}.toml")


def half_gaps(system: Any) -> Any:
    """Half gaps of the elements [SI]; one psi_c = 1e-3 rad where there is none."""
    return np.array([law.corners[-1] if law.corners.size else 1e-3 for law in system.laws])


def checked(name: str) -> Fraction:
    """Time at which errors are measured, in cycles.

    20/150 s to 2e-6 (226/71 cycles lie on a sampling grid); 5/150 s for the rattling cases 2 and 3, which are chaotic.
    """
    return Fraction(113, 142) if name in ("case2", "case3") else Fraction(226, 71)


def plant(name: str) -> Plant:
    """Scale a case."""
    model = load(name)
    system, omega = assemble(model).system, model.excitation.omega
    inputs, gap = system.inputs, half_gaps(system)
    if np.any(inputs.torque_cosine) or np.any(inputs.error_cosine):
        raise ValueError("these models are written with sines only")
    J, rows = system.inertia, system.rows
    region = []
    for k, law in enumerate(system.laws):
        corners = np.concatenate([[-FAR], law.corners / gap[k], [FAR]])
        columns = (law.stiffness * gap[k], law.damping * gap[k] * omega, law.offset, corners[:-1], corners[1:])
        region.append(np.column_stack(columns))
    deflection = rows @ gr.equilibrium(model).angle / gap  # the transmission error starts from zero
    return Plant(
        name=name,
        gain=rows * UNIT / gap[:, None],
        share=rows.T / (J * omega**2 * UNIT)[:, None],
        drag=system.drag / (J * omega),
        mean=inputs.mean / (J * omega**2 * UNIT),
        orders=inputs.cycles,
        torque=inputs.torque_sine / (J * omega**2 * UNIT)[:, None],
        error=inputs.error_sine / gap[:, None],
        region=tuple(region),
        clearances=tuple(system.clearances),
        start=np.concatenate([deflection, np.zeros(J.size)]),
        checked=checked(name),
    )
