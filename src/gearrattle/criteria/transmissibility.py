"""Transmissibility: how much of the driven inertia's acceleration reaches each inertia.

TR_rms,i = rms(theta_i'') / rms(theta_r'') and TR_peak,i = pp(theta_i'') / pp(theta_r'') over the last eight cycles,
r being the inertia that carries the first torque (Padmanabhan et al. 1995, eqs. (23)-(25)); the accelerations are
taken as they are, mean included, and the rms integral by the trapezoidal rule over whole periods.

Takes a Trajectory; gives two entries an inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.criteria.base import PAPER, Entry, Scope, Tally, Telling, entry, gather_last
from gearrattle.signals import peak_to_peak, rms
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

    merging: str = "exact: the last eight cycles are kept across chunks"

    def gather(self, trajectory: Trajectory, before: Tally | None) -> Tally:
        """Return the accelerations of the last cycles."""
        return gather_last(trajectory, before, self.cycles)

    def tell(self, tally: Tally, scope: Scope) -> list[Entry]:
        """Return TR_rms and TR_peak of every inertia; NaN, with a note, where the reference does not move."""
        layout, acceleration = scope.layout, tally["acceleration"]
        cycles = min(self.cycles, scope.window.cycles)
        reference = layout.inertia_names[layout.reference]
        short = "" if cycles == self.cycles else _shortened(cycles, self.cycles)
        entries = []
        for quantity, over, level in (
            ("TR rms", f"rms(theta_i'') / rms(theta_{reference}'')", rms(acceleration)),
            ("TR peak", f"pp(theta_i'') / pp(theta_{reference}'')", peak_to_peak(acceleration)),
        ):
            base = float(level[layout.reference])
            still = "" if base > 0.0 else f"{quantity}: {reference} shows no acceleration to refer to"
            for inertia, own in zip(layout.inertia_names, level, strict=True):
                value = float(own) / base if base > 0.0 else float("nan")
                words = f"{over}, last {cycles} T"
                entries.append(entry(self, inertia, quantity, value, formula=words, note=still or short))
        return entries


def _shortened(cycles: int, wanted: int) -> str:
    remain = "1 cycle remains" if cycles == 1 else f"{cycles} cycles remain"
    return f"transmissibility over fewer than {wanted} cycles: {remain} after the discarded ones"
