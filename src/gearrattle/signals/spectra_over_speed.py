"""Spectra side by side as the speed changes: over frequency or order, row by row or by steps of the speed.

A *waterfall* has one row per segment of time: amplitudes of lines, or densities, over frequency. Frequencies f and
orders o differ in how they run: o = 2 pi f / Omega. Between rows of a segment's length the speed changes by
Omega' L / fs, so that an order's line is smeared over o Omega' L / (2 pi fs): the shorter the segment, the less, and
the wider its bins; order spectra (``order_tracking``) have no such limit.

*Steps of speed* gather all rows whose speed rounds to the same step, whatever their order in time, as the mean of
their squares: a run-up and the run-down after it add up, and a speed held long does not fill the map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals.cross_spectra import Segments, frequencies, groups, one_sided, transformed

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Waterfall:
    """Spectra, one per row.

    Attributes
    ----------
    axis
        (f,) frequencies [Hz], or orders.
    values
        (r, f) amplitudes [unit], or densities [unit^2 / Hz].
    time
        (r,) middle of each row [s]; NaN where rows were gathered from several times.
    speed
        (r,) mean speed in each row [rad/s]; NaN where it is not known.
    counts
        (r,) segments in each row.
    """

    axis: Array
    values: Array
    time: Array
    speed: Array
    counts: NDArray[np.int64]


def waterfall(
    signal: Array, rate: float, segments: Segments, speed: Array | None, *, density: bool, highest: float
) -> Waterfall:
    """Return the spectrum of every segment.

    Parameters
    ----------
    signal
        (N,) uniform samples.
    rate
        of the samples [Hz].
    speed
        (N,) of the shaft [rad/s]; None where it is not known.
    highest
        frequency up to which they are kept [Hz].
    """
    frequency = frequencies(segments, rate)
    kept = max(1, int(np.searchsorted(frequency, highest * (1.0 + 1e-12), side="right")))
    window = segments.window
    values = np.empty((segments.count, kept))
    begin = 0
    for group in groups(signal, segments):
        modulus = np.abs(transformed(group, segments))
        if density:
            rows = one_sided(modulus**2 / (rate * float(window @ window)), segments.length)
        else:
            rows = one_sided(modulus / window.sum(), segments.length)
        values[begin : begin + len(group)] = rows[:, :kept]
        begin += len(group)
    time = np.asarray((segments.step * np.arange(segments.count) + 0.5 * segments.length) / rate, dtype=np.float64)
    nothing = np.full(segments.count, np.nan)
    mean = nothing if speed is None else np.concatenate([group.mean(axis=1) for group in groups(speed, segments)])
    return Waterfall(frequency[:kept], values, time, mean, np.ones(segments.count, np.int64))


def by_steps(rows: Waterfall, step: float, squared: bool) -> Waterfall:
    """Gather rows by steps of the speed, ascending; steps that no row falls into are left out.

    Parameters
    ----------
    step
        of the speed [rad/s].
    squared
        whether the values are squares already, such as densities; of others the mean square is taken.
    """
    index = np.rint(rows.speed / step).astype(np.int64)
    steps, step_of_row, counts = np.unique(index, return_inverse=True, return_counts=True)
    total = np.zeros((steps.size, rows.axis.size))
    np.add.at(total, step_of_row, rows.values if squared else rows.values**2)
    mean = total / counts[:, None]
    speed = np.bincount(step_of_row, rows.speed) / counts
    values = mean if squared else np.sqrt(mean)
    return Waterfall(rows.axis, values, np.full(steps.size, np.nan), speed, counts.astype(np.int64))


def over_orders(rows: Waterfall, orders: Array) -> Waterfall:
    """Read a waterfall over frequency along the lines of constant order (o,), straight between bins.

    NaN beyond the last bin.
    """
    values = np.empty((rows.speed.size, orders.size))
    for k, speed in enumerate(rows.speed.tolist()):
        values[k] = np.interp(orders * speed / (2.0 * np.pi), rows.axis, rows.values[k], right=np.nan)
    return Waterfall(np.asarray(orders, np.float64), values, rows.time, rows.speed, rows.counts)
