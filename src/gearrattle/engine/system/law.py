"""The piecewise-linear law of one element: F = k_r delta + c_r delta' + f_r in piece r.

Pieces are kept from the outermost coast piece to the outermost drive piece, separated by ascending corners. Labels
count outward from 0, the centre: +1, +2, ... on the drive side (delta > 0), -1, -2, ... on the coast side. If the
first drive and coast pieces differ, delta = 0 is itself a corner, between pieces 0 and -1.

The elastic part is continuous across every corner; the damping coefficient may jump (eqs. (9), (10) of Padmanabhan,
Barlow, Rook, Singh, ASME J. Mech. Des. 117 (1995) 185). A linear element has one piece and no corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Stage(NamedTuple):
    """One stage on one side, from the centre outward: slope, damping, outer end (None: the last)."""

    stiffness: float
    damping: float
    until: float | None


@dataclass(frozen=True)
class PiecewiseLaw:
    """Force of one element against deflection and its rate."""

    corners: Array  # (P-1,) ascending deflections where the piece changes
    # stiffness, damping, offset: (P,) of each piece, lowest deflection first
    stiffness: Array
    damping: Array
    offset: Array
    first_label: int  # label of the lowest piece (<= 0)

    @property
    def pieces(self) -> int:
        """Number of pieces P."""
        return int(self.stiffness.size)

    @property
    def lower(self) -> Array:
        """(P,) lower corner of each piece, -inf where there is none."""
        return np.append(-np.inf, self.corners)

    @property
    def upper(self) -> Array:
        """(P,) upper corner of each piece, inf where there is none."""
        return np.append(self.corners, np.inf)

    def elastic(self, deflection: float) -> float:
        """Elastic force at a deflection."""
        piece = self.piece_at(deflection)
        return float(self.stiffness[piece] * deflection + self.offset[piece])

    def piece_at(self, deflection: float) -> int:
        """Index of the piece a deflection lies in (on a corner: the upper piece)."""
        return int(np.searchsorted(self.corners, deflection, side="right"))

    def bounds(self, piece: int) -> tuple[float, float]:
        """Lower and upper corner of a piece; -inf, +inf where there is none."""
        low = float(self.corners[piece - 1]) if piece > 0 else -np.inf
        high = float(self.corners[piece]) if piece < self.pieces - 1 else np.inf
        return low, high

    def inner(self, piece: int, other: int) -> int:
        """The one of two neighbouring pieces that lies nearer the centre."""
        return piece if abs(piece + self.first_label) <= abs(other + self.first_label) else other


def staged(
    drive: Sequence[Stage], coast: Sequence[Stage], preload: float = 0.0, *, parted: bool = False
) -> PiecewiseLaw:
    """Build the law from its stages on both sides, each from the centre outward.

    ``preload`` is the force at delta = 0; ``parted`` says that the first stages differ even if the law is the same.
    """
    centre_is_one = drive[0][:2] == coast[0][:2] and not parted
    drive_ends = [stage.until for stage in drive[:-1] if stage.until is not None]
    coast_ends = [-stage.until for stage in coast[:-1] if stage.until is not None]
    outward = list(drive[1:]) if centre_is_one else list(drive)
    corners = np.array([*reversed(coast_ends), *([] if centre_is_one else [0.0]), *drive_ends])
    stages = [*reversed(coast), *outward]
    stiffness = np.array([stage.stiffness for stage in stages])
    damping = np.array([stage.damping for stage in stages])
    centre = len(coast) - 1
    offset = np.empty(len(stages))
    offset[centre] = preload
    for piece in range(centre + 1, len(stages)):
        offset[piece] = offset[piece - 1] + (stiffness[piece - 1] - stiffness[piece]) * corners[piece - 1]
    for piece in range(centre - 1, -1, -1):
        offset[piece] = offset[piece + 1] + (stiffness[piece + 1] - stiffness[piece]) * corners[piece]
    return PiecewiseLaw(corners, stiffness, damping, offset, -centre if centre_is_one else -centre - 1)
