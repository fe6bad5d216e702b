"""Severity of every mesh and clearance: quiet, touches or rattles.

The regime says on which sides corners are crossed, also by negligible impacts. Severity says how hard the impacts are:
a gap that separates *rattles* if one of its impacts reaches every threshold that applies to it (``Layout.negligible``),
and *touches* if no impact does. For one element, the energy m_eff v^2 / 2 increases with the speed |v|, so it is enough
to check the fastest impact. A gap that separates and does not close again has a largest impact of 0. A gap that does
not separate is quiet; so is a staged spring that changes stage.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.quantities.quantity import CrossingQuantity, Row, State, Sums, Values, judged_elements
from gearrattle.signals import SEVERITIES, are_negligible, is_gap
from gearrattle.trajectory import Array, Layout

_QUIET, _TOUCHES, _RATTLES = range(3)


@dataclass(frozen=True)
class ImpactSeverity(CrossingQuantity):
    """Severity of impacts by the thresholds for negligible impacts."""

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
        """Return the severity of every part; a part without a corner in some variant is quiet there."""
        return [self.row(layout.element_names[element], "severity", "quiet") for element, _ in judged_elements(layout)]

    def values(self, state: State, layout: Layout, _cycles: int, _duration: Array) -> Values:
        """Return the severity of every mesh and clearance as a number; a mesh without a corner is quiet."""
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
