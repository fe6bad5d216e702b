"""Contact share: the part of the steady time that a clearance is in contact, and its share of time in each region.

share_r = (1/t_w) sum of the stays in region r, from the event times of [discard T, end], not from samples; contact is
every region but the centre. For a gap (no stiffness at the centre) the contact share is the mean slope of its law,
scaled to 1 in contact: the stiffness contact ratio as a time average of df/d(delta) (Padmanabhan et al. 1995, sec. 6).

Takes a Trajectory; gives the contact share and one entry a region for every clearance.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.criteria.base import PAPER, Entry, entry
from gearrattle.signals import contact_share, region_shares, steady
from gearrattle.trajectory import Trajectory


@dataclass(frozen=True)
class ContactShare:
    """Share of time in contact and in each region."""

    name: str = "contact"
    title: str = "Contact share"
    formula: str = "time outside the centre region / time, over [discard T, end], from event times"
    unit: str = "1"
    source: str = f"{PAPER}, sec. 6"

    def evaluate(self, trajectory: Trajectory) -> list[Entry]:
        """Return the contact share and the share of every region, for every clearance."""
        window = steady(trajectory)
        entries = []
        for k, name in enumerate(trajectory.layout.clearance_names):
            entries.append(entry(self, name, "contact share", contact_share(trajectory, k, window)))
            for region, share in region_shares(trajectory, k, window).items():
                label = f"{region:+d}" if region else "0"
                words = f"time in region {label} / time, over [discard T, end], from event times"
                entries.append(entry(self, name, f"share of region {label}", share, formula=words))
        return entries
