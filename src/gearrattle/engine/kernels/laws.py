"""The piecewise-linear laws of all elements as compiled code reads them, one after the other."""

from __future__ import annotations

from typing import NamedTuple

from gearrattle.engine.kernels.arrays import IntVector, Vector


class Laws(NamedTuple):
    """F = stiffness delta + damping delta' + offset in each of P pieces; those of element k begin at ``first[k]``."""

    first: IntVector  # (m + 1,) where the pieces of every element begin; the last entry is P
    stiffness: Vector  # (P,)
    damping: Vector  # (P,)
    offset: Vector  # (P,)
    lower: Vector  # (P,) lower corner of every piece; infinite: none
    upper: Vector  # (P,)
