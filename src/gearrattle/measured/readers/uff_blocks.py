"""The datasets of a universal file: where they stand, and their numbers, a piece at a time.

A file is gone through once for the headers of its datasets; the numbers of those that are wanted are read later, into
their final arrays. Lines of numbers are parted by blanks, or are columns of Fortran's E13.5 or E20.12 that touch.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.recording import Array
from gearrattle.wording import counted

HEADER = 11
"""Lines of the header of a dataset 58."""
_LONGEST_LINE = 1_000_000  # bytes; such a file has 80 a line
_PIECE = 1_000_000  # bytes of numbers that are read at once
_FEWEST_BYTES = 2  # bytes of a number in a text: a digit and a separator
_DAMAGED = "the file is damaged: export it again"


class Block(NamedTuple):
    """A dataset.

    Attributes
    ----------
    begin, size
        where its numbers stand in the file, and how many bytes they are.
    order
        of the bytes of numbers: < or >; empty: they are a text.
    """

    number: int
    lines: list[str]
    begin: int
    size: int
    order: str


@dataclass(eq=False)
class Samples:
    """Numbers of a dataset, in the order of the file.

    Attributes
    ----------
    values
        (N,).
    time
        (N,) the abscissa, which stands before every value; None: even spacing, which the header states.
    """

    values: Array
    time: Array | None

    @property
    def size(self) -> int:
        """How many numbers there are."""
        return self.values.size * (1 if self.time is None else 2)

    def put(self, numbers: Array, at: int) -> None:
        """Store numbers; those beyond the size are left out."""
        numbers = numbers[: max(0, self.size - at)]
        if self.time is None:
            self.values[at : at + numbers.size] = numbers
            return
        for target, first in ((self.time, at % 2), (self.values, 1 - at % 2)):
            part = numbers[first::2]
            begin = (at + first) // 2
            target[begin : begin + part.size] = part


def blocks(stream: BinaryIO, path: Path) -> Iterator[Block]:
    """Cut an open file into datasets; binary ones by the stated number of bytes.

    A ModelError refuses a file that ends inside a dataset, lines without an end, and numbers that are not of IEEE 754.
    """
    cutter = _Cutter(stream, path)
    while cutter.at < cutter.end:
        if cutter.line().strip() != b"-1":
            continue
        head = cutter.line().decode("latin-1")
        is_binary = head[5:7].lower() == "8b" and len(head.split()) >= 5
        yield cutter.binary(head) if is_binary else cutter.text(head)


class _Cutter:
    """Reader of an open file line by line; ``at`` is its position, ``end`` the end of the file."""

    def __init__(self, stream: BinaryIO, path: Path) -> None:
        self.stream = stream
        self.path = path
        self.at = 0
        self.end = os.fstat(stream.fileno()).st_size

    def line(self) -> bytes:
        """Return the next line."""
        text = self.stream.readline(_LONGEST_LINE)
        if len(text) == _LONGEST_LINE:
            rule = f"lines have at most {_LONGEST_LINE} bytes"
            raise ModelError(Problem(str(self.path), "a longer line", rule, _DAMAGED))
        self.at += len(text)
        return text

    def binary(self, head: str) -> Block:
        """Return a dataset 58b, whose first line states its lines of header and bytes."""
        fields = [int(word) for word in head[7:].split()]
        count = fields[2]
        size = fields[3]
        if not (0 <= count <= self.end - self.at and 0 <= size <= self.end - self.at):
            raise self._cut()
        lines: list[str] = []
        for _ in range(count):
            text = self.line().decode("latin-1")
            lines += [text] if len(lines) < HEADER else []
        begin = self.at
        self.at = self.stream.seek(min(begin + size, self.end))
        if fields[1] != 2:
            rule = "binary numbers must be of IEEE 754"
            raise ModelError(Problem(str(self.path), f"format {fields[1]}", rule, "write it as text"))
        closing = self.line().strip()
        while not closing and self.at < self.end:  # a line break may stand between the bytes and the line that closes
            closing = self.line().strip()
        if begin + size > self.end or closing not in (b"-1", b""):
            raise self._cut()
        return Block(58, lines, begin, size, "<" if fields[0] == 1 else ">")

    def text(self, head: str) -> Block:
        """Return a dataset of lines."""
        lines: list[str] = []
        begin = self.at
        last = self.at
        while (content := self.line()).strip() != b"-1":
            if self.at >= self.end:
                raise self._cut()
            if len(lines) < HEADER:
                lines.append(content.decode("latin-1"))
                begin = self.at
            last = self.at
        return Block(int(head.split(maxsplit=1)[0]), lines, begin, last - begin, "")

    def _cut(self) -> ModelError:
        rule = "ends inside a dataset: the file is truncated"
        return ModelError(Problem(str(self.path), "", rule, "copy it again"))


def check_count(block: Block, count: int, samples: int, location: str) -> int:
    """Return the bytes of a sample, 0 of a text; ModelError for a header that states more than the dataset holds."""
    if block.order:
        width = block.size // samples if block.size % samples == 0 else 0
        widths = (4, 8) if count == samples else (8, 12, 16)
        if width in widths:
            return width
        rule = f"its header tells {counted(samples, 'sample')}"
        raise ModelError(Problem(location, f"{block.size} bytes", rule, _DAMAGED))
    if _FEWEST_BYTES * count > block.size + 1:
        rule = f"its header tells {counted(count, 'number')}"
        raise ModelError(Problem(location, f"{block.size} bytes of text", rule, _DAMAGED))
    return 0


def read_bytes_of(stream: BinaryIO, block: Block, width: int, samples: Samples) -> None:
    """Read numbers that are stored as bytes."""
    forms = {4: "f4", 8: "f8"} if samples.time is None else {8: "f4,f4", 12: "f4,f8", 16: "f8,f8"}
    form = np.dtype(",".join(f"{block.order}{part}" for part in forms[width].split(",")))
    stream.seek(block.begin)
    step = _PIECE // width
    for begin in range(0, samples.values.size, step):
        table = np.frombuffer(stream.read(min(step, samples.values.size - begin) * width), form)
        part = slice(begin, begin + table.size)
        if samples.time is None:
            samples.values[part] = table
        else:
            samples.time[part] = table["f0"]
            samples.values[part] = table["f1"]


def read_text_of(stream: BinaryIO, block: Block, width: int, samples: Samples, location: str) -> int:
    """Read numbers of a text; return the count of surplus numbers that fill up its last line.

    ModelError where there are not as many, ValueError for what is no number.
    """
    try:
        read, last = _fill(stream, block, 0, samples)
        touching = not 0 <= read - samples.size < max(1, last)
    except ValueError:
        touching = True
        if samples.time is not None:
            raise
    if touching and samples.time is None:  # no blank between columns
        read, last = _fill(stream, block, width, samples)
    behind = read - samples.size
    if behind and not 0 < behind < last:
        rule = f"its header tells {counted(samples.size, 'number')}"
        raise ModelError(Problem(location, f"{read} numbers", rule, _DAMAGED))
    return behind


def _fill(stream: BinaryIO, block: Block, width: int, samples: Samples) -> tuple[int, int]:
    """Read numbers parted by blanks, or columns of a width; return how many there are, in all and in the last line."""
    stream.seek(block.begin)
    left = block.size
    read = 0
    last = 0
    while left > 0 and (lines := stream.readlines(min(_PIECE, left))):
        taken = sum(map(len, lines))
        if taken > left:  # the lines that close the dataset
            lines = b"".join(lines)[:left].splitlines()
        left -= taken
        rows = [line.decode("latin-1").replace("D", "E") for line in lines if line.strip()]
        if not rows:
            continue
        words = [word for row in rows for word in _words(row, width)] if width else " ".join(rows).split()
        last = len(_words(rows[-1], width))
        samples.put(np.array(list(map(float, words))), read)
        read += len(words)
    return read, last


def _words(row: str, width: int) -> list[str]:
    """Return the numbers of a line, by blanks or by columns of a width."""
    if not width:
        return row.split()
    row = row.rstrip("\r\n")
    return [word for k in range(0, len(row), width) if (word := row[k : k + width].strip())]
