"""Impacts of every clearance: how often, how fast, how hard.

An impact is a crossing outward into contact, counted if it begins in the steady part [discard T, end]; its approach
speed is |delta'| at the crossing, its impulse the integral of the element's force over the contact (magnitudes here;
``gearrattle.signals.find_impacts`` has every one with its sign). A contact that the end of the motion cuts short
counts with what it has gathered by then, and is noted.

Takes a Trajectory; gives rates for every clearance, speeds and impulses for those that are hit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.criteria.base import Entry, deflection_rate_unit, entry, impulse_unit
from gearrattle.signals import Impacts, Window, find_impacts, steady
from gearrattle.trajectory import Trajectory


@dataclass(frozen=True)
class ImpactStatistics:
    """Rate, approach speed and impulse of impacts."""

    name: str = "impacts"
    title: str = "Impacts"
    formula: str = "crossings outward (|to| > |from|) into contact in [discard T, end]"
    unit: str = "1/cycle"
    source: str = "definition: first crossing of a corner to its return, from the log of corner crossings"

    def evaluate(self, trajectory: Trajectory) -> list[Entry]:
        """Return the impact statistics of every clearance."""
        window = steady(trajectory)
        found = find_impacts(trajectory).within(window)
        entries: list[Entry] = []
        for k, name in enumerate(trajectory.layout.clearance_names):
            mine = found.of(k)
            entries += self._rates(name, mine, window)
            if len(mine):
                entries += self._severity(trajectory, k, mine)
        return entries

    def _rates(self, name: str, mine: Impacts, window: Window) -> list[Entry]:
        count, drive = len(mine), int(np.count_nonzero(mine.drive))
        per_cycle = f"{self.formula} / cycles"
        return [
            entry(self, name, "impacts per cycle", count / window.cycles, formula=per_cycle),
            entry(self, name, "drive-side impacts per cycle", drive / window.cycles, formula=per_cycle),
            entry(self, name, "coast-side impacts per cycle", (count - drive) / window.cycles, formula=per_cycle),
            entry(
                self, name, "impacts per second", count / window.duration, unit="1/s", formula=f"{self.formula} / time"
            ),
        ]

    def _severity(self, trajectory: Trajectory, clearance: int, mine: Impacts) -> list[Entry]:
        layout = trajectory.layout
        name = layout.clearance_names[clearance]
        element = int(layout.clearance[clearance])
        speed, push = np.abs(mine.velocity), np.abs(mine.impulse)
        rate_unit, push_unit = deflection_rate_unit(layout, element), impulse_unit(layout, element)
        note = ""
        if np.isnan(push).any():
            note = f"{name}: no impulses, for {trajectory.cost.algorithm} supplies no force integral"
        elif mine.censored.any():
            note = f"{name}: the motion ends within a contact; its impulse counts up to the end"
        of_speed, of_push = "|delta'| at the crossing", "|integral of the force over the contact|"
        return [
            entry(self, name, "mean approach speed", float(speed.mean()), unit=rate_unit, formula=f"mean {of_speed}"),
            entry(self, name, "largest approach speed", float(speed.max()), unit=rate_unit, formula=f"max {of_speed}"),
            entry(self, name, "mean impulse", float(push.mean()), unit=push_unit, formula=f"mean {of_push}", note=note),
            entry(
                self, name, "largest impulse", float(push.max()), unit=push_unit, formula=f"max {of_push}", note=note
            ),
        ]
