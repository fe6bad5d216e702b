"""The browser that the tests of a module share ends with them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.workbench.page import close_browser


@pytest.fixture(scope="module", autouse=True)
def _browser_of_a_module() -> Iterator[None]:
    yield
    close_browser()
