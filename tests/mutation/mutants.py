"""Mutants of a source file: one operator, comparison, constant or name changed in the body of a function.

R. A. DeMillo, R. J. Lipton, F. G. Sayward, Computer 11 (1978) 34. Of comparisons the negation is taken, not the other
side of equality: rounded numbers are hardly ever equal. Constants of a module are tolerances and stay.
"""

from __future__ import annotations

import ast
from bisect import bisect
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.Lt: ("<", ">="),
    ast.LtE: ("<=", ">"),
    ast.Gt: (">", "<="),
    ast.GtE: (">=", "<"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
}
"""Operator -> its text, and what a mutant has in its stead."""
NAMES = {"min": "max", "max": "min", "sin": "cos", "cos": "sin", "True": "False", "False": "True"}


@dataclass(frozen=True)
class Mutant:
    """A file with one change.

    Attributes
    ----------
    file
        name of the file.
    function
        whose body is changed.
    line
        the number of the line, from 1.
    before, after
        the line without and with the change, stripped.
    text
        the whole file with the change.
    """

    file: str
    function: str
    line: int
    before: str
    after: str
    text: str

    @property
    def name(self) -> str:
        """What a list of survivors calls it; it does not move with the lines above."""
        return f"{self.file}: {self.function}: {self.before} -> {self.after}"


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Yield all mutants of a file."""
    source = path.read_bytes()
    tree = ast.parse(source)
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for function in functions:
        for begin, end, new in _changes(function, source, starts):
            text = source[:begin] + new.encode() + source[end:]
            number = bisect(starts, begin)
            before, after = (_line_at(content, starts[number - 1]) for content in (source, text))
            yield Mutant(path.name, function.name, number, before, after, text.decode())


def _line_at(source: bytes, start: int) -> str:
    """Return the line that starts there, stripped."""
    return source[start:].partition(b"\n")[0].decode().strip()


def _changes(function: ast.FunctionDef, source: bytes, starts: list[int]) -> Iterator[tuple[int, int, str]]:
    """Yield begin, end and new text of every change of a function's body."""

    def span(node: ast.expr | ast.stmt) -> tuple[int, int]:
        last, column = node.end_lineno or node.lineno, node.end_col_offset or 0
        return starts[node.lineno - 1] + node.col_offset, starts[last - 1] + column

    def between(left: ast.expr, right: ast.expr, operator: ast.AST) -> Iterator[tuple[int, int, str]]:
        if type(operator) in OPERATORS:
            old, new = OPERATORS[type(operator)]
            at = source.index(old.encode(), span(left)[1], span(right)[0])
            yield at, at + len(old), new

    for node in (node for statement in function.body for node in ast.walk(statement)):
        match node:
            case ast.BinOp(left, operator, right):
                yield from between(left, right, operator)
            case ast.Compare(left, [operator], [right]):
                yield from between(left, right, operator)
            case ast.BoolOp(operator, values):
                for left, right in pairwise(values):
                    yield from between(left, right, operator)
            case ast.AugAssign(target, operator, value) if type(operator) in OPERATORS:
                old, new = (f"{text}=" for text in OPERATORS[type(operator)])
                at = source.index(old.encode(), span(target)[1], span(value)[0])
                yield at, at + len(old), new
            case ast.Name(name) if name in NAMES:
                yield *span(node), NAMES[name]
            case ast.Constant(bool() as value):
                yield *span(node), str(not value)
            case ast.Constant(int() | float() as value):
                yield *span(node), repr(value + 1)
            case ast.UnaryOp(ast.USub() | ast.Not() as operator):
                begin = span(node)[0]
                yield begin, begin + len("not " if isinstance(operator, ast.Not) else "-"), ""
