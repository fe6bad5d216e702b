"""Speed irregularity of every body, and the peak to peak of its speed at every engine order.

    irregularity = (n_max - n_min) / n_mean,        peak to peak of an order: 2 |V(o)|  [rad/s]

of every body, such as the gearbox input. The mean speed is the mean of a channel "speed", otherwise the reference speed
times the gear ratio. The peak to peak of an order is twice its amplitude, by least squares.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gearrattle.quantities.metric_inputs import EXACT, Inputs, order_word, sampled
from gearrattle.quantities.quantity import Quantity, Row
from gearrattle.signals import speed_ratios


@dataclass(frozen=True)
class SpeedIrregularity(Quantity[Inputs]):
    """Relative speed range, and peak to peak by engine order."""

    name: str = "irregularity"
    title: str = "Speed irregularity"
    formula: str = "(n_max - n_min) / n_mean; 2 |V(o)| at every engine order"
    unit: str = "1"
    source: str = "textbook definition (coefficient of fluctuation of speed, of flywheel design)"
    window: str = EXACT
    sampling: str = "of samples: peaks as fine as these, with a note; orders below half the sampling rate"
    needs: tuple[str, ...] = ("velocity",)
    merging: str = "exact: extremes are the largest and the smallest, least squares add up"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return irregularity, peak to peak of the speed, and peak to peak of every engine order."""
        rows: list[Row] = []
        # peak to peak of the speed over its mean
        for quantity, name, average in _speeds(inputs):
            signal = inputs.signals[quantity, name]
            summary = inputs.summary(quantity, name)
            width = summary.swing
            missed = sampled(name, summary, 0.5 * summary.swing)
            known = average is not None and math.isfinite(average) and average > 0.0
            note = missed if known else f"{name}: its mean speed is not known: give a model, or the speed"
            relative = width / average if known and average else math.nan
            error = 2.0 * summary.miss / average if known and average else math.nan
            rows.append(self.row(name, "irregularity", relative, "1", note, error))
            rows.append(self.row(name, "peak-to-peak speed", width, "rad/s", missed, 2.0 * summary.miss))
            # amplitude of the speed at every engine order
            if not inputs.lacks("engine orders"):
                known_at = inputs.velocities_at(name)
                velocities = inputs.amplitudes(signal, 1) if known_at is None else known_at
                amplitude = dict(zip(inputs.orders.tolist(), np.abs(velocities).tolist(), strict=True))
                errors = dict(zip(inputs.orders.tolist(), inputs.velocity_errors(name).tolist(), strict=True))
                for order in inputs.engine_orders.tolist():
                    swing = 2.0 * amplitude[order]
                    note = "" if math.isfinite(swing) else "the samples cannot show this order"
                    error = 2.0 * errors[order]
                    rows.append(
                        self.row(name, f"peak-to-peak speed at {order_word(order)}", swing, "rad/s", note, error)
                    )
        return rows


def _speeds(inputs: Inputs) -> Iterator[tuple[str, str, float | None]]:
    """Yield quantity, subject and mean speed of every signal of a speed."""
    for name in inputs.of("speed"):
        yield "speed", name, inputs.summary("speed", name).mean
    plate = inputs.layout
    ratios = {} if plate is None else dict(zip(plate.inertia_names, speed_ratios(plate).tolist(), strict=True))
    for name in inputs.of("velocity"):
        known = inputs.omega is not None and name in ratios
        yield "velocity", name, ratios[name] * inputs.speed if known else None
