"""Regions of a clearance over time, from the log of corner crossings alone.

The region at any instant follows by replaying the log from the region at t = 0; between two crossings it is constant.
Shares of time are therefore sums of event times, exact to the accuracy of the events, whatever the output grid.

*Centre*: the piece labelled 0. If delta = 0 is itself a corner, the pieces 0 and -1 meet there and both are the centre;
but if only one of the two has no stiffness, it is the gap, and it alone is the centre. Outside the centre an element is
*in contact*.

*Regime* (Padmanabhan et al. 1995, sec. 6, Fig. 3): "quiet" if no corner is crossed, "single-sided" if only drive-side
or only coast-side ones are, "double-sided" if both. Which corners count: of a gap (a centre without stiffness) only
those of the centre, where it separates; of a staged spring all. If both pieces at delta = 0 are the centre, passing
delta = 0 is no crossing, because contact neither begins nor ends.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.variant_arrays import Judged, without_rings
from gearrattle.errors import GearRattleError
from gearrattle.signals.windows import steady
from gearrattle.trajectory import Array, IntArray, Layout, Trajectory

Regime = Literal["quiet", "single-sided", "double-sided"]


def centre(layout: Layout, clearance: int) -> frozenset[int]:
    """Return the labels of the pieces at the centre of a clearance, where it is not in contact."""
    first = int(layout.region_of_first_piece[clearance])
    corner_below_zero = -first - 1  # the corner between the pieces -1 and 0
    corners = layout.corners[clearance]
    if not 0 <= corner_below_zero < corners.size or corners[corner_below_zero] != 0.0:
        return frozenset({0})
    stiffness = layout.stiffness_of_piece[clearance]
    inner = {label: stiffness[label - first] for label in (0, -1)}
    free = frozenset(label for label, slope in inner.items() if slope == 0.0)
    return free if len(free) == 1 else frozenset(inner)


def centre_words(layout: Layout, clearance: int) -> str:
    """Return in words which regions are the centre, for formulas, if delta = 0 is a corner; else an empty text."""
    if 0.0 not in layout.corners[clearance]:
        return ""
    labels = [f"{label:+d}" if label else "0" for label in sorted(centre(layout, clearance))]
    return f"; delta = 0 is a corner, the centre is region {' and '.join(labels)}"


def clearance_arrays(layout: Layout) -> Judged:
    """Return as arrays for compiled code the pieces of every clearance, and which of them are its centre; every
    clearance is a part of its own (``rings.judged_arrays`` takes the faces of a ring together).
    """
    sizes = [stiffness.size for stiffness in layout.stiffness_of_piece]
    inner = [
        int(first + piece in centre(layout, k))
        for k, (first, size) in enumerate(zip(layout.region_of_first_piece.tolist(), sizes, strict=True))
        for piece in range(size)
    ]
    first = np.array(layout.region_of_first_piece, dtype=np.int64)
    pieces = np.cumsum([0, *sizes], dtype=np.int64)
    free = np.concatenate([np.zeros(0), *layout.stiffness_of_piece]) == 0.0
    free_centre = free & (np.array(inner) > 0)
    gap = [int(np.any(part)) for part in np.split(free_centre, pieces[1:-1])][: len(sizes)]
    return without_rings(pieces, first, np.array(inner, dtype=np.int64), np.array(gap, dtype=np.int64))


def in_contact(layout: Layout, clearance: int, region: IntArray) -> NDArray[np.bool_]:
    """Return the mask of the region labels of one clearance that are contact.

    Parameters
    ----------
    region
        (...) region labels.
    """
    return ~np.isin(region, sorted(centre(layout, clearance)))


def broken_chain(trajectory: Trajectory, row: int) -> GearRattleError:
    """Return the error for a crossing that does not lead from the last region to a neighbouring one."""
    log = trajectory.events
    k = int(trajectory.events.clearance[row])
    if not 0 <= k < trajectory.layout.clearance.size:
        return GearRattleError(f"event log, row {row}: there is no clearance {k}; simulate again, or repair the data")
    before = np.flatnonzero(log.clearance[:row] == k)
    region = int(log.to_region[before[-1]] if before.size else trajectory.initial_region[k])
    location = f"event log of {trajectory.layout.clearance_names[k]} at t = {log.time[row]:.9g}"
    if region == log.from_region[row]:
        return GearRattleError(
            f"{location}: found a crossing from region {region} to {log.to_region[row]}, which is not its neighbour"
        )
    return GearRattleError(
        f"{location}: found a crossing from region {log.from_region[row]}, but the crossings before it lead to region "
        f"{region}; a log must be gapless (simulate again, or repair the data)"
    )


def region_at(trajectory: Trajectory, clearance: int, time: float) -> int:
    """Return the region in which a clearance is just before ``time`` [s] (at its start for ``time`` <= 0)."""
    rows = np.flatnonzero(trajectory.events.clearance == clearance)
    passed = rows[trajectory.events.time[rows] < time]
    return int(trajectory.events.to_region[passed[-1]]) if passed.size else int(trajectory.initial_region[clearance])


def dwell_of_regions(trajectory: Trajectory) -> dict[tuple[int, ...], float]:
    """Return the time that the steady part spends in every region, by the labels of all clearances [s].

    Raises
    ------
    ModelError
        no cycle left after the discarded ones.
    """
    window = steady(trajectory)
    log = trajectory.events
    labels = [int(label) for label in trajectory.initial_region]
    dwell: dict[tuple[int, ...], float] = {}
    since = window.start
    for time, k, region in zip(log.time.tolist(), log.clearance.tolist(), log.to_region.tolist(), strict=True):
        until = min(max(time, window.start), window.end)
        if until > since:
            here = tuple(labels)
            dwell[here] = dwell.get(here, 0.0) + (until - since)
            since = until
        labels[k] = region
    if window.end > since:
        dwell[tuple(labels)] = dwell.get(tuple(labels), 0.0) + (window.end - since)
    return dwell


def share_in_contact(layout: Layout, clearance: int, shares: Mapping[int, float] | Mapping[int, Array]) -> Array:
    """Return the share of time in contact, 0 to 1, from the shares by region label, of one motion or of many."""
    inner = centre(layout, clearance)
    total = np.zeros(())
    for region, share in shares.items():
        total = total if region in inner else total + share
    return np.asarray(np.minimum(1.0, total))


def regime_of(drive: bool, coast: bool) -> Regime:
    """Return the regime of a clearance that crosses corners on these sides."""
    if drive and coast:
        return "double-sided"
    return "single-sided" if drive or coast else "quiet"
