"""Line numbers of the keys of a TOML document.

``tomllib`` keeps no positions, so this small scanner walks the same text again. It relies on the document being
valid (``tomllib`` has accepted it) and only needs to find keys: strings, arrays and inline tables are walked through,
other values skipped. A path is a tuple of keys and 0-based indices, as in ``("coupling", 0, "stages", 1, "until")``.
"""

from __future__ import annotations

import contextlib
import re
from typing import NamedTuple

Path = tuple[int | str, ...]

_DEEPEST = 16
_BLANK = re.compile(r"[ \t]*")
_SPACE = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_SCALAR = re.compile(r"[^,\]}#\n]*")
_BASIC = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
_LITERAL = re.compile(r"'([^'\n]*)'")
_LONG_BASIC = re.compile(r'"""(?:[^"\\]|\\.|"(?!""))*"""(?:"(?!")|""(?!"))?', re.DOTALL)
_LONG_LITERAL = re.compile(r"'''(?:[^']|'(?!''))*'''(?:'(?!')|''(?!'))?", re.DOTALL)
_ESCAPE = re.compile(r"\\(u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8}|x[0-9A-Fa-f]{2}|.)")
_PLAIN_ESCAPES = {"b": "\b", "t": "\t", "n": "\n", "f": "\f", "r": "\r", "e": "\x1b"}


def key_lines(text: str) -> dict[Path, int]:
    """Return the line, counted from 1, of every key, table and array entry of a TOML document.

    A key that several headers mention has the line of the first. In a text that is no valid TOML the scan may end
    early; the lines found before stay. NestingError for a path of more than 16 keys and indices: a parser may need time
    and memory that grow with the square of that depth, so ask here first.
    """
    scanner = _Scanner(text.replace("\r\n", "\n"))
    with contextlib.suppress(_LostError):
        scanner.document()
    return scanner.lines


class Header(NamedTuple):
    """A header, ``[a]`` or ``[[a]]``: the table or array entry it opens, and its line counted from 1."""

    path: Path
    line: int


def headers(text: str) -> list[Header]:
    """Return the headers of a valid TOML document, in their order; NestingError as ``key_lines``."""
    scanner = _Scanner(text.replace("\r\n", "\n"))
    scanner.document()
    return scanner.headers


class NestingError(ValueError):
    """Tables, arrays or dotted keys are nested too deeply, at a line counted from 1."""

    def __init__(self, line: int) -> None:
        self.line = line
        super().__init__(f"nested too deeply at line {line}")


class _LostError(Exception):
    """The text is not what a valid document would have here."""


class _Scanner:
    """Walks a document once, noting the line of every path."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[Path, int] = {}
        self.headers: list[Header] = []
        self._entries: dict[Path, int] = {}
        self._counted = 0
        self._line = 1

    def document(self) -> None:
        """Walk headers and key-value pairs to the end."""
        table: Path = ()
        while True:
            self._take(_SPACE)
            if self.at >= len(self.text):
                return
            if self.text.startswith("[", self.at):
                table = self._header()
            else:
                self._pair(table)

    def _header(self) -> Path:
        """Walk ``[a.b]`` or ``[[a.b]]``; return the path of the table it opens."""
        start = self.at
        is_array = self.text.startswith("[[", self.at)
        self.at += 2 if is_array else 1
        keys = self._keys()
        self._expect("]]" if is_array else "]")
        path: Path = ()
        for key in keys[:-1]:
            path = (*path, key)
            self._note(path, start)
            if path in self._entries:
                path = (*path, self._entries[path])
        path = (*path, keys[-1])
        self._note(path, start)
        if is_array:
            self._entries[path] = self._entries.get(path, -1) + 1
            path = (*path, self._entries[path])
            self._note(path, start)
        self.headers.append(Header(path, self._line_of(start)))
        return path

    def _pair(self, table: Path) -> None:
        """Walk ``a.b = value`` inside a table."""
        start = self.at
        path = table
        for key in self._keys():
            path = (*path, key)
            self._note(path, start)
        self._expect("=")
        self._take(_BLANK)
        self._value(path)

    def _keys(self) -> list[str]:
        """Walk a dotted key."""
        start = self.at
        keys = [self._key()]
        while self.text.startswith(".", self.at):
            self.at += 1
            keys.append(self._key())
            if len(keys) > _DEEPEST:
                raise NestingError(self._line_of(start))
        return keys

    def _key(self) -> str:
        """Walk one part of a dotted key and the blanks around it."""
        self._take(_BLANK)
        if match := _BASIC.match(self.text, self.at):
            key = _ESCAPE.sub(_unescaped, match.group(1))
        elif match := _LITERAL.match(self.text, self.at):
            key = match.group(1)
        elif match := _BARE_KEY.match(self.text, self.at):
            key = match.group()
        else:
            raise _LostError
        self.at = match.end()
        self._take(_BLANK)
        return key

    def _value(self, path: Path) -> None:
        """Walk one value."""
        if self.text.startswith("[", self.at):
            self._array(path)
        elif self.text.startswith("{", self.at):
            self._inline_table(path)
        else:
            for pattern in (_LONG_BASIC, _LONG_LITERAL, _BASIC, _LITERAL, _SCALAR):
                if match := pattern.match(self.text, self.at):
                    self.at = match.end()
                    return

    def _array(self, path: Path) -> None:
        """Walk an array; every entry gets a line."""
        self.at += 1
        index = 0
        while True:
            self._take(_SPACE)
            if self._skip("]"):
                return
            self._note((*path, index), self.at)
            self._value((*path, index))
            index += 1
            self._take(_SPACE)
            if not self._skip(","):
                self._expect("]")
                return

    def _inline_table(self, path: Path) -> None:
        """Walk an inline table."""
        self.at += 1
        while True:
            self._take(_SPACE)
            if self._skip("}"):
                return
            self._pair(path)
            self._take(_SPACE)
            if not self._skip(","):
                self._expect("}")
                return

    def _note(self, path: Path, at: int) -> None:
        """Keep the line of a path that is new."""
        line = self._line_of(at)
        if len(path) > _DEEPEST:
            raise NestingError(line)
        self.lines.setdefault(path, line)

    def _line_of(self, at: int) -> int:
        """Return the line of a position; positions only ever grow, so newlines are counted once."""
        if at > self._counted:
            self._line += self.text.count("\n", self._counted, at)
            self._counted = at
        return self._line

    def _take(self, pattern: re.Pattern[str]) -> None:
        """Walk over what a pattern matches."""
        match = pattern.match(self.text, self.at)
        self.at = match.end() if match else self.at

    def _skip(self, mark: str) -> bool:
        """Walk over a mark if it is there."""
        matched = self.text.startswith(mark, self.at)
        self.at += len(mark) if matched else 0
        return matched

    def _expect(self, mark: str) -> None:
        """Walk over a mark that must be there."""
        if not self._skip(mark):
            raise _LostError


def _unescaped(match: re.Match[str]) -> str:
    """Return the character an escape sequence stands for."""
    code = match.group(1)
    if code[0] in "uUx" and len(code) > 1:
        return chr(int(code[1:], 16))
    return _PLAIN_ESCAPES.get(code, code)
