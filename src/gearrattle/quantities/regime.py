"""Impact regime of every mesh and clearance: quiet, single-sided or double-sided.

The regime follows exactly from the corner crossings of the steady part: "quiet" without crossings (the element may be
in contact all the time, or free all the time); "single-sided" if it crosses corners on the drive side only or on the
coast side only; "double-sided" if it crosses corners on both sides (Padmanabhan et al. 1995, sec. 6 and Fig. 3: no
impact, single- and double-sided impact). For a gap only the corners of its centre count, where it separates. For a
spring with stiffness in all its stages every corner counts: it changes stage, which is not rattle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np

from gearrattle.quantities.quantity import PAPER, CrossingQuantity, Row, State, Sums, Values, judged_elements
from gearrattle.signals import Regime, centre_words
from gearrattle.trajectory import Array, Layout


@dataclass(frozen=True)
class ImpactRegime(CrossingQuantity):
    """Sides on which corners are crossed."""

    name: str = "regime"
    title: str = "Impact regime"
    formula: str = "corners crossed in [discard T, end]: none, on one side of the centre, on both"
    unit: str = ""
    source: str = f"{PAPER}, sec. 6 and Fig. 3"
    merging: str = "exact: a side crossed in any chunk is crossed"

    def occasional(self, layout: Layout) -> list[Row]:
        """Return the regime of every part; a part without a corner in some variant is quiet there."""
        return [self.row(layout.element_names[element], "regime", "quiet") for element, _ in judged_elements(layout)]

    def values(self, state: State, layout: Layout, _cycles: int, _duration: Array) -> Values:
        """Return the regime of every mesh and clearance as a number; a mesh without a corner is quiet."""
        sides = state["sides"] > 0.0
        code = sides.sum(axis=-1)
        return {
            (layout.element_names[k], self.name): np.zeros(code.shape[:-1])
            if clearance is None
            else code[..., clearance]
            for k, clearance in judged_elements(layout)
        }

    def rows(self, sums: Sums) -> list[Row]:
        """Return the regime of every mesh and clearance."""
        words = get_args(Regime)
        layout = sums.steady.layout
        return [
            self.row(name, quantity, words[int(code)], formula=self.formula + _centre(layout, name))
            for (name, quantity), code in self.values_of(sums).items()
        ]


def _centre(layout: Layout, element: str) -> str:
    """Return in words what the centre of an element is; empty for an element without corners."""
    names = layout.clearance_names
    return centre_words(layout, names.index(element)) if element in names else ""
