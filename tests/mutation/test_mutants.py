"""The tool that makes mutants: each has one change, and parses."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.architecture.places import ROOT
from tests.mutation.explained import EXPLAINED
from tests.mutation.mutants import mutants_of
from tests.mutation.trials import KERNELS

SOURCE = '''
LIMIT = 3.0


def clipped(x, y):
    """Not changed: 1 + 2."""
    if not x < -y and True:
        x += min(x, 2)
    return x * y
'''
FILES = sorted((ROOT / "src" / KERNELS).glob("*.py"))


def test_every_change_of_a_function_is_made_once(tmp_path: Path) -> None:
    path = tmp_path / "source.py"
    path.write_text(SOURCE, encoding="utf-8")
    changes = [(mutant.line, mutant.after) for mutant in mutants_of(path)]
    assert sorted(changes) == sorted(
        [
            (7, "if x < -y and True:"),
            (7, "if not x >= -y and True:"),
            (7, "if not x < y and True:"),
            (7, "if not x < -y or True:"),
            (7, "if not x < -y and False:"),
            (8, "x -= min(x, 2)"),
            (8, "x += max(x, 2)"),
            (8, "x += min(x, 3)"),
            (9, "return x / y"),
        ]
    )


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_mutants_of_a_kernel_parse_and_differ_in_one_line(file: Path) -> None:
    source = file.read_text(encoding="utf-8")
    lines = source.splitlines()
    functions = {node.name: node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)}
    for mutant in mutants_of(file):
        function = functions[mutant.function]
        ast.parse("\n".join(mutant.text.splitlines()[function.lineno - 1 : function.end_lineno]))
        changed = mutant.text.splitlines()
        assert changed[mutant.line - 1] != lines[mutant.line - 1]
        changed[mutant.line - 1] = lines[mutant.line - 1]
        assert changed == lines


def test_what_is_explained_is_still_a_mutant() -> None:
    names = {mutant.name for file in FILES for mutant in mutants_of(file)}
    assert sorted(EXPLAINED.keys() - names) == []
