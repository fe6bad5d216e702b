"""Motions of one gap made by hand: prescribed deflections, their crossings found between samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearrattle.analysis.contact_ratios.contact_ratio_record import elastic, law_of
from gearrattle.trajectory import EventLog, Trajectory
from tests import synthetic

CLUTCH = 0
SPLINE = 1
GEAR = 2


def with_deflection(deflection: np.ndarray, samples_per_cycle: int, clearance: int = GEAR) -> Trajectory:
    """Return a trajectory whose one clearance follows the samples (N + 1,), joined by straight lines."""
    base = synthetic.trajectory()
    layout, cycles = base.layout, (deflection.size - 1) // samples_per_cycle
    time = np.arange(deflection.size) * layout.period / samples_per_cycle
    columns = np.zeros((deflection.size, layout.clearance.size))
    columns[:, clearance] = deflection
    forces = np.column_stack([elastic(law_of(layout, k), columns[:, k]) for k in range(columns.shape[1])])
    corners, first = layout.corners[clearance], int(layout.region_of_first_piece[clearance])
    rows = []
    for j, corner in enumerate(corners):
        above = deflection >= corner
        for i in np.flatnonzero(above[1:] != above[:-1]):
            slope = (deflection[i + 1] - deflection[i]) / (time[i + 1] - time[i])
            up = bool(above[i + 1])
            rows.append((time[i] + (corner - deflection[i]) / slope, first + j + (not up), first + j + up, slope))
    rows.sort()
    at, of, to, rate = (np.array(column) for column in zip(*rows, strict=True)) if rows else (np.zeros(0),) * 4
    count = len(rows)
    log = EventLog(at, np.full(count, clearance), of.astype(int), to.astype(int), rate, np.full(count, np.nan))
    pieces = [np.searchsorted(c, x, side="right") for c, x in zip(layout.corners, columns.T, strict=True)]
    region = np.column_stack(pieces) + layout.region_of_first_piece
    return replace(
        base,
        time=time,
        deflection=columns,
        force=forces,
        region=region,
        events=log,
        initial_region=region[0],
        samples_per_cycle=samples_per_cycle,
        cycles=cycles,
        discard=0,
    )


def gaussian(cycles: int, samples_per_cycle: int, deviation: float, seed: int) -> np.ndarray:
    """Return (N + 1,) smooth Gaussian noise: white noise through a resonance-like band, unit cycles."""
    rng, count = np.random.default_rng(seed), cycles * samples_per_cycle
    frequency = np.fft.rfftfreq(count, 1.0 / samples_per_cycle)
    shape = np.exp(-0.5 * ((frequency - 2.0) / 0.8) ** 2)
    wave = np.fft.irfft(shape * (rng.normal(size=frequency.size) + 1j * rng.normal(size=frequency.size)), count)
    wave *= deviation / np.sqrt(np.mean(wave**2))
    return np.concatenate([wave, wave[:1]])
