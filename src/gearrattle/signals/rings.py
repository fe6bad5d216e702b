"""Rings: the faces of a bearing with clearance, taken together as one part of the verdict.

A ring of N faces stands for a circle, inside which a body floats, or touches. It is in contact while at least one of
its faces is. An *impact* is a face that closes while all others are open. A face that closes beside one that is closed
is no impact: inside a circle the body would roll on, and the number of such faces is that of the polygon. With u the
displacement of the body, the part has the deflection |u|, the corner C and the regions 0 (it floats) and +1.

A body *crosses its clearance* if its contact begins or ends at two faces whose normals are more than 90 deg apart: the
regime is "double-sided" then, otherwise "single-sided"; "quiet" if it never leaves contact, or never meets a face.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gearrattle.derived_values import kept
from gearrattle.engine.kernels import tallies
from gearrattle.engine.kernels.variant_arrays import Crossings, Judged
from gearrattle.signals.regions import clearance_arrays
from gearrattle.trajectory import Array, EventLog, Layout, Trajectory


class Ring(NamedTuple):
    """A bearing with clearance all around.

    Attributes
    ----------
    clearances
        indices into ``Layout.clearance`` of the pairs of faces that stand opposite each other, ascending.
    normals
        (N/2, 2) of the faces on the drive side.
    """

    name: str
    clearances: tuple[int, ...]
    normals: Array


@kept
def rings(layout: Layout) -> tuple[Ring, ...]:
    """Return the bearings whose faces are several clearances, in order."""
    by_bearing: dict[str, list[int]] = {}
    for k, element in enumerate(layout.clearance.tolist()):
        if layout.is_bearing[element]:
            by_bearing.setdefault(layout.component_paths[element].partition(".")[2], []).append(k)
    bearings = [name.rpartition(".")[0] for name in layout.bearing_names[::2]]
    several = []
    for name, clearances in by_bearing.items():
        if len(clearances) > 1:
            first = 2 * bearings.index(name)
            force = layout.bearing_rows[first : first + 2, layout.clearance[clearances]]
            several.append(Ring(name, tuple(clearances), -force.T))
    return tuple(several)


@kept
def parts_of(layout: Layout) -> Layout:
    """Return the layout whose clearances are the parts of the verdict: every ring is one, named as its bearing.

    Elements stay as they are, but the first face of a ring has the name of its bearing.
    """
    if not rings(layout):
        return layout
    # law of a ring, in place of that of its first face
    names = list(layout.element_names)
    corners = list(layout.corners)
    first = layout.region_of_first_piece.copy()
    stiffness = list(layout.stiffness_of_piece)
    damping = list(layout.damping_of_piece)
    left = set(range(layout.clearance.size))
    for ring in rings(layout):
        k = ring.clearances[0]
        left -= {*ring.clearances[1:]}
        names[layout.clearance[k]] = ring.name
        inner = -int(first[k])
        corners[k] = layout.corners[k][inner : inner + 1]
        stiffness[k] = layout.stiffness_of_piece[k][inner : inner + 2]
        damping[k] = layout.damping_of_piece[k][inner : inner + 2]
        first[k] = 0
    # the parts alone
    parts = sorted(left)
    return replace(
        layout,
        element_names=tuple(names),
        clearance=layout.clearance[parts],
        corners=tuple(corners[k] for k in parts),
        region_of_first_piece=first[parts],
        stiffness_of_piece=tuple(stiffness[k] for k in parts),
        damping_of_piece=tuple(damping[k] for k in parts),
    )


@kept
def judged_arrays(layout: Layout) -> Judged:
    """Return as arrays for compiled code the pieces of every part, and the clearances that belong to it."""
    own = clearance_arrays(layout)
    if not rings(layout):
        return own
    parts = clearance_arrays(parts_of(layout))
    position = {element: p for p, element in enumerate(parts_of(layout).clearance.tolist())}
    part = np.array([position.get(element, -1) for element in layout.clearance.tolist()], dtype=np.int64)
    face = np.zeros(part.size, dtype=np.int64)
    faces = np.zeros(parts.label.size, dtype=np.int64)
    for ring in rings(layout):
        of_ring = list(ring.clearances)
        part[of_ring] = part[of_ring[0]]
        face[of_ring] = np.arange(len(of_ring))
        faces[part[of_ring[0]]] = 2 * len(of_ring)
    middle = -np.array(layout.region_of_first_piece, dtype=np.int64)
    return parts._replace(faces=faces, part=part, face=face, middle=middle, size=own.size)


def crossings_of(trajectory: Trajectory) -> Crossings:
    """Return the log of corner crossings by clearances, with pieces counted from the lowest one."""
    log = trajectory.events
    label = np.array(trajectory.layout.region_of_first_piece, dtype=np.int64)
    first = label.take(log.clearance, mode="clip") if label.size else log.clearance
    return Crossings(
        np.array(log.time, dtype=np.float64),
        np.array(log.clearance, dtype=np.int64),
        np.array(log.from_region - first, dtype=np.int64),
        np.array(log.to_region - first, dtype=np.int64),
        np.array(log.velocity, dtype=np.float64),
        np.array(log.force_integral, dtype=np.float64),
    )


@kept
def by_parts(trajectory: Trajectory) -> Trajectory:
    """Return a motion whose clearances are the parts of the verdict; the same object without a ring.

    Of a ring the deflection is |u|, the force that of the bearing, and its integral is unknown.
    """
    layout = trajectory.layout
    if not rings(layout):
        return trajectory
    # crossings at which contact begins or ends
    judged = judged_arrays(layout)
    crossings = crossings_of(trajectory)
    initial = np.array(trajectory.initial_region - layout.region_of_first_piece, dtype=np.int64)
    merged = Crossings._make(np.empty_like(column) for column in crossings)
    pieces = np.zeros(judged.faces.size, dtype=np.int64)
    at = np.empty(len(trajectory.events), dtype=np.int64)
    count = tallies.ring_crossings(judged, crossings, initial, merged, pieces, at)
    merged = Crossings._make(column[:count] for column in merged)
    label = judged.label.take(merged.clearance)
    # samples of the parts
    whole = parts_of(layout)
    first = [layout.clearance.tolist().index(element) for element in whole.clearance.tolist()]
    deflection = trajectory.deflection[:, first]
    force = trajectory.force[:, first]
    region = trajectory.region[:, first]
    integral = trajectory.final_force_integral[first]
    for ring in rings(layout):
        p = whole.clearance_names.index(ring.name)
        faces = list(ring.clearances)
        displacement = trajectory.deflection[:, faces] @ np.linalg.pinv(ring.normals).T
        deflection[:, p] = np.linalg.norm(displacement, axis=1)
        force[:, p] = np.linalg.norm(trajectory.force[:, faces] @ ring.normals, axis=1)
        region[:, p] = np.any(trajectory.region[:, faces] != 0, axis=1)
        integral[p] = np.nan
    return replace(
        trajectory,
        layout=whole,
        deflection=deflection,
        force=force,
        region=region,
        initial_region=pieces + judged.label,
        final_force_integral=integral,
        events=EventLog(
            merged.time,
            merged.clearance,
            merged.from_piece + label,
            merged.to_piece + label,
            merged.velocity,
            merged.force_integral,
        ),
    )


def own_elements(layout: Layout, element: int) -> list[int]:
    """Return the elements of the bearing that an element belongs to; of others the element alone."""
    if not layout.is_bearing[element]:
        return [element]
    return [k for k, path in enumerate(layout.component_paths) if path == layout.component_paths[element]]
