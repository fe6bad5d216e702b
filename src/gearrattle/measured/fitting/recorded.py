"""Residuals of a recorded motion in standard errors: lines of its mean cycle, and levels.

Of a channel with the lines z_k of its measured mean cycle (``validation``: same pairing, same cycles, same bootstrap)
and s_k of the simulated one,

    r = Re(s_k exp(i w_k d) conj(z_k) / |z_k|) - |z_k|,   Im(s_k exp(i w_k d) conj(z_k) / |z_k|),   over sigma_k,

in phase with the measured line and in quadrature; without phases the difference of the sizes, that of the simulated one
raised as noise raises it. Lines of a mean are free of bias by noise, and smooth where the motion is; ``line_choice``
tells which lines count. The rms of a channel, which unknown noise raises, counts where its noise is stated. d is the
delay of the clocks with the least sum of squares, one more value that is fitted; or it is known.

sigma_k^2 adds up the scatter of the measured cycles, what resampling leaves open, the calibration as stated and, of a
simulated motion that does not repeat itself, the scatter of its cycles.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.fitting.covariance import Covariance
from gearrattle.measured.fitting.line_choice import Chosen, of_fitted
from gearrattle.measured.fitting.measured_motion import Complex, Measured, directions
from gearrattle.measured.identification.data_problem import Residual
from gearrattle.measured.validation import cycle_clock, level_agreement, order_agreement
from gearrattle.measured.validation.block_bootstrap import Draws, draws
from gearrattle.measured.validation.cycles import Cycles
from gearrattle.measured.validation.order_agreement import lines_of
from gearrattle.recording import Channel

Array = NDArray[np.float64]

RESAMPLED = 1e-4
"""Of the strongest line of a channel: what resampling leaves open (``signals.conditioning``)."""


@dataclass(frozen=True)
class Motion:
    """The compared values of one motion.

    Attributes
    ----------
    lines
        (K, C) lines 1 to K of the mean cycle of every channel, by the motion's own clock.
    power
        (C,) mean square in the band.
    """

    lines: Complex
    power: Array


@dataclass(frozen=True)
class Recorded(Measured):
    """The measured motion with its standard errors, and its residuals against a simulated one.

    Attributes
    ----------
    channels
        of the C columns, as measured.
    lowest
        end of the band [Hz].
    period
        of the model [s].
    base
        order of the first line.
    noise
        (m,) mean square of the stated noise.
    calibration
        (C,) relative standard uncertainty.
    scatter
        (N,) standard error of every row of the simulated motion; zero of one that repeats itself.
    """

    channels: tuple[Channel, ...]
    cycles: Cycles
    lowest: float
    period: float
    base: float
    chosen: Chosen
    draws: Draws
    noise: Array
    calibration: Array
    scatter: Array | float = 0.0

    def with_scatter_of(self, cycles: Cycles, seed: int) -> Recorded:
        """Return this motion with the scatter of simulated cycles in the standard errors."""
        how = draws(
            level_agreement.mean_squares(cycles), np.random.default_rng(seed), lines=order_agreement.strong(cycles)
        )
        lines = how.means(cycles.amplitudes()[:, self.chosen.line, self.chosen.channel])
        size = how.error(lines.real) ** 2 + how.error(lines.imag) ** 2
        parts = [np.sqrt(0.5 * size)] * (2 if self.chosen.phases else 1)
        squares = np.log(how.weights @ level_agreement.mean_squares(cycles)[:, self.chosen.by_rms])
        return replace(self, scatter=np.concatenate([*parts, 0.5 * how.error(squares)]))

    def without_scatter(self) -> Recorded:
        """Return this motion without the scatter of a simulated one."""
        return replace(self, scatter=0.0)

    def judged_by(self, fitted: Motion) -> Recorded:
        """Return this motion with the lines that are strong in a fitted one (``line_choice``), which repeats itself."""
        lines = lines_of(self.cycles, self.draws)
        omega = 2.0 * np.pi * np.arange(1, len(lines.mean) + 1) / self.period
        there = fitted.lines * np.exp(1j * omega * self.delay(fitted))[:, None]
        strongest = np.abs(self.motion.lines).max(axis=0)
        known = np.hypot(RESAMPLED * strongest, self.calibration * np.abs(lines.mean))
        within = in_band(self.cycles, self.lowest)
        line, channel = of_fitted(lines, there, known, within, phases=self.chosen.phases)
        if not line.size:  # in noise: no better choice than that by both sizes
            return replace(self, scatter=0.0)
        return replace(self, chosen=replace(self.chosen, line=line, channel=channel), scatter=0.0)

    def compares_as(self, other: Recorded) -> bool:
        """Whether another measured motion has the same compared lines and standard errors."""
        same = (self.chosen.line, other.chosen.line), (self.chosen.channel, other.chosen.channel)
        return all(np.array_equal(*pair) for pair in same) and super().compares_as(other)

    @property
    def delays(self) -> int:
        """One where the delay of the clocks is fitted, else none."""
        return int(self.chosen.phases and self.chosen.delay is None)

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the standard errors."""
        return self.draws.freedom

    @property
    def remarks_on_scatter(self) -> list[str]:
        """Return the note that the rms of a channel may be compared as well."""
        if self.chosen.by_rms.size:
            return []
        return [
            "only what is periodic in the motion was compared: state the noise of a channel to have its rms "
            "compared as well (0, if there is none)."
        ]

    @cached_property
    def motion(self) -> Motion:
        """The compared values of the measured motion."""
        return motion_of(self.cycles, self.lowest)

    @cached_property
    def measured(self) -> Complex:
        """(n,) the chosen lines."""
        return self._of(self.motion)

    @cached_property
    def omega(self) -> Array:
        """(n,) their angular frequencies [rad/s]."""
        return np.asarray(2.0 * np.pi * (self.chosen.line + 1) / self.period)

    @cached_property
    def direction(self) -> Complex:
        """(n,) unit vectors along them."""
        return directions(self.measured)

    @cached_property
    def _replicates(self) -> Complex:
        """(R, n) replicates of the chosen lines."""
        return self.draws.means(self.cycles.amplitudes()[:, self.chosen.line, self.chosen.channel])

    @cached_property
    def _deviations(self) -> Array:
        """(R, N) deviations of the measured replicates in every row."""
        turned = (self._replicates - self.measured) * np.conj(self.direction)
        parts = self._in_parts(turned.real, turned.imag)
        power = self.motion.power[self.chosen.by_rms]
        squares = level_agreement.mean_squares(self.cycles)[:, self.chosen.by_rms]
        squares = squares * (power / np.maximum(squares.mean(axis=0), np.finfo(float).tiny))
        by_rms = 0.5 * (self.draws.weights @ squares - power) / (power - self.noise)
        return np.concatenate([*parts, by_rms], axis=1)

    @cached_property
    def _open(self) -> Array:
        """(N,) error of every row by resampling."""
        strongest = np.abs(self.motion.lines).max(axis=0)
        lines = RESAMPLED * strongest[self.chosen.channel]
        return np.concatenate([*self._in_parts(lines, lines), np.full(self.noise.size, RESAMPLED)])

    @cached_property
    def _gains(self) -> Array:
        """(C, N) error of every row by the calibration, a channel each."""
        size = np.abs(self.measured) * self.calibration[self.chosen.channel]
        parts = self._in_parts(size, np.zeros_like(size))
        whole = np.concatenate([*parts, self.calibration[self.chosen.by_rms]])
        return np.where(np.arange(len(self.channels))[:, None] == self._channel_of_row, whole, 0.0)

    @cached_property
    def _channel_of_row(self) -> NDArray[np.int64]:
        return np.concatenate([*self._in_parts(self.chosen.channel, self.chosen.channel), self.chosen.by_rms])

    def _in_parts(self, in_phase: NDArray[Any], in_quadrature: NDArray[Any]) -> list[NDArray[Any]]:
        """Rows of the lines: in phase and, where phases are compared, in quadrature."""
        return [in_phase, in_quadrature] if self.chosen.phases else [in_phase]

    @cached_property
    def errors(self) -> Array:
        """(N,) standard error of every row; both parts of a line have one."""
        square = self.draws.error(self._deviations) ** 2
        n = self.measured.size
        if self.chosen.phases:
            square[:n] = 0.5 * (square[:n] + square[n : 2 * n])
            square[n : 2 * n] = square[:n]
        return np.asarray(np.sqrt(square + self._open**2 + np.sum(self._gains**2, axis=0) + self.scatter**2))

    @cached_property
    def scattered(self) -> Array:
        """(N, N) covariance of the rows in standard errors, by the scatter of whole cycles."""
        away = (self._deviations - self._deviations.mean(axis=0)) / self.errors
        widened = 1.0 / (1.0 - self.draws.block / self.draws.weights.shape[1])
        return np.asarray(widened * away.T @ away / len(away))

    def with_times_scatter(self, times: float) -> Covariance:
        """Return the covariance of the rows in standard errors: scatter, common calibration, resampling."""
        matrix = times * self.scattered + np.diag((self._open / self.errors) ** 2)
        return Covariance.dense(matrix, self._gains / self.errors)

    def _of(self, motion: Motion) -> Complex:
        return np.asarray(motion.lines[self.chosen.line, self.chosen.channel])

    def delay(self, motion: Motion) -> float:
        """Return the delay of the clocks with which a simulated motion has the least sum of squares [s]."""
        if not self.delays:
            return self.chosen.delay or 0.0
        cross = np.zeros(int(self.chosen.line.max(initial=0)) + 1, dtype=np.complex128)
        weight = 1.0 / self.errors[: self.measured.size] ** 2
        np.add.at(cross, self.chosen.line, weight * np.conj(self._of(motion)) * self.measured)
        return cycle_clock.delay_of_largest_sum(cross, self.period).delay if cross.any() else 0.0

    @cached_property
    def _raises(self) -> Array:
        """(n,) noise s in either part of a line: it raises the mean of a size a to (a^2 + s^2)^(1/2), if a > 2 s."""
        return self.draws.error_of_parts(self._replicates)

    def values(self, motion: Motion, delay: float | None = None) -> Array:
        """(N,) of a simulated motion, in the unit of every row; of the best delay of the clocks unless stated."""
        shift = self.delay(motion) if delay is None else delay
        turned = self._of(motion) * np.exp(1j * self.omega * shift) * np.conj(self.direction)
        in_phase = turned.real if self.chosen.phases else np.hypot(np.abs(turned), self._raises)
        power = np.maximum(motion.power[self.chosen.by_rms], np.finfo(float).tiny)
        return np.concatenate([*self._in_parts(in_phase, turned.imag), 0.5 * np.log(power)])

    @cached_property
    def own_values(self) -> Array:
        """(N,) of the measured motion."""
        size = np.abs(self.measured)
        parts = self._in_parts(size, np.zeros_like(size))
        return np.concatenate([*parts, 0.5 * np.log(self.motion.power[self.chosen.by_rms] - self.noise)])

    def records(self, rows: Array, widened: Array | float = 1.0) -> tuple[Residual, ...]:
        """Every datum with its fitted value; residuals of levels are of their logarithms."""
        made = super().records(rows, widened)
        of_levels = len(made) - self.noise.size
        levels = [
            replace(
                one,
                measured=float(np.exp(one.measured)),
                fitted=float(np.exp(one.fitted)),
                standard_error=one.standard_error * float(np.exp(one.measured)),
            )
            for one in made[of_levels:]
        ]
        return (*made[:of_levels], *levels)

    def labels(self) -> list[tuple[str, str]]:
        """(N,) label and unit of every row."""
        names = [
            f"{self.channels[c].name}: order {self.base * (k + 1):.6g}"
            for k, c in zip(self.chosen.line.tolist(), self.chosen.channel.tolist(), strict=True)
        ]
        parts = ("in phase", "in quadrature") if self.chosen.phases else ("amplitude",)
        labels = [f"{name}, {part}" for part in parts for name in names]
        labels += [f"{self.channels[c].name}: rms" for c in self.chosen.by_rms.tolist()]
        return [(label, self.channels[c].unit) for label, c in zip(labels, self._channel_of_row.tolist(), strict=True)]


def motion_of(cycles: Cycles, lowest: float) -> Motion:
    """Return the compared values of cycles, in a band from ``lowest`` [Hz] to the end of theirs."""
    amplitudes = np.fft.rfft(cycles.values.mean(axis=0), axis=0)[1 : cycles.lines().size + 1]
    k = np.arange(1, len(amplitudes) + 1)
    turned = np.exp(-2j * np.pi * k * ((cycles.start / cycles.period) % 1.0))
    lines = amplitudes * (2.0 / cycles.values.shape[1]) * turned[:, None]
    return Motion(lines, power_in(cycles.values, cycles.period, (lowest, float(k.size / cycles.period))))


def power_in(values: Array, period: float, band: tuple[float, float]) -> Array:
    """(C,) mean square of (N, S, C) consecutive cycles in a band [Hz], from the lines of the whole span."""
    whole = values.reshape(-1, values.shape[2])
    lines = np.fft.rfft(whole, axis=0) / len(whole)
    frequency = np.arange(len(lines)) / (len(values) * period)
    inside = (frequency > 0.0) & (frequency >= band[0]) & (frequency <= band[1] * (1.0 + 1e-9))
    return np.asarray(2.0 * np.sum(np.abs(lines[inside]) ** 2, axis=0))


def in_band(cycles: Cycles, lowest: float) -> NDArray[np.bool_]:
    """(K,) whether lines of cycles lie at or above a frequency [Hz]."""
    return np.asarray(cycles.lines() / cycles.period >= lowest)
