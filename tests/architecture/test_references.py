"""Dotted names in the text of the source, as ``kernels.march`` or ``March.counts``, name what exists."""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

from tests.architecture.places import SOURCE, nodes_of, source_files, syntax_tree
from tests.architecture.public import PUBLIC

FILE_TYPES = {"j2", "json", "nc", "py", "pyi", "toml", "wav"}
DATA = {"angle", "coupling", "deflection", "excitation", "mesh", "slider", "stages", "torque", "velocity"}
"""First parts of the paths of a model and of the columns of a recording."""
OTHERS = {"N.m", "QUANTITY.SUBJECT", "X.Data", "simulation.initial"}
"""A unit, the name of a column, a variable of a MATLAB file, an entry of a model file."""


def _texts(path: Path) -> Iterator[str]:
    """Yield the comments and the docstrings of a file, those of constants and fields included."""
    for node in nodes_of(path):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.value.value
    for token in tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline):
        if token.type == tokenize.COMMENT:
            yield token.string


def _bound(nodes: Sequence[ast.AST]) -> Iterator[str]:
    """Yield the names that nodes bind themselves."""
    for node in nodes:
        if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.id if isinstance(node, ast.Name) else node.attr
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from (alias.asname or alias.name.split(".")[0] for alias in node.names)


def _outside_functions(body: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """Yield the nodes of a module or class, without the inner nodes of its functions and classes."""
    for node in body:
        yield node
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield from _outside_functions(list(ast.iter_child_nodes(node)))


@cache
def _modules() -> dict[str, set[str]]:
    """The names in every module by each ending of its path: ``march``, ``kernels.march``, ``engine.kernels.march``."""
    modules: dict[str, set[str]] = {}
    for path in source_files():
        stub = path.with_suffix(".pyi")
        bodies = [syntax_tree(file).body for file in (path, stub) if file.exists()]
        names = {name for body in bodies for name in _bound(list(_outside_functions(body)))}
        parts = path.relative_to(SOURCE.parent).with_suffix("").parts
        parts = parts[:-1] if parts[-1] == "__init__" else parts
        for i in range(len(parts)):
            modules.setdefault(".".join(parts[i:]), set()).update(names)
    return modules


@cache
def _members() -> dict[str, set[str]]:
    """The members of every class by its name: fields, methods, attributes of instances, and those of its bases."""
    classes: dict[str, set[str]] = {}
    bases: dict[str, set[str]] = {}
    for node in (node for path in source_files() for node in nodes_of(path) if isinstance(node, ast.ClassDef)):
        fields = _bound(list(_outside_functions(node.body)))
        stored = (inner for inner in ast.walk(node) if isinstance(inner, ast.Attribute))
        attributes = _bound(list(stored))
        classes.setdefault(node.name, set()).update(fields, attributes)
        bases.setdefault(node.name, set()).update(
            name for base in node.bases for name in re.findall(r"\w+", ast.unparse(base))
        )
    for _ in range(4):  # bases of bases
        for name, known in classes.items():
            known.update(*(classes.get(base, ()) for base in bases[name]))
    return classes


@cache
def _libraries() -> set[str]:
    """The libraries that the package imports, with their short names (``np``), and those of Python."""
    own = {"gearrattle"}
    imports = [node for path in source_files() for node in nodes_of(path) if isinstance(node, ast.Import)]
    members = [node for path in source_files() for node in nodes_of(path) if isinstance(node, ast.ImportFrom)]
    names = {name for node in imports for a in node.names for name in (a.name.split(".")[0], a.asname or "")}
    return (names | {(node.module or "").split(".")[0] for node in members} | set(sys.stdlib_module_names)) - own


def exists(name: str, path: Path) -> bool:
    """Whether a dotted name in a file is a module, a name in one, a member of a class, or from a library."""
    first, second, *_ = name.split(".")
    module, last = name.rsplit(".", 1)
    if last in FILE_TYPES or first in DATA or last == "NAME" or name in OTHERS:
        return True
    if first in {"gr", "gearrattle"} and name.split(".", 1)[1] in PUBLIC:
        return True
    modules = _modules()
    if name in modules or last in modules.get(module, ()):
        return True
    classes = _members()
    if first in classes:
        return second in classes[first]
    is_variable = first in set(_bound(nodes_of(path))) and any(second in members for members in classes.values())
    return is_variable or first in _libraries()


def test_dotted_names_in_texts_exist() -> None:
    named = {
        (path.relative_to(SOURCE).as_posix(), name)
        for path in source_files()
        for text in _texts(path)
        for name in re.findall(r"``([A-Za-z_]\w*(?:\.\w+)+)``", text)
    }
    assert len(named) > 200
    assert sorted((path, name) for path, name in named if not exists(name, SOURCE / path)) == []


def test_a_dead_name_is_noticed() -> None:
    path = SOURCE / "engine" / "kernels" / "march.py"
    assert exists("first_exit.first_exit", path)
    assert exists("March.counts", path)
    assert not exists("first_exit.no_such_function", path)
    assert not exists("no_such_module.first_exit", path)
    assert not exists("March.no_such_field", path)
