"""Long arrays in slices, so that Ctrl-C works between two of them: NumPy does not react before it is done.

Slices are small enough to stay in the processor's cache, so working in them takes no longer.
"""

from __future__ import annotations

from collections.abc import Iterator

_NUMBERS = 250_000  # 2 MB of a slice


def slices(rows: int, width: int) -> Iterator[slice]:
    """Return slices that cover the rows of an array one after the other, of some 250 000 numbers each.

    Parameters
    ----------
    rows
        how many there are.
    width
        numbers worked on in a row.
    """
    step = max(1, _NUMBERS // max(1, width))
    return (slice(first, min(first + step, rows)) for first in range(0, rows, step))
