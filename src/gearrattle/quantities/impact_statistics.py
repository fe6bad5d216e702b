"""Impacts of every clearance: rate, approach speed, momentum and energy.

An impact is a crossing outward into contact, counted if it begins in the steady part [discard T, end]. With v the
deflection rate at the crossing, v' that at the end of the contact, and m_eff the reduced inertia of the element
(1/m_eff = r_a^2/J_a + r_b^2/J_b), impacts are measured by

    approach speed |v|,    momentum m_eff |v|,    energy m_eff v^2 / 2,    exchanged momentum m_eff (|v| + |v'|),

The exchanged momentum is the integral over the contact of the force above the quasi-static load
(``gearrattle.signals.impacts`` has every impact with its sign). The contact impulse is the integral of the whole force,
static load included: it grows with the length of the contact and does not measure how hard an impact is. For a contact
that is still closed at the end of the motion, v' = 0, the contact impulse is that up to the end, and a note says so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.quantities.quantity import (
    CrossingQuantity,
    Row,
    Scope,
    State,
    Sums,
    Values,
    deflection_rate_unit,
    impulse_unit,
)
from gearrattle.signals import centre_words, measure_impacts, summarise_impacts
from gearrattle.trajectory import Array, Layout

_HARDNESS = {
    "approach speed": ("speed", "|delta'| at the crossing"),
    "impact momentum": ("momentum", "m_eff |delta'| at the crossing"),
    "impact energy": ("energy", "m_eff delta'^2 / 2 at the crossing"),
    "exchanged momentum": ("exchanged", "m_eff (|delta'| at the start + |delta'| at the end of the contact)"),
    "contact impulse": ("impulse", "|integral of the force over the contact|"),
}
"""Measures of the hardness of impacts: name of the quantity, field of ``signals.Hardness``, formula."""


@dataclass(frozen=True)
class ImpactStatistics(CrossingQuantity):
    """Rate and hardness of impacts."""

    name: str = "impacts"
    title: str = "Impacts"
    formula: str = "crossings into contact, from the centre or outward (|to| > |from|), in [discard T, end]"
    unit: str = "1/cycle"
    source: str = "definition: first crossing of a corner to its return, from the log of corner crossings"
    merging: str = "exact: counts and sums add up, peaks are the largest; a contact across chunks is one contact"

    def occasional(self, layout: Layout) -> list[Row]:
        """Return rates (0 without a clearance) and hardness; without impacts the largest is 0 and the mean NaN."""
        rows = []
        for clearance, name in zip(layout.clearance.tolist(), layout.clearance_names, strict=True):
            rows += [self.row(name, f"{of}impacts per cycle", 0.0) for of in ("", "drive-side ", "coast-side ")]
            rows.append(self.row(name, "impacts per second", 0.0, unit="1/s"))
            for what in _HARDNESS:
                unit = _unit(layout, clearance, what)
                rows.append(self.row(name, f"mean {what}", float("nan"), unit=unit, note="no impact"))
                rows.append(self.row(name, f"largest {what}", 0.0, unit=unit, note="no impact"))
        return rows

    def values(self, state: State, layout: Layout, cycles: int, duration: Array) -> Values:
        """Return rates and hardness for every clearance; without impacts the largest is 0 and the mean NaN."""
        values: dict[tuple[str, str], Array] = {}
        for k, name in enumerate(layout.clearance_names):
            count = state["count"][..., k]
            drive = state["drive"][..., k]
            values |= {
                (name, "impacts per cycle"): count / cycles,
                (name, "drive-side impacts per cycle"): drive / cycles,
                (name, "coast-side impacts per cycle"): (count - drive) / cycles,
                (name, "impacts per second"): count / duration,
            }
            hardness = measure_impacts(state, layout, k)._asdict()
            for quantity, (field, _) in _HARDNESS.items():
                values[name, f"mean {quantity}"] = hardness[f"mean_{field}"]
                values[name, f"largest {quantity}"] = np.where(count > 0.0, hardness[f"largest_{field}"], 0.0)
        return values

    def rows(self, sums: Sums) -> list[Row]:
        """Return the impact statistics of every clearance."""
        scope = sums.steady
        state = sums.states["crossings"]
        rows = []
        layout = scope.layout
        hit = {name for k, name in enumerate(layout.clearance_names) if state["count"][k]}
        for (name, quantity), value in self.values_of(sums).items():
            statistic, _, what = quantity.partition(" ")
            clearance = layout.clearance_names.index(name)
            if what not in _HARDNESS:
                per = "time" if quantity == "impacts per second" else "cycles"
                unit = "1/s" if per == "time" else None
                formula = f"{self.formula} / {per}"
                note = ""
            elif name not in hit:
                continue
            else:
                word = "mean" if statistic == "mean" else "max"
                unit = _unit(layout, int(layout.clearance[clearance]), what)
                formula = f"{word} {_HARDNESS[what][1]}"
                note = _note(state, scope, clearance, what)
            formula += centre_words(layout, clearance)
            rows.append(self.row(name, quantity, float(value), unit=unit, formula=formula, note=note))
        return rows


def _unit(layout: Layout, element: int, what: str) -> str:
    if what == "approach speed":
        return deflection_rate_unit(layout, element)
    return "J" if what == "impact energy" else impulse_unit(layout, element)


def _note(state: State, scope: Scope, clearance: int, what: str) -> str:
    """Note contacts that are still closed at the end, and values that do not exist."""
    name = scope.layout.clearance_names[clearance]
    summary = summarise_impacts(state, scope.layout, clearance)
    if what == "contact impulse":
        if scope.layout.is_bearing[scope.layout.clearance[clearance]]:
            return ""  # faces all around push in different directions
        if np.isnan(summary.hardness.mean_impulse):
            return f"{name}: no contact impulses, for {scope.algorithm} supplies no force integral"
        return f"{name}: the motion ends within a contact; its impulse counts up to the end" if summary.censored else ""
    if what != "approach speed" and np.isnan(summary.hardness.mean_momentum):
        return f"{name}: no body at it is free to move, so impacts have no momentum"
    return ""
