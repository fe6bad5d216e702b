"""Contact share: the part of the steady time that a clearance is in contact, and its share of time in each region.

share_r = (1/t_w) (sum of the times spent in region r), from the event times of [discard T, end], not from samples; an
element is in contact in every region except the centre. For a gap (no stiffness at the centre) the contact share is the
mean slope of its law, scaled to 1 in contact: the stiffness contact ratio as a time average of df/d(delta) (Padmanabhan
et al. 1995, sec. 6).

Sides of contact: the shares of time of a gap on the drive side, on the coast side and free, and whether its impacts
change flanks. They are computed from the event times of a simulated motion, otherwise from the samples of a deflection.
Samples miss events between two of them, and a note says so.

An impact is *double-sided* if the contact before it was on the other flank, and *single-sided* if it was on the same
flank. This distinguishes a gear that mostly hits one flank from a gear that crosses its backlash every time; both have
a double-sided regime. The first impact in a record counts as single-sided, because the contact before it is unknown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.quantities.metric_inputs import LOG, Inputs
from gearrattle.quantities.quantity import PAPER, CrossingQuantity, Quantity, Row, State, Sums, Values
from gearrattle.signals import centre, centre_words, is_gap, pieces_of, share_in_contact
from gearrattle.signals.crossing_sums import Sides
from gearrattle.trajectory import Array, Layout


@dataclass(frozen=True)
class ContactShare(CrossingQuantity):
    """Share of time in contact and in each region."""

    name: str = "contact"
    title: str = "Contact share"
    formula: str = "time outside the centre / time, over [discard T, end], from event times"
    unit: str = "1"
    source: str = f"{PAPER}, sec. 6"
    merging: str = "exact: times add up"

    def occasional(self, layout: Layout) -> list[Row]:
        """Return the contact share of every clearance; a part without a corner in some variant is always in contact."""
        return [self.row(name, "contact share", 1.0) for name in layout.clearance_names]

    def values(self, state: State, layout: Layout, _cycles: int, duration: Array) -> Values:
        """Return the contact share and the share of every region, for every clearance."""
        values: dict[tuple[str, str], Array] = {}
        for k, name in enumerate(layout.clearance_names):
            first = int(layout.region_of_first_piece[k])
            times = state["dwell"][..., pieces_of(layout, k)]
            shares = {first + i: times[..., i] / duration for i in range(times.shape[-1])}
            values[name, "contact share"] = share_in_contact(layout, k, shares)
            values |= {(name, f"share of region {_label(region)}"): share for region, share in shares.items()}
        return values

    def rows(self, sums: Sums) -> list[Row]:
        """Return the contact share and the share of every region, for every clearance."""
        rows = []
        layout = sums.steady.layout
        for (name, quantity), share in self.values_of(sums).items():
            region = quantity.removeprefix("share of region ")
            words = f"time in region {region} / time, over [discard T, end], from event times"
            outside_centre = self.formula + centre_words(layout, layout.clearance_names.index(name))
            formula = outside_centre if region == quantity else words
            rows.append(self.row(name, quantity, float(share), formula=formula))
        return rows


def _label(region: int) -> str:
    return f"{region:+d}" if region else "0"


@dataclass(frozen=True)
class ContactSides(Quantity[Inputs]):
    """Shares of time by side, and rates of single-sided and double-sided impacts."""

    name: str = "contact_sides"
    title: str = "Sides of contact"
    formula: str = "time on a side / time; impacts after a contact on the same, on the other flank / cycles"
    unit: str = "1"
    source: str = "definition; single- and double-sided impacts after Padmanabhan et al. 1995, sec. 6, impact by impact"
    window: str = f"{LOG}; without one, the samples of the deflection"
    sampling: str = "none with a log: exact to the events"
    needs: tuple[str, ...] = ("contacts",)
    of_crossings: bool = True
    merging: str = "exact: times and counts add up; what side a chunk begins on the one before tells"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return shares of time and rates of impacts for every clearance that is a gap."""
        # gaps with a deflection
        layout = inputs.known_layout
        deflections = inputs.of("deflection")
        rows = list[Row]()
        cycles = inputs.duration / (inputs.period or math.nan)
        unknown = "" if math.isfinite(cycles) else "; no speed tells what a cycle is"
        for k, name in enumerate(layout.clearance_names):
            if not is_gap(layout, k) or name not in deflections:
                continue
            # shares and sides from the log of crossings, else from samples
            sides = inputs.sides(k) if inputs.has_log else _of_samples(layout, k, np.asarray(deflections[name]))
            shares = sides.shares
            single = sides.single
            double = sides.double
            inner = centre(layout, k)
            # share of time beyond the centre, on the drive and on the coast side
            drive = sum(share for region, share in shares.items() if region > max(inner))
            coast = sum(share for region, share in shares.items() if region < min(inner))
            note = f"{name}: sides of contact from samples of the deflection" if not inputs.has_log else ""
            error = 0.0 if inputs.has_log else math.nan
            # one row per share, one per kind of impact
            rows += [
                self.row(name, "drive-side share", drive, "1", note, error),
                self.row(name, "coast-side share", coast, "1", note, error),
                self.row(name, "free share", max(0.0, 1.0 - drive - coast), "1", note, error),
                self.row(name, "single-sided impacts per cycle", single / cycles, "1/cycle", note + unknown, error),
                self.row(name, "double-sided impacts per cycle", double / cycles, "1/cycle", note + unknown, error),
            ]
        return rows


def _of_samples(layout: Layout, clearance: int, deflection: Array) -> Sides:
    """Shares and impacts from samples: an impact is between a sample in the centre and the next one in contact."""
    first = int(layout.region_of_first_piece[clearance])
    inner = centre(layout, clearance)
    region = np.searchsorted(layout.corners[clearance], deflection, side="right") + first
    labels = range(first, first + layout.stiffness_of_piece[clearance].size)
    weight = np.ones(region.size)
    weight[[0, -1]] = 0.5  # the trapezoidal rule
    shares = {label: float(np.sum(weight[region == label])) / (region.size - 1) for label in labels}
    closed = ~np.isin(region, sorted(inner))
    sides = np.sign(np.where(region > max(inner), 1, -1) * closed)
    begins = 1 + np.flatnonzero((sides[1:] != 0) & (sides[1:] != sides[:-1]))
    drive = sides[begins] > 0
    before = _flank_before(drive, int(region[0]), inner)
    return Sides(shares, int(np.sum(drive == before)), int(np.sum(drive != before)))


def _flank_before(drive: NDArray[np.bool_], begun: int, inner: frozenset[int]) -> NDArray[np.bool_]:
    """(I,) whether the contact before an impact was on the drive side; ``drive`` (I,) whether the impact itself is."""
    first = drive[:1].tolist() if begun in inner else [begun > max(inner)]
    return np.array([*first, *drive[:-1].tolist()], dtype=np.bool_)[: drive.size]
