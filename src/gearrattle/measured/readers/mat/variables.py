"""A variable of a MAT file, and the bytes it is read from, a piece at a time.

A vector of 0.9 GB as uint8 is 7.2 GB in double precision, and a compressed one is a thousandth of it in the file. So
the heads of all variables are read first, and the numbers of those that are wanted later, into their final array.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from gearrattle.measured.readers.packing import PIECE
from gearrattle.recording import Array

_BLOCK = 65_536  # compressed bytes that are read at once
_SMALL = 1_000_000  # bytes of a head, a name or a text at most
_UNKNOWN = 2**62  # length of unpacked bytes, before they are unpacked


class Damaged(ValueError):
    """A file that contradicts its format."""


class Part:
    """A range of bytes, read in order."""

    def __init__(self, read: Callable[[int], bytes], skip: Callable[[int], object], left: int) -> None:
        self._read = read
        self._skip = skip
        self.left = left

    def read(self, count: int) -> bytes:
        """Return the next bytes; Damaged where there are fewer."""
        if count > self.left:
            raise Damaged(f"{count} bytes are needed where {self.left} are left")
        self.left -= count
        return self._read(count)

    def skip(self, count: int) -> None:
        """Skip bytes, as far as there are any."""
        count = min(count, self.left)
        self.left -= count
        self._skip(count)

    def part(self, count: int) -> Part:
        """Return the next bytes as a part of their own, which must be read before this one."""
        if count > self.left:
            raise Damaged(f"an element of {count} bytes ends beyond the file")
        return Part(self.read, self.skip, count)

    def small(self) -> bytes:
        """Return all bytes that are left: a head, a name or a text."""
        if self.left > _SMALL:
            raise Damaged(f"a head or a text of {self.left} bytes")
        return self.read(self.left)

    def unpacked(self) -> Part:
        """Return the unpacked bytes; their length is not known before."""
        unpacking = zlib.decompressobj()

        def read(count: int) -> bytes:
            pieces = []
            while count:
                packed = unpacking.unconsumed_tail or self.read(min(_BLOCK, self.left))
                piece = unpacking.decompress(packed, count)
                if not piece and not packed:
                    raise Damaged("a compressed variable ends too early")
                pieces.append(piece)
                count -= len(piece)
            return pieces[0] if len(pieces) == 1 else b"".join(pieces)

        def skip(count: int) -> None:
            while count:
                count -= len(read(min(count, PIECE)))

        return Part(read, skip, _UNKNOWN)


def part_of(stream: BinaryIO, size: int) -> Part:
    """Return the bytes of an open file from its position to its end, the size of the whole file."""

    def read(count: int) -> bytes:
        data = stream.read(count)
        if len(data) < count:
            raise Damaged("ends too early")
        return data

    return Part(read, lambda count: stream.seek(count, 1), size - stream.tell())


@dataclass(frozen=True, eq=False)
class Variable:
    """A variable, or a field of a structure.

    Its sort is "numbers", "text", "object", "structure" (compressed, and not looked into) or "other".
    """

    name: str
    sort: str
    shape: tuple[int, ...] = ()
    stored: str = "f8"
    coding: str = ""
    said: str = ""
    part: Part | None = None

    def text(self) -> str:
        """Return the text; empty for anything else."""
        return self.part.small().decode(self.coding, "replace") if self.sort == "text" and self.part else ""

    def table(self) -> Array:
        """Return the numbers, (columns, samples) of a vector or a table, the longer side being that of the samples."""
        assert self.part is not None
        samples = max(self.shape)
        rows = self.shape[0]
        is_wide = len(self.shape) == 2 and 1 < rows < samples  # the file goes down the rows first
        table = np.empty((int(np.prod(self.shape)) // samples, samples))
        step = max(1, PIECE // rows) * rows if is_wide else PIECE
        for begin in range(0, table.size, step):
            count = min(step, table.size - begin)
            numbers = np.frombuffer(self.part.read(count * np.dtype(self.stored).itemsize), self.stored)
            if is_wide:
                table[:, begin // rows : (begin + count) // rows] = numbers.reshape(-1, rows).T
            else:
                table.reshape(-1)[begin : begin + count] = numbers
        return table
