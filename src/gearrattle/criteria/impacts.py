"""Impacts of every clearance: how often, how fast, how hard.

An impact is a crossing outward into contact, counted if it begins in the steady part [discard T, end]; its approach
speed is |delta'| at the crossing, its impulse the integral of the element's force over the contact (magnitudes here;
``gearrattle.signals.find_impacts`` has every one with its sign). A contact that the end of the motion cuts short
counts with what it has gathered by then, and is noted.

Takes Trajectories; gives rates for every clearance, speeds and impulses for those that are hit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.criteria.base import Entry, Scope, Tally, Telling, deflection_rate_unit, entry, impulse_unit
from gearrattle.signals import ImpactSummary, Window, add_impacts, steady, summarise_impacts
from gearrattle.trajectory import Trajectory


@dataclass(frozen=True)
class ImpactStatistics(Telling):
    """Rate, approach speed and impulse of impacts."""

    name: str = "impacts"
    title: str = "Impacts"
    formula: str = "crossings outward (|to| > |from|) into contact in [discard T, end]"
    unit: str = "1/cycle"
    source: str = "definition: first crossing of a corner to its return, from the log of corner crossings"

    merging: str = "exact: counts and sums add up, peaks are the largest; a contact across chunks is one contact"

    def gather(self, trajectory: Trajectory, before: Tally | None) -> Tally:
        """Return counts, sums and peaks by clearance, and the contacts still open (see ``add_impacts``)."""
        return add_impacts(before, trajectory, steady(trajectory))

    def tell(self, tally: Tally, scope: Scope) -> list[Entry]:
        """Return the impact statistics of every clearance."""
        entries: list[Entry] = []
        for k, name in enumerate(scope.layout.clearance_names):
            found = summarise_impacts(tally, scope.layout, k)
            entries += self._rates(name, found, scope.window)
            if found.count:
                entries += self._severity(scope, k, found)
        return entries

    def _rates(self, name: str, found: ImpactSummary, window: Window) -> list[Entry]:
        per_cycle, per_second = f"{self.formula} / cycles", f"{self.formula} / time"
        coast = found.count - found.drive
        return [
            entry(self, name, "impacts per cycle", found.count / window.cycles, formula=per_cycle),
            entry(self, name, "drive-side impacts per cycle", found.drive / window.cycles, formula=per_cycle),
            entry(self, name, "coast-side impacts per cycle", coast / window.cycles, formula=per_cycle),
            entry(self, name, "impacts per second", found.count / window.duration, unit="1/s", formula=per_second),
        ]

    def _severity(self, scope: Scope, clearance: int, found: ImpactSummary) -> list[Entry]:
        layout = scope.layout
        name = layout.clearance_names[clearance]
        element = int(layout.clearance[clearance])
        rate_unit, push_unit = deflection_rate_unit(layout, element), impulse_unit(layout, element)
        note = ""
        if np.isnan(found.mean_impulse):
            note = f"{name}: no impulses, for {scope.algorithm} supplies no force integral"
        elif found.censored:
            note = f"{name}: the motion ends within a contact; its impulse counts up to the end"
        of_speed, of_push = "|delta'| at the crossing", "|integral of the force over the contact|"
        mean, top = found.mean_impulse, found.largest_impulse
        return [
            entry(self, name, "mean approach speed", found.mean_speed, unit=rate_unit, formula=f"mean {of_speed}"),
            entry(self, name, "largest approach speed", found.largest_speed, unit=rate_unit, formula=f"max {of_speed}"),
            entry(self, name, "mean impulse", mean, unit=push_unit, formula=f"mean {of_push}", note=note),
            entry(self, name, "largest impulse", top, unit=push_unit, formula=f"max {of_push}", note=note),
        ]
