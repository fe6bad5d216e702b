"""A force in addition to an element's law, on the same deflection, with a memory or a limit of its own.

    F = k_p delta + c_p delta' + s_p e + f_p,        e' = m_p delta'

in its piece p, which holds while lower_p <= g <= upper_p with g = a_p delta + b_p delta' + d_p e. ``below`` and
``above`` are the pieces beyond these bounds; ``follow`` is the piece after the element has entered another piece of its
law. The auxiliary is piecewise linear, so for the exact engine e is one more state and g one more watched quantity.

* ``slider``: a spring in series with a Coulomb slider (Jenkins element; G. M. Jenkins, Analysis of the stress-strain
  relationships in reactor grade graphite, British Journal of Applied Physics 13, 1962, pp. 30-32). It sticks, e' =
  delta', until its spring carries H; then it slips with the torque H until delta' changes sign.
* ``limiters``: corrections of the damping force c delta', which in contact may neither pull nor push more than the
  elastic force. With the size E >= 0 of the elastic force,

      min(max(c delta', -E), E) = c delta' + min(0, E - c delta') + max(0, -E - c delta'),

  so there is one auxiliary element for pushing and one for pulling. Its force is zero, or the elastic force minus the
  damping force.

* ``alternation``: the part of a stiffness that is absent half of the time; a ``Clock`` defines the instants.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.law import PiecewiseLaw

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

STICK, FORWARD, BACKWARD, OFF = range(4)
"""Pieces of a slider."""


@dataclass(frozen=True)
class Auxiliary:
    """One auxiliary element; arrays are over its P pieces."""

    element: int  # whose deflection it acts on
    kind: str  # "slider", "limiter" or "alternation"
    # stiffness, damping, memory, offset: (P,) k, c, s, f
    stiffness: Array
    damping: Array
    memory: Array
    offset: Array
    moves: Array  # (P,) m
    known: Array  # (P,) the value of e in a piece in which it is constant; NaN: e keeps its value
    watched: Array  # (P, 3) a, b [s], d
    # lower, upper: (P,) bounds of g, infinite where there is none
    lower: Array
    upper: Array
    # below, above: (P,) the piece entered beyond them
    below: IntArray
    above: IntArray
    follow: IntArray  # (pieces of the element, P) the piece of the auxiliary after the element has entered a piece
    scale: float  # size of g

    @property
    def pieces(self) -> int:
        """Number of pieces P."""
        return int(self.stiffness.size)

    @cached_property
    def remembers(self) -> bool:
        """Whether the auxiliary has a state e."""
        return bool(np.any(self.moves != 0.0))

    @cached_property
    def is_let_go(self) -> bool:
        """Whether it is a slider that is released in some pieces of its element's law, with any torque."""
        off = self.follow == OFF
        return self.remembers and bool(off.any()) and not off.all()

    def start(self, piece: int, deflection: float, rate: float) -> int:
        """The piece at the start for e = 0 and the element in ``piece``: the first whose bounds enclose g."""
        allowed = [p for p in range(self.pieces) if self.follow[piece, p] == p]
        for p in allowed:
            value = self.watched[p, 0] * deflection + self.watched[p, 1] * rate
            if self.lower[p] <= value <= self.upper[p]:
                return p
        return allowed[0]


def slider(
    element: int, law: PiecewiseLaw, spring: tuple[float, float], labels: Sequence[int], period: float
) -> Auxiliary:
    """A spring in series with a slider that slips at a torque.

    element: index of the element on whose deflection it acts.
    spring: stiffness, and slip torque H > 0.
    labels: of the pieces of the law in which it is engaged; in the others it is released, and its spring relaxes.
    period: a time [s] by which rates are multiplied to give deflections.
    """
    # pieces: sticking, slipping forwards, slipping backwards, released
    (stiffness, limit) = spring
    none = np.inf
    reach = limit / stiffness
    # the piece of the slider for every piece of the element
    follow = np.full((law.pieces, 4), OFF, dtype=np.int64)
    for piece in range(law.pieces):
        if piece + law.first_label in labels:
            follow[piece] = STICK, FORWARD, BACKWARD, STICK
    # sticking: the force follows the memory, until it reaches the limit; slipping: until the rate changes its sign
    return Auxiliary(
        element,
        "slider",
        stiffness=np.zeros(4),
        damping=np.zeros(4),
        memory=np.array([stiffness, 0.0, 0.0, 0.0]),
        offset=np.array([0.0, limit, -limit, 0.0]),
        moves=np.array([1.0, 0.0, 0.0, 0.0]),
        known=np.array([np.nan, reach, -reach, 0.0]),
        watched=np.array([[0.0, 0.0, 1.0], [0.0, period, 0.0], [0.0, period, 0.0], [0.0, 0.0, 0.0]]),
        lower=np.array([-reach, 0.0, -none, -none]),
        upper=np.array([reach, none, 0.0, none]),
        below=np.array([BACKWARD, STICK, BACKWARD, OFF]),
        above=np.array([FORWARD, FORWARD, STICK, OFF]),
        follow=follow,
        scale=reach,
    )


def limiters(element: int, law: PiecewiseLaw) -> tuple[Auxiliary, Auxiliary]:
    """The limits of the damping in contact: what it would push, then what it would pull beyond the spring's force.

    element: whose deflection they act on.
    law: its law, a free gap with one contact piece on either side, E = |k delta + f| there.
    """
    return _limiter(element, law, 1.0), _limiter(element, law, -1.0)


def _limiter(element: int, law: PiecewiseLaw, way: float) -> Auxiliary:
    """The part that limits pushing (way 1) or pulling (-1); pieces: off, then idle and limiting for each of the law's.

    On the side s = +-1 of contact E = s (k delta + f), and with sign = s way it holds sign c delta' <= E: it idles
    while s delta - sign (c / k) delta' >= -s f / k.
    """
    # pieces: off, then idle and limiting for each of the law's
    count = 1 + 2 * law.pieces
    stiffness = np.zeros(count)
    damping = np.zeros(count)
    offset = np.zeros(count)
    watched = np.zeros((count, 3))
    lower = np.full(count, -np.inf)
    upper = np.full(count, np.inf)
    below = np.arange(count)
    above = np.arange(count)
    follow = np.zeros((law.pieces, count), dtype=np.int64)
    for piece in range(law.pieces):
        # only pieces with stiffness and damping can be limited
        k = float(law.stiffness[piece])
        c = float(law.damping[piece])
        f = float(law.offset[piece])
        if k == 0.0 or c == 0.0:
            continue
        # limiting: the damping force c delta' is replaced by way (k delta + f)
        side = np.sign(piece + law.first_label)
        idle = 1 + 2 * piece
        limiting = 2 + 2 * piece
        stiffness[limiting] = way * k
        damping[limiting] = -c
        offset[limiting] = way * f
        # watched: s delta - sign (c / k) delta', with the bound -s f / k
        watched[idle] = side, -way * side * c / k, 0.0
        watched[limiting] = watched[idle]
        lower[idle] = -side * f / k
        upper[limiting] = lower[idle]
        below[idle] = limiting
        above[limiting] = idle
        # the piece in which contact begins
        follow[piece] = limiting if way > 0.0 else idle  # contact begins with s c delta' > E = 0
        follow[piece, [idle, limiting]] = idle, limiting
    return Auxiliary(
        element=element,
        kind="limiter",
        stiffness=stiffness,
        damping=damping,
        memory=np.zeros(count),
        offset=offset,
        moves=np.zeros(count),
        known=np.full(count, np.nan),
        watched=watched,
        lower=lower,
        upper=upper,
        below=below,
        above=above,
        follow=follow,
        scale=float(np.abs(law.corners).max()),
    )


def alternation(element: int, law: PiecewiseLaw, lacking: float, *, begins_lacking: bool) -> Auxiliary:
    """A part of the elastic force that is absent in one piece and present in the other.

    lacking: the part, 0 ... 1.
    begins_lacking: whether it is absent at the start.
    """
    p = law.pieces
    none = np.inf
    both = np.arange(2 * law.pieces)
    part = -lacking * np.array([1.0, 0.0] if begins_lacking else [0.0, 1.0])
    nothing = np.zeros(2 * p)
    return Auxiliary(
        element=element,
        kind="alternation",
        stiffness=np.outer(part, law.stiffness).ravel(),
        damping=nothing,
        memory=nothing,
        offset=np.outer(part, law.offset).ravel(),
        moves=nothing,
        known=np.full(2 * p, np.nan),
        watched=np.zeros((2 * p, 3)),
        lower=np.full(2 * p, -none),
        upper=np.full(2 * p, none),
        below=both,
        above=(both + p) % (2 * p),
        follow=np.stack([np.where(both < p, q, p + q) for q in range(p)]),
        scale=1.0,
    )
