"""The arrays in which many variants of one driveline lie, and what they have in common.

Variants of one *structure* differ in numbers alone: the same elements in the same places, as many pieces to each law,
the same orders. What their structure says is a ``Frame``, their numbers are ``Coefficients`` with a leading axis of
variants.

n inertias, m elements, H orders, r deflections that are states, K clearances, R reference angles, E elements with
stiffness.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np

from gearrattle.engine.kernels.laws import Laws

T = TypeVar("T", "Coefficients", "Laws", "Tallies")


class Coefficients(NamedTuple):
    """Numbers of one driveline; of V variants with a leading axis (V, ...)."""

    inertia: Any  # (n,)
    drag: Any  # (n,)
    mean: Any  # (n,) mean torques
    torque_sine: Any  # (n, H)
    torque_cosine: Any  # (n, H)
    error_sine: Any  # (m, H)
    error_cosine: Any  # (m, H)
    period: Any  # (1,)
    laws: Any  # Laws


class Frame(NamedTuple):
    """What variants of one structure share."""

    rows: Any  # (m, n) W
    label: Any  # (m,) label of its lowest piece
    clearances: Any  # (K,) elements with corners
    cycles: Any  # (H,) oscillations a period
    basis: Any  # (r, n) X
    combination: Any  # (m, r) B
    elements: Any  # (r,) the element of each row of X
    references: Any  # (R,) inertias whose angle is carried


class Scales(NamedTuple):
    """The scales of one variant, see ``system.scaling``."""

    deflection: Any  # (r,)
    velocity: Any  # (n,)
    inputs: Any  # (1 + H,)
    corner: Any  # (K,)


class Statics(NamedTuple):
    """What the search for the equilibrium needs to know: coordinates of the elements with stiffness alone."""

    elastic: Any  # (E,) these elements
    at: Any  # (r,) which of them each deflection that is sought belongs to
    combination: Any  # (E, r) B
    angle_from_basis: Any  # (n, r)
    motion: Any  # (n, R) free motion of the trains


class Judged(NamedTuple):
    """What the judging of variants needs to know of their structure; corners and pieces of clearances end to end."""

    pieces: Any  # (K + 1,) where a clearance's pieces begin; its corners begin at pieces[k] - k
    label: Any  # (K,) label of its lowest piece
    inner: Any  # (pieces,) whether one is its centre, 1 or 0
    gap: Any  # (K,) whether its centre is free of stiffness, 1 or 0


class Crossings(NamedTuple):
    """Crossings of corners in pieces, ordered by time, then element; ``EventLog`` has them in region labels."""

    time: Any  # (E,) [s]
    clearance: Any  # (E,)
    from_piece: Any  # (E,) the piece left, the lowest of a clearance is 0
    to_piece: Any  # (E,) the piece entered
    velocity: Any  # (E,) deflection rate [rad/s or m/s]
    force_integral: Any  # (E,) of the element's force since t = 0 [N m s or N s]


class Tallies(NamedTuple):
    """What is kept of the crossings of V motions, each array with a leading axis (V, ...)."""

    sides: Any  # (K, 2) 1 where corners of the drive side, of the coast side are crossed
    dwell: Any  # (pieces,) time in each region [s]
    count: Any  # (K,) impacts
    drive: Any  # (K,) on the drive side
    speed: Any  # (K,) sum of their speeds
    top_speed: Any  # (K,)
    square: Any  # (K,) sum of the squares of their speeds
    left: Any  # (K,) sum of the speeds at which contacts end
    top_change: Any  # (K,) largest change of the deflection rate, begin to end of a contact
    push: Any  # (K,) sum of their contact impulses
    top_push: Any  # (K,)
    lost: Any  # (K,) sum of v^2 - v'^2 of contacts that have ended
    kept: Any  # (K,) sum of |v'| / |v| of those with v other than zero
    moving: Any  # (K,) how many these are
    held: Any  # (K,) time in contacts that have ended [s]
    same: Any  # (K,) impacts on the flank of the contact before
    other: Any  # (K,) impacts on the other one
    flank: Any  # (K,) of the last contact: 1 drive, -1 coast, 0 none yet
    final: Any  # (K,) force integral at the end
    open: Any  # (corners,) 1 where a contact has not ended
    begun: Any  # (corners,) the force integral at its begin
    met: Any  # (corners,) the speed at its begin
    since: Any  # (corners,) when it began [s]
    crossings: Any  # (1,) crossings in the window
    calls: Any  # (1,) function calls of the algorithm


def room_for(count: int, judged: Judged) -> Tallies:
    """Tallies of so many motions, all zero."""
    clearances, pieces = judged.label.size, int(judged.pieces[-1])
    shapes = {"sides": (clearances, 2), "dwell": (pieces,), "crossings": (1,), "calls": (1,)}
    shapes |= dict.fromkeys(("open", "begun", "met", "since"), (pieces - clearances,))
    return Tallies(*(np.zeros((count, *shapes.get(name, (clearances,)))) for name in Tallies._fields))


def picked(many: T, which: Any) -> T:
    """Those of many that are chosen along the leading axis; one by its index."""
    return type(many)._make(picked(part, which) if isinstance(part, Laws) else part[which] for part in many)
