"""The page of a server in a real browser, and what a user does in its Edit view.

Takes a server; gives a page whose errors and requests to elsewhere fail the test.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from tests.browser import BROWSER
from tests.workbench.server import Server


@contextmanager
def opened_page(server: Server, width: int = 1280, height: int = 800) -> Iterator[Any]:
    """Open the page of a server; errors on the console and requests that leave the machine fail the test."""
    playwright = pytest.importorskip("playwright.sync_api")
    wrong: list[str] = []
    with playwright.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": width, "height": height})
        tab.on("console", lambda line: wrong.append(f"{line.text} {line.location}") if is_fault(line) else None)
        tab.on("pageerror", lambda error: wrong.append(str(error)))
        tab.on("request", lambda sent: None if is_own(sent.url, server.address) else wrong.append(sent.url))
        tab.goto(f"{server.address}/?token={server.token}")
        yield tab
        browser.close()
    assert wrong == [], "\n".join(wrong)


def is_fault(line: Any) -> bool:
    """Whether a line of the console is an error; a refused precondition is answered by a question of the page."""
    return line.type == "error" and "status of 412" not in line.text


def is_own(url: str, address: str) -> bool:
    """Whether a request stays with the server."""
    return url.startswith((address, "data:", f"blob:{address}"))


def text_of(tab: Any) -> str:
    return str(tab.locator(".toml-area").input_value())


def waits(tab: Any, condition: str) -> None:
    """Wait until the text fulfils a condition on ``text``."""
    tab.wait_for_function(f"() => {{ const text = document.querySelector('.toml-area').value; return {condition}; }}")


def name_it(tab: Any, old: str, name: str) -> None:
    """Type a name into the field that has the focus."""
    tab.wait_for_function(f"() => document.activeElement.value === '{old}'")
    tab.keyboard.type(name)
    tab.keyboard.press("Enter")
    waits(tab, f"text.includes('\"{name}\"')")


def fill(tab: Any, label: str, value: str) -> None:
    """Type a value into a field of the form."""
    field = tab.locator(".ed-form").get_by_label(label, exact=True)
    field.fill(value)
    field.press("Enter")
    waits(tab, f"text.includes({value!r})")


def selected(tab: Any, key: str) -> Any:
    """Select a mark of the drawing by keys."""
    playwright = pytest.importorskip("playwright.sync_api")
    mark = tab.locator(f'[data-key="{key}"]').first
    mark.focus()
    tab.keyboard.press("Enter")
    playwright.expect(mark).to_have_attribute("aria-pressed", "true")
    return mark
