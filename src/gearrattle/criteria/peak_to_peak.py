"""Peak-to-peak acceleration of every inertia, the paper's measure against experiment (its Table 5).

pp(theta_i'') = max - min over the samples of the last eight cycles (Padmanabhan et al. 1995, sec. 8). A peak between
two samples is missed: the value is as fine as the output grid.

Takes a Trajectory; gives one entry an inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.criteria.base import PAPER, Entry, Scope, Tally, Telling, entry, gather_last
from gearrattle.signals import peak_to_peak
from gearrattle.trajectory import Trajectory
from gearrattle.wording import counted


@dataclass(frozen=True)
class PeakToPeak(Telling):
    """Peak-to-peak acceleration."""

    cycles: int = 8
    name: str = "peak_to_peak"
    title: str = "Peak-to-peak acceleration"
    formula: str = "max theta_i'' - min theta_i'' over the samples of the last 8 T"
    unit: str = "rad/s^2"
    source: str = f"{PAPER}, sec. 8 and Table 5"

    merging: str = "exact: the last eight cycles are kept across chunks"

    def gather(self, trajectory: Trajectory, before: Tally | None) -> Tally:
        """Return the accelerations of the last cycles."""
        return gather_last(trajectory, before, self.cycles)

    def tell(self, tally: Tally, scope: Scope) -> list[Entry]:
        """Return the peak-to-peak acceleration of every inertia."""
        cycles = min(self.cycles, scope.window.cycles)
        level = peak_to_peak(tally["acceleration"])
        short = ""
        if cycles < self.cycles:
            remain = f"{counted(cycles, 'cycle')} remain{'s' * (cycles == 1)}"
            short = f"peak-to-peak acceleration over fewer than {counted(self.cycles, 'cycle')}: "
            short += f"{remain} after the discarded ones"
        words = f"max theta_i'' - min theta_i'' over the samples of the last {cycles} T"
        names = scope.layout.inertia_names
        return [
            entry(self, name, "peak-to-peak acceleration", float(value), formula=words, note=short)
            for name, value in zip(names, level, strict=True)
        ]
