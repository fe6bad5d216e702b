"""Slices of long arrays, between which Ctrl-C is answered: NumPy does not react before a call is done.

A slice fits into the processor's cache, so work in slices takes no longer.
"""

from __future__ import annotations

from collections.abc import Iterator

_NUMBERS = 250_000  # 2 MB of a slice


def slices(rows: int, width: int) -> Iterator[slice]:
    """Return slices that cover the rows of an array one after the other, of some 250 000 numbers each."""
    step = max(1, _NUMBERS // max(1, width))
    return (slice(first, min(first + step, rows)) for first in range(0, rows, step))
