"""The arrays of many variants of one driveline, and of their common structure.

Variants of one *structure* have the same elements between the same bodies, laws with the same numbers of pieces, and
the same orders; only their numbers differ. The structure is a ``Frame``, the numbers are ``Coefficients`` with a
leading axis of variants.

n inertias, m elements, H orders, r deflections that are states, K clearances, R reference angles, E elements with
stiffness.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np

from gearrattle.engine.kernels.arrays import Array3, IntVector, Matrix, Vector
from gearrattle.engine.kernels.laws import Laws

T = TypeVar("T", "Coefficients", "Laws", "Tallies")


class Coefficients(NamedTuple):
    """Numbers of one driveline; for V variants with a leading axis (V, ...)."""

    inertia: Vector  # (n,)
    drag: Vector  # (n,)
    mean: Vector  # (n,) mean torques
    torque_sine: Matrix  # (n, H)
    torque_cosine: Matrix  # (n, H)
    error_sine: Matrix  # (m, H)
    error_cosine: Matrix  # (m, H)
    period: Vector  # (1,)
    laws: Laws


class Frame(NamedTuple):
    """The structure that variants share."""

    rows: Matrix  # (m, n) deflections of the elements per angle of the bodies
    label: IntVector  # (m,) label of the lowest piece of every element
    clearances: IntVector  # (K,) elements with corners
    cycles: Vector  # (H,) oscillations per period
    basis: Matrix  # (r, n) X: deflections that are states, per angle
    combination: Matrix  # (m, r) B: deflections of all elements, per deflection that is a state
    elements: IntVector  # (r,) the element of every row of X
    references: IntVector  # (R,) inertias whose angle is carried


class Scales(NamedTuple):
    """The scales of one variant, see ``system.energy_scaling``."""

    deflection: Vector  # (r,)
    velocity: Vector  # (n,)
    inputs: Vector  # (1 + H,)
    corner: Vector  # (K,)


class Statics(NamedTuple):
    """Input of the search for the equilibrium: coordinates of the elements that have a stiffness."""

    elastic: IntVector  # (E,) these elements
    at: IntVector  # (r,) index in ``elastic`` of the element of every unknown deflection
    combination: Matrix  # (E, r) B
    angle_from_basis: Matrix  # (n, r)
    motion: Matrix  # (n, R) free motion of the trains


class Judged(NamedTuple):
    """Structure of the parts for the sums over crossings; arrays hold one part's pieces after the other's.

    A part is a clearance, or a *ring*: C clearances of opposite faces around a body, with pieces 0 (no contact) and 1.
    """

    pieces: IntVector  # (K + 1,) where the pieces of part k begin; its corners begin at pieces[k] - k
    label: IntVector  # (K,) label of the lowest piece of every part
    inner: IntVector  # (pieces,) 1: the piece is the central one, else 0
    gap: IntVector  # (K,) 1: the central piece has no stiffness, else 0
    faces: IntVector  # (K,) number of faces of a ring; 0 for a clearance
    part: IntVector  # (C,) the part of every clearance
    face: IntVector  # (C,) number of its face on the drive side, in a ring
    middle: IntVector  # (C,) its central piece, in a ring
    size: IntVector  # (C,) number of its pieces


def without_rings(pieces: IntVector, label: IntVector, inner: IntVector, gap: IntVector) -> Judged:
    """Return the structure of clearances that are all parts of their own."""
    none = np.zeros(label.size, np.int64)
    return Judged(pieces, label, inner, gap, none, np.arange(label.size), none, none, np.diff(pieces))


class Crossings(NamedTuple):
    """Crossings of corners, ordered by time, then element; pieces are indices here, labels in ``EventLog``."""

    time: Vector  # (E,) [s]
    clearance: IntVector  # (E,)
    from_piece: IntVector  # (E,) the piece that is left; 0 is the lowest piece of a clearance
    to_piece: IntVector  # (E,) the piece that is entered
    velocity: Vector  # (E,) deflection rate [rad/s or m/s]
    force_integral: Vector  # (E,) time integral of the element's force since t = 0 [N m s or N s]


class Tallies(NamedTuple):
    """Sums over the crossings of V motions, each array with a leading axis (V, ...)."""

    sides: Array3  # (K, 2) 1 if corners of the drive side, of the coast side are crossed
    touched: Matrix  # (faces,) 1 if contact of a ring begins or ends at this face
    dwell: Matrix  # (pieces,) time in every piece [s]
    count: Matrix  # type: ignore[assignment]  # (K,) impacts; hides tuple.count
    drive: Matrix  # (K,) impacts on the drive side
    speed: Matrix  # (K,) sum of the impact speeds v
    top_speed: Matrix  # (K,) largest impact speed
    square: Matrix  # (K,) sum of v^2
    left: Matrix  # (K,) sum of the speeds v' at the end of a contact
    top_change: Matrix  # (K,) largest change of the deflection rate from the start to the end of a contact
    push: Matrix  # (K,) sum of the contact impulses
    top_push: Matrix  # (K,) largest contact impulse
    lost: Matrix  # (K,) sum of v^2 - v'^2 over the contacts that have ended
    kept: Matrix  # (K,) sum of |v'| / |v| over the contacts that have ended with v other than zero
    moving: Matrix  # (K,) number of these contacts
    held: Matrix  # (K,) time in contacts that have ended [s]
    same: Matrix  # (K,) impacts on the flank of the last contact
    other: Matrix  # (K,) impacts on the opposite flank
    flank: Matrix  # (K,) flank of the last contact: 1 drive, -1 coast, 0 none yet
    final: Matrix  # (K,) force integral at the end
    open: Matrix  # (corners,) 1 if a contact has not ended
    begun: Matrix  # (corners,) force integral at the start of that contact
    met: Matrix  # (corners,) speed at its start
    since: Matrix  # (corners,) instant of its start [s]
    crossings: Matrix  # (1,) crossings in the window
    calls: Matrix  # (1,) function calls of the algorithm


def room_for(count: int, judged: Judged) -> Tallies:
    """Tallies of ``count`` motions, all zero."""
    clearances = judged.label.size
    pieces = int(judged.pieces[-1])
    shapes = {"sides": (clearances, 2), "dwell": (pieces,), "crossings": (1,), "calls": (1,)}
    shapes["touched"] = (int(judged.faces.sum()),)
    shapes |= dict.fromkeys(("open", "begun", "met", "since"), (pieces - clearances,))
    return Tallies._make(np.zeros((count, *shapes.get(name, (clearances,)))) for name in Tallies._fields)


def picked(many: T, which: Any) -> T:
    """The entries of ``many`` at ``which`` along the leading axis: an index, or a selection."""
    return type(many)._make(picked(part, which) if isinstance(part, Laws) else part[which] for part in many)
