"""Variables of a MAT file of version 5: elements within elements, each with its kind and length in front.

Every length is checked against what is there: SciPy 1.17 ends the process on some damaged files. Objects, such as
a timetable or a datetime, are recognised by name and class; what they hold only MATLAB can read. Format: The MathWorks,
MAT-File Format (R2023a); the head of an object (class 17), which it leaves out, is flags, name, "MCOS", class.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from gearrattle.measured.readers.mat.variables import Damaged, Part, Variable, part_of

HEAD = 128
"""Bytes before the first element."""
_DEEPEST = 20
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_MATRIX = 14
_PACKED = 15
_STRUCTURE = 2
_OBJECT = 3
_TEXT = 4
_FUNCTION = 16
_OPAQUE = 17
_FIRST_NUMBER = 6
_LAST_NUMBER = 15
_COMPLEX = 0x800
_LOGICAL = 0x200


class _Element(NamedTuple):
    kind: int
    part: Part


def variables(head: bytes, part: Part, *, within: bool) -> Iterator[Variable]:
    """Yield variables, and fields of structures by their path.

    Parameters
    ----------
    head
        the first 128 bytes of the file.

    Yields
    ------
    Variable
        its numbers or its text are read before the next one is asked for, or not at all.

    Raises
    ------
    Damaged
        elements that contradict the format.
    """
    order = "<" if head[126:128] == b"IM" else ">"
    for element in _elements(part, order):
        inner = element
        if element.kind == _PACKED:
            inner = next(_elements(element.part.unpacked(), order))
        if inner.kind == _MATRIX:
            is_closed = element.kind == _PACKED and not within
            yield from _variable(inner.part, order, "", 0, is_closed)


def _elements(part: Part, order: str) -> Iterator[_Element]:
    """Yield the elements of a part; unread bytes of an element are skipped."""
    while part.left:
        if part.left < 8:
            raise Damaged("ends inside the head of an element")
        head = part.read(8)
        kind, size = (int(x) for x in np.frombuffer(head, f"{order}u4", 2))
        if kind >> 16:  # short: length and kind share four bytes, the data are the next four
            size = kind >> 16
            kind = kind & 0xFFFF
            if size > 4:
                raise Damaged(f"a short element of {size} bytes")
            yield _Element(kind, part_of(io.BytesIO(head[4 : 4 + size]), size))
            continue
        inner = part.part(size)
        yield _Element(kind, inner)
        inner.skip(inner.left)
        if kind != _PACKED:
            part.skip(-size % 8)


def _variable(part: Part, order: str, prefix: str, depth: int, is_closed: bool) -> Iterator[Variable]:
    """Yield one matrix, or the fields of a structure."""
    # flags, shape and name
    elements = _elements(part, order)
    flags = _numbers(next(elements, None), f"{order}u4")
    if not flags:
        return  # an empty field
    kind = flags[0] & 0xFF
    shape = () if kind == _OPAQUE else tuple(_numbers(next(elements, None), f"{order}i4"))
    own = _words(next(elements, None))
    name = f"{prefix}.{own}" if prefix and own else prefix or own
    if not name:
        return  # the contents of MATLAB objects: one variable without a name, after all others
    # one variable, by its class
    if kind == _OPAQUE:
        next(elements, None)
    if kind in (_OPAQUE, _OBJECT, _FUNCTION):
        said = "function_handle" if kind == _FUNCTION else _words(next(elements, None))
        yield Variable(name, "object", said=said)
    elif kind == _STRUCTURE and is_closed:
        yield Variable(name, "structure", part=part)
    elif kind == _STRUCTURE and depth < _DEEPEST:
        yield from _fields(elements, order, name, int(np.prod(shape, dtype=object)), depth)
    elif _FIRST_NUMBER <= kind <= _LAST_NUMBER and not flags[0] & (_COMPLEX | _LOGICAL):
        yield _stored(next(elements, None), order, name, shape)
    else:
        yield _written(next(elements, None) if kind == _TEXT else None, order, name, shape)


def _fields(elements: Iterator[_Element], order: str, name: str, count: int, depth: int) -> Iterator[Variable]:
    """Yield the fields of a structure, or of the structures of an array one after the other."""
    width = (_numbers(next(elements, None), f"{order}i4") or [0])[0]
    if width < 1:
        raise Damaged(f"{name}: names of fields have no length")
    names = next(elements, None)
    text = names.part.small() if names else b""
    fields = [text[k : k + width].split(b"\0")[0].decode("utf-8", "replace") for k in range(0, len(text), width)]
    total = count * len(fields)
    at = 0
    for at, element in enumerate(elements, 1):
        if at > total:
            break
        number, field = divmod(at - 1, len(fields))
        path = name if count == 1 else f"{name}({number + 1})"
        if element.kind == _MATRIX:
            yield from _variable(element.part, order, f"{path}.{fields[field]}", depth + 1, False)
    if at != total:
        raise Damaged(f"{name}: structures of {total} fields in all hold {'more' if at > total else at}")


def _stored(element: _Element | None, order: str, name: str, shape: tuple[int, ...]) -> Variable:
    """Return a variable of numbers."""
    if element is None:
        return Variable(name, "other")
    if element.kind not in _NUMBERS:
        raise Damaged(f"{name}: numbers of the unknown kind {element.kind}")
    stored = f"{order}{_NUMBERS[element.kind]}"
    width = np.dtype(stored).itemsize
    if min(shape, default=-1) < 0 or element.part.left != np.prod(shape, dtype=object) * width:
        raise Damaged(f"{name}: {element.part.left // width} numbers for the shape {shape}")
    return Variable(name, "numbers", shape, stored, part=element.part)


def _written(element: _Element | None, order: str, name: str, shape: tuple[int, ...]) -> Variable:
    """Return a variable of one line of text, or of anything else."""
    if element is None or element.kind not in _TEXTS or len(shape) != 2 or shape[0] != 1:
        return Variable(name, "other")
    coding = _TEXTS[element.kind]
    ending = {"<": "-le", ">": "-be"}[order] if coding.startswith("utf-") and coding != "utf-8" else ""
    return Variable(name, "text", coding=coding + ending, part=element.part)


def _numbers(element: _Element | None, stored: str) -> list[int]:
    """Return the whole numbers of a head; none where there is no element."""
    data = element.part.small() if element else b""
    return [int(x) for x in np.frombuffer(data[: len(data) // 4 * 4], stored)]


def _words(element: _Element | None) -> str:
    """Return the text of a head."""
    return element.part.small().split(b"\0")[0].decode("utf-8", "replace") if element else ""
