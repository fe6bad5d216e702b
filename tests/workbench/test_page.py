"""Results in a real browser: a run is read and zoomed, variants compared, maps keep the colours of their legend.

With no error and no foreign request.
"""

from __future__ import annotations

import io
import time
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from tests.browser import MARKS
from tests.workbench.jobs import model
from tests.workbench.page import opened_page
from tests.workbench.server import Server

pytest.importorskip("uvicorn")
playwright = pytest.importorskip("playwright.sync_api")
pytestmark = MARKS
TOLD = 0.5  # seconds in which a message of the socket reaches the page


@pytest.fixture
def server(finished_server: Server) -> Server:
    return finished_server


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
    rows = server.client.get("/api/compare", params={"jobs": "first,second"}).json()["numbers"]
    assert tab.locator("table .best").count() == sum(row["best"] is not None for row in rows)
    assert tab.get_by_text("within the scatter").count() == sum(row["in_scatter"] for row in rows) > 0


def test_sounds_are_compared_at_one_gain(tab: Any, server: Server) -> None:
    tab.goto(f"{server.address}/#/compare?jobs=first,second")
    tab.get_by_role("button", name="Make the sounds").click()
    playwright.expect(tab.locator("audio")).to_have_count(2)
    gain = server.client.get("/api/sound", params={"jobs": "first,second"}).json()["gain"]
    sources = tab.locator("audio").evaluate_all("all => all.map((one) => one.getAttribute('src'))")
    assert [float(source.partition("?gain=")[2]) for source in sources] == [gain, gain]
    tab.goto(f"{server.address}/#/runs/second/sound")
    playwright.expect(tab.locator(".gr-tabpanel")).to_contain_text("The highest peak of this run is half of full scale")


def test_runs_of_one_name_have_two_entries_in_a_legend(tab: Any, server: Server) -> None:
    names = {job: server.state(job)["name"] for job in ("first", "second")}
    try:
        for job in names:
            server.client.patch(f"/api/jobs/{job}", json={"name": "gearbox"})
        tab.goto(f"{server.address}/#/compare?jobs=first,second")
        legend = tab.locator("section[aria-label='Laid over each other'] .gr-legend li")
        playwright.expect(legend.filter(has_text="gearbox")).to_have_count(2)
        assert sorted(legend.all_inner_texts()) == ["gearbox", "gearbox (2)"]
    finally:
        for job, name in names.items():
            server.client.patch(f"/api/jobs/{job}", json={"name": name})


def test_a_name_that_changes_while_the_list_is_read_is_shown(tab: Any, server: Server) -> None:
    name = server.state("first")["name"]
    names = []

    def delayed(route: Any) -> None:
        """Answer with the list of a moment ago: the run has another name by now, and the socket has told so."""
        answer = route.fetch()
        names.append(f"renamed {len(names)}")
        server.client.patch("/api/jobs/first", json={"name": names[-1]})
        time.sleep(TOLD)
        route.fulfill(response=answer)

    try:
        tab.route("**/api/jobs", delayed)
        tab.reload()
        tab.goto(f"{server.address}/#/runs")
        tab.wait_for_selector(".runs li")
        playwright.expect(tab.locator(".runs").get_by_text(names[-1], exact=True)).to_have_count(1)
        tab.unroute_all(behavior="wait")
        playwright.expect(tab.locator(".runs").get_by_text(names[-1], exact=True)).to_have_count(1)
    finally:
        server.client.patch("/api/jobs/first", json={"name": name})


def test_pictures_are_dark_in_the_dark_scheme(server: Server) -> None:
    image = pytest.importorskip("PIL.Image")
    lightness = {}
    for scheme in ("light", "dark"):
        with opened_page(server) as tab:
            tab.emulate_media(color_scheme=scheme)
            tab.goto(f"{server.address}/#/runs/modes")
            tab.get_by_role("tab", name="Shapes", exact=True).click()
            tab.wait_for_function("() => document.querySelector('.gr-picture')?.naturalWidth > 0")
            shot = image.open(io.BytesIO(tab.locator(".gr-picture").first.screenshot())).convert("L")
            lightness[scheme] = np.median(np.asarray(shot))
    assert lightness["light"] > 240
    assert lightness["dark"] < 50


def test_plain_numbers_have_their_unit(tab: Any, server: Server) -> None:
    tab.goto(f"{server.address}/#/runs/first/vary")
    output = tab.locator(".slider output")
    playwright.expect(output).to_have_text("0.0001 m", timeout=60_000)
    tab.get_by_role("slider", name="mesh.gear.backlash").evaluate(
        "(slider) => { slider.value = 0.00005; slider.dispatchEvent(new Event('input', { bubbles: true })); }"
    )
    playwright.expect(output).to_have_text("0.0000497 m")
    choice = tab.get_by_label("Add a slider").locator("option")
    assert {"coupling.clutch.stiffness = 1500 N m/rad", "torque.0.harmonics.0.order = 1"} <= {*choice.all_inner_texts()}
    tab.goto(f"{server.address}/#/studies")
    tab.get_by_label("Model of").select_option("first")
    tab.get_by_label("Vary").select_option("mesh.gear.backlash")
    playwright.expect(tab.get_by_label("from [m]")).to_be_visible()


_PIXELS = """(canvas, [across, up]) => {
  const ratio = canvas.width / canvas.clientWidth, context = canvas.getContext("2d");
  const width = canvas.clientWidth - 66 - 14, height = canvas.clientHeight - 24 - 38;
  const [left, top] = [66 + (across + 0.2) * width / 2, 24 + (1 - up + 0.2) * height / 2];
  return [...context.getImageData(left * ratio, top * ratio, 0.3 * width * ratio, 0.3 * height * ratio).data];
}"""
"""Pixels well within a cell of a map of two by two; the margins are those of plot.js."""


def colours(tab: Any, cell: tuple[int, int]) -> list[tuple[tuple[int, ...], float]]:
    """Return the colours of a cell and their shares, the commonest first."""
    canvas = tab.locator(".gr-canvas").first.element_handle()
    pixels = np.reshape(canvas.evaluate(_PIXELS, list(cell)), (-1, 4))
    counts = Counter(map(tuple, pixels.tolist()))
    return [(colour, count / len(pixels)) for colour, count in counts.most_common()]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_cells_without_a_value_are_hatched_on_the_background(server: Server, scheme: str) -> None:
    with opened_page(server) as tab:
        tab.emulate_media(color_scheme=scheme)
        tab.goto(f"{server.address}/#/runs/holes")
        tab.wait_for_selector(".gr-tabpanel canvas")
        playwright.expect(tab.locator(".gr-legend").first).to_contain_text("no value")
        swatches = tab.locator(".gr-legend").first.locator(".gr-swatch")
        backgrounds = swatches.evaluate_all("all => all.map((one) => getComputedStyle(one).background)")
        panel = tab.evaluate("() => getComputedStyle(document.querySelector('.card')).backgroundColor")
        (paper, share), *strokes = colours(tab, (1, 1))
        assert str(paper[:3]) in panel.replace("rgb", "")
        assert 0.5 < share < 0.9
        assert max(abs(a - b) for a, b in zip(paper, strokes[0][0], strict=True)) > 60
        assert sum("gradient" in words for words in backgrounds) == 1
        for cell in ((0, 0), (0, 1), (1, 0)):
            ((colour, whole),) = colours(tab, cell)
            assert whole == 1.0
            assert any(str(colour[:3]) in words for words in backgrounds)
