"""Contact share: the part of the steady time that a clearance is in contact, and its share of time in each region.

share_r = (1/t_w) sum of the stays in region r, from the event times of [discard T, end], not from samples; contact is
every region but the centre. For a gap (no stiffness at the centre) the contact share is the mean slope of its law,
scaled to 1 in contact: the stiffness contact ratio as a time average of df/d(delta) (Padmanabhan et al. 1995, sec. 6).

Takes a Trajectory; gives the contact share and one entry a region for every clearance.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.criteria.base import PAPER, Entry, Measures, Scope, Tally, Telling, entry, measured
from gearrattle.signals import add_crossings, centre_words, outside, pieces_of, steady
from gearrattle.trajectory import Array, Layout, Trajectory


@dataclass(frozen=True)
class ContactShare(Telling):
    """Share of time in contact and in each region."""

    name: str = "contact"
    title: str = "Contact share"
    formula: str = "time outside the centre / time, over [discard T, end], from event times"
    unit: str = "1"
    source: str = f"{PAPER}, sec. 6"
    sums: str = "crossings"
    merging: str = "exact: times add up"

    def occasional(self, layout: Layout) -> list[Entry]:
        """Return the contact share of every clearance: a part that has none in some variant is always in contact."""
        return [entry(self, name, "contact share", 1.0) for name in layout.clearance_names]

    def gather(self, trajectory: Trajectory, before: Tally | None) -> Tally:
        """Return dwell (pieces of all clearances,): the time in each region [s]; beside other sums of crossings."""
        return add_crossings(before, trajectory, steady(trajectory))

    def measure(self, tally: Tally, layout: Layout, _cycles: int, duration: Array) -> Measures:
        """Return the contact share and the share of every region, for every clearance."""
        found: dict[tuple[str, str], Array] = {}
        for k, name in enumerate(layout.clearance_names):
            first, times = int(layout.region_of_first_piece[k]), tally["dwell"][..., pieces_of(layout, k)]
            shares = {first + i: times[..., i] / duration for i in range(times.shape[-1])}
            found[name, "contact share"] = outside(layout, k, shares)
            found |= {(name, f"share of region {_label(region)}"): share for region, share in shares.items()}
        return found

    def tell(self, tally: Tally, scope: Scope) -> list[Entry]:
        """Return the contact share and the share of every region, for every clearance."""
        entries = []
        for (name, quantity), share in measured(self, tally, scope).items():
            region = quantity.removeprefix("share of region ")
            words = f"time in region {region} / time, over [discard T, end], from event times"
            outside_centre = self.formula + centre_words(scope.layout, scope.layout.clearance_names.index(name))
            formula = outside_centre if region == quantity else words
            entries.append(entry(self, name, quantity, float(share), formula=formula))
        return entries


def _label(region: int) -> str:
    return f"{region:+d}" if region else "0"
