"""Severity of every mesh and clearance: quiet, touches or rattles.

The regime says where corners are crossed, however softly. Severity says whether that matters: a gap that separates
*rattles* if one of its impacts is as large as every threshold that applies to it (``Layout.negligible``), and *touches*
if none is. The energy m_eff v^2 / 2 of an element and its speed |v| rise together, so the fastest impact decides for
all. A gap that separates and is not hit again has a largest impact of 0. What does not separate is quiet; so is a
staged spring that changes stage.

Takes sums over crossings; gives one row an element.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from gearrattle.quantities.quantity import CrossingQuantity, Row, State, Sums, Values, judged_elements
from gearrattle.signals import is_gap, measure_impacts
from gearrattle.trajectory import Array, Layout, NegligibleImpacts
from gearrattle.wording import engineering, listed

Severity = Literal["quiet", "touches", "rattles"]
SEVERITIES: tuple[Severity, ...] = get_args(Severity)
"""From the mildest on; codes in this order."""
RANKS: Mapping[Severity, int] = {word: rank for rank, word in enumerate(SEVERITIES)}
_QUIET, _TOUCHES, _RATTLES = range(3)


@dataclass(frozen=True)
class ImpactSeverity(CrossingQuantity):
    """Whether impacts matter."""

    name: str = "severity"
    title: str = "Severity"
    formula: str = (
        "quiet: the gap does not separate in [discard T, end]; touches: its largest impact there is negligible; "
        "rattles: it is not"
    )
    unit: str = ""
    source: str = "definition: thresholds of the model, [criteria] negligible"
    merging: str = "exact: the largest impact of all chunks decides"

    def occasional(self, layout: Layout) -> list[Row]:
        """Return the severity of every part: one that has no corner in some variant is quiet there."""
        return [self.row(layout.element_names[element], "severity", "quiet") for element, _ in judged_elements(layout)]

    def values(self, state: State, layout: Layout, _cycles: int, _duration: Array) -> Values:
        """Return the severity of every mesh and clearance by its code; a mesh without a corner is quiet."""
        separates = state["sides"].max(axis=-1) > 0.0
        values: dict[tuple[str, str], Array] = {}
        for element, clearance in judged_elements(layout):
            code = np.zeros(separates.shape[:-1])
            if clearance is not None and is_gap(layout, clearance):
                weak = are_negligible(state, layout, clearance)
                code = np.where(separates[..., clearance], np.where(weak, _TOUCHES, _RATTLES), _QUIET)
            values[layout.element_names[element], self.name] = code
        return values

    def rows(self, sums: Sums) -> list[Row]:
        """Return the severity of every mesh and clearance."""
        return [
            self.row(name, quantity, SEVERITIES[int(code)]) for (name, quantity), code in self.values_of(sums).items()
        ]


def are_negligible(state: State, layout: Layout, clearance: int) -> Array:
    """Return whether all impacts of a clearance are touches, of one motion or of many along leading axes."""
    limits, hardness = layout.negligible, measure_impacts(state, layout, clearance)
    is_hit = state["count"][..., clearance] > 0.0
    speed = np.where(is_hit, hardness.largest_speed, 0.0)
    energy = np.where(is_hit, hardness.largest_energy, 0.0)  # NaN without a free body: no threshold applies
    slowest = limits.speed if layout.is_mesh[layout.clearance[clearance]] else limits.angular_speed
    return np.asarray((speed < slowest) | (energy < limits.energy))


def limits_words(limits: NegligibleImpacts, *, is_si: bool = True) -> str:
    """Say which impacts are negligible."""
    sizes = (
        ("energy", limits.energy, "J", ""),
        ("approach speed", limits.speed, "m/s", " of a mesh"),
        ("approach speed", limits.angular_speed, "rad/s", " of a coupling"),
    )
    words = [
        f"{what} below {engineering(value, unit if is_si else '')}{of}" for what, value, unit, of in sizes if value
    ]
    return f"negligible is an impact with an {listed(words, 'or')}" if words else "no impact is negligible"
