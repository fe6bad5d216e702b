"""What remains of impacts when the motion itself is let go: counts, sums and largest values, clearance by clearance.

Sums of consecutive chunks of a motion add up to those of the whole. A contact that a chunk ends within is kept open,
with the force integral at its begin; the first crossing of the same corner in a later chunk closes it, so its impulse
is that of the whole contact.

Takes Trajectories, in order; gives plain arrays to the criteria.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gearrattle.signals.impacts import corner_keys, find_impacts
from gearrattle.signals.windows import Window
from gearrattle.trajectory import Array, IntArray, Layout, Trajectory


@dataclass(frozen=True)
class ImpactSummary:
    """The impacts of one clearance.

    Attributes:
        count, drive: how many, and how many of them on the drive side.
        mean_speed, largest_speed: magnitudes of the approach velocity [rad/s or m/s]; NaN without impacts.
        mean_impulse, largest_impulse: magnitudes [N m s or N s]; NaN without impacts or force integrals.
        censored: whether the motion ends within a contact that counts.
    """

    count: int
    drive: int
    mean_speed: float
    largest_speed: float
    mean_impulse: float
    largest_impulse: float
    censored: bool


def add_impacts(before: Mapping[str, Array] | None, trajectory: Trajectory, window: Window) -> dict[str, Array]:
    """Return the sums over all chunks so far.

    Args:
        before: those of the chunks before; None at the first.
        trajectory: the next chunk.
        window: the part of it in which an impact must begin to count.

    Returns:
        count, drive, speed, top_speed, push, top_push, final (K,): numbers of impacts, sums and largest magnitudes of
        speed and impulse, the force integral at the end. open, begun (corners of all clearances): 1 where a contact
        has not ended, and the force integral at its begin.
    """
    layout, events = trajectory.layout, trajectory.events
    corners = sum(each.size for each in layout.corners)
    sums = _nothing(layout.clearance.size, corners) if before is None else {k: v.copy() for k, v in before.items()}
    crossed = corner_keys(layout, events.clearance, events.from_region, events.to_region)
    for corner in np.flatnonzero(sums["open"]).tolist():
        returns = np.flatnonzero(crossed == corner)[:1]
        if returns.size:
            push = events.force_integral[returns] - sums["begun"][corner]
            _add_pushes(sums, events.clearance[returns], push)
            sums["open"][corner] = 0.0
    impacts = find_impacts(trajectory).within(window)
    speed = np.abs(impacts.velocity)
    np.add.at(sums["count"], impacts.clearance, 1.0)
    np.add.at(sums["drive"], impacts.clearance, impacts.drive.astype(float))
    np.add.at(sums["speed"], impacts.clearance, speed)
    np.maximum.at(sums["top_speed"], impacts.clearance, speed)
    ended = ~impacts.censored
    _add_pushes(sums, impacts.clearance[ended], impacts.impulse[ended])
    rows = impacts.row[impacts.censored]
    sums["open"][crossed[rows]], sums["begun"][crossed[rows]] = 1.0, events.force_integral[rows]
    sums["final"] = trajectory.final_force_integral.astype(float)
    return sums


def summarise_impacts(sums: Mapping[str, Array], layout: Layout, clearance: int) -> ImpactSummary:
    """Return the statistics of one clearance; an open contact counts with what it has gathered."""
    found = measure_impacts(sums, layout, clearance)
    return ImpactSummary(
        count=int(sums["count"][clearance]),
        drive=int(sums["drive"][clearance]),
        mean_speed=float(found.mean_speed),
        largest_speed=float(found.largest_speed),
        mean_impulse=float(found.mean_impulse),
        largest_impulse=float(found.largest_impulse),
        censored=bool(np.any(sums["open"][_corners(layout, clearance)] > 0.0)),
    )


class Severity(NamedTuple):
    """Speeds and impulses as in ``ImpactSummary``, with the leading axes of the sums."""

    mean_speed: Array
    largest_speed: Array
    mean_impulse: Array
    largest_impulse: Array


def measure_impacts(sums: Mapping[str, Array], layout: Layout, clearance: int) -> Severity:
    """Return the severity of one clearance's impacts; the sums may be those of many motions along leading axes."""
    mine = _corners(layout, clearance)
    count, push, top = (sums[name][..., clearance] for name in ("count", "push", "top_push"))
    pending, largest = np.zeros(np.shape(count)), top
    for corner in range(mine.start, mine.stop):
        is_open = sums["open"][..., corner] > 0.0
        gathered = np.abs(sums["final"][..., clearance] - sums["begun"][..., corner])
        pending = np.where(is_open, pending + gathered, pending)
        largest = np.where(is_open, np.maximum(largest, gathered), largest)
    with np.errstate(invalid="ignore", divide="ignore"):
        means = sums["speed"][..., clearance] / count, (push + pending) / count
    each = (means[0], sums["top_speed"][..., clearance], means[1], largest)
    return Severity(*(np.where(count > 0.0, value, np.nan) for value in each))


def _corners(layout: Layout, clearance: int) -> slice:
    """Where a clearance's corners lie among those of all."""
    before = sum(corners.size for corners in layout.corners[:clearance])
    return slice(before, before + layout.corners[clearance].size)


def _nothing(clearances: int, corners: int) -> dict[str, Array]:
    names = ("count", "drive", "speed", "top_speed", "push", "top_push", "final")
    return {name: np.zeros(clearances) for name in names} | {name: np.zeros(corners) for name in ("open", "begun")}


def _add_pushes(sums: dict[str, Array], clearance: IntArray, push: Array) -> None:
    np.add.at(sums["push"], clearance, np.abs(push))
    np.maximum.at(sums["top_push"], clearance, np.abs(push))
