"""How an input is damaged: bytes by themselves, texts by tokens such as numbers and names, JSON by its values.

Takes bytes and a generator of random numbers; gives bytes.
"""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from copy import deepcopy
from typing import Any, Literal

LARGEST = 60_000
_TOKEN = re.compile(rb'"[^"\n]*"|[A-Za-z_][\w.-]*|[+-]?\d[\w.+-]*|[\[\]{}=,;]|\S')
_WORDS = [
    word.encode()
    for word in (
        *("", "0", "-1", "1", "2", "nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "5e-324", "1e999", "1,5", "true"),
        *("0x7fffffffffffffff", "4294967295", "-2147483648", "18446744073709551615", "1" + "0" * 400, "9" * 5000),
        *("[]", "{}", "[[1]]", "1979-05-27", "07:32:00", "'a'", '"""', "#", "\r", "\t", "\u0131", "\ud7ff"),
        *('""', '".."', '"ground"', '"\\u0000"', '"\\u202e"', '"' + "x" * 300 + '"', '"a.b"', '"a/b"', '"static"'),
        *('"1 kg"', '"1 N*m/rad"', '"1e400 m"', '"rpm"', '"1 m^99"', '"sample"', '"regime"'),
        *("{ from = 1, to = 2, count = 3 }", '{ distribution = "normal" }'),
    )
]
_NUMBERS = [
    number.to_bytes(size, order)
    for size in (1, 2, 4, 8)
    for order in ("little", "big")
    for number in (0, 1, 2 ** (8 * size - 1) - 1, 2 ** (8 * size - 1), 2 ** (8 * size) - 1, 255)
    if number < 2 ** (8 * size)
]


def _flip(data: bytearray, draw: random.Random) -> None:
    data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)


def _set(data: bytearray, draw: random.Random) -> None:
    data[draw.randrange(len(data))] = draw.randrange(256)


def _number(data: bytearray, draw: random.Random) -> None:
    at, number = draw.randrange(len(data)), draw.choice(_NUMBERS)
    data[at : at + len(number)] = number


def _cut(data: bytearray, draw: random.Random) -> None:
    begin, end = sorted((draw.randrange(len(data) + 1), draw.randrange(len(data) + 1)))
    del data[begin : min(end, begin + draw.choice((1, 8, 200, LARGEST)))]


def _end(data: bytearray, draw: random.Random) -> None:
    del data[draw.randrange(len(data) + 1) :]


def _repeat(data: bytearray, draw: random.Random) -> None:
    begin = draw.randrange(len(data))
    part = bytes(data[begin : begin + draw.choice((1, 8, 200))])
    at = draw.randrange(len(data) + 1)
    data[at:at] = part * draw.choice((1, 2, 50))


def _token(data: bytearray, draw: random.Random) -> None:
    """Replace a token of a text by a word that is likely to be wrong there, or by another token of it."""
    tokens = list(_TOKEN.finditer(bytes(data)))
    if tokens:
        chosen = draw.choice(tokens)
        word = draw.choice(_WORDS) if draw.random() < 0.7 else draw.choice(tokens).group()
        data[chosen.start() : chosen.end()] = word


def _line(data: bytearray, draw: random.Random) -> None:
    """Remove, repeat or move a line."""
    lines = bytes(data).split(b"\n")
    line = lines.pop(draw.randrange(len(lines)))
    for _ in range(draw.choice((0, 1, 2))):
        lines.insert(draw.randrange(len(lines) + 1), line)
    data[:] = b"\n".join(lines)


Slot = tuple[Any, Any]
"""A list or an object, and an index or a key in it."""


def _slots(node: Any) -> Iterator[Slot]:
    """Yield where the values of a document stand."""
    keys = node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
    for key in keys:
        yield node, key
        yield from _slots(node[key])


def _nested(depth: int) -> Any:
    """Return lists in lists."""
    value: Any = []
    for _ in range(depth):
        value = [value]
    return value


def any_value(draw: random.Random) -> Any:
    """Return a value that JSON can hold, of a type or a size that is likely to be wrong."""
    if draw.random() < 0.05:
        return _nested(draw.choice((3, 60, 200, 900)))
    value = draw.choice(_VALUES)
    return [value] * draw.choice((1, 2)) if draw.random() < 0.1 else value


def _value(data: bytearray, draw: random.Random) -> None:
    """Replace, remove, add or rename a value of a JSON document; damage a text within it as texts are."""
    try:
        document = json.loads(bytes(data))
        slots = list(_slots(document))
        deepcopy(document)
    except (ValueError, RecursionError):
        slots = []
    if not slots:
        _token(data, draw)
        return
    holder, key = draw.choice(slots)
    what = draw.choice(("value", "value", "value", "other", "remove", "add", "text", "text"))
    is_long = isinstance(holder[key], str) and len(holder[key]) > 100  # such as a file
    if isinstance(holder[key], str) and (what == "text" or (is_long and draw.random() < 0.8)):
        content = bytearray(holder[key].encode("utf-8", "surrogatepass") or b"0")
        draw.choice(OF_TEXT)(content, draw)
        holder[key] = content.decode("utf-8", "replace")
    elif what == "remove":
        del holder[key]
    elif what == "add":
        value = any_value(draw)
        name = draw.choice([*_KEYS, *(key for node, _ in slots if isinstance(node, dict) for key in node)])
        holder.insert(key, value) if isinstance(holder, list) else holder.update({name: value})
    elif what == "other":
        other, there = draw.choice(slots)
        holder[key] = deepcopy(other[there])
    else:
        holder[key] = any_value(draw)
    with suppress(RecursionError):  # deeper than anything is read
        data[:] = json.dumps(document).encode()


_KEYS = ("", "file", "to", "\ud800", "\u0000", "__class__", "a.b", "x" * 300)
_VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2**31, 2**63, -(2**63) - 1, 10**400, 0.5, -0.0, 1e308, 5e-324, 1e999, -1e999),
    *(
        float("nan"),
        "",
        "a",
        "1",
        "nan",
        "1e999",
        "10 N*m",
        "\ud800",
        "\udfff\ud800",
        "\u0000",
        "\u202e",
        "\r\n",
        "x" * 300,
    ),
    *("..", "../x", "/etc/passwd", "~", "a/b", "job.json", "2026-01-01T00:00:00+00:00", "set", "add", "begin", "run"),
    *(
        [],
        {},
        [[]],
        [None],
        [0],
        ["a"],
        {"": {}},
        {"file": "x"},
        {"from": 0, "to": 1, "count": 3},
        [{"a": float("nan")}],
    ),
)

Mutation = Callable[[bytearray, random.Random], None]
Kind = Literal["bytes", "text", "JSON"]
"""What an input consists of, for its damage."""
OF_BYTES: tuple[Mutation, ...] = (_flip, _set, _set, _number, _number, _cut, _end, _repeat)
OF_TEXT: tuple[Mutation, ...] = (_token, _token, _token, _token, _line, _set, _cut, _repeat)
OF_JSON: tuple[Mutation, ...] = (_value, _value, _value, _value, _value, _value, _value, _value, _token, _set, _cut)
_MUTATIONS: dict[Kind, tuple[Mutation, ...]] = {"bytes": OF_BYTES, "text": OF_TEXT, "JSON": OF_JSON}


def mutated(data: bytes, draw: random.Random, *, kind: Kind) -> bytes:
    """Return a damaged copy, at most ``LARGEST`` bytes."""
    actual = bytearray(data)
    for _ in range(draw.choice((1, 1, 1, 2, 3, 5, 12))):
        if not actual:
            actual += b"0"
        draw.choice(_MUTATIONS[kind])(actual, draw)
    return bytes(actual[:LARGEST])
