"""Amplitude and phase of every order line of the mean cycle, measured against simulated, with standard errors.

The mean cycle is the synchronous average; its lines are the orders. Standard errors come from replicates of the mean:
their deviations along and across the line's own direction, so that a small line is not biased. Phases are compared on
one clock; a replicate sets its own, so the clock's uncertainty is in the standard errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.validation.block_bootstrap import Draws, factor
from gearrattle.measured.validation.cycle_clock import Complex, step
from gearrattle.measured.validation.cycles import Cycles
from gearrattle.measured.validation.validation_records import Order
from gearrattle.trajectory import Array

MOST = 12
"""Number of orders reported per channel: the strongest."""
_PRESENT = 3.0  # least amplitude of a line that counts as present, in standard errors
_STRONG = 3
_SMALL = 0.01  # least amplitude of a line that counts, as a share of the strongest line
_ROUNDING = 1e-9  # share of the strongest line: a smaller line is rounding


@dataclass(frozen=True)
class Lines:
    """Lines 1 to K of all channels, on the model's clock.

    Attributes
    ----------
    mean
        (K, C) of the mean cycle.
    replicates
        (R, K, C) of its replicates.
    """

    mean: Complex
    replicates: Complex
    draws: Draws

    def along(self) -> Array:
        """(R, K, C) deviations of the amplitude."""
        return np.asarray(self._turned().real)

    def across(self) -> Array:
        """(R, K, C) deviations of the phase [rad]."""
        size = np.abs(self.mean)
        return np.asarray(self._turned().imag / np.where(size > 0.0, size, np.inf))

    def _turned(self) -> Complex:
        """Deviations in the direction of each line."""
        size = np.abs(self.mean)
        direction = np.where(size > 0.0, self.mean / np.where(size > 0.0, size, 1.0), 1.0)
        return np.asarray((self.replicates - self.mean) * np.conj(direction))


def strong(cycles: Cycles) -> Array:
    """(N, L) size of the three strongest lines of every channel in every cycle, along their mean direction."""
    amplitudes = cycles.amplitudes()
    mean = amplitudes.mean(axis=0)
    in_phase = []
    for c in range(mean.shape[1]):
        k = np.argsort(-np.abs(mean[:, c]), kind="stable")[:_STRONG]
        in_phase.append((amplitudes[:, k, c] * np.exp(-1j * np.angle(mean[k, c]))).real)
    return np.concatenate(in_phase, axis=1)


def lines_of(cycles: Cycles, drawn: Draws) -> Lines:
    """Return the lines of a record by its own clock."""
    amplitudes = cycles.amplitudes()
    return Lines(amplitudes.mean(axis=0), drawn.means(amplitudes), drawn)


def delays(
    simulated: Lines, measured: Lines, channel: int, used: NDArray[np.bool_], timing: tuple[float, float]
) -> Array:
    """(R,) delay of every replicate [s].

    Parameters
    ----------
    simulated, measured
        each by its own clock.
    used
        (K,) which of its lines do.
    timing
        the delay of the means and the period [s].
    """
    cross = np.conj(simulated.replicates[:, :, channel]) * measured.replicates[:, :, channel]
    delay, period = timing
    return delay + step(np.asarray(np.where(used, cross, 0.0)), delay, period)


def moved(lines: Lines, delay: float, own: Array, period: float) -> Lines:
    """Return lines on a clock that is ``delay`` later, each replicate by its ``own`` (R,) delay [s]."""
    w = 2.0 * np.pi * np.arange(1, len(lines.mean) + 1) / period
    mean = lines.mean * np.exp(-1j * w * delay)[:, None]
    return Lines(mean, lines.replicates * np.exp(-1j * np.multiply.outer(own, w))[:, :, None], lines.draws)


def strongest(
    sizes: tuple[Array, Array], errors: tuple[Array, Array]
) -> tuple[list[int], tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
    """Return the indices of the lines that are compared, ascending, and which lines stand out of their scatter.

    Parameters
    ----------
    sizes
        (K,) of the lines of a channel, measured and simulated.
    errors
        (K,) their standard errors.
    """
    floor = _ROUNDING * max(float(size.max(initial=0.0)) for size in sizes)
    first, second = (size > _PRESENT * error + floor for size, error in zip(sizes, errors, strict=True))
    larger = np.maximum(np.where(first, sizes[0], 0.0), np.where(second, sizes[1], 0.0))
    most = np.argsort(-larger, kind="stable")[:MOST]
    return sorted(k for k in most.tolist() if larger[k] > _SMALL * float(larger.max(initial=0.0))), (first, second)


def compare_orders(measured: Lines, simulated: Lines, base: float, frequency: float) -> list[tuple[Order, ...]]:
    """Return the strongest orders of every channel, ascending.

    Parameters
    ----------
    measured, simulated
        on one clock.
    base
        order of the first line.
    frequency
        of it [Hz].
    """
    # standard errors of the lines, along and across their direction, and their intervals
    errors = measured.draws.error(measured.along()), simulated.draws.error(simulated.along())
    turned = measured.draws.error(measured.across()), simulated.draws.error(simulated.across())
    freedoms = measured.draws.freedom, simulated.draws.freedom
    reach = factor(errors, freedoms) * np.hypot(*errors)
    together = _joint(measured, simulated)
    spread = factor(turned, freedoms) * together
    compared = []
    for c in range(measured.mean.shape[1]):
        # strongest lines of the channel
        one = np.abs(measured.mean[:, c])
        other = np.abs(simulated.mean[:, c])
        chosen, there = strongest((one, other), (errors[0][:, c], errors[1][:, c]))
        rows = []
        # relative error of the amplitude, and its interval
        for k in chosen:
            a = float(one[k])
            b = float(other[k])
            far = float(reach[k, c])
            ratio = 100.0 / a if there[0][k] else float("nan")
            # phase on one clock; open where an amplitude is lost in its scatter
            phase = float(np.angle(measured.mean[k, c] * np.conj(simulated.mean[k, c]), deg=True))
            both = there[0][k] and there[1][k]
            phase, error, wide = (
                value if both else float("nan")
                for value in (phase, *(float(np.degrees(angles[k, c])) for angles in (together, spread)))
            )
            rows.append(
                Order(
                    order=base * (k + 1),
                    frequency=frequency * (k + 1),
                    measured=a,
                    measured_error=float(errors[0][k, c]),
                    simulated=b,
                    simulated_error=float(errors[1][k, c]),
                    sigma=ratio * (a - b),
                    low=ratio * (a - b - far),
                    high=ratio * (a - b + far),
                    phase=phase,
                    phase_error=error,
                    phase_low=phase - wide,
                    phase_high=phase + wide,
                )
            )
        compared.append(tuple(rows))
    return compared


def _joint(measured: Lines, simulated: Lines) -> Array:
    """(K, C) standard error of the difference of phases: its replicates share their clock [rad]."""
    widened = [1.0 / np.sqrt(1.0 - side.draws.block / side.draws.weights.shape[1]) for side in (measured, simulated)]
    return np.asarray(max(widened) * np.std(measured.across() - simulated.across(), axis=0))
