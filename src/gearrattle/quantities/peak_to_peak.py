"""Peak-to-peak acceleration of every inertia, the paper's measure against experiment (its Table 5).

pp(theta_i'') = max - min over the last eight cycles (Padmanabhan et al. 1995, sec. 8, over samples). For an exact
motion it includes the motion between samples, with both limits at every crossing. A value from samples has an estimate
of its error.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.quantities.quantity import PAPER, Quantity, Row, Sums
from gearrattle.signals.last_levels import LAST_CYCLES, peak_to_peak_of, shortened


@dataclass(frozen=True)
class PeakToPeak(Quantity[Sums]):
    """Peak-to-peak acceleration."""

    name: str = "peak_to_peak"
    title: str = "Peak-to-peak acceleration"
    formula: str = "max theta_i'' - min theta_i'' over the last 8 T"
    unit: str = "rad/s^2"
    source: str = f"{PAPER}, sec. 8 and Table 5"
    sums: tuple[str, ...] = ("last cycles",)
    merging: str = "exact: extremes of each of the last eight cycles are kept across chunks"

    def rows(self, sums: Sums) -> list[Row]:
        """Return the peak-to-peak acceleration of every inertia."""
        scope = sums.steady
        state = sums.states["last cycles"]
        cycles = min(LAST_CYCLES, scope.window.cycles)
        level = peak_to_peak_of(state)
        short = shortened("peak-to-peak acceleration", cycles)
        words = f"max theta_i'' - min theta_i'' over the last {cycles} T"
        return [
            self.row(name, "peak-to-peak acceleration", value, formula=words, note=short, error=error)
            for name, value, error in zip(scope.layout.inertia_names, *level, strict=True)
        ]
