"""Energy that is lost in impacts, and the work of contacts.

From the log: what is gone of the relative kinetic energy between the begin and the end of each contact,

    E = m (v^2 - v'^2) / 2,     rate = (1/t_w) sum of E over the completed contacts that begin in the window  [W]

with m the reduced inertia of the two bodies along the deflection. At both ends of a contact the spring holds the same
energy, so E is the energy lost in the contact, but for the work of other elements during it. (The impact energy
m v^2 / 2 of the criterion "impacts" is what a contact begins with.) From the audit: the work of the element's damping
and friction itself, by quadrature of its power on dense output, exact, but over the whole run.

Takes inputs; gives values for every gap proper, and for every element with a corner.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearrattle.quantities.inputs import LOG, Inputs, about
from gearrattle.quantities.quantity import PFEIFFER, Quantity, Row
from gearrattle.signals import is_gap, reduced_inertia


@dataclass(frozen=True)
class ImpactLoss(Quantity[Inputs]):
    """Relative kinetic energy that is lost in impacts."""

    name: str = "impact_loss"
    title: str = "Energy lost in impacts"
    formula: str = "sum of m (v^2 - v'^2) / 2 over completed contacts / time"
    unit: str = "W"
    source: str = PFEIFFER
    window: str = LOG
    sampling: str = "none: exact to the events"
    needs: tuple[str, ...] = ("gaps",)
    merging: str = "exact: sums add up; a contact across chunks is one contact"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return the rate, and the mean of an impact, of every gap."""
        layout, rows = inputs.known_layout, list[Row]()
        for k, name in enumerate(layout.clearance_names):
            if not is_gap(layout, k):
                continue
            mass = reduced_inertia(layout, int(layout.clearance[k]))
            contacts = inputs.contacts(k)
            loss = 0.5 * mass * contacts.squares
            cut = about(name, contacts, inputs.duration)
            none = "" if contacts.whole else f"{name}: no impact begins and ends in the window"
            mean = loss / contacts.whole if contacts.whole else math.nan
            rows += [
                self.row(name, "impact loss rate", loss / inputs.duration, "W", cut),
                self.row(name, "mean loss of an impact", mean, "J", none or cut),
            ]
        return rows


@dataclass(frozen=True)
class ContactWork(Quantity[Inputs]):
    """Work of damping and friction in elements with a corner, from the energy audit."""

    name: str = "contact_work"
    title: str = "Work of contacts"
    formula: str = "integral of (F - dU/d delta) delta' over the run / its time"
    unit: str = "W"
    source: str = "definition; the quadrature of the energy audit (gearrattle.engine.system.energy)"
    window: str = "the whole run, start-up included"
    sampling: str = "none: quadrature on dense output"
    needs: tuple[str, ...] = ("gaps", "energy")
    merging: str = "exact: work and time add up, of chunks that were audited"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return the mean power that every element with a corner takes."""
        work = inputs.work
        assert work is not None
        layout, (loss, time, share) = inputs.known_layout, work
        note = f"work of contacts counts the discarded start-up, {100.0 * share:.3g} % of the run" if share else ""
        return [
            self.row(name, "contact work rate", float(loss[element]) / time, "W", note)
            for name, element in zip(layout.clearance_names, layout.clearance.tolist(), strict=True)
        ]
