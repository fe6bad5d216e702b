"""The page of a server in a real browser, and what a user does in its Edit view.

Takes a server; gives a page whose errors and requests to elsewhere fail the test.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.browser import BROWSER
from tests.workbench.server import Server

_ENDS = ExitStack()
_PATIENCE = 30_000  # milliseconds until what a test expects must be there: other tests may take both cores
_BETWEEN = 100  # milliseconds between two looks at where a mark is


@cache
def browser() -> Any:
    """Chromium, started when it is first asked for."""
    playwright = pytest.importorskip("playwright.sync_api")
    playwright.expect.set_options(timeout=_PATIENCE)
    play = _ENDS.enter_context(playwright.sync_playwright())
    started = play.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
    _ENDS.callback(started.close)
    return started


def close_browser() -> None:
    """End it, if it was started."""
    _ENDS.close()
    browser.cache_clear()


@contextmanager
def opened_page(server: Server, width: int = 1280, height: int = 800) -> Iterator[Any]:
    """Open the page of a server; errors on the console and requests that leave the machine fail the test."""
    wrong: list[str] = []
    with browser().new_context(viewport={"width": width, "height": height}) as context:
        tab = context.new_page()
        tab.on("console", lambda line: wrong.append(f"{line.text} {line.location}") if is_fault(line) else None)
        tab.on("pageerror", lambda error: wrong.append(str(error)))
        tab.on("request", lambda sent: None if is_own(sent.url, server.address) else wrong.append(sent.url))
        tab.goto(f"{server.address}/?token={server.token}")
        yield tab
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


def boxes_of(*marks: Any) -> list[dict[str, float]]:
    """Return where marks are once two looks agree: a drawing that changes replaces its marks, or moves them."""
    before: list[dict[str, float] | None] = []
    for _ in range(_PATIENCE // _BETWEEN):
        boxes = [mark.bounding_box() for mark in marks]
        if None not in boxes and boxes == before:
            return boxes
        before = boxes
        marks[0].page.wait_for_timeout(_BETWEEN)
    raise AssertionError(f"not drawn at rest within {_PATIENCE // 1000} s: {marks}")


def middle_of(box: dict[str, float]) -> tuple[float, float]:
    """Return the middle of a box of the screen."""
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def selected(tab: Any, key: str) -> Any:
    """Select a mark of the drawing by keys."""
    playwright = pytest.importorskip("playwright.sync_api")
    mark = tab.locator(f'[data-key="{key}"]').first
    mark.focus()
    tab.keyboard.press("Enter")
    playwright.expect(mark).to_have_attribute("aria-pressed", "true")
    return mark


def violations(tab: Any) -> list[str]:
    """Return what axe-core finds serious or critical on the page."""
    axe = pytest.importorskip("axe_playwright_python")
    tab.evaluate((Path(axe.__file__).parent / "axe.min.js").read_text(encoding="utf-8"))
    answer = tab.evaluate("() => axe.run(document, { resultTypes: ['violations'] })")
    serious = [rule for rule in answer["violations"] if rule["impact"] in ("serious", "critical")]
    return [f"{rule['id']}: {node['target']} {node['failureSummary']}" for rule in serious for node in rule["nodes"]]


_CUT_OFF = """() => {
  const width = document.documentElement.clientWidth, whole = document.documentElement.scrollWidth;
  const wrong = whole > width ? [`the page is ${whole} wide`] : [];
  const overflow = (node) => getComputedStyle(node).overflowX;
  const isInScroll = (node) =>
    node !== document.body && (overflow(node) !== "visible" || isInScroll(node.parentElement));
  for (const node of document.querySelectorAll("main *, header *")) {
    const { left, right, width: wide, height } = node.getBoundingClientRect();
    const isBeyond = wide && height && (right > width + 1 || left < -1);
    if (isBeyond && !isInScroll(node.parentElement)) wrong.push(`${node.tagName} from ${left} to ${right}`);
  }
  for (const node of document.querySelectorAll("button, a.button, nav a, summary, h1, h2")) {
    const isCut = overflow(node) !== "visible" && getComputedStyle(node).textOverflow !== "ellipsis";
    if (isCut && node.scrollWidth > node.clientWidth + 1) wrong.push(`the text ${node.textContent}`);
  }
  return wrong;
}"""


def cut_off(tab: Any) -> list[str]:
    """Return what of a page does not fit: the page itself if it scrolls sideways, and what stands beyond its edge."""
    beyond: list[str] = tab.evaluate(_CUT_OFF)
    return beyond
