"""Speed irregularity, and what every engine order makes of it.

    irregularity = (n_max - n_min) / n_mean,        peak to peak of an order: 2 |V(o)|  [rad/s]

of every body; the gearbox input is one of them. The mean speed is that of a channel that holds it, else the reference
speed times the ratio of the gears between. The peak to peak of an order is twice its amplitude, by least squares.

Takes what is heard; gives values for every body whose velocity, and every shaft whose speed is heard.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gearrattle.quantities.metric import EXACT, Heard, Value, order_word, sampled
from gearrattle.signals import speed_ratios


@dataclass(frozen=True)
class SpeedIrregularity:
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

    def measure(self, heard: Heard) -> list[Value]:
        """Return irregularity, speed range, and the range of every engine order."""
        values = []
        for quantity, name, average in _speeds(heard):
            signal = heard.signals[quantity, name]
            told = heard.summary(quantity, name)
            width, missed = told.swing, sampled(name, told, 0.5 * told.swing)
            known = average is not None and math.isfinite(average) and average > 0.0
            note = missed if known else f"{name}: its mean speed is not known: give a model, or the speed"
            relative = width / average if known and average else math.nan
            error = 2.0 * told.miss / average if known and average else math.nan
            values.append(Value(name, "irregularity", relative, "1", note, error))
            values.append(Value(name, "peak-to-peak speed", width, "rad/s", missed, 2.0 * told.miss))
            if not heard.lacks("engine orders"):
                known_at = heard.velocities_at(name)
                found = heard.amplitudes(signal, 1) if known_at is None else known_at
                amplitude = dict(zip(heard.orders.tolist(), np.abs(found).tolist(), strict=True))
                errors = dict(zip(heard.orders.tolist(), heard.velocity_errors(name).tolist(), strict=True))
                for order in heard.engine_orders.tolist():
                    swing = 2.0 * amplitude[order]
                    note = "" if math.isfinite(swing) else "the samples cannot show this order"
                    error = 2.0 * errors[order]
                    values.append(
                        Value(name, f"peak-to-peak speed at {order_word(order)}", swing, "rad/s", note, error)
                    )
        return values


def _speeds(heard: Heard) -> Iterator[tuple[str, str, float | None]]:
    """Yield quantity, name and mean speed of all that turns."""
    for name in heard.of("speed"):
        yield "speed", name, heard.summary("speed", name).mean
    plate = heard.layout
    ratios = {} if plate is None else dict(zip(plate.inertia_names, speed_ratios(plate).tolist(), strict=True))
    for name in heard.of("velocity"):
        known = heard.omega is not None and name in ratios
        yield "velocity", name, ratios[name] * heard.speed if known else None
