"""What the name plate tells of bodies: which gears are loose, how heavy a pair is to its impacts, how fast each turns.

A gear is *loose* if it carries a drag torque and its mesh is the only element with a stiffness on its body. Along the
deflection of an element, delta = r_a theta_a - r_b theta_b - e, its two bodies weigh

    1 / m = r_a^2 / J_a + r_b^2 / J_b        [kg along a line of action, kg m^2 along an angle]

ground weighing infinitely much; what hangs on the two bodies by other elements is left out, for it takes part only as
its springs let it. Mean speeds go by the radii of the meshes, element by element from the reference shaft.

Takes a Layout; gives plain numbers to criteria and metrics.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from gearrattle.signals.regions import centre
from gearrattle.trajectory import Array, Layout


class LooseGear(NamedTuple):
    """A loose gear on its driver.

    Attributes:
        mesh: index of the element between them.
        loose, driver: indices of the inertias.
        reduction: R_driver / R_loose, the loose gear's angle over its driver's.
    """

    mesh: int
    loose: int
    driver: int
    reduction: float


def loose_gears(layout: Layout) -> tuple[LooseGear, ...]:
    """Return every loose gear, in the order of the meshes."""
    found = []
    for mesh in np.flatnonzero(layout.is_mesh).tolist():
        for end in (0, 1):
            loose, driver = (int(layout.between[mesh, side]) for side in (end, 1 - end))
            if layout.drag_torque[loose] > 0.0 and _is_loose(layout, loose, mesh):
                reduction = float(layout.radii[mesh, 1 - end] / layout.radii[mesh, end])
                found.append(LooseGear(mesh, loose, driver, reduction))
    return tuple(found)


def _is_loose(layout: Layout, inertia: int, mesh: int) -> bool:
    """Return whether the mesh is the only element with a stiffness on the inertia's body."""
    touching = np.flatnonzero((layout.between == inertia).any(axis=1))
    return not any(layout.stiffness[k] > 0.0 for k in touching.tolist() if k != mesh)


def reduced_inertia(layout: Layout, element: int) -> float:
    """Return what the two bodies of an element weigh along its deflection [kg for a mesh, kg m^2 for a coupling]."""
    ends = zip(layout.between[element].tolist(), layout.radii[element].tolist(), strict=True)
    compliance = sum(radius**2 / float(layout.inertia[body]) for body, radius in ends if body >= 0)
    return float(1.0 / compliance) if compliance > 0.0 else math.inf


def is_gap(layout: Layout, clearance: int) -> bool:
    """Return whether the centre of a clearance is free of stiffness: a gap proper, no stage of a spring."""
    first = int(layout.region_of_first_piece[clearance])
    return any(layout.stiffness_of_piece[clearance][label - first] == 0.0 for label in centre(layout, clearance))


def speed_ratios(layout: Layout) -> Array:
    """Return (n,) the magnitude of every body's mean speed over that of the reference inertia.

    NaN for bodies that no element connects with it. Where elements close a loop the shortest way counts.
    """
    ratios = np.full(len(layout.inertia_names), np.nan)
    ratios[layout.reference] = 1.0
    reached = [layout.reference]
    for body in reached:
        for element in np.flatnonzero((layout.between == body).any(axis=1)).tolist():
            ends = layout.between[element].tolist()
            here = ends.index(body)
            other = ends[1 - here]
            if other >= 0 and np.isnan(ratios[other]):
                ratios[other] = ratios[body] * layout.radii[element, here] / layout.radii[element, 1 - here]
                reached.append(other)
    return ratios
