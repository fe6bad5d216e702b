"""Lists of blocks in an ASAM MDF file: a list that leads back into itself has no end, and libraries follow it for ever.

Data groups, channel groups and channels are blocks that name the next of their kind and the first of the kind below.
Offsets: ASAM MDF 3.3 and 4.1.

A file whose lists do not end is refused.
"""

from __future__ import annotations

from typing import BinaryIO, NamedTuple

from gearrattle.files import Refused

_VERSION = 28  # offset of the version, two bytes
# offsets in version 4: address of the next block, and of a channel's parts
_NEXT = 24
_PARTS = 32
_DATA = 40  # offset in a data group
_FIRST_GROUP = 88  # offset in the file


class _Format(NamedTuple):
    """Positions of addresses in the blocks of a version.

    Attributes
    ----------
    width
        bytes of an address.
    first
        kind of block by the offset in the file of the first of its list.
    links
        by kind of block, kinds of the blocks that it names, by the offset in it.
    """

    width: int
    first: dict[int, str]
    links: dict[str, dict[int, str]]


_VERSION_3 = _Format(
    4,
    {68: "data group"},
    {
        "data group": {4: "data group", 8: "channel group"},
        "channel group": {4: "channel group", 8: "channel"},
        "channel": {4: "channel"},
    },
)
_VERSION_4 = _Format(
    8,
    {88: "data group", 96: "file history", 104: "hierarchy", 112: "attachment", 120: "event"},
    {
        "data group": {24: "data group", 32: "channel group"},
        "channel group": {24: "channel group", 32: "channel"},
        "channel": {24: "channel"},
        "file history": {24: "file history"},
        "hierarchy": {24: "hierarchy", 32: "hierarchy"},
        "attachment": {24: "attachment"},
        "event": {24: "event"},
    },
)


def check_lists(stream: BinaryIO) -> None:
    """Follow all lists of blocks, and refuse a block that is met twice (Refused)."""
    layout = _VERSION_4 if _number(stream, _VERSION, 2) >= 400 else _VERSION_3
    waiting = [(_number(stream, offset, layout.width), kind) for offset, kind in layout.first.items()]
    met: set[tuple[int, str]] = set()
    ended: set[int] = set()
    while waiting:
        block = waiting.pop()
        address, kind = block
        if address == 0:
            continue
        if block in met:
            raise _endless(kind)
        met.add(block)
        if kind == "channel" and layout is _VERSION_4:
            _check_parts(stream, _number(stream, address + _PARTS, layout.width), ended)
        waiting += [(_number(stream, address + at, layout.width), below) for at, below in layout.links[kind].items()]


def has_long_list_of_data(stream: BinaryIO) -> bool:
    """Return whether a list of data blocks of version 4 goes on in a second block; groups end (``check_lists``)."""
    group = _number(stream, _FIRST_GROUP, _VERSION_4.width)
    while group:
        data = _number(stream, group + _DATA, _VERSION_4.width)
        if _mark(stream, data) == b"##HL":
            data = _number(stream, data + _NEXT, _VERSION_4.width)
        if _mark(stream, data) == b"##DL" and _number(stream, data + _NEXT, _VERSION_4.width):
            return True
        group = _number(stream, group + _NEXT, _VERSION_4.width)
    return False


def _check_parts(stream: BinaryIO, address: int, ended: set[int]) -> None:
    """Follow the parts of a channel, each of which names the next; ``ended`` holds those that are known to end."""
    met: set[int] = set()
    while address and address not in ended:
        if address in met:
            raise _endless("parts of a channel")
        met.add(address)
        address = _number(stream, address + _NEXT, _VERSION_4.width)
    ended |= met


def _endless(kind: str) -> Refused:
    return Refused(f"is damaged: a list of blocks ({kind}) leads back into itself", "copy or export it again")


def _number(stream: BinaryIO, offset: int, width: int) -> int:
    """The unsigned number at an offset; 0 beyond the end of the file."""
    try:
        stream.seek(offset)
    except (OSError, OverflowError, ValueError):
        return 0
    return int.from_bytes(stream.read(width), "little")


def _mark(stream: BinaryIO, address: int) -> bytes:
    """The four letters that tell the kind of a block; fewer beyond the end of the file."""
    _number(stream, address, 0)
    return stream.read(4) if address else b""
