"""Where things stand in the source tree."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "gearrattle"
EXAMPLES = ROOT / "examples"
DOCS = ROOT / "docs"


def source_files() -> list[Path]:
    """Return every Python file of the package."""
    return sorted(SOURCE.rglob("*.py"))


@cache
def syntax_tree(path: Path) -> ast.Module:
    """Parse a Python file, once a process."""
    return ast.parse(path.read_bytes())


@cache
def nodes_of(path: Path) -> tuple[ast.AST, ...]:
    """All nodes of a Python file, walked through once a process."""
    return tuple(ast.walk(syntax_tree(path)))


def document_files() -> list[Path]:
    """Return every hand-written page: the ones at the root and the manual's."""
    built = DOCS / "_build"
    pages = [path for path in DOCS.rglob("*.md") if built not in path.parents]
    return sorted([*ROOT.glob("*.md"), *pages])
