"""Orders of a shaft whose speed changes: computed-order resampling, order spectra of blocks, and orders by fitting.

*Resampling* (K. R. Fyfe, E. D. S. Munck 1997, Mech. Syst. Signal Process. 11, 187-205): a signal sampled uniformly in
time is resampled at uniform angles of the shaft, S samples per turn. The angle is the integral of the speed by cubics
through four samples (error of a step: 11/720 dt^5 |d^4 Omega / dt^4|), or is measured; the time of an angle follows
from the cubic Hermite between two samples by Newton's method. Between samples the signal is interpolated by the
windowed sinc of ``conditioning``. Its band is that of the local sampling rate n S (n turns per second), or of the
record's own rate if that is lower:

    orders below 0.4 S pass with an error of 1e-4, orders above 0.5 S are attenuated by 80 dB: there is no aliasing,

provided that n changes little over the length of the kernel, 60 / S turns, and that the frequency is below 0.4 of the
record's sampling rate.

*Order spectra*: of blocks of R turns with a window, scaled so that a line a sin(o theta + phi) at a bin gives
a exp(i phi). The bins are 1/R of an order apart, so orders p/R with an integer p are at bins at every speed.

*Orders by fitting*: over the samples of a block, in time, without resampling, least squares with Hann weights of

    x = m + n theta + sum_o a_o sin(o theta(t) + phi_o)

for all requested orders at once; n is the trend of a signal that changes with the speed. It separates orders that an
order spectrum of the same block cannot separate. The two methods have only the angle in common.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.band_limited_signal import banded
from gearrattle.signals.conditioning import DECIBELS, PASSED, STOPPED
from gearrattle.signals.cross_spectra import cut, groups, taper, transformed

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_HALF_WIDTH = 30.0  # of the kernel, in intervals of the lower rate, as in ``conditioning``
_PER_UNIT = 2048
_NEWTON = 4
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Turned:
    """A signal over the angle of a shaft.

    Attributes
    ----------
    values
        (M,) at uniform angles.
    angle
        of the first value [rad].
    time
        (M,) times of these angles [s].
    speed
        (M,) speed of the shaft at these times [rad/s].
    """

    values: Array
    angle: float
    per_turn: int
    time: Array
    speed: Array


@dataclass(frozen=True)
class Orders:
    """Amplitudes of orders, block by block.

    Attributes
    ----------
    order
        (o,) multiples of the shaft's speed.
    amplitude
        (b, o) complex: modulus in the unit of the signal, argument the phase of a sine of the angle.
    time
        (b,) mean time of each block, weighted by its window [s].
    speed
        (b,) mean speed with the same weights [rad/s].
    """

    order: Array
    amplitude: Complex
    time: Array
    speed: Array
    turns: float


def angle_of(speed: Array, interval: float) -> Array:
    """Return (N,) the angle [rad] that a shaft has turned since the first sample.

    Parameters
    ----------
    speed
        (N,) uniform samples [rad/s], N >= 4.
    interval
        between them [s].
    """
    steps = np.empty(speed.size)
    steps[0] = 0.0
    steps[1] = (9.0 * speed[0] + 19.0 * speed[1] - 5.0 * speed[2] + speed[3]) / 24.0
    steps[-1] = (9.0 * speed[-1] + 19.0 * speed[-2] - 5.0 * speed[-3] + speed[-4]) / 24.0
    steps[2:-1] = (13.0 * (speed[1:-2] + speed[2:-1]) - speed[:-3] - speed[3:]) / 24.0
    np.cumsum(steps, out=steps)
    steps *= interval
    return steps


def when_at(wanted: Array, angle: Array, speed: Array, interval: float) -> tuple[Array, Array]:
    """Return the times of given shaft angles [samples after the first] and the speeds there [rad/s].

    Parameters
    ----------
    wanted
        (M,) ascending, within the record [rad].
    angle
        (N,) ascending [rad].
    speed
        (N,) its derivative, positive [rad/s].
    interval
        between samples [s].
    """
    below = np.clip(np.searchsorted(angle, wanted, side="right") - 1, 0, angle.size - 2)
    start = angle[below]
    rise = angle[below + 1] - angle[below]
    left = speed[below] * interval
    right = speed[below + 1] * interval
    square = 3.0 * rise - 2.0 * left - right
    cube = left + right - 2.0 * rise
    part = (wanted - start) / rise
    for _ in range(_NEWTON):
        value = part * (left + part * (square + part * cube)) - (wanted - start)
        slope = left + part * (2.0 * square + 3.0 * part * cube)
        part = np.clip(part - value / np.where(slope > 0.0, slope, np.inf), 0.0, 1.0)
    slope = left + part * (2.0 * square + 3.0 * part * cube)
    return below + part, slope / interval


def turned(values: Array, interval: float, angle: Array, speed: Array, per_turn: int) -> Turned:
    """Return a signal at uniform angles, from the first to the last multiple of the angle step in the record.

    Parameters
    ----------
    values
        (N,) uniform samples.
    interval
        between them [s].
    angle
        (N,) of the shaft, ascending [rad].
    speed
        (N,) of the shaft, positive [rad/s].
    """
    step = TURN / per_turn
    first = int(np.ceil(angle[0] / step - 1e-9))
    last = int(np.floor(angle[-1] / step + 1e-9))
    wanted = np.clip(step * np.arange(first, last + 1), angle[0], angle[-1])
    position, speed_there = when_at(wanted, angle, speed, interval)
    width = np.maximum(TURN / (speed_there * per_turn * interval), 1.0)
    resampled = banded(np.ascontiguousarray(values, np.float64), position, width, _kernel(), float(_PER_UNIT))
    return Turned(resampled, float(wanted[0]), per_turn, interval * position, speed_there)


def _kernel() -> Array:
    """Return the kernel of ``conditioning.resample`` at multiples of 1/2048 interval, followed by a zero."""
    from scipy.special import i0

    distance = np.arange(int(_HALF_WIDTH) * _PER_UNIT + 2) / _PER_UNIT
    beta = 0.1102 * (DECIBELS + 6.0 - 8.7)
    window = i0(beta * np.sqrt(np.clip(1.0 - (distance / _HALF_WIDTH) ** 2, 0.0, None))) * (distance < _HALF_WIDTH)
    return np.asarray(np.sinc((PASSED + STOPPED) * distance) * window, dtype=np.float64)


def order_spectra(signal: Turned, turns: int, overlap: float, window: str, highest: float) -> Orders:
    """Return the order spectrum of every block of ``turns`` turns.

    Parameters
    ----------
    signal
        at least ``turns`` turns long.
    overlap
        fraction of a block that the next one shares, 0 <= overlap < 1.
    """
    length = turns * signal.per_turn
    blocks = cut(signal.values.size, length, overlap, window)
    order = np.arange(length // 2 + 1) / turns
    kept = int(np.searchsorted(order, highest * (1.0 + 1e-12), side="right"))
    order = order[:kept]
    amplitude = np.empty((blocks.count, kept), np.complex128)
    begin = 0
    for group in groups(signal.values, blocks):
        amplitude[begin : begin + len(group)] = transformed(group, blocks)[:, :kept]
        begin += len(group)
    amplitude *= 2.0j / blocks.window.sum()  # of a sine: exp(i phi) a L / (2 i)
    start = signal.angle + TURN / signal.per_turn * blocks.step * np.arange(blocks.count)
    amplitude *= np.exp(-1j * np.outer(start, order))
    amplitude[:, 0] = [row.mean() for group in groups(signal.values, blocks) for row in group]
    weights = taper("hann", length) / length * 2.0
    time = np.concatenate([group @ weights for group in groups(signal.time, blocks)])
    speed = np.concatenate([group @ weights for group in groups(signal.speed, blocks)])
    return Orders(order, amplitude, time, speed, float(turns))


def fitted_orders(
    values: Array, interval: float, angle: Array, speed: Array, *, orders: Array, turns: float, overlap: float
) -> Orders:
    """Return the amplitudes of given orders in every block, by least squares in time.

    Parameters
    ----------
    values
        (N,) uniform samples.
    interval
        between them [s].
    angle
        (N,) of the shaft, ascending, over more than ``turns`` turns [rad].
    speed
        (N,) of the shaft [rad/s].
    orders
        (o,) positive and distinct.
    turns
        per block; orders closer than about 1 / turns cannot be separated.
    overlap
        fraction of a block that the next one shares, 0 <= overlap < 1.
    """
    span = TURN * turns
    step = span * (1.0 - overlap)
    count = 1 + int(np.floor((angle[-1] - angle[0] - span) / step + 1e-9))
    starts = angle[0] + step * np.arange(count)
    blocks = orders_of_blocks(values[:, None], interval, (angle, speed), orders=orders, turns=turns, starts=starts)
    return replace(blocks, amplitude=blocks.amplitude[:, :, 0])


def orders_of_blocks(
    values: Array, interval: float, shaft: tuple[Array, Array], *, orders: Array, turns: float, starts: Array
) -> Orders:
    """Return the amplitudes (b, o, C) of orders of C signals in blocks that begin at shaft angles, as fitted_orders.

    Parameters
    ----------
    values
        (N, C) uniform samples.
    interval
        between them [s].
    shaft
        (N,) its angle, ascending [rad], and its speed [rad/s].
    orders
        (o,) positive and distinct.
    starts
        (b,) angles at which blocks begin [rad].
    """
    # samples of every block
    angle, speed = shaft
    span = TURN * turns
    firsts = np.searchsorted(angle, starts - 1e-9)
    ends = np.searchsorted(angle, starts + span + 1e-9, side="right")
    amplitude = np.empty((starts.size, orders.size, values.shape[1]), np.complex128)
    time = np.empty(starts.size)
    mean = np.empty(starts.size)
    for k, (first, end) in enumerate(zip(firsts.tolist(), ends.tolist(), strict=True)):
        # the Hann window over the angle, and the weight of a sample: the angle to the next one
        theta = angle[first:end]
        share = (theta - starts[k]) / span
        root = np.sin(np.clip(share, 0.0, 1.0) * np.pi) * np.sqrt(speed[first:end])
        # least squares for the mean, the trend and all orders at once
        phase = np.multiply.outer(theta, orders)
        level = np.column_stack([np.ones_like(share), share - 0.5])
        columns = np.concatenate([level, np.sin(phase), np.cos(phase)], axis=1) * root[:, None]
        moments = columns.T @ (values[first:end] * root[:, None])
        coefficients = np.linalg.lstsq(columns.T @ columns, moments, rcond=None)[0][2:]
        amplitude[k] = coefficients[: orders.size] + 1j * coefficients[orders.size :]
        # where the block lies in time and speed
        weight = root**2 / np.sum(root**2)
        time[k] = interval * (first + weight @ np.arange(theta.size))
        mean[k] = weight @ speed[first:end]
    return Orders(np.asarray(orders, np.float64), amplitude, time, mean, turns)


def speed_of(angle: Array, interval: float) -> Array:
    """Return (N,) the speed of a shaft [rad/s] from its angle (N,) [rad]: differences of fourth order, N >= 5."""
    speed = np.gradient(angle, interval)
    speed[2:-2] = (8.0 * (angle[3:-1] - angle[1:-3]) - (angle[4:] - angle[:-4])) / (12.0 * interval)
    return np.asarray(speed, dtype=np.float64)
