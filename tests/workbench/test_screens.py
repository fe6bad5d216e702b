"""Every page at three sizes, in both schemes: nothing cut off, nothing that a screen reader or a weak eye misses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.browser import MARKS
from tests.workbench.page import cut_off, opened_page, violations
from tests.workbench.server import Server

pytest.importorskip("uvicorn")
pytest.importorskip("playwright.sync_api")
pytestmark = MARKS

SIZES = [(1024, 768), (1280, 800), (1920, 1080)]
PAGES = {
    "edit": (".ed-start", "#/edit"),
    "drawing": (".gr-node", "#/edit?job=first"),
    "verdict": (".gr-headline", "#/runs/first"),
    "histories": (".gr-canvas", "#/runs/first/histories"),
    "modes": (".gr-tabpanel table", "#/runs/modes"),
    "fit": (".gr-tabpanel table", "#/runs/fit"),
    "study": (".gr-tabpanel :is(svg, canvas)", "#/runs/study"),
    "vary": (".live canvas", "#/runs/first/vary"),
    "compare": ("section canvas", "#/compare?jobs=first,second"),
    "measured": ("section[aria-label=Spectra] canvas", "#/measured?job=first&file=rig.csv"),
    "studies": (".page h1", "#/studies"),
}
"""Page -> what it shows when it is there, and its address."""


@pytest.fixture(scope="module")
def server(finished_server: Server) -> Server:
    return finished_server


SMALLEST, USUAL, LARGEST = SIZES
SOME = [SMALLEST, pytest.param(USUAL, marks=pytest.mark.long), pytest.param(LARGEST, marks=pytest.mark.long)]
"""Of the quick tests the smallest alone: there things are cut off first."""


@pytest.fixture(scope="module", params=SOME, ids=lambda size: f"{size[0]}x{size[1]}")
def tab(request: pytest.FixtureRequest, server: Server) -> Iterator[Any]:
    with opened_page(server, *request.param) as opened:
        yield opened


def shown(tab: Any, server: Server, page: str) -> None:
    sign, address = PAGES[page]
    tab.evaluate("() => localStorage.removeItem('gearrattle.draft')")
    tab.goto("about:blank")
    tab.goto(f"{server.address}/{address}")
    tab.wait_for_selector(sign, timeout=60_000)


@pytest.mark.parametrize("page", PAGES)
def test_nothing_of_a_page_is_cut_off(tab: Any, server: Server, page: str) -> None:
    shown(tab, server, page)
    assert cut_off(tab) == []


@pytest.mark.parametrize("tab", SIZES[1:2], indirect=True)
@pytest.mark.parametrize("page", PAGES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_page_can_be_read_by_all(tab: Any, server: Server, page: str, scheme: str) -> None:
    tab.emulate_media(color_scheme=scheme)
    shown(tab, server, page)
    assert violations(tab) == []


@pytest.mark.parametrize("tab", SIZES[1:2], indirect=True)
def test_what_does_not_fit_or_has_no_name_is_noticed(tab: Any, server: Server) -> None:
    shown(tab, server, "studies")
    tab.evaluate(
        "() => { document.querySelector('h1').style.cssText = 'width: 3000px; color: #ddd; background: #eee'; }"
    )
    tab.evaluate("() => document.querySelector('main').append(document.createElement('button'))")
    assert any("the page is" in words for words in cut_off(tab))
    rules = {words.partition(":")[0] for words in violations(tab)}
    assert {"button-name", "color-contrast"} <= rules
