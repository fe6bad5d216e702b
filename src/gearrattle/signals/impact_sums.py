"""What remains of impacts when the motion itself is let go: counts, sums and largest values, clearance by clearance.

Sums of consecutive chunks of a motion add up to those of the whole. A contact that a chunk ends within is kept open,
with the force integral and the speed at its begin; the first crossing of the same corner in a later chunk closes it, so
its contact impulse and its exchanged momentum (``impacts``) are those of the whole contact.

Takes Trajectories, in order; gives plain arrays to the criteria.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gearrattle.signals.bodies import reduced_inertias
from gearrattle.signals.impacts import corner_keys, find_impacts
from gearrattle.signals.windows import Window
from gearrattle.trajectory import Array, IntArray, Layout, Trajectory


class Severity(NamedTuple):
    """How hard the impacts of one clearance are: magnitudes, NaN without impacts.

    Attributes:
        mean_speed, largest_speed: of the approach velocity v [rad/s or m/s].
        mean_momentum, largest_momentum: m_eff |v| [N m s or N s].
        mean_energy, largest_energy: m_eff v^2 / 2 [J].
        mean_exchanged, largest_exchanged: m_eff (|v| + |v'|), v' the rate at the end of the contact [N m s or N s].
        mean_impulse, largest_impulse: contact impulse, static load included [N m s or N s]; NaN without force
            integrals.
    """

    mean_speed: Array
    largest_speed: Array
    mean_momentum: Array
    largest_momentum: Array
    mean_energy: Array
    largest_energy: Array
    mean_exchanged: Array
    largest_exchanged: Array
    mean_impulse: Array
    largest_impulse: Array


@dataclass(frozen=True)
class ImpactSummary:
    """The impacts of one clearance.

    Attributes:
        count, drive: how many, and how many of them on the drive side.
        severity: how hard they are.
        censored: whether the motion ends within a contact that counts.
    """

    count: int
    drive: int
    severity: Severity
    censored: bool


def add_impacts(before: Mapping[str, Array] | None, trajectory: Trajectory, window: Window) -> dict[str, Array]:
    """Return the sums over all chunks so far.

    Args:
        before: those of the chunks before; None at the first.
        trajectory: the next chunk.
        window: the part of it in which an impact must begin to count.

    Returns:
        As in ``kernels.variants.Tallies``: count, drive, speed, top_speed, square, left, top_change, push, top_push,
        final (K,); open, begun, met (corners of all clearances). And mass (K,), m_eff of every clearance.
    """
    layout, events = trajectory.layout, trajectory.events
    corners = sum(each.size for each in layout.corners)
    sums = _nothing(layout, corners) if before is None else {k: v.copy() for k, v in before.items()}
    crossed = corner_keys(layout, events.clearance, events.from_region, events.to_region)
    for corner in np.flatnonzero(sums["open"]).tolist():
        returns = np.flatnonzero(crossed == corner)[:1]
        if returns.size:
            push = events.force_integral[returns] - sums["begun"][corner]
            _add_ends(sums, events.clearance[returns], sums["met"][corner], (events.velocity[returns], push))
            sums["open"][corner] = 0.0
    impacts = find_impacts(trajectory).within(window)
    speed = np.abs(impacts.velocity)
    np.add.at(sums["count"], impacts.clearance, 1.0)
    np.add.at(sums["drive"], impacts.clearance, impacts.drive.astype(float))
    np.add.at(sums["speed"], impacts.clearance, speed)
    np.maximum.at(sums["top_speed"], impacts.clearance, speed)
    np.add.at(sums["square"], impacts.clearance, speed * speed)
    ended = ~impacts.censored
    _add_ends(sums, impacts.clearance[ended], speed[ended], (impacts.departure[ended], impacts.impulse[ended]))
    rows = impacts.row[impacts.censored]
    open_ = crossed[rows]
    sums["open"][open_], sums["begun"][open_] = 1.0, events.force_integral[rows]
    sums["met"][open_] = speed[impacts.censored]
    sums["final"] = trajectory.final_force_integral.astype(float)
    return sums


def summarise_impacts(sums: Mapping[str, Array], layout: Layout, clearance: int) -> ImpactSummary:
    """Return the statistics of one clearance; an open contact counts with what it has gathered."""
    return ImpactSummary(
        count=int(sums["count"][clearance]),
        drive=int(sums["drive"][clearance]),
        severity=measure_impacts(sums, layout, clearance),
        censored=bool(np.any(sums["open"][_corners(layout, clearance)] > 0.0)),
    )


def measure_impacts(sums: Mapping[str, Array], layout: Layout, clearance: int) -> Severity:
    """Return the severity of one clearance's impacts; the sums may be those of many motions along leading axes.

    Momenta and energies of an element without a free end do not exist: NaN.
    """
    mine = _corners(layout, clearance)
    of = {name: sums[name][..., clearance] for name in (*_OF_CLEARANCES, "mass")}
    pending, largest, change = np.zeros(np.shape(of["count"])), of["top_push"], of["top_change"]
    for corner in range(mine.start, mine.stop):
        is_open = sums["open"][..., corner] > 0.0
        gathered = np.abs(of["final"] - sums["begun"][..., corner])
        pending = np.where(is_open, pending + gathered, pending)
        largest = np.where(is_open, np.maximum(largest, gathered), largest)
        change = np.where(is_open, np.maximum(change, sums["met"][..., corner]), change)
    mass, count = np.where(np.isfinite(of["mass"]), of["mass"], np.nan), of["count"]
    with np.errstate(invalid="ignore", divide="ignore"):
        values = (
            of["speed"] / count, of["top_speed"],
            mass * (of["speed"] / count), mass * of["top_speed"],
            0.5 * mass * (of["square"] / count), 0.5 * mass * of["top_speed"] ** 2,
            mass * ((of["speed"] + of["left"]) / count), mass * change,
            (of["push"] + pending) / count, largest,
        )  # fmt: skip
    return Severity(*(np.where(count > 0.0, value, np.nan) for value in values))


def _corners(layout: Layout, clearance: int) -> slice:
    """Where a clearance's corners lie among those of all."""
    before = sum(corners.size for corners in layout.corners[:clearance])
    return slice(before, before + layout.corners[clearance].size)


_OF_CLEARANCES = ("count", "drive", "speed", "top_speed", "square", "left", "top_change", "push", "top_push", "final")
_OF_CORNERS = ("open", "begun", "met")


def _nothing(layout: Layout, corners: int) -> dict[str, Array]:
    sums = {name: np.zeros(layout.clearance.size) for name in _OF_CLEARANCES}
    sums |= {name: np.zeros(corners) for name in _OF_CORNERS}
    return sums | {"mass": reduced_inertias(layout, layout.clearance.tolist())}


def _add_ends(sums: dict[str, Array], clearance: IntArray, met: Array, ends: tuple[Array, Array]) -> None:
    """Add contacts that have ended: their speeds at the begin, and (rates, contact impulses) at the end."""
    left, push = np.abs(ends[0]), np.abs(ends[1])
    np.add.at(sums["left"], clearance, left)
    np.maximum.at(sums["top_change"], clearance, met + left)
    np.add.at(sums["push"], clearance, push)
    np.maximum.at(sums["top_push"], clearance, push)
