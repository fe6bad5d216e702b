"""Amplitude and phase at given orders of the reference speed, by least squares over whole periods.

x(t) = x_0 + sum_j a_j sin(o_j Omega t + phi_j), fitted to all orders at once. Over whole common periods the columns
are orthogonal and this *is* the discrete Fourier transform at those lines, exact for every line below half the
sampling rate; where the orders have no common period it still separates them.

The complex amplitudes are c_j = a_j exp(i phi_j).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array

_WHOLE = 1e-12  # of the turns in a period: as much is rounding


def resolved(orders: Array, omega: float, spacing: float) -> NDArray[np.bool_]:
    """Return the mask of orders strictly between zero and half the sampling rate.

    Parameters
    ----------
    orders
        (o,) multiples of omega.
    omega
        reference speed [rad/s].
    spacing
        time between two samples [s].
    """
    phase_step = np.asarray(orders) * omega * spacing
    return np.asarray((phase_step > 0.0) & (phase_step < np.pi * (1.0 - 1e-9)), dtype=np.bool_)


def harmonics(signal: Array, time: Array, omega: float, orders: Array, *, trend: int = 0) -> NDArray[np.complex128]:
    """Return the complex amplitudes of a signal at the given orders, by least squares.

    Parameters
    ----------
    signal
        (N,) or (N, n) samples over whole periods, each phase once.
    time
        (N,) uniform sample times [s]; the phases refer to time zero.
    omega
        reference speed [rad/s].
    orders
        (o,) distinct multiples of omega.
    trend
        degree of a polynomial of time that is fitted beside them: 0, the mean; 1, a drift.

    Returns
    -------
    NDArray[np.complex128]
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
    weights = np.linalg.lstsq(
        np.hstack([*drifts, _columns(omega * np.multiply.outer(time, orders[shown]))]), signal, rcond=None
    )[0]
    sines, cosines = np.split(weights[1 + trend :], 2)
    result[shown] = sines + 1j * cosines
    return result


def order_sums(signal: Array, time: Array, omega: float, orders: Array, *, periods: int = 1) -> tuple[Array, Array]:
    """Return the two sums of the least squares of ``harmonics``; those of consecutive samples add up.

    Where every order turns whole times in a period, sines and cosines repeat: samples of equal phase are added first.

    Parameters
    ----------
    signal
        (N, n) samples.
    time
        (N,) their times [s].
    omega
        reference speed [rad/s].
    orders
        (o,) orders that the samples can show (see ``resolved``).
    periods
        in how many equal parts the samples may be cut, of which each is a period or not.

    Returns
    -------
    tuple[Array, Array]
        gram: (2 o + 1, 2 o + 1) products of 1, sines and cosines with each other.
        moments: (2 o + 1, n) their products with the signal.
    """
    orders = np.asarray(orders, dtype=np.float64)
    angle = repeating_angles(time, omega, orders, periods)
    if angle is None:
        columns = _columns(omega * np.multiply.outer(time, orders))
        return columns.T @ columns, columns.T @ signal
    columns = _columns(angle)
    folded = signal.reshape(periods, len(angle), -1).sum(axis=0)
    return periods * (columns.T @ columns), columns.T @ folded


def repeating_angles(time: Array, omega: float, orders: Array, periods: int) -> Array | None:
    """Return (N / periods, o) angles of the orders in each of some equal parts of the samples; None: they differ.

    Whole turns are left out before they could round anything.

    Parameters
    ----------
    time
        (N,) uniform sample times [s].
    omega
        reference speed [rad/s].
    orders
        (o,) multiples of omega.
    """
    length = time.size // max(periods, 1)
    if length < 2 or length * periods != time.size:
        return None
    period = float(time[-1] - time[0]) * (length / (time.size - 1))
    turns = orders * omega * period / (2.0 * np.pi)
    whole = np.rint(turns)
    if np.any(np.abs(turns - whole) > _WHOLE * np.maximum(1.0, turns)):
        return None
    begun = float(time[0]) / period
    before = 0.0 if abs(begun - round(begun)) <= _WHOLE * max(1.0, abs(begun)) else begun - np.floor(begun)
    parts = np.remainder(np.multiply.outer(np.arange(length), whole), length) / length
    return np.asarray(2.0 * np.pi * (parts + np.remainder(whole * before, 1.0)))


def amplitudes_from(gram: Array, moments: Array) -> NDArray[np.complex128]:
    """Return (o, n) the complex amplitudes from ``order_sums``; NaN where there are fewer samples than unknowns."""
    if gram[0, 0] < len(gram):  # the first entry counts the samples
        return np.full((len(gram) // 2, moments.shape[1]), np.nan + 0j)
    sines, cosines = np.split(np.linalg.lstsq(gram, moments, rcond=None)[0][1:], 2)
    return np.asarray(sines + 1j * cosines, dtype=np.complex128)


def _columns(angle: Array) -> Array:
    """Return (N, 2 o + 1): ones, sines, cosines of angles (N, o)."""
    return np.concatenate([np.ones((len(angle), 1)), np.sin(angle), np.cos(angle)], axis=1)
