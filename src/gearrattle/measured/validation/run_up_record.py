"""What the validation of a run-up holds: the amplitude of every order over speed, measured and simulated.

Every sigma has the sign of the paper's Table 5: positive where the simulation reads low. Intervals are 95 % ones and
come from repeated run-ups alone.

Takes numbers; gives frozen records to plots, reports and commands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearrattle.comparison.record import Record
from gearrattle.json_types import Json, json_value
from gearrattle.measured.validation.record import NEGLIGIBLE
from gearrattle.measured.validation.sigma import sigma
from gearrattle.result import Result
from gearrattle.trajectory import Array
from gearrattle.wording import counted

if TYPE_CHECKING:
    import pandas as pd


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


@dataclass(frozen=True, eq=False)
class RunUp(Result, Record):
    """A simulated run-up against measured ones.

    Attributes
    ----------
    model
        its name.
    sources
        of the measurements.
    algorithm
        of the simulation.
    turns
        in a block.
    units
        of the model.
    tracks
        a channel and order each.
    notes
        what the user must know.

    Examples
    --------
    >>> run = gr.simulate(gr.example("run_up"), samples_per_cycle=64, audit=False)
    >>> data = run.data["velocity"]
    >>> shaft = 1.1 * data.sel(inertia="input_shaft").values
    >>> gear = gr.measured.Channel("gear", "velocity", "input_shaft", "rad/s", shaft)
    >>> speed = gr.measured.Channel("n", "speed", "", "rad/s", run.data["speed"].values)
    >>> rig = gr.measured.Recording(data.time.values, (gear, speed), "rig")
    >>> answer = gr.validate_run_up(run, rig, [2.0], speed="n")
    >>> [track.order for track in answer.tracks]
    [2.0]
    """

    kind: ClassVar[str] = "validation of a run-up"
    model: str
    sources: tuple[str, ...]
    algorithm: str
    turns: float
    units: str
    tracks: tuple[Track, ...]
    notes: tuple[str, ...]

    def __getitem__(self, key: tuple[str, float]) -> Track:
        """Return a track by channel, measured or simulated, and order."""
        name, order = key
        return next(t for t in self.tracks if name in (t.channel, t.partner) and abs(t.order - order) < 1e-9)

    @property
    def channels(self) -> tuple[str, ...]:
        """Measured channels."""
        return tuple(dict.fromkeys(track.channel for track in self.tracks))

    def of(self, channel: str) -> Sequence[Track]:
        """Return the tracks of a channel."""
        return [track for track in self.tracks if track.channel == channel]

    @property
    def verdict(self) -> str:
        """The largest disagreement in a sentence: of rms over speed, as a share of the channel's largest order."""
        worst = max(self.tracks, key=lambda t: abs(t.levels[0] - t.levels[1]) / self._largest(t.channel))
        low = "low" if worst.sigma > 0.0 else "high"
        return (
            f"{counted(len(self.tracks), 'order')} of {counted(len(self.channels), 'channel')} over speed; look "
            f"first at {worst.channel}, "
            f"order {worst.order:g}: over the run-up it is simulated {abs(worst.sigma):.3g} % {low}."
        )

    def _largest(self, channel: str) -> float:
        return max((track.levels[0] for track in self.of(channel)), default=0.0) or 1.0

    def to_dict(self) -> dict[str, Json]:
        """Return everything in JSON types."""
        tracks = [
            {
                **track.summary(),
                "speed": json_value(track.speed),
                "measured_over_speed": json_value(track.measured),
                "simulated_over_speed": json_value(track.simulated),
                "standard_error": json_value(track.error),
            }
            for track in self.tracks
        ]
        names = ("model", "sources", "algorithm", "turns", "units", "notes")
        return {**{name: json_value(getattr(self, name)) for name in names}, "verdict": self.verdict, "tracks": tracks}

    def to_dataframe(self) -> pd.DataFrame:
        """Return a row a channel and order: levels over speed, sigma [%], the peaks and their speeds [rad/s]."""
        import pandas as pd

        return pd.DataFrame([track.summary() for track in self.tracks])
