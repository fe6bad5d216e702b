"""The arrays of many variants of one driveline, and of what the variants have in common.

Variants of one *structure* differ in numbers alone: the same elements in the same places, as many pieces to each law,
the same orders. Their structure is a ``Frame``, their numbers are ``Coefficients`` with a leading axis of
variants.

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
    """Numbers of one driveline; of V variants with a leading axis (V, ...)."""

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

    rows: Matrix  # (m, n) W
    label: IntVector  # (m,) label of its lowest piece
    clearances: IntVector  # (K,) elements with corners
    cycles: Vector  # (H,) oscillations per period
    basis: Matrix  # (r, n) X
    combination: Matrix  # (m, r) B
    elements: IntVector  # (r,) the element of each row of X
    references: IntVector  # (R,) inertias whose angle is carried


class Scales(NamedTuple):
    """The scales of one variant, see ``system.energy_scaling``."""

    deflection: Vector  # (r,)
    velocity: Vector  # (n,)
    inputs: Vector  # (1 + H,)
    corner: Vector  # (K,)


class Statics(NamedTuple):
    """Input of the search for the equilibrium: coordinates of the elements with stiffness alone."""

    elastic: IntVector  # (E,) these elements
    at: IntVector  # (r,) which of them each deflection that is sought belongs to
    combination: Matrix  # (E, r) B
    angle_from_basis: Matrix  # (n, r)
    motion: Matrix  # (n, R) free motion of the trains


class Judged(NamedTuple):
    """Structure of the clearances for the sums over crossings; their corners and pieces end to end."""

    pieces: IntVector  # (K + 1,) where a clearance's pieces begin; its corners begin at pieces[k] - k
    label: IntVector  # (K,) label of its lowest piece
    inner: IntVector  # (pieces,) whether one is its centre, 1 or 0
    gap: IntVector  # (K,) whether its centre is free of stiffness, 1 or 0


class Crossings(NamedTuple):
    """Crossings of corners in pieces, ordered by time, then element; ``EventLog`` has them in region labels."""

    time: Vector  # (E,) [s]
    clearance: IntVector  # (E,)
    from_piece: IntVector  # (E,) the piece left, the lowest of a clearance is 0
    to_piece: IntVector  # (E,) the piece entered
    velocity: Vector  # (E,) deflection rate [rad/s or m/s]
    force_integral: Vector  # (E,) of the element's force since t = 0 [N m s or N s]


class Tallies(NamedTuple):
    """Sums over the crossings of V motions, each array with a leading axis (V, ...)."""

    sides: Array3  # (K, 2) 1 where corners of the drive side, of the coast side are crossed
    dwell: Matrix  # (pieces,) time in each region [s]
    count: Matrix  # type: ignore[assignment]  # (K,) impacts; hides tuple.count
    drive: Matrix  # (K,) on the drive side
    speed: Matrix  # (K,) sum of their speeds
    top_speed: Matrix  # (K,)
    square: Matrix  # (K,) sum of the squares of their speeds
    left: Matrix  # (K,) sum of the speeds at which contacts end
    top_change: Matrix  # (K,) largest change of the deflection rate, begin to end of a contact
    push: Matrix  # (K,) sum of their contact impulses
    top_push: Matrix  # (K,)
    lost: Matrix  # (K,) sum of v^2 - v'^2 of contacts that have ended
    kept: Matrix  # (K,) sum of |v'| / |v| of those with v other than zero
    moving: Matrix  # (K,) how many these are
    held: Matrix  # (K,) time in contacts that have ended [s]
    same: Matrix  # (K,) impacts on the flank of the contact before
    other: Matrix  # (K,) impacts on the other one
    flank: Matrix  # (K,) of the last contact: 1 drive, -1 coast, 0 none yet
    final: Matrix  # (K,) force integral at the end
    open: Matrix  # (corners,) 1 where a contact has not ended
    begun: Matrix  # (corners,) the force integral at its start
    met: Matrix  # (corners,) the speed at its start
    since: Matrix  # (corners,) when it began [s]
    crossings: Matrix  # (1,) crossings in the window
    calls: Matrix  # (1,) function calls of the algorithm


def room_for(count: int, judged: Judged) -> Tallies:
    """Tallies of so many motions, all zero."""
    clearances = judged.label.size
    pieces = int(judged.pieces[-1])
    shapes = {"sides": (clearances, 2), "dwell": (pieces,), "crossings": (1,), "calls": (1,)}
    shapes |= dict.fromkeys(("open", "begun", "met", "since"), (pieces - clearances,))
    return Tallies._make(np.zeros((count, *shapes.get(name, (clearances,)))) for name in Tallies._fields)


def picked(many: T, which: Any) -> T:
    """Those of many that are chosen along the leading axis; one by its index."""
    return type(many)._make(picked(part, which) if isinstance(part, Laws) else part[which] for part in many)
