"""Amplitude and phase at given orders of the reference speed, by least squares over whole periods.

x(t) = x_0 + sum_j a_j sin(o_j Omega t + phi_j), fitted to all orders at once. Over whole common periods the columns
are orthogonal and this *is* the discrete Fourier transform at those lines, exact for every line below half the
sampling rate; where the orders have no common period it still separates them.

Takes plain arrays; gives complex amplitudes c_j = a_j exp(i phi_j) to the criteria and reports.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array


def resolved(orders: Array, omega: float, spacing: float) -> NDArray[np.bool_]:
    """Return which orders lie strictly between zero and half the sampling rate.

    Args:
        orders: (o,) multiples of omega.
        omega: reference speed [rad/s].
        spacing: time between two samples [s].
    """
    phase_step = np.asarray(orders) * omega * spacing
    return np.asarray((phase_step > 0.0) & (phase_step < np.pi * (1.0 - 1e-9)), dtype=np.bool_)


def harmonics(signal: Array, time: Array, omega: float, orders: Array, *, trend: int = 0) -> NDArray[np.complex128]:
    """Return the complex amplitudes of a signal at the given orders, by least squares.

    Args:
        signal: (N,) or (N, n) samples over whole periods, each phase once.
        time: (N,) uniform sample times [s]; the phases refer to time zero.
        omega: reference speed [rad/s].
        orders: (o,) distinct multiples of omega.
        trend: degree of a polynomial of time that is fitted beside them: 0, the mean; 1, a drift.

    Returns:
        (o,) or (o, n); modulus in the unit of the signal, argument the phase of a sine. NaN at orders that the
        samples cannot show (see ``resolved``) and at all orders where there are fewer samples than unknowns.
    """
    orders = np.asarray(orders, dtype=np.float64)
    result = np.full((orders.size, *signal.shape[1:]), np.nan + 0j, dtype=np.complex128)
    if time.size < 2:
        return result
    shown = resolved(orders, omega, (time[-1] - time[0]) / (time.size - 1))
    if not shown.any() or time.size < 2 * np.count_nonzero(shown) + 1 + trend:
        return result
    along = np.linspace(-1.0, 1.0, time.size)
    drifts = [along[:, None] ** power for power in range(1, trend + 1)]
    weights = np.linalg.lstsq(np.hstack([*drifts, _columns(time, omega, orders[shown])]), signal, rcond=None)[0]
    sines, cosines = np.split(weights[1 + trend :], 2)
    result[shown] = sines + 1j * cosines
    return result


def order_sums(signal: Array, time: Array, omega: float, orders: Array) -> tuple[Array, Array]:
    """Return the two sums the same least squares rest on; those of consecutive samples add up.

    Args:
        signal: (N, n) samples.
        time: (N,) their times [s].
        omega: reference speed [rad/s].
        orders: (o,) orders that the samples can show (see ``resolved``).

    Returns:
        gram: (2 o + 1, 2 o + 1) products of 1, sines and cosines with each other.
        moments: (2 o + 1, n) their products with the signal.
    """
    columns = _columns(time, omega, np.asarray(orders, dtype=np.float64))
    return columns.T @ columns, columns.T @ signal


def amplitudes_from(gram: Array, moments: Array) -> NDArray[np.complex128]:
    """Return (o, n) the complex amplitudes from ``order_sums``; NaN where there are fewer samples than unknowns."""
    if gram[0, 0] < len(gram):  # the first entry counts the samples
        return np.full((len(gram) // 2, moments.shape[1]), np.nan + 0j)
    sines, cosines = np.split(np.linalg.lstsq(gram, moments, rcond=None)[0][1:], 2)
    return np.asarray(sines + 1j * cosines, dtype=np.complex128)


def _columns(time: Array, omega: float, orders: Array) -> Array:
    """Return (N, 2 o + 1): ones, sines, cosines."""
    angle = omega * np.multiply.outer(time, orders)
    return np.concatenate([np.ones((time.size, 1)), np.sin(angle), np.cos(angle)], axis=1)
