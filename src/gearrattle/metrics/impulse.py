"""Impulse of impacts, their restitution and mean intensity, from the velocities in the log of crossings.

Two bodies that weigh m along the deflection meet at the rate v and part at v'; e = |v'| / |v| is what they keep of it:

    p = m (1 + e) |v|,      I = (1/t_w) sum of p over the completed contacts that begin in the window  [N or N m]

It is the momentum balance of the two bodies alone: what other elements and torques push during the contact is left
out. The criterion "impacts" has the integral of the force, which holds them; the two agree as far as contacts are
short. The intensity is the mean force of the impacts.

Takes what is heard; gives values for every gap proper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearrattle.metrics.base import LOG, PFEIFFER, Heard, Value, about
from gearrattle.signals import is_gap, reduced_inertia


@dataclass(frozen=True)
class ImpactImpulse:
    """m (1 + e) |v| of the impacts, and what it adds up to in time."""

    name: str = "impact_impulse"
    title: str = "Impulse of impacts"
    formula: str = "p = m (1 + e) |v|, e = |v'| / |v|; intensity: sum of p / time"
    unit: str = "N s"
    source: str = PFEIFFER
    window: str = LOG
    sampling: str = "none: exact to the events"
    needs: tuple[str, ...] = ("gaps",)
    merging: str = "exact: sums add up; a contact across chunks is one contact"

    def measure(self, heard: Heard) -> list[Value]:
        """Return mean restitution, mean impulse and mean intensity of every gap."""
        layout, values = heard.plate, []
        for k, name in enumerate(layout.clearance_names):
            if not is_gap(layout, k):
                continue
            element = int(layout.clearance[k])
            mesh, mass = bool(layout.is_mesh[element]), reduced_inertia(layout, element)
            found = heard.contacts(k)
            cut = about(name, found, heard.duration)
            none = "" if found.whole else f"{name}: no impact begins and ends in the window"
            restitution = found.kept / found.moving if found.moving else math.nan
            mean_impulse = mass * found.speeds / found.whole if found.whole else math.nan
            values += [
                Value(name, "mean restitution", restitution, "1", none or cut),
                Value(name, "mean impulse m (1 + e) |v|", mean_impulse, "N s" if mesh else "N m s", none or cut),
                Value(name, "mean impact intensity", mass * found.speeds / heard.duration, "N" if mesh else "N m", cut),
            ]
        return values
