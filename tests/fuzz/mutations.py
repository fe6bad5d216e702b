"""How an input is damaged: bytes by themselves, and texts by the tokens that numbers, names and brackets are.

Takes bytes and a generator of random numbers; gives bytes.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable

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


Mutation = Callable[[bytearray, random.Random], None]
OF_BYTES: tuple[Mutation, ...] = (_flip, _set, _set, _number, _number, _cut, _end, _repeat)
OF_TEXT: tuple[Mutation, ...] = (_token, _token, _token, _token, _line, _set, _cut, _repeat)


def mutated(data: bytes, draw: random.Random, *, text: bool) -> bytes:
    """Return a damaged copy, at most ``LARGEST`` bytes."""
    actual = bytearray(data)
    for _ in range(draw.choice((1, 1, 1, 2, 3, 5, 12))):
        if not actual:
            actual += b"0"
        draw.choice(OF_TEXT if text else OF_BYTES)(actual, draw)
    return bytes(actual[:LARGEST])
