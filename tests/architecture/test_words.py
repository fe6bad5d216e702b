"""Every module says its idea; every public name says what it takes."""

from __future__ import annotations

import ast
import inspect
import re
from functools import cached_property
from pathlib import Path

import pytest

from tests.architecture.places import SOURCE, source_files
from tests.architecture.public import PUBLIC


def _has_line(parameter: str, words: str) -> bool:
    """Return whether an ``Args:`` line, perhaps shared with other parameters, explains this one."""
    return re.search(rf"^\s+(?:\w+, )*{parameter}(?:, \w+)*(?: \[.*\])?:", words, flags=re.MULTILINE) is not None


@pytest.mark.parametrize("path", source_files(), ids=lambda path: str(path.relative_to(SOURCE)))
def test_module_opens_with_a_docstring(path: Path) -> None:
    assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("name", PUBLIC)
def test_public_name_is_explained(name: str) -> None:
    thing = PUBLIC[name]
    words = inspect.getdoc(thing) or ""
    assert len(words.split()) >= 5
    if inspect.isfunction(thing):
        assert [p for p in inspect.signature(thing).parameters if not _has_line(p, words)] == []


@pytest.mark.parametrize("name", [name for name in PUBLIC if inspect.isclass(PUBLIC[name])])
def test_public_members_are_explained(name: str) -> None:
    thing = PUBLIC[name]
    own = {key: member for key, member in vars(thing).items() if not key.startswith("_")}
    verbs = {
        k: m for k, m in own.items() if inspect.isfunction(m) or isinstance(m, property | cached_property | classmethod)
    }
    assert [key for key in verbs if not inspect.getdoc(getattr(thing, key))] == []
