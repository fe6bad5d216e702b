"""The examples in the docstrings of public names, executed."""

from __future__ import annotations

import doctest
import inspect
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from tests.architecture.public import PUBLIC

NAMES = [name for name, public in PUBLIC.items() if inspect.isfunction(public) or inspect.isclass(public)]


@pytest.mark.parametrize("name", NAMES)
def test_the_example_shows_what_it_says(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tests = doctest.DocTestFinder(recurse=False).find(PUBLIC[name], name, globs={"gr": gr, "np": np})
    assert [test for test in tests if test.examples]
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    said: list[str] = []
    for test in tests:
        runner.run(test, out=said.append, clear_globs=False)
    assert runner.summarize(verbose=False).failed == 0, "".join(said)
