"""A force in addition to an element's law, on the same deflection, with a memory or a limit of its own.

    F = k_p delta + c_p delta' + s_p e + f_p,        e' = m_p delta'

in its piece p, which holds while lower_p <= g <= upper_p with g = a_p delta + b_p delta' + d_p e. Beyond, ``below`` and
``above`` say which piece comes next; ``follow`` says which one comes when the element itself enters another piece of
its law. All is piecewise linear, so the exact engine sees nothing new: e is one more state, g one more thing to watch.

* ``slider``: a spring in series with a Coulomb slider (Jenkins element; G. M. Jenkins, Analysis of the stress-strain
  relationships in reactor grade graphite, British Journal of Applied Physics 13, 1962, pp. 30-32). It sticks, e' =
  delta', until its spring carries H; then it slips with the torque H until delta' changes sign.
* ``limiters``: what damping c delta' lacks where contact can neither be pulled nor be pushed by more than the spring
  does. With the elastic force's size E >= 0,

      min(max(c delta', -E), E) = c delta' + min(0, E - c delta') + max(0, -E - c delta'),

  so what damping would push, and what it would pull, beyond E is an auxiliary element each: nothing, or the elastic
  force without the damping.

* ``alternation``: the part of a stiffness that is lacking half of the time; when is up to a ``Clock``.
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
    known: Array  # (P,) the value of e in a piece where it is constant; NaN where e goes on
    watched: Array  # (P, 3) a, b [s], d
    # lower, upper: (P,) bounds of g, infinite where there is none
    lower: Array
    upper: Array
    # below, above: (P,) the piece entered beyond them
    below: IntArray
    above: IntArray
    follow: IntArray  # (pieces of the element, P) the piece it is in once the element has entered one of its own
    scale: float  # size of g

    @property
    def pieces(self) -> int:
        """Number of pieces P."""
        return int(self.stiffness.size)

    @cached_property
    def remembers(self) -> bool:
        """Whether it has a state e."""
        return bool(np.any(self.moves != 0.0))

    @cached_property
    def is_let_go(self) -> bool:
        """Whether it is a slider that its element lets go in some pieces of its law, whatever torque it holds."""
        off = self.follow == OFF
        return self.remembers and bool(off.any()) and not off.all()

    def start(self, piece: int, deflection: float, rate: float) -> int:
        """The piece it starts in while its element is in ``piece``, e = 0: the first whose bounds hold g."""
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

    element: whose deflection it acts on.
    spring: its stiffness, and H > 0, the torque at which it slips.
    labels: of the pieces of the law in which it is engaged; it is released, and its spring relaxes, in the others.
    period: a time [s] by which rates are made deflections.
    """
    # pieces: sticking, slipping forwards, slipping backwards, released
    (stiffness, limit) = spring
    none = np.inf
    reach = limit / stiffness
    # the piece that it is in while its element is in each of its own
    follow = np.full((law.pieces, 4), OFF, dtype=np.int64)
    for piece in range(law.pieces):
        if piece + law.first_label in labels:
            follow[piece] = STICK, FORWARD, BACKWARD, STICK
    # while it sticks the force follows the memory; it slips where that reaches the limit, until the rate turns
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
    """A part of the elastic force that is lacking now, and not lacking then.

    lacking: the part, 0 ... 1.
    begins_lacking: whether it is lacking at the start.
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
