"""Acceleration of every loose gear: rms and peak, in the full band and above the engine's orders.

The mean is removed. The band above the engine's orders is the discrete Fourier transform of the window without the
lines up to the highest order of the engine's torque. Impacts excite this band; the torque does not excite it directly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gearrattle.quantities.metric_inputs import EXACT, WHOLE, Inputs, closed, sampled
from gearrattle.quantities.quantity import Quantity, Row
from gearrattle.signals import loose_gears
from gearrattle.signals.levels import thinned
from gearrattle.signals.summaries import Summary, summary_of
from gearrattle.trajectory import Array


@dataclass(frozen=True)
class LooseMotion(Quantity[Inputs]):
    """Acceleration levels of loose gears."""

    name: str = "loose_gear_motion"
    title: str = "Motion of loose gears"
    formula: str = "rms and max| | of theta_loose'' - mean; the same above the highest engine order"
    unit: str = "rad/s^2"
    source: str = "definition; the band above the engine's orders is common practice, without an origin known to us"
    window: str = EXACT
    sampling: str = "of samples, and above the engine's orders always: well above the frequency of stiff contacts"
    needs: tuple[str, ...] = ("loose gears", "acceleration")
    merging: str = "exact: moments add up, peaks are the largest; what is above the engine's orders needs the whole"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return rms and peak of every loose gear."""
        rows = list[Row]()
        accelerations = inputs.of("acceleration")
        for gear in loose_gears(inputs.known_layout):
            name = inputs.known_layout.inertia_names[gear.loose]
            signal = accelerations.get(name)
            full = None if signal is None else inputs.summary("acceleration", name)
            note = f"{name}: no acceleration is known" if full is None else ""
            missed = math.nan if full is None else inputs.summary_error("acceleration", name, lambda x: x.spread)
            rows += self._levels(name, "acceleration", full, note, missed)
            cannot = inputs.lacks("engine orders") or (
                "" if signal is None or isinstance(signal, np.ndarray) else WHOLE
            )
            above = None
            error = math.nan
            if full is not None and not cannot:
                above, error = _summary_above(inputs, np.asarray(signal))
            rows += self._levels(name, "acceleration above the engine orders", above, note or cannot, error)
        return rows

    def _levels(self, name: str, what: str, summary: Summary | None, note: str, error: float) -> list[Row]:
        level, peak = (math.nan, math.nan) if summary is None else (summary.spread, summary.reach)
        missed = note if summary is None else note or sampled(name, summary, peak)
        return [
            self.row(name, f"rms {what}", level, "rad/s^2", note, error),
            self.row(name, f"peak {what}", peak, "rad/s^2", missed, math.nan if summary is None else summary.miss),
        ]


def _summary_above(inputs: Inputs, signal: Array) -> tuple[Summary, float]:
    """Return the summary of an acceleration above the engine's orders, with the sampling error of its peak and rms."""
    summary, *parts = (
        summary_of(_above(inputs, samples - np.mean(samples[:-1])))
        for samples in (signal, *(closed(some) for some in thinned(signal[:-1])))
    )
    miss = max([summary.miss, *(summary.peak - some.peak for some in parts)])
    return replace(summary, miss=miss), max((abs(some.spread - summary.spread) for some in parts), default=math.nan)


def _above(inputs: Inputs, signal: Array) -> Array:
    """Return the samples without all lines up to the highest engine order."""
    lines = np.fft.rfft(signal[:-1])
    spacing = 2.0 * np.pi / (inputs.speed * inputs.duration)
    lines[np.arange(lines.size) * spacing <= float(inputs.engine_orders[-1]) + 0.5 * spacing] = 0.0
    left = np.fft.irfft(lines, signal.size - 1)
    return np.append(left, left[0])
