"""What is kept of the crossings of a motion, in NumPy: the oracle of the compiled loop (``kernels.tallies``)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gearrattle.signals import Window, centre, clearance_arrays, find_impacts, reduced_inertias, region_at
from gearrattle.signals.impacts import Impacts
from gearrattle.trajectory import Array, IntArray, Layout, Trajectory

_OF_CLEARANCES = ("count", "drive", "speed", "top_speed", "square", "left", "top_change", "push", "top_push", "final")
_OF_CORNERS = ("open", "begun", "met")


def sums_of(trajectory: Trajectory, window: Window) -> dict[str, Array]:
    """Return all sums over a motion that comes in one piece."""
    clearances = range(trajectory.layout.clearance.size)
    impacts = find_impacts(trajectory)
    inside = window.contains(trajectory.events.time)
    every = [_contacts(impacts.of(k).within(window)) for k in clearances]
    flanks = [_flanks(trajectory, impacts.of(k), k, window) for k in clearances]
    return {
        **impact_sums(None, trajectory, window),
        "dwell": np.concatenate([np.zeros(0), *(dwell_times(trajectory, k, window) for k in clearances)]),
        "sides": np.array([sides_crossed(trajectory, k, window) for k in clearances], dtype=float).reshape(-1, 2),
        **{name: np.array([of[name] for of in every]) for name in ("lost", "kept", "moving", "held")},
        **{name: np.array([of[name] for of in flanks]) for name in ("same", "other", "flank")},
        "touched": np.zeros(0),
        "since": _since(trajectory, impacts.within(window)),
        "crossings": np.array([float(np.count_nonzero(inside))]),
        "calls": np.zeros(1),
    }


def dwell_times(trajectory: Trajectory, clearance: int, window: Window) -> Array:
    """Return (pieces,) the time in the window that a clearance spends in each of its regions, lowest first [s]."""
    events, first = trajectory.events, int(trajectory.layout.region_of_first_piece[clearance])
    inside = np.flatnonzero((events.clearance == clearance) & window.contains(events.time))
    bounds = np.concatenate([[window.start], events.time[inside], [window.end]])
    region = np.concatenate([[region_at(trajectory, clearance, window.start)], events.to_region[inside]])
    pieces = trajectory.layout.stiffness_of_piece[clearance].size
    return np.bincount(region - first, weights=np.diff(bounds), minlength=pieces).astype(np.float64)


def sides_crossed(trajectory: Trajectory, clearance: int, window: Window) -> tuple[bool, bool]:
    """Return whether a clearance crosses corners on its drive side, and on its coast side, in the window."""
    events = trajectory.events
    inside = np.flatnonzero((events.clearance == clearance) & window.contains(events.time))
    lower = np.minimum(events.from_region[inside], events.to_region[inside])  # the piece below the crossed corner
    inner = sorted(centre(trajectory.layout, clearance))
    below, above = np.isin(lower, inner), np.isin(lower + 1, inner)
    crossed = below != above if clearance_arrays(trajectory.layout).gap[clearance] else ~(below & above)
    return bool(np.any(crossed & (lower >= max(inner)))), bool(np.any(crossed & (lower < max(inner))))


def _contacts(impacts: Impacts) -> dict[str, float]:
    whole = ~impacts.censored
    arrival, left = np.abs(impacts.velocity[whole]), np.abs(impacts.departure[whole])
    moving = arrival > 0.0
    return {
        "lost": float(np.sum(arrival**2 - left**2)),
        "kept": float(np.sum(left[moving] / arrival[moving])),
        "moving": float(moving.sum()),
        "held": float(np.sum(impacts.duration[whole])),
    }


def _flanks(trajectory: Trajectory, impacts: Impacts, clearance: int, window: Window) -> dict[str, float]:
    begun, inner = int(trajectory.initial_region[clearance]), centre(trajectory.layout, clearance)
    start = 0 if begun in inner else 1 if begun > max(inner) else -1
    flanks = np.concatenate([[start], np.where(impacts.drive, 1, -1)])
    changes, inside = flanks[1:] == -flanks[:-1], window.contains(impacts.time)
    return {"same": float(np.sum(inside & ~changes)), "other": float(np.sum(inside & changes)), "flank": flanks[-1]}


def _since(trajectory: Trajectory, impacts: Impacts) -> Array:
    log, layout = trajectory.events, trajectory.layout
    since = np.zeros(sum(corners.size for corners in layout.corners))
    rows = impacts.row[impacts.censored]
    since[corner_keys(layout, log.clearance, log.from_region, log.to_region)[rows]] = log.time[rows]
    return since


def impact_sums(before: Mapping[str, Array] | None, trajectory: Trajectory, window: Window) -> dict[str, Array]:
    """Return the sums over the impacts of all chunks so far."""
    layout, events = trajectory.layout, trajectory.events
    corners = sum(corner.size for corner in layout.corners)
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


def _nothing(layout: Layout, corners: int) -> dict[str, Array]:
    sums = {name: np.zeros(layout.clearance.size) for name in _OF_CLEARANCES}
    sums |= {name: np.zeros(corners) for name in _OF_CORNERS}
    return sums | {"mass": reduced_inertias(layout, layout.clearance.tolist())}


def _add_ends(sums: dict[str, Array], clearance: IntArray, met: Array, ends: tuple[Array, Array]) -> None:
    """Add contacts that have ended: their speeds at the start, and (rates, contact impulses) at the end."""
    left, push = np.abs(ends[0]), np.abs(ends[1])
    np.add.at(sums["left"], clearance, left)
    np.maximum.at(sums["top_change"], clearance, met + left)
    np.add.at(sums["push"], clearance, push)
    np.maximum.at(sums["top_push"], clearance, push)


def corner_keys(layout: Layout, clearance: IntArray, region: IntArray, other: IntArray) -> IntArray:
    """Return (E,) the number of the corner between two neighbouring regions, counted over all clearances.

    Parameters
    ----------
    layout
        names and constants of the driveline.
    clearance
        (E,) indices into ``layout.clearance``.
    region, other
        (E,) labels of the regions the corner lies between.
    """
    before = np.concatenate([[0], np.cumsum([corners.size for corners in layout.corners])]).astype(np.int64)
    lower = np.minimum(region, other) - layout.region_of_first_piece[clearance] if len(clearance) else clearance
    return np.asarray(before[:-1][clearance] + lower if len(clearance) else clearance, dtype=np.int64)
