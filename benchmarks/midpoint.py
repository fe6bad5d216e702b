"""The yardstick: the paper's RK2 (explicit midpoint) on the four-inertia transmission, written out and compiled.

Eqs. (1)-(10) of Padmanabhan, Barlow, Rook, Singh (ASME J. Mech. Des. 117 (1995) 185) as a programmer would write them
for this one model: absolute angles, no event handling, two sines and cosines a stage (four with a transmission error;
the other orders by recurrence). It is as fast as a plain fixed step gets here, and shares nothing with the package.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any, NamedTuple

import numba
import numpy as np

import gearrattle as gr


class Transmission(NamedTuple):
    """The four-inertia model in arrays: flywheel, hub, input gear, output gear; clutch, spline, mesh."""

    inertia: Any  # (4,)
    drag: Any  # (4,)
    mean: Any  # (4,) mean torques, drag torques included
    torque: Any  # (5,) amplitudes at orders 1 ... 5 on the flywheel
    elements: Any  # (3, 5) K, C, b, alpha, beta
    radii: Any  # (2,)
    error: Any  # (2,) amplitude and order of the transmission error
    omega: float


@numba.njit(cache=True, inline="always")
def _law(delta, b, alpha):  # type: ignore[no-untyped-def]
    """Eq. (9): slope 1 outside +-b, alpha inside."""
    if delta > b:
        return delta - (1.0 - alpha) * b
    if delta < -b:
        return delta + (1.0 - alpha) * b
    return alpha * delta


@numba.njit(cache=True, inline="always")
def _force(element, delta, rate):  # type: ignore[no-untyped-def]
    """Eqs. (5)-(7): K f(delta) + C g(delta) delta'."""
    share = 1.0 if abs(delta) > element[2] else element[4]
    return element[0] * _law(delta, element[2], element[3]) + element[1] * share * rate


@numba.njit(cache=True, inline="always")
def _slopes(t, y, out, p):  # type: ignore[no-untyped-def]
    """Right-hand side of eqs. (1)-(4); y = angles, then velocities."""
    e, de = 0.0, 0.0
    if p.error[0] != 0.0:
        turn = p.error[1] * p.omega
        e, de = p.error[0] * sin(turn * t), p.error[0] * turn * cos(turn * t)
    applied = p.mean[0]
    twice, now, before = 2.0 * cos(p.omega * t), sin(p.omega * t), 0.0
    for j in range(p.torque.size):
        applied += p.torque[j] * now
        now, before = twice * now - before, now  # sin (j + 2) x from sin (j + 1) x and sin j x
    clutch = _force(p.elements[0], y[0] - y[1], y[4] - y[5])
    spline = _force(p.elements[1], y[1] - y[2], y[5] - y[6])
    a, b = p.radii[0], p.radii[1]
    mesh = _force(p.elements[2], a * y[2] - b * y[3] - e, a * y[6] - b * y[7] - de)
    for i in range(4):
        out[i] = y[4 + i]
    out[4] = (applied - p.drag[0] * y[4] - clutch) / p.inertia[0]
    out[5] = (p.mean[1] - p.drag[1] * y[5] + clutch - spline) / p.inertia[1]
    out[6] = (p.mean[2] - p.drag[2] * y[6] + spline - a * mesh) / p.inertia[2]
    out[7] = (p.mean[3] - p.drag[3] * y[7] + b * mesh) / p.inertia[3]


@numba.njit(cache=True)
def march(y, h, steps, p):  # type: ignore[no-untyped-def]
    """March y (8,) over so many steps h, in place."""
    slope, middle = np.empty(8), np.empty(8)
    for n in range(steps):
        _slopes(n * h, y, slope, p)
        for i in range(8):
            middle[i] = y[i] + 0.5 * h * slope[i]
        _slopes((n + 0.5) * h, middle, slope, p)
        for i in range(8):
            y[i] += h * slope[i]


def transmission(model: gr.Model) -> Transmission:
    """Take a case1 ... case3 model apart."""
    names = [inertia.name for inertia in model.inertias]
    mean = -np.array([inertia.drag_torque for inertia in model.inertias])
    torque = np.zeros(5)
    for applied in model.torques:
        mean[names.index(applied.on)] += applied.mean
        for harmonic in applied.harmonics:
            torque[int(harmonic.order) - 1] = harmonic.amplitude
    (mesh,) = model.meshes
    rows = [[c.stiffness, c.damping, c.clearance, c.stiffness_ratio, c.damping_ratio] for c in model.couplings]
    rows.append([mesh.stiffness, mesh.damping, mesh.backlash / 2, 0.0, 0.0])
    errors = [(harmonic.amplitude, harmonic.order) for harmonic in mesh.transmission_error] or [(0.0, 0.0)]
    return Transmission(
        inertia=np.array([inertia.J for inertia in model.inertias]),
        drag=np.array([inertia.drag for inertia in model.inertias]),
        mean=mean,
        torque=torque,
        elements=np.array(rows, dtype=float),
        radii=np.array(mesh.radii),
        error=np.array(errors[0]),
        omega=model.excitation.omega,
    )
