"""Functions stay short enough to be read at one sitting; ruff limits their branches and how deep they are nested."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.architecture.places import SOURCE, source_files

LONGEST_FUNCTION = 80
LONGEST_KERNEL = 105  # a compiled loop, or a list of arrays with their shapes, is one function


def _lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Count the lines of a function without its docstring."""
    first = function.body[0]
    words = (first.end_lineno or 0) - first.lineno + 1 if ast.get_docstring(function) is not None else 0
    return (function.end_lineno or 0) - function.lineno + 1 - words


@pytest.mark.parametrize("path", source_files(), ids=lambda path: str(path.relative_to(SOURCE)))
def test_functions_are_short(path: Path) -> None:
    limit = LONGEST_KERNEL if "kernels" in path.parts else LONGEST_FUNCTION
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    assert {function.name: lines for function in functions if (lines := _lines(function)) >= limit} == {}
