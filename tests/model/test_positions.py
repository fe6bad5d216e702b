"""The scanner finds every key of a document where it stands; tomllib is the judge of what the keys are."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from gearrattle.model.toml_line_numbers import NestingError, key_lines

BARE = st.text("ab_-1", min_size=1, max_size=3)
ODD = st.text(st.sampled_from("a.\"'#=[]{}, \t\\é"), max_size=4)
TRICKY = st.text(st.sampled_from("ab'\"\\#=[]{},\n \t"), max_size=12)


def _paths(value: Any, path: tuple[int | str, ...] = ()) -> Iterator[tuple[tuple[int | str, ...], Any]]:
    """Yield every path of a parsed document with its value."""
    if path:
        yield path, value
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _paths(item, (*path, key))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _paths(item, (*path, index))


class _Writer:
    """Writes random TOML; every whole number in it is a marker that occurs once."""

    def __init__(self, draw: Any) -> None:
        self.draw = draw
        self.marker = 700_000

    def blank(self) -> str:
        return self.draw(st.sampled_from(["", " ", "\t "]))

    def gap(self) -> str:
        """Blanks, newlines and comments, as allowed between the entries of an array."""
        return self.draw(st.sampled_from(["", " ", "\n", " # note, ] } ' \"\n\n", "\n\t"]))

    def key(self, key: str) -> str:
        if key and all(c in "ab_-1" for c in key) and self.draw(st.booleans()):
            return key
        if "'" not in key and self.draw(st.booleans()):
            return f"'{key}'"
        return json.dumps(key, ensure_ascii=self.draw(st.booleans()))

    def text(self) -> str:
        text = self.draw(TRICKY)
        style = self.draw(st.sampled_from(["basic", "literal", "long basic", "long literal"]))
        if style == "literal" and "'" not in text and "\n" not in text:
            return f"'{text}'"
        if style == "long literal" and "'''" not in text and not text.endswith("'" * 3):
            return f"'''\n{text}'''" if not text.endswith("'") else f"'''\n{text} '''"
        if style == "long basic":
            body = text.replace("\\", "\\\\").replace('"""', '""\\"')
            return f'"""\n{body} """' if body.endswith(('"', "\\")) and self.draw(st.booleans()) else json.dumps(text)
        return json.dumps(text)

    def value(self, depth: int) -> str:
        kind = self.draw(st.sampled_from(["number", "number", "text", "word", "array", "table"]))
        if kind == "array" and depth:
            items = [self.value(depth - 1) for _ in range(self.draw(st.integers(0, 3)))]
            inner = ",".join(self.gap() + item + self.gap() for item in items)
            return "[" + inner + (("," if items and self.draw(st.booleans()) else "") + self.gap()) + "]"
        if kind == "table" and depth:
            return "{ " + ", ".join(self.pair(key, depth - 1) for key in self.keys()) + " }"
        if kind == "text":
            return self.text()
        if kind == "word":
            return self.draw(st.sampled_from(["true", "-1.5e-3", "inf", "1979-05-27 07:32:00Z", "1979-05-27", "0x1F"]))
        self.marker += 1
        return str(self.marker)

    def keys(self) -> list[str]:
        return self.draw(st.lists(st.one_of(BARE, BARE, ODD), max_size=3, unique=True))

    def pair(self, key: str, depth: int) -> str:
        dotted = self.draw(st.lists(BARE, max_size=2))
        parts = [self.key(key), *(self.key(part) for part in dotted)]
        equals = f"{self.blank()}={self.blank()}"
        return f"{self.blank()}.{self.blank()}".join(parts) + equals + self.value(depth)

    def pairs(self) -> list[str]:
        comment = [" # c = 1", "", "\t#[x]"]
        return [self.blank() + self.pair(key, 2) + self.draw(st.sampled_from(comment)) for key in self.keys()]

    def document(self) -> str:
        lines = self.pairs()
        arrays = self.draw(st.lists(BARE.map(lambda key: "z" + key), max_size=3))
        for name in arrays:
            lines += ["", f"[[{self.blank()}{self.key(name)}{self.blank()}]]{self.blank()}# x", *self.pairs()]
            if self.draw(st.booleans()):
                lines += [f"[{name}.{self.key('sub y')}]", *self.pairs()]
            for _ in range(self.draw(st.integers(0, 2))):
                lines += [f"[[{name}.more]]", *self.pairs()]
        for name in self.draw(st.lists(BARE.map(lambda key: "t" + key), max_size=2, unique=True)):
            lines += [f"[{name} . deep]", *self.pairs()]
        return self.draw(st.sampled_from(["\n", "\r\n"])).join(lines)


@st.composite
def documents(draw: Any) -> str:
    return _Writer(draw).document()


@settings(max_examples=100, deadline=None)
@given(documents())
def test_same_paths_as_tomllib_and_the_lines_of_their_markers(text: str) -> None:
    try:
        tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        reject()  # two keys collided
    lines = key_lines(text)
    expected = dict(_paths(tree))
    assert set(lines) == set(expected)
    rows = text.replace("\r\n", "\n").split("\n")
    for path, value in expected.items():
        if isinstance(value, int) and not isinstance(value, bool) and value > 700_000:
            assert str(value) in rows[lines[path] - 1]


@settings(max_examples=300, deadline=None)
@given(st.text(st.sampled_from("ab=.[]{}\"'#\\,\n 1"), max_size=60))
def test_never_raises_on_any_text(text: str) -> None:
    try:
        lines = key_lines(text)
    except NestingError as error:
        lines = {(): error.line}
    assert all(1 <= line <= text.count("\n") + 1 for line in lines.values())


@pytest.mark.parametrize(
    ("text", "path", "line"),
    [
        ("a = '''\n=\n'''\nb = 1", ("b",), 4),
        ('a = """x\\"""""\nb = 1', ("b",), 2),
        ("a = [\n  1, # ]\n  { b = 2 },\n]", ("a", 1, "b"), 3),
        ("[[a]]\n[[a]]\n[a.b]\nc = 1", ("a", 1, "b", "c"), 4),
        ('"a\\u0062" . c = 1', ("ab", "c"), 1),
        ("[a]\nb.c = 1\nb.d = 2", ("a", "b"), 2),
    ],
)
def test_known_positions(text: str, path: tuple[int | str, ...], line: int) -> None:
    tomllib.loads(text)
    assert key_lines(text)[path] == line


def test_long_documents_take_linear_time() -> None:
    text = "".join(f"[[a]]\nb = {index}\n" for index in range(20_000))
    assert key_lines(text)["a", 19_999, "b"] == 40_000
