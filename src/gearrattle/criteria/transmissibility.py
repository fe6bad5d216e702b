"""Transmissibility: how much of the driven inertia's acceleration reaches each inertia.

TR_rms,i = rms(theta_i'') / rms(theta_r'') and TR_peak,i = pp(theta_i'') / pp(theta_r'') over the last eight cycles,
r being the inertia that carries the first torque (Padmanabhan et al. 1995, eqs. (23)-(25)); the accelerations are
taken as they are, mean included. Of an exact motion extremes and means are taken between its samples; those of samples,
the rms integral by the trapezoidal rule over whole periods, carry an estimate of their error.

Takes a Trajectory; gives two entries an inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.criteria.base import PAPER, Entry, Scope, Tally, Telling, entry
from gearrattle.signals.last_levels import gather_levels, peak_to_peak_of, rms_of, shortened
from gearrattle.trajectory import Trajectory


@dataclass(frozen=True)
class Transmissibility(Telling):
    """Ratio of rms and of peak-to-peak accelerations to those of the reference inertia."""

    cycles: int = 8
    name: str = "transmissibility"
    title: str = "Transmissibility"
    formula: str = "rms(theta_i'') / rms(theta_r'') and pp(theta_i'') / pp(theta_r''), r: reference inertia, last 8 T"
    unit: str = "1"
    source: str = f"{PAPER}, eqs. (23)-(25)"
    sums: str = "last cycles"
    merging: str = "exact: levels of each of the last eight cycles are kept across chunks"

    def gather(self, trajectory: Trajectory, before: Tally | None) -> Tally:
        """Return levels of the accelerations in the last cycles."""
        return gather_levels(trajectory, before, self.cycles)

    def tell(self, tally: Tally, scope: Scope) -> list[Entry]:
        """Return TR_rms and TR_peak of every inertia; NaN, with a note, where the reference does not move."""
        layout = scope.layout
        cycles = min(self.cycles, scope.window.cycles)
        reference = layout.inertia_names[layout.reference]
        short = shortened("transmissibility", cycles, self.cycles)
        entries = []
        for quantity, over, level in (
            ("TR rms", f"rms(theta_i'') / rms(theta_{reference}'')", rms_of(tally)),
            ("TR peak", f"pp(theta_i'') / pp(theta_{reference}'')", peak_to_peak_of(tally)),
        ):
            base = float(level.value[layout.reference])
            still = "" if base > 0.0 else f"{quantity}: {reference} shows no acceleration to refer to"
            for i, inertia in enumerate(layout.inertia_names):
                value = error = float("nan")
                if base > 0.0:
                    value, error = float(level.value[i]) / base, float(level.error[i]) / base
                    error += value * float(level.error[layout.reference]) / base if i != layout.reference else -error
                words = f"{over}, last {cycles} T"
                entries.append(entry(self, inertia, quantity, value, formula=words, note=still or short, error=error))
        return entries
