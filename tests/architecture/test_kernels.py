"""What compiled code may not say, for what it costs to compile."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.architecture.places import SOURCE

KERNELS = sorted((SOURCE / "engine" / "kernels").glob("*.py"))


def is_sliced(target: ast.expr) -> bool:
    if not isinstance(target, ast.Subscript):
        return False
    parts = target.slice.elts if isinstance(target.slice, ast.Tuple) else [target.slice]
    return any(isinstance(part, ast.Slice) for part in parts)


@pytest.mark.parametrize("file", KERNELS, ids=lambda file: file.stem)
def test_no_array_is_assigned_to_a_slice(file: Path) -> None:
    """Numba compiles the message for shapes that differ along with it: seconds, in every process without a cache."""
    assigned = [node for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))) if isinstance(node, ast.Assign)]
    arrays = [node for node in assigned if not isinstance(node.value, ast.Constant)]
    assert [node.lineno for node in arrays if any(map(is_sliced, node.targets))] == []
