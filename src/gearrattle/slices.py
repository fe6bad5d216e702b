"""Slices of long arrays, so that Ctrl-C is handled between two of them: NumPy handles it only after a call.

A slice fits into the cache of the processor, so computing in slices takes no longer.
"""

from __future__ import annotations

from collections.abc import Iterator

_NUMBERS = 250_000  # in a slice: 2 MB


def slices(rows: int, width: int) -> Iterator[slice]:
    """Return slices that cover the rows of an array one after the other, of some 250 000 numbers each."""
    step = max(1, _NUMBERS // max(1, width))
    return (slice(first, min(first + step, rows)) for first in range(0, rows, step))
