"""The piecewise-linear laws of all elements as compiled code reads them, one after the other."""

from __future__ import annotations

from typing import Any, NamedTuple


class Laws(NamedTuple):
    """F = stiffness delta + damping delta' + offset in each of P pieces; those of element k begin at ``first[k]``."""

    first: Any  # (m + 1,) where an element's pieces begin, and where the last end
    stiffness: Any  # (P,)
    damping: Any  # (P,)
    offset: Any  # (P,)
    lower: Any  # (P,) corners around each piece, infinite where there is none
    upper: Any  # (P,)
