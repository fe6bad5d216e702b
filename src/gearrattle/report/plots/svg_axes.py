"""The x and y axes of a panel in static SVG: limits, ticks, and the pixels of values.

Ticks stand at 1, 2 or 5 times a power of ten, on whole decades of a logarithmic axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import count

import numpy as np

from gearrattle.report.plots.chart import Panel
from gearrattle.trajectory import Array

_FEWEST = 3


@dataclass(frozen=True)
class Axis:
    """Maps values to pixels: limits in the unit of the data, both positive if logarithmic, to ``start`` and ``end``."""

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def at(self, values: Array) -> Array:
        """Return the pixels of some values; what a logarithmic axis cannot show stands far below it."""
        low = self.low
        high = self.high
        shown = np.asarray(values, dtype=np.float64)
        if self.log:
            tiny = self.low * 1e-3
            low = math.log(low)
            high = math.log(high)
            shown = np.log(np.maximum(shown, tiny))
        return np.asarray(self.start + (self.end - self.start) * (shown - low) / (high - low), dtype=np.float64)

    def ticks(self) -> list[float]:
        """Return at least three round values within the limits, ascending, as few as that allows."""
        if self.log:
            return log_ticks(self.low, self.high)
        power = math.floor(math.log10(self.high - self.low))
        steps = (mantissa * 10.0**p for p in count(power, -1) for mantissa in (5.0, 2.0, 1.0))
        return next(multiples for step in steps if len(multiples := self._multiples(step)) >= _FEWEST)

    def _multiples(self, step: float) -> list[float]:
        first = math.ceil(self.low / step - 1e-9)
        last = math.floor(self.high / step + 1e-9)
        return [float(f"{k * step:.12g}") for k in range(first, last + 1)]


def log_ticks(low: float, high: float) -> list[float]:
    """Return whole powers of ten within limits, five at most; within two decades 1, 2 and 5 times such powers."""
    first = math.ceil(math.log10(low) - 1e-9)
    last = math.floor(math.log10(high) + 1e-9)
    powers = range(first, last + 1)
    if len(powers) >= _FEWEST:
        return [10.0**power for power in powers[:: max(1, -(-len(powers) // 5))]]
    multiples = [mantissa * 10.0**power for power in range(first - 1, last + 1) for mantissa in (1.0, 2.0, 5.0)]
    return [value for value in multiples if low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9)]


def limits(panel: Panel) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the limits of both axes: the panel's own, or those of what it holds with a margin above and below."""
    x = [line.x for line in panel.lines] + [bars.edges for bars in panel.bars]
    x += [np.array(panel.heat.x_range)] if panel.heat else []
    x += [edge for cells in panel.cells for edge in (cells.left, cells.right)]
    y = [line.y for line in panel.lines]
    y += [edge for cells in panel.cells for edge in (cells.low, cells.high)]
    y += [bars.heights + (0.0 if bars.base is None else bars.base) for bars in panel.bars]
    floor = 0.0 if panel.bars else None
    heat = panel.heat.y_range if panel.heat else None
    return panel.x_range or _fit(x, None, 0.0), panel.y_range or heat or _fit(y, floor, 0.06)


def widened(panel: Panel, ratio: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return limits with which one unit is as long across as up, on axes so many times as wide as high."""
    (left, right), (low, high) = limits(panel)
    across = max(right - left, ratio * (high - low))
    up = max(high - low, (right - left) / ratio)
    return (
        (0.5 * (left + right) - 0.5 * across, 0.5 * (left + right) + 0.5 * across),
        (0.5 * (low + high) - 0.5 * up, 0.5 * (low + high) + 0.5 * up),
    )


def _fit(values: list[Array], floor: float | None, margin: float) -> tuple[float, float]:
    finite = np.concatenate([np.zeros(0), *(v[np.isfinite(v)] for v in values)])
    if not finite.size:
        return 0.0, 1.0
    low = float(finite.min())
    high = float(finite.max())
    if high == low:
        low = low - 0.5 * (abs(low) or 1.0)
        high = high + 0.5 * (abs(high) or 1.0)
    room = margin * (high - low)
    return (low - room if floor is None else floor), high + room
