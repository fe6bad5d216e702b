"""Constants of a driveline: loose gears, reduced inertias of pairs at impacts, mean speeds.

A gear is *loose* if it carries a drag torque and its mesh is the only element with a stiffness that turns it; of a mesh
with a line of action for either flank that of the drive flank is named. Along the
deflection of an element, delta = sum_i w_i theta_i - e, its bodies have the reduced inertia m_eff,

    1 / m_eff = sum_i w_i^2 / J_i        [kg for a mesh, kg m^2 for a coupling]

and of a body that moves sideways also its mass counts, with the share of its displacement.

Ground and bodies of prescribed motion contribute 0. Bodies connected by other elements are left out: in the short time
of an impact those elements transmit next to nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from gearrattle.mean_speeds import Kinematics, mean_speed_ratios
from gearrattle.signals.regions import clearance_arrays
from gearrattle.trajectory import Array, Layout

T = TypeVar("T", float, Array)


class LooseGear(NamedTuple):
    """A loose gear on its driver.

    Attributes
    ----------
    reduction
        R_driver / R_loose, the loose gear's angle over its driver's.
    """

    mesh: int
    loose: int
    driver: int
    reduction: float


def loose_gears(layout: Layout) -> tuple[LooseGear, ...]:
    """Return every loose gear, in the order of the meshes; two flanks of one mesh count once."""
    gears = []
    pairs = layout.is_mesh & (np.count_nonzero(layout.rows, axis=1) == 2) & np.all(layout.between >= 0, axis=1)
    for mesh in np.flatnonzero(pairs).tolist():
        if any(is_same_mesh(layout, k, mesh) for k in range(mesh)):
            continue
        for end in (0, 1):
            loose, driver = (int(layout.between[mesh, side]) for side in (end, 1 - end))
            if (
                layout.largest_drag_torque(loose) > 0.0
                and loose not in layout.prescribed
                and _is_loose(layout, loose, mesh)
            ):
                reduction = float(layout.radii[mesh, 1 - end] / layout.radii[mesh, end])
                gears.append(LooseGear(mesh, loose, driver, reduction))
    return tuple(gears)


def _is_loose(layout: Layout, inertia: int, mesh: int) -> bool:
    """Return whether the mesh is the only element with a stiffness that turns the inertia; both its flanks are it."""
    touching = np.flatnonzero(layout.rows[:, inertia])
    return not any(layout.stiffness[k] > 0.0 for k in touching.tolist() if not is_same_mesh(layout, k, mesh))


def is_same_mesh(layout: Layout, one: int, other: int) -> bool:
    """Whether two elements are flanks of one mesh, or the same element."""
    of = layout.component_paths
    return one == other or (bool(of) and of[one] == of[other] and np.array_equal(layout.rows[one], layout.rows[other]))


def torque_ratio(layout: Layout, gear: LooseGear, acceleration: T, drag: T | None = None) -> T:
    """Return J_loose (R_driver/R_loose) theta_driver'' / |T_drag|: needed torque over drag, whatever its sense.

    Parameters
    ----------
    acceleration
        theta_driver'' [rad/s^2].
    drag
        drag torques that belong to the accelerations [N m]; None takes the layout's.
    """
    needed = float(layout.inertia[gear.loose]) * gear.reduction * acceleration
    if drag is None:
        return needed / abs(float(layout.drag_torque[gear.loose]))
    return needed / abs(drag)


def decibels(ratio: float) -> float:
    """Return 20 log10 of a ratio; minus infinity of zero, NaN of NaN [dB]."""
    if math.isnan(ratio):
        return math.nan
    return 20.0 * math.log10(ratio) if ratio > 0.0 else -math.inf


def reduced_inertia(layout: Layout, element: int) -> float:
    """Return m_eff of one element [kg for a mesh, kg m^2 for a coupling]; infinite if no end of it is free."""
    return float(reduced_inertias(layout, [element])[0])


def reduced_inertias(layout: Layout, elements: Sequence[int], inertia: Array | None = None) -> Array:
    """Return m_eff of several elements.

    Parameters
    ----------
    inertia
        (..., n) J of the bodies [kg m^2], of many variants along leading axes; None takes the layout's.

    Returns
    -------
    Array
        (..., elements) [kg for a mesh, kg m^2 for a coupling]; infinite where no end of an element is free.
    """
    J = layout.inertia if inertia is None else inertia
    compliance = np.zeros((*J.shape[:-1], len(elements)))
    for i, element in enumerate(elements):
        if layout.direction_mass.size:
            compliance[..., i] = layout.direction_rows[element] ** 2 @ (1.0 / layout.direction_mass)
        for body in np.flatnonzero(layout.rows[element]).tolist():
            if body not in layout.prescribed:
                compliance[..., i] += layout.rows[element, body] ** 2 / J[..., body]
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / compliance)


def is_gap(layout: Layout, clearance: int) -> bool:
    """Return whether the centre of a clearance is free of stiffness: a gap, which can separate."""
    return bool(clearance_arrays(layout).gap[clearance])


def gap_names(layout: Layout) -> tuple[str, ...]:
    """Return the names of the clearances that can separate, in element order: only these can rattle."""
    return tuple(name for k, name in enumerate(layout.clearance_names) if is_gap(layout, k))


def speed_ratios(layout: Layout) -> Array:
    """Return (n,) the magnitude of every body's mean speed over that of the reference inertia; NaN for bodies whose
    speed it does not settle (``gearrattle.mean_speeds``).
    """
    kinematics = Kinematics(layout.rows, layout.between, layout.radii, layout.is_mesh, layout.stiffness > 0.0)
    return np.asarray(np.abs(mean_speed_ratios(kinematics, layout.reference)))
