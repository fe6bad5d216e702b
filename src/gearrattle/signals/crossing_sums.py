"""Sums over the crossings of a motion: counts, sums, largest values, times; the package's one definition of them.

The sums begin at zero, every chunk of a motion adds to them, and their size does not grow with the number of chunks. A
contact that a chunk ends within is kept open, with force integral, speed and time at its start; the first crossing of
the same corner in a later chunk closes it, so the whole contact counts. Batches of variants use the same compiled loop
(``kernels.tallies``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gearrattle.engine.kernels import tallies
from gearrattle.engine.kernels.variant_arrays import Judged, Tallies, room_for
from gearrattle.errors import GearRattleError
from gearrattle.signals.driveline_constants import reduced_inertias
from gearrattle.signals.regions import Regime, broken_chain, clearance_arrays, regime_of, share_in_contact
from gearrattle.signals.rings import crossings_of, judged_arrays, parts_of
from gearrattle.signals.windows import Window, steady
from gearrattle.trajectory import Array, Layout, Trajectory

Sums = Mapping[str, Array]
"""Of one motion, or of many along leading axes: the arrays of ``kernels.variant_arrays.Tallies`` by name, and ``mass``
(K,), m_eff of every part. The parts are the clearances of ``rings.parts_of``."""


def add_crossings(
    before: Sums | None, trajectory: Trajectory, window: Window | None, judged: Judged | None = None
) -> Sums:
    """Return the sums over all chunks so far.

    Parameters
    ----------
    window
        the part of it that counts; None for nothing of it: only the flanks of its last contacts are kept.
    judged
        which clearances belong together; None takes the parts of the verdict.

    Raises
    ------
    GearRattleError
        if the log has a gap.
    """

    # the sums of the chunks before
    layout = trajectory.layout
    judged = judged_arrays(layout) if judged is None else judged
    out = room_for(1, judged)
    if before is not None:
        for name, array in zip(Tallies._fields, out, strict=True):
            array[0] = before[name]
    # the part of the chunk that counts
    nothing = np.nextafter(trajectory.end, np.inf)
    span = np.array([nothing, nothing] if window is None else [window.start, window.end])
    # regions at the start
    initial = np.array(trajectory.initial_region - layout.region_of_first_piece, dtype=np.int64)
    if np.any((initial < 0) | (initial >= judged.size)):
        raise GearRattleError(f"the motion begins in regions {trajectory.initial_region.tolist()}, which do not exist")
    # add the crossings; their chain must not break
    final = np.array(trajectory.final_force_integral, dtype=np.float64)
    broken = tallies.add_crossings(judged, crossings_of(trajectory), span, initial, final, before is None, 0, out)
    if broken >= 0:
        raise broken_chain(trajectory, int(broken))
    elements = parts_of(layout).clearance.tolist()
    mass = reduced_inertias(layout, elements) if before is None else before["mass"]
    return {name: array[0] for name, array in zip(Tallies._fields, out, strict=True)} | {"mass": mass}


@dataclass(frozen=True)
class Contacts:
    """Sums over the contacts of one clearance that begin in the window.

    Attributes
    ----------
    whole
        how many begin and end.
    speeds
        sum of |v| + |v'| [rad/s or m/s]; v' of one that does not end is 0.
    squares
        sum of v^2 - v'^2 of those that end [the same squared].
    kept
        sum of |v'| / |v| of those with v other than zero.
    moving
        how many these are.
    time
        of all contacts, the one cut short included [s].
    cut
        whether the motion ends within one.
    """

    whole: int
    speeds: float
    squares: float
    kept: float
    moving: int
    time: float
    cut: bool


def contacts_of(sums: Sums, layout: Layout, clearance: int, end: float) -> Contacts:
    """Return the sums over the contacts of one clearance; an open one counts up to the end of the motion [s]."""
    mine = corners_of(layout, clearance)
    is_open = sums["open"][mine] > 0.0
    of = {name: float(sums[name][clearance]) for name in ("count", "speed", "left", "lost", "kept", "moving", "held")}
    return Contacts(
        whole=int(of["count"]) - int(is_open.sum()),
        speeds=of["speed"] + of["left"],
        squares=of["lost"],
        kept=of["kept"],
        moving=int(of["moving"]),
        time=of["held"] + float(np.sum(end - sums["since"][mine][is_open])),
        cut=bool(is_open.any()),
    )


@dataclass(frozen=True)
class Sides:
    """Time of a clearance in its regions, and its changes of flank at impacts.

    An impact is ``single`` if it follows a contact on the same flank, ``double`` if on the other one. The first impact
    of all follows the side on which the motion begins; from within the gap it counts as single-sided.
    """

    shares: dict[int, float]
    single: int
    double: int


def sides_of(sums: Sums, layout: Layout, clearance: int, duration: float) -> Sides:
    """Return the times of one clearance in its regions in a window [s], and its changes of flank at impacts."""
    shares = _shares(sums, layout, clearance, duration)
    return Sides(shares, int(sums["same"][clearance]), int(sums["other"][clearance]))


def corners_of(layout: Layout, clearance: int) -> slice:
    """Return the range of a clearance's corners among those of all."""
    before = sum(corners.size for corners in layout.corners[:clearance])
    return slice(before, before + layout.corners[clearance].size)


def pieces_of(layout: Layout, clearance: int) -> slice:
    """Return the range of a clearance's pieces among those of all."""
    before = sum(stiffness.size for stiffness in layout.stiffness_of_piece[:clearance])
    return slice(before, before + layout.stiffness_of_piece[clearance].size)


def dwell_times(trajectory: Trajectory, clearance: int, window: Window) -> Array:
    """Return (pieces,) the time in the window that a clearance spends in each of its regions, lowest first [s].

    Raises
    ------
    GearRattleError
        if the log has a gap.
    """
    sums = add_crossings(None, trajectory, window, clearance_arrays(trajectory.layout))
    return sums["dwell"][pieces_of(trajectory.layout, clearance)]


def region_shares(trajectory: Trajectory, clearance: int, window: Window) -> dict[int, float]:
    """Return the share of the window's time that a part spends in each of its regions, from the event times.

    Parameters
    ----------
    clearance
        index into the clearances of ``rings.parts_of``.

    Returns
    -------
    dict[int, float]
        share by region label, ascending, every region of the element included; they sum to 1.

    Raises
    ------
    GearRattleError
        if the log has a gap.
    """
    return _shares(add_crossings(None, trajectory, window), parts_of(trajectory.layout), clearance, window.duration)


def contact_share(trajectory: Trajectory, clearance: int, window: Window) -> float:
    """Return the share of the window's time that a part spends in contact (0 to 1), from the event times.

    Raises
    ------
    GearRattleError
        if the log has a gap.
    """
    return float(share_in_contact(parts_of(trajectory.layout), clearance, region_shares(trajectory, clearance, window)))


def regime(trajectory: Trajectory, clearance: int, window: Window) -> Regime:
    """Return the regime of a part in the window, from the sides on which it crosses corners.

    Of a gap only the corners of its centre count: where it separates.

    Raises
    ------
    GearRattleError
        if the log has a gap.
    """
    drive, coast = add_crossings(None, trajectory, window)["sides"][clearance] > 0.0
    return regime_of(bool(drive), bool(coast))


def sums_of(trajectory: Trajectory) -> Sums:
    """Return the sums over the steady part of a motion.

    Raises
    ------
    ModelError
        if no cycle remains after the discarded ones.
    GearRattleError
        if the log has a gap.
    """
    return add_crossings(None, trajectory, steady(trajectory))


def _shares(sums: Sums, layout: Layout, clearance: int, duration: float) -> dict[int, float]:
    first = int(layout.region_of_first_piece[clearance])
    times = sums["dwell"][pieces_of(layout, clearance)]
    return {first + piece: share for piece, share in enumerate((times / duration).tolist())}
