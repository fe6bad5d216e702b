"""Energy lost in impacts, and work dissipated in contacts.

From the event log: the loss of relative kinetic energy between the start and the end of each contact,

    E = m (v^2 - v'^2) / 2,     rate = (1/t_w) sum of E over the completed contacts that begin in the window  [W]

with m the reduced inertia of the two bodies along the deflection. At both ends of a contact the spring holds the same
energy, so E is the energy lost in the contact, apart from the work of other elements during it. (The impact energy
m v^2 / 2 of the criterion "impacts" is the energy at the start of a contact.) From the energy audit: the work of the
element's own damping and friction. It is an exact quadrature of their power on dense output, but covers the whole run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearrattle.quantities.metric_inputs import LOG, Inputs, about
from gearrattle.quantities.quantity import PFEIFFER, Quantity, Row
from gearrattle.signals import is_gap, own_elements, reduced_inertia


@dataclass(frozen=True)
class ImpactLoss(Quantity[Inputs]):
    """Relative kinetic energy lost in impacts."""

    name: str = "impact_loss"
    title: str = "Energy lost in impacts"
    formula: str = "sum of m (v^2 - v'^2) / 2 over completed contacts / time"
    unit: str = "W"
    source: str = PFEIFFER
    window: str = LOG
    sampling: str = "none: exact to the events"
    needs: tuple[str, ...] = ("gaps",)
    of_crossings: bool = True
    merging: str = "exact: sums add up; a contact across chunks is one contact"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return the loss rate and the mean loss per impact of every gap."""
        layout = inputs.known_layout
        rows = list[Row]()
        for k, name in enumerate(layout.clearance_names):
            if not is_gap(layout, k):
                continue
            mass = reduced_inertia(layout, int(layout.clearance[k]))
            contacts = inputs.contacts(k)
            loss = 0.5 * mass * contacts.squares
            cut = about(name, contacts, inputs.duration)
            no_impact = "" if contacts.whole else f"{name}: no impact begins and ends in the window"
            mean = loss / contacts.whole if contacts.whole else math.nan
            rows += [
                self.row(name, "impact loss rate", loss / inputs.duration, "W", cut),
                self.row(name, "mean loss of an impact", mean, "J", no_impact or cut),
            ]
        return rows


@dataclass(frozen=True)
class ContactWork(Quantity[Inputs]):
    """Work of damping and friction in elements with a corner, from the energy audit."""

    name: str = "contact_work"
    title: str = "Work of contacts"
    formula: str = "integral of (F - dU/d delta) delta' over the run / its time"
    unit: str = "W"
    source: str = "definition; the quadrature of the energy audit (gearrattle.engine.system.energy_audit)"
    window: str = "the whole run, start-up included"
    sampling: str = "none: quadrature on dense output"
    needs: tuple[str, ...] = ("gaps", "energy")
    merging: str = "exact: work and time add up, of chunks that were audited"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return the mean power that every element with a corner dissipates."""
        work = inputs.work
        assert work is not None
        layout = inputs.known_layout
        (loss, time, share) = work
        note = f"work of contacts includes the discarded start-up, {100.0 * share:.3g} % of the run" if share else ""
        return [
            self.row(name, "contact work rate", float(loss[own_elements(layout, element)].sum()) / time, "W", note)
            for name, element in zip(layout.clearance_names, layout.clearance.tolist(), strict=True)
        ]
