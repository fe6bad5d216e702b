"""Files and functions stay short enough to be read at one sitting."""

from __future__ import annotations

import ast
from pathlib import Path
from statistics import median

import pytest

from tests.architecture.places import SOURCE, source_files

LONGEST_FILE = 500
MEDIAN_FILE = 150
LONGEST_FUNCTION = 80
LONGEST_KERNEL = 100


def _lines(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


def test_the_median_file_is_short() -> None:
    assert median(_lines(path) for path in source_files()) < MEDIAN_FILE


@pytest.mark.parametrize("path", source_files(), ids=lambda path: str(path.relative_to(SOURCE)))
def test_file_and_its_functions_are_short(path: Path) -> None:
    assert _lines(path) <= LONGEST_FILE
    limit = LONGEST_KERNEL if "kernels" in path.parts else LONGEST_FUNCTION
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    too_long = {f.name: lines for f in functions if (lines := (f.end_lineno or f.lineno) - f.lineno + 1) >= limit}
    assert too_long == {}
