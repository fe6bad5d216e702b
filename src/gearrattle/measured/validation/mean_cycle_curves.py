"""The mean cycles of both records on one clock, from the model's time zero on, and their spectra: for figures."""

from __future__ import annotations

import numpy as np

from gearrattle.measured.validation.band_densities import Segments
from gearrattle.measured.validation.cycles import Cycles
from gearrattle.measured.validation.validation_records import Curves
from gearrattle.trajectory import Array


def curves_of(cycles: tuple[Cycles, Cycles], spectra: tuple[Segments, Segments], delay: float) -> list[Curves]:
    """Return the curves of every channel; the delay is added to the measured times [s]."""
    measured, simulated = cycles
    turns = (measured.start + delay) / measured.period, simulated.start / simulated.period
    means = [_turned(cycle.values.mean(axis=0), turn) for cycle, turn in zip(cycles, turns, strict=True)]
    spread = [_turned(cycle.values.std(axis=0), turn, lines=False) for cycle, turn in zip(cycles, turns, strict=True)]
    return [
        Curves(
            means[0][:, c],
            means[1][:, c],
            spread[0][:, c],
            spread[1][:, c],
            spectra[1].frequency,
            spectra[0].density[:, c],
            spectra[1].density[:, c],
        )
        for c in range(measured.values.shape[2])
    ]


def _turned(cycle: Array, turn: float, *, lines: bool = True) -> Array:
    """(S, C) a cycle that begins at a phase, from phase zero on: by its lines, or by straight lines between samples."""
    samples = len(cycle)
    if lines:
        k = np.arange(samples // 2 + 1)
        moved = np.fft.rfft(cycle, axis=0) * np.exp(-2j * np.pi * k * (turn % 1.0))[:, None]
        return np.asarray(np.fft.irfft(moved, samples, axis=0))
    at = (np.arange(samples) / samples - turn) % 1.0 * samples
    columns = [np.interp(at, np.arange(samples + 1), np.append(column, column[0])) for column in cycle.T]
    return np.stack(columns, axis=1)
