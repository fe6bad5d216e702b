"""The yardstick: the paper's RK2 (explicit midpoint) on the four-inertia transmission, as fast as we can write it.

Eqs. (1)-(10) of Padmanabhan, Barlow, Rook, Singh (ASME J. Mech. Des. 117 (1995) 185) for this one model: absolute
angles, no event handling. State and slopes are scalars, so that nothing is stored between steps; inertias are divided
out beforehand; sines are turned on by products, made anew every 64 steps; a stage sums five orders by Clenshaw's rule.
The compiler may reorder and contract sums (fastmath). It shares nothing with the package. ``march_4`` is the classical
fourth order in the same form.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any, NamedTuple

import numba
import numpy as np

import gearrattle as gr

_AGAIN = 64  # steps after which sines are made anew


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


@numba.njit(inline="always")
def _force(delta, rate, law):  # type: ignore[no-untyped-def]
    """Eqs. (5)-(7) and (9): K f(delta) + C g(delta) delta'; law = K, C, b, alpha, beta, K (1 - alpha) b."""
    if delta > law[2]:
        return law[0] * delta - law[5] + law[1] * rate
    if delta < -law[2]:
        return law[0] * delta + law[5] + law[1] * rate
    return law[0] * law[3] * delta + law[1] * law[4] * rate


@numba.njit(inline="always")
def _slopes(x, v, wave, q):  # type: ignore[no-untyped-def]
    """Accelerations by eqs. (1)-(4).

    x, v: four angles and velocities; wave: sine and cosine of the excitation, e and e'; q: ``_constants``.
    """
    clutch = _force(x[0] - x[1], v[0] - v[1], q[0])
    spline = _force(x[1] - x[2], v[1] - v[2], q[1])
    mesh = _force(q[6][0] * x[2] - q[6][1] * x[3] - wave[2], q[6][0] * v[2] - q[6][1] * v[3] - wave[3], q[2])
    twice = 2.0 * wave[1]
    b4 = q[5][3] + twice * q[5][4]
    b3 = q[5][2] + twice * b4 - q[5][4]
    b2 = q[5][1] + twice * b3 - b4
    applied = wave[0] * (q[5][0] + twice * b2 - b3)
    inverse = q[3]
    drag = q[4]
    mean = q[7]
    return (
        applied + mean[0] - drag[0] * v[0] - clutch * inverse[0],
        mean[1] - drag[1] * v[1] + (clutch - spline) * inverse[1],
        mean[2] - drag[2] * v[2] + (spline - q[6][0] * mesh) * inverse[2],
        mean[3] - drag[3] * v[3] + q[6][1] * mesh * inverse[3],
    )


@numba.njit(inline="always")
def _constants(p):  # type: ignore[no-untyped-def]
    """Everything a stage needs: three laws, 1/J, drag/J, amplitudes/J, radii, means/J."""
    one = 1.0 / p.inertia
    e = p.elements
    return (
        (e[0, 0], e[0, 1], e[0, 2], e[0, 3], e[0, 4], e[0, 0] * (1.0 - e[0, 3]) * e[0, 2]),
        (e[1, 0], e[1, 1], e[1, 2], e[1, 3], e[1, 4], e[1, 0] * (1.0 - e[1, 3]) * e[1, 2]),
        (e[2, 0], e[2, 1], e[2, 2], e[2, 3], e[2, 4], e[2, 0] * (1.0 - e[2, 3]) * e[2, 2]),
        (one[0], one[1], one[2], one[3]),
        (p.drag[0] * one[0], p.drag[1] * one[1], p.drag[2] * one[2], p.drag[3] * one[3]),
        (p.torque[0] * one[0], p.torque[1] * one[0], p.torque[2] * one[0], p.torque[3] * one[0], p.torque[4] * one[0]),
        (p.radii[0], p.radii[1]),
        (p.mean[0] * one[0], p.mean[1] * one[1], p.mean[2] * one[2], p.mean[3] * one[3]),
    )


@numba.njit(inline="always")
def _phases(t, p):  # type: ignore[no-untyped-def]
    """Sines and cosines of the excitation and of the transmission error."""
    slow, fast = p.omega * t, p.error[1] * p.omega * t
    return sin(slow), cos(slow), sin(fast), cos(fast)


@numba.njit(inline="always")
def _turned(phase, by):  # type: ignore[no-untyped-def]
    """The same, half a step later."""
    return (
        phase[0] * by[1] + phase[1] * by[0],
        phase[1] * by[1] - phase[0] * by[0],
        phase[2] * by[3] + phase[3] * by[2],
        phase[3] * by[3] - phase[2] * by[2],
    )


@numba.njit(inline="always")
def _wave(phase, amplitude, rate):  # type: ignore[no-untyped-def]
    return phase[0], phase[1], amplitude * phase[2], rate * phase[3]


@numba.njit(inline="always")
def _on(x, h, v):  # type: ignore[no-untyped-def]
    """x + h v of four."""
    return x[0] + h * v[0], x[1] + h * v[1], x[2] + h * v[2], x[3] + h * v[3]


@numba.njit(inline="always")
def _mean_of_four(a, b, c, d):  # type: ignore[no-untyped-def]
    """(a + 2 b + 2 c + d) / 6 of four."""
    return (
        (a[0] + 2.0 * (b[0] + c[0]) + d[0]) / 6.0,
        (a[1] + 2.0 * (b[1] + c[1]) + d[1]) / 6.0,
        (a[2] + 2.0 * (b[2] + c[2]) + d[2]) / 6.0,
        (a[3] + 2.0 * (b[3] + c[3]) + d[3]) / 6.0,
    )


@numba.njit(cache=True, fastmath=True)
def march(y, h, steps, p):  # type: ignore[no-untyped-def]
    """March y (8,), four angles and four velocities, over so many steps h, in place."""
    x, v = (y[0], y[1], y[2], y[3]), (y[4], y[5], y[6], y[7])
    q = _constants(p)
    half = 0.5 * h
    by = _phases(0.5 * h, p)
    amplitude, rate = p.error[0], p.error[0] * p.error[1] * p.omega
    phase = _phases(0.0, p)
    for n in range(steps):
        if n % _AGAIN == 0:
            phase = _phases(n * h, p)
        middle_v = _on(v, half, _slopes(x, v, _wave(phase, amplitude, rate), q))
        middle_x = _on(x, half, v)
        phase = _turned(phase, by)
        v = _on(v, h, _slopes(middle_x, middle_v, _wave(phase, amplitude, rate), q))
        x = _on(x, h, middle_v)
        phase = _turned(phase, by)
    for i in range(4):
        y[i], y[4 + i] = x[i], v[i]


@numba.njit(cache=True, fastmath=True)
def march_4(y, h, steps, p):  # type: ignore[no-untyped-def]
    """The same by the classical fourth order."""
    x, v = (y[0], y[1], y[2], y[3]), (y[4], y[5], y[6], y[7])
    q = _constants(p)
    half = 0.5 * h
    by = _phases(0.5 * h, p)
    amplitude, rate = p.error[0], p.error[0] * p.error[1] * p.omega
    phase = _phases(0.0, p)
    for n in range(steps):
        if n % _AGAIN == 0:
            phase = _phases(n * h, p)
        a_1 = _slopes(x, v, _wave(phase, amplitude, rate), q)
        phase = _turned(phase, by)
        wave, v_2 = _wave(phase, amplitude, rate), _on(v, half, a_1)
        a_2 = _slopes(_on(x, half, v), v_2, wave, q)
        v_3 = _on(v, half, a_2)
        a_3 = _slopes(_on(x, half, v_2), v_3, wave, q)
        v_4 = _on(v, h, a_3)
        phase = _turned(phase, by)
        a_4 = _slopes(_on(x, h, v_3), v_4, _wave(phase, amplitude, rate), q)
        x = _on(x, h, _mean_of_four(v, v_2, v_3, v_4))
        v = _on(v, h, _mean_of_four(a_1, a_2, a_3, a_4))
    for i in range(4):
        y[i], y[4 + i] = x[i], v[i]


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
