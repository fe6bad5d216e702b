"""Captions hold on every background: a figure may stand on white or on dark, and its ink changes with it."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import gearrattle.report

FOLDER = Path(gearrattle.report.__file__).parent
INK = re.compile(r"\b(white|black|gr[ea]y|dark|light|darker|lighter)\b", re.IGNORECASE)
"""What background and ink are called; they change with the scheme. Colours of curves and areas do not."""


def _texts(path: Path) -> list[tuple[int, str]]:
    """Return line and text of every string of a module but its docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    statements = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    strings = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in statements]
    return [(node.lineno, node.value) for node in strings if isinstance(node.value, str)]


def test_no_text_of_a_figure_names_the_colour_of_ink_or_background() -> None:
    modules = sorted(FOLDER.rglob("*.py"))
    assert len(modules) > 80
    named = [
        f"{path.relative_to(FOLDER)}:{line}: {text}"
        for path in modules
        for line, text in _texts(path)
        if " " in text.strip() and INK.search(text)
    ]
    assert named == []
