"""The page in a real browser: a run is read and zoomed, variants compared, with no error and no foreign request."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

import gearrattle as gr
from tests.browser import MARKS
from tests.workbench.jobs import make_job
from tests.workbench.page import opened_page
from tests.workbench.server import Server, serving
from tests.workbench.test_results import model

pytest.importorskip("uvicorn")
playwright = pytest.importorskip("playwright.sync_api")
pytestmark = MARKS


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    root = tmp_path_factory.mktemp("page")
    make_job(root, "first", gr.run(model()), model(), name="wide")
    narrow = model().with_({"mesh.gear.backlash": "0.05 mm"})
    make_job(root, "second", gr.run(narrow), narrow, name="narrow", parent="first")
    with serving(root) as running:
        yield running


@pytest.fixture
def tab(server: Server) -> Iterator[Any]:
    with opened_page(server) as page:
        yield page


def test_a_run_is_read_and_zoomed_to_one_impact(tab: Any, server: Server) -> None:
    tab.goto(f"{server.address}/#/runs/first")
    tab.wait_for_selector(".gr-headline")
    assert tab.locator(".gr-headline").inner_text() == "Double-sided rattle"
    assert tab.locator(".gr-drawing svg").count() == 1
    tab.get_by_role("tab", name="Histories").click()
    state = tab.locator(".gr-state")
    playwright.expect(state).to_contain_text("20 cycles")
    events = gr.simulate(model()).events
    count = int((events.to_region.abs() > events.from_region.abs()).sum())
    assert state.inner_text() == f"20 cycles, {count} impacts"
    tab.get_by_role("button", name="Hardest").click()
    playwright.expect(state).to_contain_text("0.5 cycles")
    tab.locator(".gr-canvas").first.focus()
    tab.keyboard.press("0")
    playwright.expect(state).to_contain_text("20 cycles")
    for name in ("Regions", "Phase plane", "Spectra", "Impacts", "Mode shapes", "Criteria"):
        tab.get_by_role("tab", name=name, exact=True).click()
        tab.wait_for_selector(".gr-tabpanel :is(canvas, svg, table)")


def test_tabs_are_walked_by_keys(tab: Any, server: Server) -> None:
    tab.goto(f"{server.address}/#/runs/first")
    tab.get_by_role("tab", name="Verdict").focus()
    tab.keyboard.press("ArrowRight")
    playwright.expect(tab.get_by_role("tab", name="Histories")).to_have_attribute("aria-selected", "true")


def test_variants_stand_side_by_side(tab: Any, server: Server) -> None:
    tab.goto(f"{server.address}/#/compare?jobs=first,second")
    tab.wait_for_selector("text=mesh.gear.backlash")
    tab.wait_for_selector("section canvas")
    assert tab.locator("table .best").count() > 3
