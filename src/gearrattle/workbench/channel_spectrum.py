"""Spectrum of a channel, and the time shift between a simulated and a measured channel, to overlay their curves."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.json_types import json_value
from gearrattle.recording import Recording
from gearrattle.results import Run
from gearrattle.signals.spectral.densities import psd
from gearrattle.trajectory import Array


def density(source: Run | Recording, channel: str) -> dict[str, Any]:
    """Return the power spectral density of a channel, and the frequency of the shaft that orders refer to; None
    for it along a sweep.
    """
    data = psd(source, channel)
    layout = assemble(source.model).layout if isinstance(source, Run) else None
    shaft = layout.omega if layout is not None and layout.ramp is None else None
    return {
        "channel": channel,
        "unit": str(data["density"].attrs.get("units", "")),
        "frequency_unit": str(data["frequency"].attrs.get("units", "")),
        "frequency": json_value(data["frequency"].values),
        "psd": json_value(data["density"].values),
        "shaft": shaft,
    }


def best_shift(simulated: tuple[Array, Array], measured: tuple[Array, Array]) -> float:
    """Return the shift of the measured time [s] with the best agreement of both channels, which are uniformly sampled.

    It has the largest cross-correlation of the channels without their means, at the measured rate, over all shifts for
    which the measured channel (or a part with the length of the simulated one) is within the simulated one. A periodic
    motion has several such shifts; any of them is returned.
    """
    from scipy.signal import fftconvolve

    (time, values) = simulated
    (other_time, other) = measured
    step = float(other_time[-1] - other_time[0]) / (other_time.size - 1)
    grid = np.arange(time[0], time[-1], step)
    sampled = np.interp(grid, time, values)
    pattern = other[: grid.size] - other[: grid.size].mean()
    ones = np.ones(pattern.size)
    alike = fftconvolve(sampled, pattern[::-1], mode="valid")
    mean, square = (fftconvolve(power, ones, mode="valid") / pattern.size for power in (sampled, sampled**2))
    spread = np.sqrt(np.maximum(square - mean**2, 1e-12 * float(np.var(sampled)) + 1e-300))
    return float(grid[int(np.argmax(alike / spread))] - other_time[0])
