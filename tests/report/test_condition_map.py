"""The map of a study of conditions on a saved page, in a real browser: by pointer and by keys, seen and heard."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import gearrattle as gr
from tests.browser import MARKS
from tests.studies.test_conditions import LOAD, OIL, SPEED, idle
from tests.workbench.page import browser, close_browser

pytestmark = MARKS
LISTENING = """
window.begun = [];
window.ended = 0;
const start = AudioBufferSourceNode.prototype.start;
AudioBufferSourceNode.prototype.start = function (...when) {
  const samples = this.buffer.getChannelData(0);
  const square = samples.reduce((sum, x) => sum + x * x, 0) / samples.length;
  window.begun.push({ rate: this.buffer.sampleRate, loop: this.loop, square });
  return start.apply(this, when);
};
const stop = AudioBufferSourceNode.prototype.stop;
AudioBufferSourceNode.prototype.stop = function (...when) { window.ended += 1; return stop.apply(this, when); };
"""


@pytest.fixture(scope="module", autouse=True)
def _end_of_browser() -> Iterator[None]:
    yield
    close_browser()


def opened(page: Path, tab: Any, faults: list[str]) -> None:
    tab.on("console", lambda line: faults.append(line.text))
    tab.on("pageerror", lambda error: faults.append(str(error)))
    tab.on("request", lambda sent: None if sent.url.startswith("file:") else faults.append(sent.url))
    tab.add_init_script(LISTENING)
    tab.goto(page.as_uri())


def test_a_condition_is_chosen_by_pointer_and_by_keys(tmp_path: Path) -> None:
    """Its row appears, its loop begins and the one before ends; silence and Escape play nothing."""
    data = gr.conditions(idle(), OIL, SPEED, LOAD, workers=1)
    page = gr.save(data, tmp_path / "page")
    faults: list[str] = []
    with browser().new_context(viewport={"width": 1200, "height": 900}) as context:
        tab = context.new_page()
        opened(page, tab, faults)
        cells = tab.locator("table.conditions button")
        row = tab.locator(".condition-row")
        heard = [k for k in range(cells.count()) if "rattles" in cells.nth(k).inner_text()]
        silent = [k for k in range(cells.count()) if cells.nth(k).inner_text() == "quiet"]
        assert cells.count() == 8
        assert tab.locator("#map-figure .static").is_hidden()
        # pointer: the levels of two conditions differ as their texts say
        levels = []
        for k in heard[:2]:
            cells.nth(k).click()
            levels.append(float(cells.nth(k).inner_text().split()[1]))
            assert cells.nth(k).get_attribute("aria-pressed") == "true"
            assert f"{levels[-1]:.3g}" in row.inner_text()
        first, second = tab.evaluate("begun")
        assert first["loop"]
        assert tab.evaluate("ended") == 1
        ratio = 10.0 * tab.evaluate("Math.log10(begun[0].square / begun[1].square)")
        assert ratio == pytest.approx(levels[0] - levels[1], abs=4.0)
        assert first["rate"] == second["rate"] == 24_000
        # Escape stops, a silent one plays nothing
        tab.keyboard.press("Escape")
        assert tab.evaluate("ended") == 2
        cells.nth(silent[0]).click()
        assert "silent" in row.inner_text()
        assert len(tab.evaluate("begun")) == 2
        # keys alone: one stop of Tab a panel, arrows move, Enter chooses
        cells.nth(0).focus()
        assert cells.evaluate_all("all => all.filter((one) => one.tabIndex === 0).length") == 2
        tab.keyboard.press("ArrowDown")
        tab.keyboard.press("ArrowRight")
        assert cells.nth(3).evaluate("one => one === document.activeElement")
        tab.keyboard.press("Enter")
        assert cells.nth(3).get_attribute("aria-pressed") == "true"
        tab.emulate_media(media="print")
        assert tab.locator("#map-figure .static").is_visible()
    assert faults == []
