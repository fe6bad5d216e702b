"""Restitution and mean intensity of impacts, from the velocities in the log of crossings.

Two bodies with the reduced inertia m along the deflection begin a contact at the rate v and end it at v'; e = |v'|/|v|:

    p = m (1 + e) |v|,      I = (1/t_w) sum of p over the contacts that begin in the window  [N or N m]

p is the exchanged momentum, the integral over the contact of the force above the quasi-static load
(``gearrattle.signals.impacts``); the criterion "impacts" has its mean and largest value. A contact that is still closed
at the end of the motion has e = 0 and does not count for the restitution. The intensity is the mean force of impacts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearrattle.quantities.metric_inputs import LOG, Inputs, about
from gearrattle.quantities.quantity import PFEIFFER, Quantity, Row
from gearrattle.signals import is_gap, reduced_inertia


@dataclass(frozen=True)
class ImpactIntensity(Quantity[Inputs]):
    """Mean intensity of impacts, the rate of their exchanged momenta m (1 + e) |v|, and their restitution."""

    name: str = "impact_intensity"
    title: str = "Intensity of impacts"
    formula: str = "e = |v'| / |v|; intensity: sum of m (1 + e) |v| / time"
    unit: str = "N"
    source: str = PFEIFFER
    window: str = LOG
    sampling: str = "none: exact to the events"
    needs: tuple[str, ...] = ("gaps",)
    of_crossings: bool = True
    merging: str = "exact: sums add up; a contact across chunks is one contact"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return mean restitution and mean intensity of every gap."""
        layout = inputs.known_layout
        rows = list[Row]()
        for k, name in enumerate(layout.clearance_names):
            if not is_gap(layout, k):
                continue
            element = int(layout.clearance[k])
            mesh = bool(layout.is_mesh[element])
            mass = reduced_inertia(layout, element)
            contacts = inputs.contacts(k)
            cut = about(name, contacts, inputs.duration)
            unknown = "" if contacts.whole else f"{name}: no impact begins and ends in the window"
            restitution = contacts.kept / contacts.moving if contacts.moving else math.nan
            intensity = mass * contacts.speeds / inputs.duration
            rows += [
                self.row(name, "mean restitution", restitution, "1", unknown or cut),
                self.row(name, "mean impact intensity", intensity, "N" if mesh else "N m", cut),
            ]
        return rows
