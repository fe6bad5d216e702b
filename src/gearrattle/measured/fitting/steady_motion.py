"""A recorded motion at one speed: its cycles, the lines that are compared, and its simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.fitting.line_choice import Chosen, of_both
from gearrattle.measured.fitting.recorded import Recorded, in_band
from gearrattle.measured.fitting.recording_table import RecordingTable
from gearrattle.measured.fitting.simulated_cycles import Simulator, cycles_of
from gearrattle.measured.validation import level_agreement, order_agreement
from gearrattle.measured.validation.block_bootstrap import draws
from gearrattle.measured.validation.cycles import Setting, Source, samples_for, source_of
from gearrattle.measured.validation.measured_cycles import measured_cycles
from gearrattle.measured.validation.pairing import Pairing
from gearrattle.measured.validation.validation_arguments import Wanted
from gearrattle.model.table import listed
from gearrattle.recording import Recording
from gearrattle.results import Run
from gearrattle.signals.conditioning import PASSED

Array = NDArray[np.float64]


def steady_motion(
    run: Run,
    recording: Recording,
    asked: tuple[Pairing, Wanted],
    table: RecordingTable,
    watched: Callable[[float], None],
) -> tuple[Recorded, Simulator, list[str]]:
    """Cut the measured record into cycles, choose what is compared, and say how a motion is simulated; with notes."""
    pairing, wanted = asked
    names = tuple(channel.name for channel in pairing.simulated)
    # cycles of both
    source, notes = source_of(recording, pairing.measured)
    period = run.trajectory.layout.period
    own = cycles_of(run, names, wanted.trend)
    grid = Source(np.zeros((2, len(names))), period / own.values.shape[1], 0.0, "the simulation")
    setting = Setting(samples_for((source, grid), period, wanted.band[1]), 0.0, wanted.trend)
    cycles = measured_cycles(source, period, setting, wanted)
    # lines of the simulated ones in the band of the measured ones
    lowest = wanted.band[0]
    band = lowest, PASSED * setting.samples / period
    simulator = Simulator(table.settings, names, band, int(PASSED * setting.samples), wanted.trend, watched)
    start = simulator.motion_of(own)
    # lines and levels that are compared
    how = draws(
        level_agreement.mean_squares(cycles), np.random.default_rng(wanted.seed), lines=order_agreement.strong(cycles)
    )
    by_rms = np.array([i for i, c in enumerate(pairing.measured) if c.name in wanted.noise], dtype=np.int64)
    line, channel = of_both(order_agreement.lines_of(cycles, how), start.lines, in_band(cycles, lowest))
    delay = None if wanted.clock == "cycle" else 0.0 if wanted.clock == "none" else float(wanted.clock)
    recorded = Recorded(
        channels=pairing.measured,
        cycles=cycles,
        lowest=lowest,
        period=period,
        base=2.0 * np.pi / (period * run.trajectory.layout.omega),
        chosen=Chosen(line, channel, by_rms, table.phases, delay),
        draws=how,
        noise=np.array([wanted.noise[pairing.measured[i].name] ** 2 for i in by_rms.tolist()]),
        calibration=calibration_of(wanted, pairing),
    )
    _check_levels(recorded)
    return recorded, simulator, [*notes, *_off(cycles.period, period)]


def _check_levels(recorded: Recorded) -> None:
    """Refuse a record without a strong line, and noise that is louder than the record."""
    by_rms = recorded.chosen.by_rms
    power = recorded.motion.power[by_rms]
    names = [channel.name for channel in recorded.channels]
    if not recorded.chosen.line.size and not by_rms.size:
        rule = "no order of the model's period stands out of the scatter of the cycles, neither measured nor simulated"
        raise ModelError(Problem("recording", listed(names), rule, "check speed, band and channels"))
    problems = [
        Problem(f"recording.noise.{names[i]}", f"{level**0.5:.6g}", f"must be below the rms in the band, {rms:.6g}")
        for i, level, rms in zip(by_rms.tolist(), recorded.noise.tolist(), np.sqrt(power).tolist(), strict=True)
        if level >= rms**2
    ]
    if problems:
        raise ModelError(problems)


def _off(measured: float, period: float) -> list[str]:
    """Return a note where the record has a period of its own."""
    off = measured / period - 1.0
    way = "longer" if off > 0.0 else "shorter"
    return [f"the measured cycle is {100.0 * abs(off):.3g} % {way} than the model's."] if off else []


def calibration_of(wanted: Wanted, pairing: Pairing) -> Array:
    """(C,) relative standard uncertainty of every channel."""
    stated = wanted.calibration
    if not isinstance(stated, Mapping):
        return np.full(len(pairing.measured), 0.01 * (stated or 0.0))
    return np.array([0.01 * stated.get(channel.name, 0.0) for channel in pairing.measured])
