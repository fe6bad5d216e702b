"""What a type checker sees of the package from outside the source tree, and that public signatures have no ``Any``."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.architecture.places import ROOT, SOURCE
from tests.architecture.public import PUBLIC


def _mypy(program: str, folder: Path) -> str:
    """Return what mypy --strict says of a program that uses gearrattle as an installed package."""
    path = folder / "program.py"
    path.write_text(program, encoding="utf-8")
    cache = ROOT / ".mypy_cache" / "outside"  # kept: the first check of the whole package takes 13 s, the next ones 1 s
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", f"--cache-dir={cache}", path.name]
    environment = {"PYTHONPATH": str(SOURCE.parent), "PATH": ""}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False).stdout


@pytest.mark.long
def test_public_names_have_their_types_outside_the_source_tree(tmp_path: Path) -> None:
    names = list(PUBLIC)
    program = ["import gearrattle as gr", *(f"reveal_type(gr.{name})" for name in names)]
    lines = _mypy("\n".join(program), tmp_path).splitlines()
    types = dict(zip(names, (line.partition('Revealed type is "')[2] for line in lines), strict=True))
    assert [name for name, text in types.items() if re.search(r'^(Any)?"?$|-> Any"$', text)] == []
    assert types["compare"].endswith('-> pandas.core.frame.DataFrame"')


@pytest.mark.long
def test_wrong_uses_are_reported_outside_the_source_tree(tmp_path: Path) -> None:
    program = """import gearrattle as gr

run = gr.simulate(gr.example("case3"), cycle=3)
reveal_type(gr.criteria(run).verdict)
gr.criteri
gr.load(3)
"""
    assert re.findall(r":(\d+): (?:error|note): ([^,\"]+\"[^\"]*\")", _mypy(program, tmp_path)) == [
        ("3", 'Unexpected keyword argument "cycle"'),
        ("4", "Revealed type is \"Literal['quiet'] | Literal['single-sided'] | Literal['double-sided']\""),
        ("5", 'Module has no attribute "criteri"'),
        ("6", 'Argument 1 to "load"'),
    ]


HOOKS = {"Model.rules"}
"""Methods that the class calls itself, on tables not yet checked."""


def _annotations(name: str, public: Any) -> Iterator[tuple[str, str]]:
    """Yield where an annotation stands and its text: of a function, or of the attributes and methods of a class."""
    if inspect.isclass(public):
        yield from ((f"{name}.{key}", str(text)) for key, text in inspect.get_annotations(public).items())
        for key, member in inspect.getmembers_static(public):
            inner = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
            is_ours = inspect.isfunction(inner) and inner.__module__.startswith("gearrattle")
            if is_ours and (key == "__init__" or not key.startswith("_")) and f"{name}.{key}" not in HOOKS:
                yield from _annotations(f"{name}.{key}", inner)
    elif inspect.isfunction(public):
        signature = inspect.signature(public)
        yield f"{name} ->", str(signature.return_annotation)
        yield from ((f"{name}({key})", str(p.annotation)) for key, p in signature.parameters.items())


def test_public_signatures_say_what_they_take_and_give() -> None:
    annotations = [row for name, public in PUBLIC.items() for row in _annotations(name, public)]
    assert len(annotations) > 500
    assert [f"{where}: {text}" for where, text in annotations if re.search(r"\bAny\b", text)] == []
