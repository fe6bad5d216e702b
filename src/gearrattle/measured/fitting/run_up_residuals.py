"""Residuals of a recorded run-up in standard errors: amplitude and phase of every order over speed.

A change of speed has no period. A measured and a simulated run-up have in common the orders of the shaft at every
speed: complex amplitudes z of blocks of turns that overlap by half (``signals.order_tracking``). The simulated ones, s,
are fitted over blocks that have the measured mean speeds. Of every channel, order and block

    r = Re(s exp(i o phi) conj(z) / |z|) - |z|,   Im(s exp(i o phi) conj(z) / |z|),   over sigma,

phi the angle between the zeros of both shafts, one value a record that is fitted as well; without phases the sizes.

Standard errors come from the scatter between blocks. The part of e = z - s exp(i o phi) that is smooth over the blocks
is an error of the model; the second difference of neighbours leaves the noise. Blocks that overlap by half share, with
Hann's weights, a sixth of their noise, so that

    E |e_(b-1) - 2 e_b + e_(b+1)|^2 = (6 - 8 / 6) E |e_b|^2.

It is averaged over neighbouring blocks, with all channels and orders together, as they are disturbed together. Where a
run-up was repeated, intervals come from the repeats alone: of R records with residuals r_k the covariance of the
parameters is G sum(r_k r_k') G' R / (R - 1) (K.-Y. Liang, S. L. Zeger 1986, Biometrika 73, 13-22), with Student's t.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.fitting.angle_offset import angle_offset
from gearrattle.measured.fitting.covariance import Covariance, widening
from gearrattle.measured.fitting.measured_motion import Complex, Measured, directions
from gearrattle.measured.order_over_speed import Track
from gearrattle.recording import Channel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SHARED = 1.0 / 6.0
"""Of the noise of a block, that the next one has as well."""
_WINDOW = 24  # blocks over which the scatter is averaged
_LEAST = 1e-4  # of the largest amplitude of a channel: error of blocks at two samplings
_INDEPENDENT = 0.9  # degrees of freedom of the mean square of overlapping complex second differences, a difference
TWO_SIDED = 1.96
"""Standard errors to either side that hold 95 %."""
_DRIFT = 0.1  # rad at the highest order
_SURE = 4.0  # standard errors


@dataclass(frozen=True)
class MeasuredRunUp(Measured):
    """Measured orders over speed with their standard errors, and their residuals against simulated ones.

    Attributes
    ----------
    channel, order
        (m,) index of the channel, and order, of every column.
    record
        (B,) index of the record of every block, ascending.
    speed
        (B,) mean speed of every block, ascending in a record [rad/s].
    amplitude
        (B, m) measured.
    phases
        whether phases are compared, or sizes alone.
    calibration
        (C,) relative standard uncertainty of every channel.
    noise
        (B, m, m) covariance of every block.
    simulated_noise
        (B, m, m) of the simulated blocks; zero of a motion without scatter.
    misfit
        (B, m) measured less fitted, of sizes without phases; None before there is a fit.
    """

    channels: tuple[Channel, ...]
    channel: Indices
    order: Array
    record: Indices
    speed: Array
    amplitude: Complex
    phases: bool
    fits_angle: bool
    calibration: Array
    per_minute: bool
    noise: Complex
    simulated_noise: Complex
    misfit: Complex | Array | None = None

    @cached_property
    def _records(self) -> list[slice]:
        """Blocks of every record."""
        ends = np.searchsorted(self.record, np.arange(self.record[-1] + 2))
        return [slice(a, b) for a, b in pairwise(ends.tolist())]

    def judged_by(self, fitted: Complex) -> MeasuredRunUp:
        """Return this run-up with standard errors from the residuals of a fitted motion."""
        misfit = self.amplitude - self._turned(fitted) if self.phases else np.abs(self.amplitude) - self._raised(fitted)
        return replace(self, noise=self.noise_of(misfit), misfit=misfit)

    def with_scatter_of(self, samples: Complex, seed: int) -> MeasuredRunUp:
        """Return this run-up with the scatter of simulated blocks in the standard errors."""
        del seed
        return replace(self, simulated_noise=self.noise_of(samples if self.phases else np.abs(samples)))

    def noise_of(self, values: Complex | Array) -> Complex:
        """(B, m, m) covariance of the noise of amplitudes; sizes have the variance of one part, half of it."""
        noise = block_noise(values.astype(np.complex128), self.speed, self._records)
        return noise if self.phases else 2.0 * noise

    def without_scatter(self) -> MeasuredRunUp:
        """Return this run-up without the scatter of a simulated one."""
        return replace(self, simulated_noise=np.zeros_like(self.simulated_noise))

    @property
    def delays(self) -> int:
        """Number of angles between the zeros of shafts that are fitted."""
        return len(self._records) if self.phases and self.fits_angle else 0

    @property
    def repeated(self) -> bool:
        """Whether there is more than one record."""
        return len(self._records) > 1

    @cached_property
    def freedom(self) -> float:
        """Degrees of freedom of the standard errors: of all differences, and of the columns with information."""
        strength = np.sum(np.abs(self.amplitude) ** 2 / np.maximum(self._variance, np.finfo(float).tiny), axis=0)
        columns = float(np.sum(strength) ** 2 / np.sum(strength**2)) if strength.any() else 1.0
        differences = self.speed.size - 2 * len(self._records)
        return _INDEPENDENT * differences * columns

    # rows: in phase, then in quadrature, of every column; block by block

    def _rows_of(self, in_phase: Array, in_quadrature: Array) -> Array:
        """(N,) from (B, m) of both parts."""
        parts = [in_phase, in_quadrature] if self.phases else [in_phase]
        return np.concatenate(parts, axis=1).ravel()

    @cached_property
    def direction(self) -> Complex:
        """(B, m) unit vectors along the measured amplitudes."""
        return directions(self.amplitude)

    @cached_property
    def _variance(self) -> Array:
        """(B, m) of an amplitude, both parts together."""
        return np.asarray(np.einsum("bjj->bj", self.noise + self.simulated_noise).real)

    @cached_property
    def _open(self) -> Array:
        """(B, m) error of either part by the fit over blocks."""
        largest = np.abs(self.amplitude).max(axis=0)
        of_channel = np.array([largest[self.channel == c].max(initial=0.0) for c in range(len(self.channels))])
        return np.broadcast_to(_LEAST * of_channel[self.channel], self.amplitude.shape)

    @cached_property
    def _gain(self) -> Array:
        """(N,) error of every row by the calibration."""
        size = np.abs(self.amplitude) * self.calibration[self.channel]
        return self._rows_of(size, np.zeros_like(size))

    @cached_property
    def errors(self) -> Array:
        """(N,) standard error of every row."""
        of_part = np.sqrt(0.5 * self._variance + self._open**2)
        return np.hypot(self._rows_of(of_part, of_part), self._gain)

    @cached_property
    def own_values(self) -> Array:
        """(N,) of the measured motion."""
        size = np.abs(self.amplitude)
        return self._rows_of(size, np.zeros_like(size))

    def _turned(self, motion: Complex) -> Complex:
        """(B, m) simulated amplitudes by the angles of the measured shafts."""
        if not self.delays:
            return motion
        weight = 1.0 / (0.5 * self._variance + self._open**2)
        turned = np.empty_like(motion)
        for part in self._records:
            cross = np.sum(weight[part] * np.conj(motion[part]) * self.amplitude[part], axis=0)
            turned[part] = motion[part] * np.exp(1j * self.order * angle_offset(cross, self.order))
        return turned

    def values(self, motion: Complex) -> Array:
        """(N,) of a simulated motion; noise s in either part raises the mean of a size a to (a^2 + s^2)^(1/2)."""
        if not self.phases:
            return self._raised(motion).ravel()
        along = self._turned(motion) * np.conj(self.direction)
        return self._rows_of(along.real, along.imag)

    def _raised(self, motion: Complex) -> Array:
        """(B, m) sizes of simulated amplitudes, raised as noise raises the measured ones."""
        return np.asarray(np.hypot(np.abs(motion), np.sqrt(0.5 * self._variance)))

    # covariance of the rows

    @cached_property
    def covariance_for_values(self) -> Covariance:
        """Covariance from the repeats, if there are any; else from the scatter of blocks, widened for few."""
        if not self.repeated or self.misfit is None:
            return self.with_times_scatter(widening(self.freedom))
        count = len(self._records)
        along = self.misfit * np.conj(self.direction) if self.phases else self.misfit
        rows = self._rows_of(along.real, along.imag) / self.errors
        by_row = np.repeat(self.record, rows.size // self.record.size)
        of_record = np.where(by_row == np.arange(count)[:, None], rows, 0.0)
        factor = np.sqrt(widening(count - 1.0) * count / (count - 1.0)) * of_record
        shape = self._blocks.shape
        none = Covariance(np.zeros(shape), np.zeros((shape[0] - 1, *shape[1:])), factor)
        return none.plus(self._gains)

    @cached_property
    def _gains(self) -> Array:
        """(C, N) errors by the calibration, a channel each."""
        columns = np.tile(self.channel, (2 if self.phases else 1))
        by_row = np.tile(columns, len(self.speed))
        return np.where(by_row == np.arange(len(self.channels))[:, None], self._gain / self.errors, 0.0)

    @cached_property
    def _blocks(self) -> Array:
        """(B, k, k) covariance of the rows of a block, by scatter."""
        return self._parts(self.noise + self.simulated_noise, self.direction, self.direction)

    def _parts(self, noise: Complex, one: Complex, other: Complex) -> Array:
        """Covariance of the parts of amplitudes along directions, of noise of any phase.

        Such noise e has E[Re Re] = E[Im Im] = Re S / 2 and E[Im Re] = Im S / 2 with S = E[e e*].
        """
        if not self.phases:
            return np.asarray(0.5 * noise.real)
        along = np.conj(one)[:, :, None] * noise * other[:, None, :]
        upper = np.concatenate([along.real, -along.imag], axis=2)
        lower = np.concatenate([along.imag, along.real], axis=2)
        return np.asarray(0.5 * np.concatenate([upper, lower], axis=1))

    def with_times_scatter(self, times: float) -> Covariance:
        """Return the covariance of the rows in standard errors: scatter, common calibration, fit over blocks."""
        noise = self.noise + self.simulated_noise
        shared = SHARED * 0.5 * (noise[:-1] + noise[1:])
        shared[self.record[1:] != self.record[:-1]] = 0.0
        neighbour = self._parts(shared, self.direction[:-1], self.direction[1:])
        parts = 2 if self.phases else 1
        left_open = np.tile(self._open, (1, parts))
        within = times * self._blocks + np.eye(left_open.shape[1]) * (left_open**2)[:, :, None]
        size = within.shape[1] * len(within)
        plain = Covariance(within, times * neighbour, np.zeros((0, size)))
        return plain.weighted(1.0 / self.errors).plus(self._gains)

    # words

    def labels(self) -> list[tuple[str, str]]:
        """(N,) label and unit of every row."""
        parts = (", in phase", ", in quadrature") if self.phases else ("",)
        factor, unit = (30.0 / np.pi, " rpm") if self.per_minute else (1.0, "")
        labels = []
        for record, speed in zip(self.record.tolist(), (factor * self.speed).tolist(), strict=True):
            where = f"{speed:.6g}{unit}" + (f", record {record + 1}" if self.repeated else "")
            for part in parts:
                for c, order in zip(self.channel.tolist(), self.order.tolist(), strict=True):
                    channel = self.channels[c]
                    labels.append((f"{channel.name}: order {order:.6g} at {where}{part}", channel.unit))
        return labels

    def tracks(self, fitted: Complex, partners: Sequence[str]) -> tuple[Track, ...]:
        """Return every channel and order over speed, measured and fitted (B, m), a record each."""
        error = np.sqrt(0.5 * self._variance + self._open**2)
        made = []
        for number, part in enumerate(self._records, start=1):
            for k, c in enumerate(self.channel.tolist()):
                channel = self.channels[c]
                name = f"{channel.name}, record {number}" if self.repeated else channel.name
                sizes = np.abs(self.amplitude[part, k]), np.abs(fitted[part, k])
                errors = error[part, k]
                order = float(self.order[k])
                made.append(
                    Track(name, partners[c], channel.unit, order, self.speed[part], *sizes, errors, TWO_SIDED * errors)
                )
        return tuple(made)

    def remarks(self, fitted: Complex) -> list[str]:
        """Return notes: where the angle of a measured shaft drifts along the run-up."""
        if not self.delays:
            return []
        turned = self._turned(fitted)
        weight = self.order**2 / (0.5 * self._variance + self._open**2)
        bend = np.sum(weight * np.abs(turned) ** 2, axis=1)
        push = np.sum(weight / self.order * np.imag(np.conj(turned) * self.amplitude), axis=1)
        worst = 0.0
        for part in self._records:
            at = np.linspace(-0.5, 0.5, part.stop - part.start)
            information = float(np.sum(bend[part] * at**2))
            drift = float(np.sum(push[part] * at)) / information
            clear = abs(drift) * np.sqrt(information) > _SURE and abs(drift) * self.order.max() > _DRIFT
            worst = max(worst, abs(drift) if clear else 0.0)
        if not worst:
            return []
        return [
            f"along the run-up the angle of the measured shaft drifts from the model's by {np.degrees(worst):.3g} deg: "
            "its speed is not exact, or the model's phases are wrong. phases = false compares amplitudes alone."
        ]


def block_noise(values: Complex, speed: Array, records: list[slice]) -> Complex:
    """(B, m, m) covariance of what scatters in (B, m) amplitudes of blocks, from their second differences.

    A block of slower turns is longer and scatters less: its noise is as its speed.
    """
    noise = np.empty((*values.shape, values.shape[1]), np.complex128)
    for part in records:
        scaled = values[part] / np.sqrt(speed[part])[:, None]
        differences = scaled[:-2] - 2.0 * scaled[1:-1] + scaled[2:]
        squares = differences[:, :, None] * np.conj(differences)[:, None, :] / (6.0 - 8.0 * SHARED)
        # the mean over a window of blocks around every block
        count = len(squares)
        width = min(_WINDOW, count)
        sums = np.concatenate([np.zeros((1, *squares.shape[1:])), np.cumsum(squares, axis=0)])
        first = np.clip(np.arange(count + 2) - 1 - width // 2, 0, count - width)
        noise[part] = (sums[first + width] - sums[first]) / width * speed[part][:, None, None]
    return noise
