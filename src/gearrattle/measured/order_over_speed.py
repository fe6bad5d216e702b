"""An order of a run-up over speed: its amplitude measured and simulated.

Sigma has the sign of the paper's Table 5: positive where the simulation reads low.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gearrattle.comparison.comparison_record import Record
from gearrattle.json_types import Json, json_value
from gearrattle.measured.paper_sigma import NEGLIGIBLE, sigma
from gearrattle.trajectory import Array


@dataclass(frozen=True, eq=False)
class Track(Record):
    """One order of one channel over speed.

    Attributes
    ----------
    channel, partner
        measured and simulated one.
    unit
        of the amplitudes.
    order
        multiple of the shaft's speed [1].
    speed
        (n,) ascending [rad/s].
    measured
        (n,) amplitude, the mean of repeats.
    simulated
        (n,) amplitude.
    error
        (n,) standard error of the measured one by the scatter of repeats; NaN of one run-up.
    reach
        (n,) half the interval of the measured one; NaN likewise.
    """

    channel: str
    partner: str
    unit: str
    order: float
    speed: Array
    measured: Array
    simulated: Array
    error: Array
    reach: Array

    @property
    def levels(self) -> tuple[float, float]:
        """Root mean square of both amplitudes over the speeds."""
        one, other = (float(np.sqrt(np.mean(signal**2))) for signal in (self.measured, self.simulated))
        return one, other

    @property
    def sigma(self) -> float:
        """Of these levels [%]."""
        return sigma(*self.levels)

    @property
    def peaks(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Speed [rad/s] and amplitude of the largest, measured and simulated."""
        at = int(np.argmax(self.measured)), int(np.argmax(self.simulated))
        first = float(self.speed[at[0]]), float(self.measured[at[0]])
        return first, (float(self.speed[at[1]]), float(self.simulated[at[1]]))

    @property
    def outside(self) -> float:
        """Share of the speeds at which the simulation lies outside the interval [1]; NaN without repeats."""
        if not np.isfinite(self.reach).all():
            return float("nan")
        far = np.abs(self.measured - self.simulated)
        return float(np.mean((far > self.reach) & (far > 0.01 * NEGLIGIBLE * self.measured)))

    def summary(self) -> dict[str, Any]:
        """Return the numbers of a row, in JSON types."""
        (at, peak), (simulated_at, simulated_peak) = self.peaks
        content = {
            "channel": self.channel,
            "partner": self.partner,
            "unit": self.unit,
            "order": self.order,
            "measured": self.levels[0],
            "simulated": self.levels[1],
            "sigma": self.sigma,
            "peak_speed": at,
            "peak": peak,
            "simulated_peak_speed": simulated_at,
            "simulated_peak": simulated_peak,
            "outside": self.outside,
        }
        return {key: json_value(value) for key, value in content.items()}

    def to_dict(self) -> dict[str, Json]:
        """Return everything in JSON types."""
        return {
            **self.summary(),
            "speed": json_value(self.speed),
            "measured_over_speed": json_value(self.measured),
            "simulated_over_speed": json_value(self.simulated),
            "standard_error": json_value(self.error),
        }
