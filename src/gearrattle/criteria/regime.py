"""Impact regime of every mesh and clearance: quiet, single-sided or double-sided.

From the corner crossings of the steady part, exactly: no crossing is "quiet" (the element may be in contact all the
time, or float free), crossings of drive-side corners only or of coast-side ones only are "single-sided", of both
"double-sided" (Padmanabhan et al. 1995, sec. 6 and Fig. 3: no impact, single- and double-sided impact).

Takes a Trajectory; gives one entry an element.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.criteria.base import PAPER, Entry, entry, judged_elements
from gearrattle.signals import regime, steady
from gearrattle.trajectory import Trajectory


@dataclass(frozen=True)
class ImpactRegime:
    """Sides on which corners are crossed."""

    name: str = "regime"
    title: str = "Impact regime"
    formula: str = "corners crossed in [discard T, end]: none, on one side of the centre, on both"
    unit: str = ""
    source: str = f"{PAPER}, sec. 6 and Fig. 3"

    def evaluate(self, trajectory: Trajectory) -> list[Entry]:
        """Return the regime of every mesh and clearance; a mesh without a corner is quiet."""
        window = steady(trajectory)
        names = trajectory.layout.element_names
        return [
            entry(self, names[k], "regime", "quiet" if clearance is None else regime(trajectory, clearance, window))
            for k, clearance in judged_elements(trajectory.layout)
        ]
