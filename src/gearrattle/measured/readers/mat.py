"""MAT files of version 5, as MATLAB's ``save`` writes them without further words, and of version 4.

A vector is a signal; a matrix is one signal a column; fields of structures are read through their dots. Units are not
in such files; ``write`` puts names, units and quantities beside the signals, as JSON in the text ``gearrattle``, and
the format in ``gearrattle_format``.
Format: The MathWorks, MAT-File Format (R2023a). Version 7.3 is HDF5, and read there. The elements of version 5 are
parsed here, every length checked against what is there: SciPy 1.17 ends the process on some damaged files.

Takes a path; gives columns with times.
"""

from __future__ import annotations

import io
import json
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import read_bytes, within_limit
from gearrattle.formats import check_format, format_name
from gearrattle.measured.readers.base import Column, Raw, Request, split_columns, unfit, with_times
from gearrattle.recording import Recording

NAME = "mat"
SUFFIXES = (".mat",)
_TOLD = "gearrattle"
_FORMAT = "gearrattle_format"
_LONGEST_NAME = 63
_DEEPEST = 20
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_MATRIX, _PACKED = 14, 15
_STRUCTURE = 2
_TEXT = 4
_FIRST_NUMBER = 6
_LAST_NUMBER = 15
_COMPLEX, _LOGICAL = 0x800, 0x200


class _Damaged(ValueError):
    """An element that contradicts the format."""


class _Element(NamedTuple):
    kind: int
    data: memoryview


def knows(_path: Path, head: bytes) -> bool:
    """Tell the text and the mark of byte order of a MAT file of version 5; version 4 has neither."""
    return head[:10] == b"MATLAB 5.0" or (len(head) >= 128 and head[124:128] in (b"\x00\x01IM", b"\x01\x00MI"))


def read(path: Path, request: Request) -> Raw:
    """Return its vectors."""
    content = read_bytes(path)
    arrays = list(_version_5(content) if knows(path, content[:128]) else _version_4(content))
    described = next((_column_entries(value) for name, value in arrays if name == _TOLD), {})
    check_format(next((value for name, value in arrays if name == _FORMAT), ""), path, "recording")
    columns: list[Column] = []
    skipped: list[str] = []
    for name, value in arrays:
        vectors = list(split_columns(name, value)) if isinstance(value, np.ndarray) else []
        skipped += [] if vectors or name in (_TOLD, _FORMAT) else [name]
        for full, array in vectors:
            row = described.get(full, {})
            said = [str(row.get(key, "")) for key in ("unit", "quantity", "subject")]
            columns.append(Column(str(row.get("name", full)), said[0], array, None, *said[1:]))
    if not columns:
        rule = "holds no vectors of real numbers"
        raise ModelError(Problem(str(path), ", ".join(skipped[:8]), rule, "save time and signals as plain vectors"))
    notes = (f"no signals, left out: {', '.join(skipped)}",) if skipped else ()
    return Raw(with_times(columns, path, request), str(path), NAME, notes)


def write(recording: Recording, path: Path) -> None:
    """Write ``time`` [s], one vector a channel, and what they are."""
    from scipy.io import savemat

    variables: dict[str, Any] = {"time": recording.time}
    rows = {}
    for channel in recording.channels:
        variable = re.sub(r"\W", "_", channel.name, flags=re.ASCII)
        variable = variable if variable[:1].isalpha() else f"x{variable}"
        if variable in (*variables, _TOLD, _FORMAT) or len(variable) > _LONGEST_NAME:
            rule = f"as a variable of MATLAB its name would be {variable}, which is taken or too long"
            raise unfit(path, channel.name, rule, "rename the channel")
        variables[variable] = channel.values
        rows[variable] = {k: getattr(channel, k) for k in ("name", "unit", "quantity", "subject")}
    about = {_FORMAT: format_name("recording"), _TOLD: json.dumps(rows)}
    savemat(path, {**variables, **about}, oned_as="column", appendmat=False, long_field_names=True)


def _column_entries(value: Any) -> dict[str, dict[str, str]]:
    """Return what ``write`` put beside the signals, by variable."""
    try:
        rows = json.loads(value)
    except (TypeError, ValueError):
        return {}
    plain = isinstance(rows, dict) and all(isinstance(row, dict) for row in rows.values())
    return rows if plain else {}


def _version_4(content: bytes) -> Iterator[tuple[str, Any]]:
    from scipy.io import loadmat

    for name, value in loadmat(io.BytesIO(content)).items():
        if not name.startswith("__"):
            yield name, value


def _version_5(content: bytes) -> Iterator[tuple[str, Any]]:
    """Yield names and values of the variables, fields of structures by their path."""
    unpacked = 0
    order = "<" if content[126:128] == b"IM" else ">"
    for element in _elements(memoryview(content)[128:], order):
        inner = element
        if element.kind == _PACKED:
            data = _unpacked(element.data, order, unpacked)
            unpacked += len(data)
            inner = next(_elements(memoryview(data), order))
        if inner.kind == _MATRIX:
            yield from _variable(inner.data, order, "", 0)


def _unpacked(data: memoryview, order: str, before: int) -> bytes:
    """Return what a compressed variable holds: one element, whose head says its length.

    Parameters
    ----------
    data
        the compressed bytes.
    order
        of bytes in a number.
    before
        bytes unpacked from the file so far.

    Raises
    ------
    Refused
        the file would take more memory than the limit.
    """
    unpacking = zlib.decompressobj()
    head = unpacking.decompress(data, 8)
    if len(head) < 8:
        raise _Damaged("a compressed variable ends too early")
    kind, size = (int(x) for x in np.frombuffer(head, f"{order}u4", 2))
    length = 0 if kind >> 16 else size
    within_limit(before + length)
    rest = unpacking.decompress(unpacking.unconsumed_tail, length + 8)
    if len(rest) < length:
        raise _Damaged("a compressed variable ends too early")
    return head + rest


def _elements(data: memoryview, order: str) -> Iterator[_Element]:
    """Cut bytes into elements; each tells its kind and length in front."""
    at = 0
    while at < len(data):
        if len(data) - at < 8:
            raise _Damaged("ends inside the head of an element")
        kind, size = (int(x) for x in np.frombuffer(data, f"{order}u4", 2, at))
        if kind >> 16:  # short: length and kind share four bytes, the data are the next four
            kind, size, begin, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        else:
            begin = at + 8
            after = begin + size if kind == _PACKED else begin + -(-size // 8) * 8
        if begin + size > len(data):
            raise _Damaged(f"an element of {size} bytes ends beyond the file")
        yield _Element(kind, data[begin : begin + size])
        at = after


def _variable(data: memoryview, order: str, prefix: str, depth: int) -> Iterator[tuple[str, Any]]:
    """Yield the value of one matrix, or of the fields of a structure; None for what is no number and no text."""
    parts = list(_elements(data, order))
    if len(parts) < 3:
        return  # an empty field
    flags = int(np.frombuffer(parts[0].data, f"{order}u4", 1)[0])
    shape = tuple(int(n) for n in np.frombuffer(parts[1].data, f"{order}i4"))
    own = bytes(parts[2].data).decode("utf-8", "replace")
    name = f"{prefix}.{own}" if prefix and own else prefix or own
    kind, rest = flags & 0xFF, parts[3:]
    if kind == _STRUCTURE and len(rest) >= 2 and int(np.prod(shape)) == 1 and depth < _DEEPEST:
        width = int(np.frombuffer(rest[0].data, f"{order}i4", 1)[0])
        if width < 1:
            raise _Damaged("names of fields have no length")
        text = bytes(rest[1].data)
        fields = [text[k : k + width].split(b"\0")[0].decode("utf-8", "replace") for k in range(0, len(text), width)]
        if len(fields) != len(rest) - 2:
            raise _Damaged(f"a structure of {len(fields)} fields holds {len(rest) - 2}")
        for field, part in zip(fields, rest[2:], strict=True):
            yield from _variable(part.data, order, f"{name}.{field}", depth + 1)
    elif _FIRST_NUMBER <= kind <= _LAST_NUMBER and not flags & (_COMPLEX | _LOGICAL) and rest:
        if rest[0].kind not in _NUMBERS:
            raise _Damaged(f"{name}: numbers of the unknown kind {rest[0].kind}")
        numbers = np.frombuffer(rest[0].data, f"{order}{_NUMBERS[rest[0].kind]}")
        if min(shape, default=-1) < 0 or numbers.size != np.prod(shape, dtype=object):
            raise _Damaged(f"{name}: {numbers.size} numbers for the shape {shape}")
        yield name, numbers.reshape(shape, order="F")
    elif kind == _TEXT and rest and rest[0].kind in _TEXTS and len(shape) == 2 and shape[0] == 1:
        coding = _TEXTS[rest[0].kind]
        ending = {"<": "-le", ">": "-be"}[order] if coding.startswith("utf-") and coding != "utf-8" else ""
        yield name, bytes(rest[0].data).decode(coding + ending, "replace")
    else:
        yield name, None
