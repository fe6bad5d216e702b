"""Peak-to-peak acceleration of every inertia, the paper's measure against experiment (its Table 5).

pp(theta_i'') = max - min over the last eight cycles (Padmanabhan et al. 1995, sec. 8, over samples); of an exact motion
between its samples too, both limits at every crossing included. A value of samples carries an estimate of its error.

Takes a Trajectory; gives one entry an inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.quantities.criterion import PAPER, Entry, Scope, Tally, Telling, entry
from gearrattle.signals.last_levels import gather_levels, peak_to_peak_of, shortened
from gearrattle.trajectory import Trajectory


@dataclass(frozen=True)
class PeakToPeak(Telling):
    """Peak-to-peak acceleration."""

    cycles: int = 8
    name: str = "peak_to_peak"
    title: str = "Peak-to-peak acceleration"
    formula: str = "max theta_i'' - min theta_i'' over the last 8 T"
    unit: str = "rad/s^2"
    source: str = f"{PAPER}, sec. 8 and Table 5"
    sums: str = "last cycles"
    merging: str = "exact: extremes of each of the last eight cycles are kept across chunks"

    def gather(self, trajectory: Trajectory, before: Tally | None) -> Tally:
        """Return levels of the accelerations in the last cycles."""
        return gather_levels(trajectory, before, self.cycles)

    def tell(self, tally: Tally, scope: Scope) -> list[Entry]:
        """Return the peak-to-peak acceleration of every inertia."""
        cycles = min(self.cycles, scope.window.cycles)
        level, short = peak_to_peak_of(tally), shortened("peak-to-peak acceleration", cycles, self.cycles)
        words = f"max theta_i'' - min theta_i'' over the last {cycles} T"
        return [
            entry(self, name, "peak-to-peak acceleration", value, formula=words, note=short, error=error)
            for name, value, error in zip(scope.layout.inertia_names, *level, strict=True)
        ]
