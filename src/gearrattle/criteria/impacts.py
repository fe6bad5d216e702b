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

from gearrattle.criteria.base import (
    Entry,
    Measures,
    Scope,
    Tally,
    Telling,
    deflection_rate_unit,
    entry,
    impulse_unit,
    measured,
)
from gearrattle.signals import add_impacts, measure_impacts, steady, summarise_impacts
from gearrattle.trajectory import Array, Layout, Trajectory


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

    def measure(self, tally: Tally, layout: Layout, cycles: int, duration: Array) -> Measures:
        """Return rates for every clearance; speeds and impulses, NaN for those that are not hit."""
        found: dict[tuple[str, str], Array] = {}
        for k, name in enumerate(layout.clearance_names):
            all_, drive = tally["count"][..., k], tally["drive"][..., k]
            severity = measure_impacts(tally, layout, k)
            found |= {
                (name, "impacts per cycle"): all_ / cycles,
                (name, "drive-side impacts per cycle"): drive / cycles,
                (name, "coast-side impacts per cycle"): (all_ - drive) / cycles,
                (name, "impacts per second"): all_ / duration,
                (name, "mean approach speed"): severity.mean_speed,
                (name, "largest approach speed"): severity.largest_speed,
                (name, "mean impulse"): severity.mean_impulse,
                (name, "largest impulse"): severity.largest_impulse,
            }
        return found

    def tell(self, tally: Tally, scope: Scope) -> list[Entry]:
        """Return the impact statistics of every clearance."""
        per_cycle, per_second = f"{self.formula} / cycles", f"{self.formula} / time"
        of_speed, of_push = "|delta'| at the crossing", "|integral of the force over the contact|"
        formulas = {
            "impacts per second": per_second, "mean approach speed": f"mean {of_speed}",
            "largest approach speed": f"max {of_speed}", "mean impulse": f"mean {of_push}",
            "largest impulse": f"max {of_push}",
        }  # fmt: skip
        entries, layout = [], scope.layout
        hit = {name for k, name in enumerate(layout.clearance_names) if tally["count"][k]}
        for (name, quantity), value in measured(self, tally, scope).items():
            if quantity in _SEVERITY and name not in hit:
                continue
            clearance = layout.clearance_names.index(name)
            formula, note = formulas.get(quantity, per_cycle), _note(tally, scope, clearance, quantity)
            unit = _unit(layout, int(layout.clearance[clearance]), quantity)
            entries.append(entry(self, name, quantity, float(value), unit=unit, formula=formula, note=note))
        return entries


_SPEEDS, _PUSHES = ("mean approach speed", "largest approach speed"), ("mean impulse", "largest impulse")
_SEVERITY = (*_SPEEDS, *_PUSHES)


def _unit(layout: Layout, element: int, quantity: str) -> str | None:
    if quantity in _SPEEDS:
        return deflection_rate_unit(layout, element)
    if quantity in _PUSHES:
        return impulse_unit(layout, element)
    return "1/s" if quantity == "impacts per second" else None


def _note(tally: Tally, scope: Scope, clearance: int, quantity: str) -> str:
    """Say what there is to know about impulses."""
    if quantity not in _PUSHES:
        return ""
    name, found = scope.layout.clearance_names[clearance], summarise_impacts(tally, scope.layout, clearance)
    if np.isnan(found.mean_impulse):
        return f"{name}: no impulses, for {scope.algorithm} supplies no force integral"
    return f"{name}: the motion ends within a contact; its impulse counts up to the end" if found.censored else ""
