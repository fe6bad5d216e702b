"""The piecewise-linear laws of all elements as compiled code reads them, one after the other."""

from __future__ import annotations

from typing import NamedTuple

from gearrattle.engine.kernels.arrays import IntVector, Vector


class Laws(NamedTuple):
    """F = stiffness delta + damping delta' + offset in each of P pieces; those of element k begin at ``first[k]``."""

    first: IntVector  # (m + 1,) where an element's pieces begin, and where the last end
    stiffness: Vector  # (P,)
    damping: Vector  # (P,)
    offset: Vector  # (P,)
    lower: Vector  # (P,) corners around each piece, infinite where there is none
    upper: Vector  # (P,)
