"""Functions stay short enough to be read at one sitting; ruff limits their branches and how deep they are nested.

A compiled loop has no limit: it is one function so that nothing in it is called, and its comments name its steps.
"""

from __future__ import annotations

import ast

from tests.architecture.places import nodes_of, source_files

LONGEST_FUNCTION = 80


def _lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Count the lines of a function without its docstring."""
    first = function.body[0]
    words = (first.end_lineno or 0) - first.lineno + 1 if ast.get_docstring(function) is not None else 0
    return (function.end_lineno or 0) - function.lineno + 1 - words


def test_functions_are_short() -> None:
    long_ones = []
    for path in source_files():
        if "kernels" in path.parts:
            continue
        functions = [node for node in nodes_of(path) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
        long_ones += [f"{path}: {f.name}: {lines} lines" for f in functions if (lines := _lines(f)) >= LONGEST_FUNCTION]
    assert long_ones == []
