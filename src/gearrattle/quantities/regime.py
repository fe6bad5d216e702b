"""Impact regime of every mesh and clearance: quiet, single-sided or double-sided.

From the corner crossings of the steady part, exactly: no crossing is "quiet" (the element may be in contact all the
time, or float free), crossings of drive-side corners only or of coast-side ones only are "single-sided", of both
"double-sided" (Padmanabhan et al. 1995, sec. 6 and Fig. 3: no impact, single- and double-sided impact). Of a gap only
the corners of its centre count, where it separates: a gap that is not quiet rattles. Of a spring with stiffness in all
its stages every corner counts: it changes stage, which is no rattle.

Takes a Trajectory; gives one entry an element.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.quantities.criterion import (
    PAPER,
    SEVERITY,
    Entry,
    Measures,
    Scope,
    Tally,
    Telling,
    entry,
    judged_elements,
    measured,
)
from gearrattle.signals import add_crossings, centre_words, steady
from gearrattle.trajectory import Array, Layout, Trajectory


@dataclass(frozen=True)
class ImpactRegime(Telling):
    """Sides on which corners are crossed."""

    name: str = "regime"
    title: str = "Impact regime"
    formula: str = "corners crossed in [discard T, end]: none, on one side of the centre, on both"
    unit: str = ""
    source: str = f"{PAPER}, sec. 6 and Fig. 3"
    sums: str = "crossings"
    merging: str = "exact: a side crossed in any chunk is crossed"

    def occasional(self, layout: Layout) -> list[Entry]:
        """Return the regime of every part: one that has no corner in some variant is quiet there."""
        return [entry(self, layout.element_names[element], "regime", "quiet") for element, _ in judged_elements(layout)]

    def gather(self, trajectory: Trajectory, before: Tally | None) -> Tally:
        """Return sides (K, 2): 1 where a clearance crosses corners of its drive side, of its coast side; and others."""
        return add_crossings(before, trajectory, steady(trajectory))

    def measure(self, tally: Tally, layout: Layout, _cycles: int, _duration: Array) -> Measures:
        """Return the regime of every mesh and clearance, by its severity; a mesh without a corner is quiet."""
        sides = tally["sides"] > 0.0
        code = sides.sum(axis=-1)
        return {
            (layout.element_names[k], self.name): np.zeros(code.shape[:-1])
            if clearance is None
            else code[..., clearance]
            for k, clearance in judged_elements(layout)
        }

    def tell(self, tally: Tally, scope: Scope) -> list[Entry]:
        """Return the regime of every mesh and clearance."""
        words = list(SEVERITY)
        return [
            entry(self, name, quantity, words[int(code)], formula=self.formula + _centre(scope.layout, name))
            for (name, quantity), code in measured(self, tally, scope).items()
        ]


def _centre(layout: Layout, element: str) -> str:
    """Say what the centre of an element is; nothing for one without corners."""
    names = layout.clearance_names
    return centre_words(layout, names.index(element)) if element in names else ""
