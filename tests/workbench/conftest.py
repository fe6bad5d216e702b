"""Servers that tests of the workbench share: one that is empty at first, one with finished jobs of every kind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.workbench.jobs import make_finished
from tests.workbench.page import close_browser
from tests.workbench.server import Server, serving


@pytest.fixture(scope="package")
def empty_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server of a folder without jobs and files, but for those that other tests have left."""
    with serving(tmp_path_factory.mktemp("workspace")) as running:
        yield running


@pytest.fixture(scope="package")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with finished jobs."""
    root = tmp_path_factory.mktemp("finished")
    make_finished(root)
    return root


@pytest.fixture(scope="package")
def finished_server(finished: Path) -> Iterator[Server]:
    """A server of that folder."""
    with serving(finished) as running:
        yield running


@pytest.fixture(scope="module", autouse=True)
def _browser_of_a_module() -> Iterator[None]:
    """End the browser, if a test of the module has started it: other modules start browsers of their own."""
    yield
    close_browser()
