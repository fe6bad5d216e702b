"""Mean cycles of a model's motion from its output grid, which has a whole number of samples in each cycle.

Lines of a band-limited record and of the run's own samples agree within the error of resampling, as long as nothing
folds back into the band; the budget of a validation shows whether it does. Accelerations jump at impacts: their samples
fold back, and change in steps as an impact passes a sample. Velocities do neither, so accelerations are computed as
their derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.fitting.recorded import Motion, power_in
from gearrattle.measured.validation.cycles import FEWEST, Cycles
from gearrattle.measured.validation.simulated_recording import recorded
from gearrattle.model import Model
from gearrattle.recording import Recording
from gearrattle.results import Run
from gearrattle.signals.conditioning import detrended
from gearrattle.simulation.simulate import simulate
from gearrattle.trajectory import Array
from gearrattle.wording import counted

SETTLED = 1e-3
"""Share of a channel's rms that may scatter from cycle to cycle in a motion that counts as one that repeats."""


@dataclass(frozen=True)
class Simulator:
    """Simulation of a model's motion, and the reading of its cycles.

    Attributes
    ----------
    band
        lowest and highest frequency [Hz].
    lines
        K, how many lines are kept.
    """

    settings: Mapping[str, Any]
    names: tuple[str, ...]
    band: tuple[float, float]
    lines: int
    trend: str
    watched: Callable[[float], None] | None = None

    def samples(self, model: Model) -> Cycles:
        """Return the judged cycles of a model's motion."""
        return cycles_of(self.run(model), self.names, self.trend)

    def run(self, model: Model) -> Run:
        """Simulate a model."""
        return simulate(model, **self.settings, audit=False, progress=self.watched)

    def motion(self, model: Model) -> Motion:
        """Return the compared values of a model's motion."""
        return self.motion_of(self.samples(model))

    def motion_of(self, cycles: Cycles) -> Motion:
        """Return the compared values of cycles that begin at a multiple of the period."""
        lines = np.fft.rfft(cycles.values.mean(axis=0), axis=0)[1 : self.lines + 1] * (2.0 / cycles.values.shape[1])
        return Motion(lines, power_in(cycles.values, cycles.period, self.band))

    def remarks(self, cycles: Cycles) -> list[str]:
        """Return notes: where the motion has not settled."""
        restless = 100.0 * float(np.max(unrest(cycles), initial=0.0))
        if restless <= 100.0 * SETTLED:
            return []
        return [
            f"the simulated motion still changes from cycle to cycle, by {restless:.2g} % of a channel's rms: "
            "raise discard if it has not settled."
        ]


def cycles_of(run: Run, names: tuple[str, ...], trend: str) -> Cycles:
    """Return the judged cycles of a run; ModelError for fewer than eight of them."""
    t = run.trajectory
    count = t.cycles - t.discard
    if count < FEWEST:
        rule = f"at least {FEWEST} cycles after those discarded are needed"
        raise ModelError(Problem("settings", counted(count, "cycle"), rule, "raise cycles, or lower discard"))
    recording = recorded(run)
    samples = (len(recording.time) - 1) // t.cycles
    judged = slice(t.discard * samples, t.cycles * samples)
    interval = t.layout.period / samples
    values = np.stack([band_limited(recording, name, judged, interval) for name in names], axis=1)
    if trend == "linear":
        values = np.stack([detrended(t.time[judged], column, 1) for column in values.T], axis=1)
    whole = values.reshape(count, samples, -1)
    period = t.layout.period
    return Cycles(whole, whole, t.discard * period, period)


def band_limited(recording: Recording, name: str, judged: slice, interval: float) -> Array:
    """(M,) samples of a channel; of an acceleration the derivative of the velocity, by its Fourier series."""
    quantity, _, where = name.partition(".")
    if quantity != "acceleration":
        return recording[name].values[judged]
    velocity = recording[f"velocity.{where}"].values[judged.start : judged.stop + 1]
    count = velocity.size - 1
    rise = (velocity[-1] - velocity[0]) / count
    lines = np.fft.rfft(velocity[:-1] - rise * np.arange(count))
    turn = 2j * np.pi * np.fft.rfftfreq(count)
    return np.asarray((np.fft.irfft(turn * lines, count) + rise) / interval)


def unrest(cycles: Cycles) -> Array:
    """(C,) rms of the change from cycle to cycle, as a share of the rms."""
    away = cycles.values - cycles.values.mean(axis=0)
    moving = cycles.values - cycles.values.mean(axis=(0, 1))
    size = np.sqrt(np.mean(moving**2, axis=(0, 1)))
    return np.asarray(np.sqrt(np.mean(away**2, axis=(0, 1))) / np.where(size > 0.0, size, np.inf))
