"""A TOML document as blocks: a block is a header with the comment above it, its keys, and the lines after them.

The concatenated blocks are the document, letter by letter. A comment directly above a header belongs to this header,
and a new key of a table is inserted after its last key, not after the comment on the next table.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from gearrattle.model.toml_line_numbers import headers

Location = tuple[int | str, ...]


@dataclass
class Block:
    """One table of a document.

    Attributes
    ----------
    path
        keys and 0-based indices of the table; empty for the keys above the first header.
    head
        comment lines directly above its header, and the header.
    body
        lines from its first key to its last.
    tail
        blank lines and comments below them.
    """

    path: Location
    head: str
    body: str
    tail: str

    @property
    def text(self) -> str:
        """Its part of the document."""
        return self.head + self.body + self.tail

    def parted_tail(self) -> tuple[str, str]:
        """Return the part of the tail that belongs to the table, and the rest from the first blank line."""
        lines = _lines(self.tail)
        blank = next((k for k, line in enumerate(lines) if not line.strip()), len(lines))
        return "".join(lines[:blank]), "".join(lines[blank:])


def blocks_of(text: str) -> list[Block]:
    """Split a valid TOML document into blocks; the first one holds the keys above the first header."""
    lines = _lines(text)
    opened = headers(text)
    starts = [_first_comment(lines, header.line - 1) for header in opened]
    ends = [*starts[1:], len(lines)] if starts else []
    blocks = [_block((), [], lines[: starts[0] if starts else len(lines)])]
    for header, start, end in zip(opened, starts, ends, strict=True):
        blocks.append(_block(header.path, lines[start : header.line], lines[header.line : end]))
    return blocks


def text_of(blocks: Sequence[Block]) -> str:
    """Return the document."""
    return "".join(block.text for block in blocks)


def within(blocks: Sequence[Block], location: Location) -> list[int]:
    """Return the numbers of the blocks of a table and of the tables in it."""
    return [number for number, block in enumerate(blocks) if block.path[: len(location)] == location]


def around(blocks: Sequence[Block], location: Location) -> Block:
    """Return the block in which a key stands, or has to stand."""
    holders = (block for block in blocks if block.path == location[: len(block.path)])
    return max(holders, key=lambda block: len(block.path))


def insert(blocks: list[Block], after: int, path: Location, body: str, *, is_array: bool) -> None:
    """Insert a new table below block number ``after``, with a blank line between them."""
    name = ".".join(str(key) for key in path if isinstance(key, str))
    before = blocks[after]
    own, rest = before.parted_tail()
    before.tail = own + "\n"
    head = f"[[{name}]]\n" if is_array else f"[{name}]\n"
    blocks.insert(after + 1, Block(path, head, body, rest))


def remove(blocks: list[Block], numbers: Sequence[int]) -> None:
    """Remove tables; comments that stand apart below them stay."""
    for number in sorted(numbers, reverse=True):
        rest = blocks.pop(number).parted_tail()[1]
        above = blocks[number - 1]
        if above.tail.endswith("\n\n") or above.tail == "\n":
            rest = rest.removeprefix("\n")
        if number == len(blocks) and not rest.strip():
            above.tail = above.tail.rstrip("\n") + "\n" if above.tail.strip() else ""
        else:
            above.tail += rest


def _lines(text: str) -> list[str]:
    """Return lines with their ends; only a line feed ends one, as in TOML."""
    return re.findall(r"[^\n]*\n|[^\n]+", text)


def _block(path: Location, head: list[str], lines: list[str]) -> Block:
    """Part the lines below a header into keys and what follows them."""
    end = len(lines)
    while end and _is_aside(lines[end - 1]):
        end -= 1
    return Block(path, "".join(head), "".join(lines[:end]), "".join(lines[end:]))


def _first_comment(lines: list[str], header: int) -> int:
    """Return the line at which the comment directly above a header begins."""
    start = header
    while start and lines[start - 1].lstrip().startswith("#"):
        start -= 1
    return start


def _is_aside(line: str) -> bool:
    """Whether a line is blank or a comment."""
    return not line.strip() or line.lstrip().startswith("#")
