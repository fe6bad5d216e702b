"""Every module says its idea; every public name says what it takes."""

from __future__ import annotations

import ast
import inspect
import re
from functools import cached_property
from pathlib import Path

import pytest

from tests.architecture.places import ROOT, SOURCE, nodes_of, source_files
from tests.architecture.public import PUBLIC


def _documented(docstring: str) -> list[str]:
    """Return the parameters that a docstring explains."""
    section = re.search(
        r"^( *)Parameters\n\1-+\n((?:.*\n?)*?)(?=^\1\w+\n\1--+$|\Z)", f"{docstring}\n", flags=re.MULTILINE
    )
    if section is None:
        return []
    lines = re.findall(rf"^{section[1]}(\S.*)\n{section[1]}    \S", section[2], flags=re.MULTILINE)
    return [name.strip(" *") for line in lines for name in line.split(",")]


EMPTY_NAMES = {"found", "told", "given", "each", "place", "beside", "bench", "got", "thing", "stuff", "tmp", "foo"}
"""Names that do not say what they hold."""

PLACES = {"errors.py", "model/table.py", "model/csv_layout.py", "measured/readers/mapping.py"}
"""Where ``place`` is the word of messages: place, value, rule, remedy."""


def _bound_names(path: Path) -> set[str]:
    nodes = nodes_of(path)
    stored = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    return stored | {node.arg for node in nodes if isinstance(node, ast.arg)}


def test_names_say_what_they_hold() -> None:
    folders = (SOURCE, ROOT / "tests", ROOT / "benchmarks", ROOT / "examples")
    allowed = {(SOURCE / path, "place") for path in PLACES}
    files = [path for folder in folders for path in sorted(folder.rglob("*.py"))]
    empty = {(path, name) for path in files for name in _bound_names(path) & EMPTY_NAMES}
    assert len(files) > 1000
    assert empty - allowed == set()


def test_docstrings_explain_parameters_that_exist() -> None:
    wrong = []
    for path in source_files():
        for node in nodes_of(path):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                known = {argument.arg for argument in ast.walk(node.args) if isinstance(argument, ast.arg)}
                unknown = set(_documented(ast.get_docstring(node) or "")) - known
                wrong += [f"{path}: {node.name}: {name}" for name in unknown]
    assert wrong == []


def test_a_parameter_that_is_not_there_is_noticed() -> None:
    text = "Do.\n\nParameters\n----------\na, b\n    two.\n    more: of them.\n*c\n    rest.\n\nReturns\n-------\nint"
    assert _documented(text) == ["a", "b", "c"]


@pytest.mark.parametrize("name", PUBLIC)
def test_public_name_is_explained(name: str) -> None:
    public = PUBLIC[name]
    words = inspect.getdoc(public) or ""
    assert len(words.split()) >= 5
    if inspect.isfunction(public):
        assert [p for p in inspect.signature(public).parameters if p not in _documented(words)] == []


@pytest.mark.parametrize("name", [name for name in PUBLIC if inspect.isclass(PUBLIC[name])])
def test_public_members_are_explained(name: str) -> None:
    public = PUBLIC[name]
    own = {key: member for key, member in vars(public).items() if not key.startswith("_")}
    verbs = {
        k: m for k, m in own.items() if inspect.isfunction(m) or isinstance(m, property | cached_property | classmethod)
    }
    assert [key for key in verbs if not inspect.getdoc(getattr(public, key))] == []
