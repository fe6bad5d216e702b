"""Orders of a recorded run-up in blocks of turns, and of a simulated one at the same speeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.fitting.measured_motion import Complex
from gearrattle.measured.fitting.recording_table import RecordingTable
from gearrattle.measured.fitting.run_up_residuals import MeasuredRunUp
from gearrattle.measured.fitting.simulated_cycles import band_limited
from gearrattle.measured.fitting.steady_motion import calibration_of
from gearrattle.measured.validation.pairing import Pairing
from gearrattle.measured.validation.simulated_recording import recorded
from gearrattle.measured.validation.validate_run_up import check_repeats, longest_stretch, orders_in_common
from gearrattle.measured.validation.validation_arguments import Wanted
from gearrattle.model import Model
from gearrattle.model.table import listed
from gearrattle.recording import Channel, Recording
from gearrattle.results import Run
from gearrattle.signals.order_tracking import TURN, orders_of_blocks
from gearrattle.signals.spectral.order_maps_of_signals import order_cuts
from gearrattle.signals.spectral.sampled import required, sampled
from gearrattle.simulation.simulate import simulate
from gearrattle.wording import counted

Array = NDArray[np.float64]

FEWEST = 6
"""Blocks that a run-up needs."""
_MOST = 60_000_000  # entries of the covariances of all blocks
_GRID = 0.1  # of a block, between the blocks whose mean speeds are tabulated


@dataclass(frozen=True)
class RunUpSimulator:
    """Simulation of a model's run-up, and the reading of its orders.

    Attributes
    ----------
    orders
        (o,) of each.
    starts
        (B,) angles of the shaft at which blocks begin [rad].
    """

    settings: Mapping[str, Any]
    names: tuple[str, ...]
    orders: Array
    turns: float
    starts: Array
    watched: Callable[[float], None] | None = None

    def samples(self, model: Model) -> Complex:
        """(B, m) amplitudes of a model's run-up, the orders of one channel after those of another."""
        return self.amplitudes(simulate(model, **self.settings, audit=False, progress=self.watched))

    def amplitudes(self, run: Run) -> Complex:
        """(B, m) amplitudes of a run."""
        recording = recorded(run)
        signal = sampled(run, self.names[0])
        shaft = required(run, signal, None)
        judged = slice(len(recording.time) - signal.values.size, len(recording.time))
        values = [band_limited(recording, name, judged, signal.interval) for name in self.names]
        blocks = orders_of_blocks(
            np.stack(values, axis=1),
            signal.interval,
            (shaft.angle, shaft.speed),
            orders=self.orders,
            turns=self.turns,
            starts=self.starts,
        )
        return np.asarray(np.swapaxes(blocks.amplitude, 1, 2).reshape(self.starts.size, -1))

    def motion_of(self, samples: Complex) -> Complex:
        """Return the amplitudes as they are."""
        return samples

    def remarks(self, _samples: Complex) -> list[str]:
        """Return no notes: a run-up need not settle."""
        return []


def run_up_motion(
    run: Run,
    recordings: Sequence[Recording],
    asked: tuple[Sequence[Pairing], Wanted],
    table: RecordingTable,
    watched: Callable[[float], None],
) -> tuple[MeasuredRunUp, RunUpSimulator, list[str]]:
    """Fit the orders of measured blocks, and say how a run-up is simulated and read at their speeds; with notes.

    A ModelError refuses repeats with other channels, speeds that are not simulated, too few blocks, and what
    ``order_cuts`` refuses.
    """
    # orders that all records and the simulation have
    pairings, wanted = asked
    channels = pairings[0].measured
    check_repeats(recordings, pairings)
    records = [_cut(recording, wanted) for recording in recordings]
    orders = np.array(orders_in_common(run, records, table.orders or None, table.shaft or None, channels[0].name))
    # measured blocks of the part in which the speed rises or falls, by rising speed
    simulated = _SimulatedSpeeds.of(run, pairings[0].simulated[0].name, table.turns)
    notes: list[str] = []
    parts = []
    for recording, pairing in zip(records, pairings, strict=True):
        part, said = _measured_blocks(recording, pairing, orders, table, simulated)
        parts.append(part)
        notes += said
    # the two together
    speed = np.concatenate([at for at, _ in parts])
    amplitude = np.concatenate([values for _, values in parts])
    record = np.repeat(np.arange(len(parts)), [len(at) for at, _ in parts])
    _check_size(amplitude, channels, orders)
    names = tuple(channel.name for channel in pairings[0].simulated)
    simulator = RunUpSimulator(table.settings, names, orders, table.turns, simulated.starts_at(speed), watched)
    none = np.zeros((len(speed), amplitude.shape[1], amplitude.shape[1]), np.complex128)
    measured = MeasuredRunUp(
        channels=channels,
        channel=np.repeat(np.arange(len(channels)), orders.size),
        order=np.tile(orders, len(channels)),
        record=record,
        speed=speed,
        amplitude=amplitude,
        phases=table.phases,
        fits_angle=wanted.clock == "cycle",
        calibration=calibration_of(wanted, pairings[0]),
        per_minute=run.model.units != "dimensionless",
        noise=none,
        simulated_noise=none,
    )
    measured = replace(measured, noise=measured.noise_of(amplitude if table.phases else np.abs(amplitude)))
    return measured, simulator, notes


@dataclass(frozen=True)
class _SimulatedSpeeds:
    """Mean speed of a block of a simulated run-up by the angle at which it begins.

    Attributes
    ----------
    starts
        (n,) angles [rad], by rising speed.
    speed
        (n,) mean speeds [rad/s].
    """

    starts: Array
    speed: Array
    rises: bool

    @classmethod
    def of(cls, run: Run, name: str, turns: float) -> _SimulatedSpeeds:
        """Tabulate the mean speeds of a run."""
        signal = sampled(run, name)
        shaft = required(run, signal, None)
        span = TURN * turns
        last = float(shaft.angle[-1]) - span
        if last <= float(shaft.angle[0]):
            rule = f"a block takes {turns:g} turns of the shaft, and the simulated run-up has fewer"
            raise ModelError(Problem("recording.turns", f"{turns:g}", rule, "take fewer"))
        count = 2 + int((last - float(shaft.angle[0])) / (_GRID * span))
        starts = np.linspace(float(shaft.angle[0]), last, count)
        none = np.zeros((shaft.angle.size, 1))
        blocks = orders_of_blocks(
            none, signal.interval, (shaft.angle, shaft.speed), orders=np.ones(1), turns=turns, starts=starts
        )
        rows, _ = longest_stretch(blocks.speed, f"run of {run.model.name or 'the model'}")
        return cls(starts[rows], blocks.speed[rows], bool(rows[-1] > rows[0]))

    def starts_at(self, speed: Array) -> Array:
        """(B,) angles at which blocks of mean speeds begin."""
        return np.interp(speed, self.speed, self.starts)


def _measured_blocks(
    recording: Recording, pairing: Pairing, orders: Array, table: RecordingTable, simulated: _SimulatedSpeeds
) -> tuple[tuple[Array, Complex], list[str]]:
    """Return mean speeds and (B, m) amplitudes of a record's blocks at simulated speeds; with notes.

    ModelError where there are too few of them, or a speed falls where the simulated one rises.
    """
    # mean speeds of the blocks, where the speed rises or falls steadily
    cuts = [
        order_cuts(recording, channel.name, orders.tolist(), speed=table.shaft or None, turns=table.turns)
        for channel in pairing.measured
    ]
    means = cuts[0]["speed"].values
    rows, note = longest_stretch(means, recording.source)
    rises = bool(rows[-1] > rows[0])
    if rises != simulated.rises:
        way = "rises" if rises else "falls"
        rule = "the measured speed and that of the model's sweep must change the same way: motions may differ by it"
        raise ModelError(Problem(f"{recording.source}: speed", way, rule, "turn the sweep round: from, to"))
    # blocks at speeds that the simulation has as well
    inside = (means[rows] >= simulated.speed[0]) & (means[rows] <= simulated.speed[-1])
    if np.count_nonzero(inside) < FEWEST:
        ends = [
            f"{at[0] * 30.0 / np.pi:.6g} to {at[-1] * 30.0 / np.pi:.6g} rpm" for at in (means[rows], simulated.speed)
        ]
        rule = f"measured and simulated run-up ({listed(ends)}) have fewer than {FEWEST} blocks in common"
        value = counted(int(np.count_nonzero(inside)), "block")
        raise ModelError(Problem(recording.source, value, rule, "take fewer turns, or simulate the sweep measured"))
    notes = [note] if note else []
    left = rows.size - int(np.count_nonzero(inside))
    if left:
        notes.append(f"{recording.source}: {counted(left, 'block')} at speeds that are not simulated left out.")
    # complex amplitudes of the orders in these blocks
    kept = rows[inside]
    values = np.concatenate([cut["amplitude"].values[kept] * np.exp(1j * cut["phase"].values[kept]) for cut in cuts], 1)
    return (means[kept], values), notes


def _cut(recording: Recording, wanted: Wanted) -> Recording:
    """Return a record between its start and its end, where they are given."""
    low = -np.inf if wanted.start is None else wanted.start
    high = np.inf if wanted.end is None else wanted.end
    inside = (recording.time >= low) & (recording.time <= high)
    if inside.all():
        return recording
    channels = tuple(replace(channel, values=channel.values[inside]) for channel in recording.channels)
    return replace(recording, time=recording.time[inside], channels=channels)


def _check_size(amplitude: Complex, channels: Sequence[Channel], orders: Array) -> None:
    """Refuse more channels and orders than can be judged together."""
    count, columns = amplitude.shape
    if count * (2 * columns) ** 2 > _MOST:
        value = f"{counted(len(channels), 'channel')}, {counted(orders.size, 'order')}, {counted(count, 'block')}"
        rule = "their covariances do not fit into memory"
        raise ModelError(Problem("recording", value, rule, "name fewer orders or channels, or take more turns a block"))


def run_up_problems(table: RecordingTable, count: int, is_run_up: bool) -> list[Problem]:
    """Return keys that do not go with a run-up, or with a motion at one speed."""
    stated = RecordingTable.model_fields
    of_run_up = ("orders", "turns", "shaft")
    of_one_speed = ("band", "trend", "noise")
    wrong = of_one_speed if is_run_up else of_run_up
    rule = "applies to a motion at one speed" if is_run_up else "applies to a run-up: a model with a sweep"
    problems = [
        Problem(f"recording.{name}", str(getattr(table, name)), rule, "leave it out")
        for name in wrong
        if getattr(table, name) != stated[name].get_default(call_default_factory=True)
    ]
    if not is_run_up and count > 1:
        value = counted(count, "record")
        problems.append(Problem("recording.file", value, "repeats are for run-ups", "fit one record"))
    if is_run_up and not isinstance(table.clock, str):
        rule = 'the clocks of run-ups are the shafts: must be "cycle" or "none"'
        problems.append(Problem("recording.clock", f"{table.clock} s", rule, "leave it out"))
    return problems
