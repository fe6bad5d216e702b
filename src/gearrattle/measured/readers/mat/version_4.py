"""Variables of a MAT file of version 4: a head of five whole numbers, a name, and the numbers, one behind the other.

The first number of a head is MOPT in decimal digits: M is the order of bytes, P the type of the numbers, T what they
mean. Format: The MathWorks, MAT-File Format (R2023a), level 4.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from gearrattle.measured.readers.mat.variables import Damaged, Part, Variable

_HEAD = 20
_LONGEST_NAME = 64
_STORED = ("f8", "f4", "i4", "i2", "u2", "u1")  # by P
_FULL = 0  # T; 1 is text, 2 a sparse matrix


class _Head(NamedTuple):
    order: str
    stored: str
    meaning: int
    rows: int
    columns: int
    is_complex: bool
    name_length: int


def is_version_4(head: bytes) -> bool:
    """Return whether a file begins with the head and the name of a variable of version 4."""
    about = _head_of(head[:_HEAD])
    if about is None:
        return False
    name = head[_HEAD : _HEAD + about.name_length]
    return name.endswith(b"\0") and name[:-1].isascii() and name[:-1].decode("ascii").isidentifier()


def variables(part: Part) -> Iterator[Variable]:
    """Yield the variables; their numbers are read before the next one is asked for, or not at all.

    Damaged where there is no head where one must be, or numbers go beyond the end of the file.
    """
    while part.left:
        about = _head_of(part.read(_HEAD))
        if about is None:
            raise Damaged("no variable of version 4 stands where one must")
        name = part.read(about.name_length).split(b"\0")[0].decode("latin-1")
        stored = about.order + about.stored
        size = about.rows * about.columns * np.dtype(stored).itemsize * (2 if about.is_complex else 1)
        numbers = part.part(size)
        if about.meaning == _FULL and not about.is_complex:
            yield Variable(name, "numbers", (about.rows, about.columns), stored, part=numbers)
        else:
            yield Variable(name, "other")
        numbers.skip(numbers.left)


def _head_of(head: bytes) -> _Head | None:
    """Read a head; None where there is none."""
    if len(head) < _HEAD:
        return None
    for machine, order in enumerate("<>"):
        kind, rows, columns, imaginary, length = struct.unpack(f"{order}5i", head)
        digits = f"{kind:04d}"
        if kind < 0 or len(digits) != 4 or int(digits[0]) != machine or digits[1] != "0":
            continue
        stored = int(digits[2])
        meaning = int(digits[3])
        is_right = stored < len(_STORED) and meaning <= 2 and imaginary in (0, 1)
        if is_right and rows >= 0 and columns >= 0 and 1 < length <= _LONGEST_NAME:
            return _Head(order, _STORED[stored], meaning, rows, columns, imaginary == 1, length)
    return None
