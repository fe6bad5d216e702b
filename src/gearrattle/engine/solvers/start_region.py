"""The region a motion starts in.

Off the corners the deflection decides. Exactly on a corner (to rounding) the first non-zero derivative of the
deflection decides; the inner region if there is none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.kernels.march_arrays import ON_CORNER
from gearrattle.engine.system.flow import Flow

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_NOTHING = 1e-12  # a derivative this small against its own terms is rounding
_DERIVATIVES = 6


def starting_pieces(
    flow: Flow, z: Array, angle: Array, auxiliary_pieces: IntArray | None = None
) -> tuple[tuple[int, ...], IntArray]:
    """Pieces of all elements and auxiliaries at the state z (Z,), and of all watched the side of the piece they sit on.

    ``angle`` (n,) is what the deflections in z were computed from; it sets how much of them is rounding. Pieces of
    auxiliaries (C,), where they are known, are taken as far as the region allows them; -1: deflection, rate and clock
    decide.

    Returns the pieces (m + auxiliaries,), and the side (W,): -1 on the lower corner of its piece, +1 on the upper one,
        0 on neither.
    """
    known = () if auxiliary_pieces is None else tuple(auxiliary_pieces.tolist())
    key = z.tobytes(), angle.tobytes(), known
    last = _last_start(flow)
    start = last.get(key)
    if start is None:
        start = _new_start(flow, z, angle, auxiliary_pieces)
        last.clear()
        last[key] = start
    pieces, side = start
    return pieces, side.copy()


@kept
def _last_start(_: Flow) -> dict[tuple[bytes, bytes, tuple[int, ...]], tuple[tuple[int, ...], IntArray]]:
    """Pieces of the last start of the flow, by its state."""
    return {}


def _new_start(
    flow: Flow, z: Array, angle: Array, auxiliary_pieces: IntArray | None
) -> tuple[tuple[int, ...], IntArray]:
    # pieces by the deflection alone; on a corner within rounding the inner one
    pieces = [0] * len(flow.system.laws)
    on_corner: dict[int, int] = {}
    for i, k in enumerate(flow.system.clearances):
        law = flow.system.laws[k]
        delta = float(flow.deflection[k] @ z)
        size = float(np.abs(flow.system.rows[k]) @ np.abs(angle) + np.abs(flow.deflection[k]) @ np.abs(z))
        pieces[k] = law.piece_at(delta)
        for c, corner in enumerate(law.corners):
            if abs(delta - corner) <= ON_CORNER * max(abs(corner), size):
                pieces[k] = law.inner(c, c + 1)
                on_corner[i] = c
    # on a corner: by the first derivative that is not rounding
    undecided = dict(on_corner)
    for order in range(1, _DERIVATIVES + 1 if undecided else 1):
        signs = _signs(flow, _accompanied(flow, pieces, z, auxiliary_pieces), z, order)
        for i, c in list(undecided.items()):
            if signs[i] != 0:  # a lower derivative of one element may change a higher one of another: pieces at once
                pieces[flow.system.clearances[i]] = c + 1 if signs[i] > 0 else c
                del undecided[i]
    # which corner each clearance sits on
    side = np.zeros(flow.system.watched, dtype=np.int64)
    for i, c in on_corner.items():
        side[i] = -1 if pieces[flow.system.clearances[i]] == c + 1 else 1
    return _accompanied(flow, pieces, z, auxiliary_pieces), side


def _accompanied(flow: Flow, pieces: Sequence[int], z: Array, known: IntArray | None) -> tuple[int, ...]:
    """The pieces of all elements, and those in which their auxiliaries start."""
    auxiliary_pieces = []
    for c, auxiliary in enumerate(flow.system.auxiliaries):
        if known is not None and known[c] >= 0:  # one of a region that the deflection has left is another one here
            auxiliary_pieces.append(int(auxiliary.follow[pieces[auxiliary.element], known[c]]))
            continue
        deflection = float(flow.deflection[auxiliary.element] @ z)
        rate = float(flow.rate[auxiliary.element] @ z)
        auxiliary_pieces.append(auxiliary.start(pieces[auxiliary.element], deflection, rate))
    return (*pieces, *auxiliary_pieces)


def _signs(flow: Flow, pieces: tuple[int, ...], z: Array, order: int) -> IntArray:
    """(K,) sign of one derivative of every clearance's deflection; 0 where it is rounding."""
    matrix = flow.generator(pieces)
    rows = flow.deflection[list(flow.system.clearances)]
    derivative = z
    size = np.abs(z)
    for _ in range(order):
        derivative = matrix @ derivative
        size = np.abs(matrix) @ size
    value = rows @ derivative
    return np.where(np.abs(value) > _NOTHING * (np.abs(rows) @ size), np.sign(value), 0.0).astype(np.int64)
