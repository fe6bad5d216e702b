"""Record of a run-up's validation: the amplitude of every order over speed, measured and simulated.

Every sigma has the sign of the paper's Table 5: positive where the simulation reads low. Intervals are 95 % ones and
come from repeated run-ups alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from gearrattle.comparison.comparison_record import Record
from gearrattle.json_types import Json, json_value
from gearrattle.measured.order_over_speed import Track
from gearrattle.result import Result
from gearrattle.wording import counted

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class RunUp(Result, Record):
    """A simulated run-up against measured ones.

    Attributes
    ----------
    model
        name of the driveline.
    sources
        sources of the measurements.
    algorithm
        algorithm of the simulation.
    turns
        turns of the shaft in a block.
    units
        units of the model.
    tracks
        one for every channel and order.
    notes
        sentences that the user must know.

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
        names = ("model", "sources", "algorithm", "turns", "units", "notes")
        return {
            **{name: json_value(getattr(self, name)) for name in names},
            "verdict": self.verdict,
            "tracks": [track.to_dict() for track in self.tracks],
        }

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row per channel and order: levels over speed, sigma [%], the peaks and their speeds [rad/s]."""
        import pandas as pd

        return pd.DataFrame([track.summary() for track in self.tracks])
