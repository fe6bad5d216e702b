"""Interactive figures of a page in a real browser: what the pointer, the keys and the legend do."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gearrattle.report.page import Page, Section
from gearrattle.report.plots.chart import Bars, Cells, Chart, Heat, Key, Line, Panel
from gearrattle.report.written_page import fill_page
from tests.browser import MARKS
from tests.report.live_page import drawn, page_of_a_file

pytestmark = MARKS
TIME = np.linspace(0.0, 4.0, 401)
MANY = 200_000
PANELS = (
    Panel("up", "mm", "time  [s]", (Line(TIME, TIME, "ramp"), Line(TIME, -TIME, "fall", "#d55e00"))),
    Panel("power", "W", "time  [s]", (Line(TIME, 10.0**TIME, "power"),), y_log=True, y_range=(1.0, 1e4)),
)
LINKED = Chart("linked", "Linked", "Two panels.", PANELS, legend=(Key("falling", "#d55e00"), Key("other", "#123456")))
RNG = np.random.default_rng(1)
NOISE = Line(np.linspace(0.0, 1.0, MANY), RNG.standard_normal(MANY), "noise")
CLOUD = Line(RNG.uniform(0.0, 1.0, MANY), RNG.standard_normal(MANY), "cloud", mark="points", width=1.5)
LARGE = Chart("large", "Large", "Many points.", (Panel("noise", lines=(NOISE,)), Panel("cloud", lines=(CLOUD,))))
AREAS = Chart(
    "areas",
    "Areas",
    "Whatever is no line.",
    (
        Panel("map", heat=Heat((0.0, 1.0), (0.0, 1.0), np.array([[7.0]]), 0.0, 10.0, "dB")),
        Panel("bars", bars=(Bars(np.array([0.0, 1.0]), np.array([5.0]), "count"),)),
        Panel("cells", cells=(Cells(np.zeros(1), np.ones(1), np.zeros(1), np.ones(1), "quiet"),)),
    ),
    columns=3,
    share_x=False,
)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    sections = tuple(Section(chart.key, chart.title, charts=(chart,)) for chart in (LINKED, AREAS, LARGE))
    fill_page(Page("test", "Figures", sections, is_interactive=True), folder)
    return folder / "report.html"


@pytest.fixture
def tab(file: Path) -> Iterator[Any]:
    with page_of_a_file(file) as tab:
        yield tab


def at(canvas: Any, across: float, up: float = 0.5) -> tuple[float, float]:
    """A point of a canvas, as shares of its width and height."""
    box = canvas.bounding_box()
    return box["x"] + across * box["width"], box["y"] + (1.0 - up) * box["height"]


def ink(canvas: Any) -> str:
    return str(canvas.evaluate("(canvas) => canvas.toDataURL()"))


def drag(tab: Any, begin: tuple[float, float], end: tuple[float, float]) -> None:
    tab.mouse.move(*begin)
    tab.mouse.down()
    tab.mouse.move(*end, steps=3)
    tab.mouse.up()


def readout(tab: Any, key: str, panel: int = 0) -> str:
    return str(tab.locator(f"#{key}-live .gr-readout").nth(panel).inner_text())


def seconds(words: str) -> float:
    """The time in a readout of the panel of one line."""
    return float(words.split(" s ", maxsplit=1)[0])


def test_the_pointer_reads_values_with_units_in_all_linked_panels(tab: Any) -> None:
    up, power = drawn(tab, "linked").all()
    tab.mouse.move(*at(power, 0.5))
    time = seconds(readout(tab, "linked", 1))
    assert 1.8 < time < 2.3
    value = float(readout(tab, "linked", 1).partition("→ ")[2].removesuffix(" W"))
    assert value == pytest.approx(10.0**time, rel=1e-3)
    assert readout(tab, "linked").startswith(f"ramp {time:g} s → {time:.4g} mm · fall ")
    assert up.get_attribute("aria-label") == "Linked: up mm"


def test_a_box_zooms_both_linked_panels_and_a_double_click_resets(tab: Any) -> None:
    canvases = drawn(tab, "linked").all()
    whole = [ink(canvas) for canvas in canvases]
    drag(tab, at(canvases[0], 0.45), at(canvases[0], 0.55))
    tab.mouse.move(5, 5)
    zoomed = [ink(canvas) for canvas in canvases]
    assert all(now != before for now, before in zip(zoomed, whole, strict=True))
    tab.mouse.move(*at(canvases[1], 0.9))
    assert 2.0 < seconds(readout(tab, "linked", 1)) < 2.5
    tab.mouse.dblclick(*at(canvases[0], 0.5))
    tab.mouse.move(5, 5)
    assert [ink(canvas) for canvas in canvases] == whole


def test_keys_do_what_the_pointer_does(tab: Any) -> None:
    canvas = drawn(tab, "linked").nth(1)
    before = ink(canvas)
    canvas.focus()
    canvas.press("ArrowRight")
    first = seconds(readout(tab, "linked", 1))
    canvas.press("ArrowRight")
    assert seconds(readout(tab, "linked", 1)) > first
    canvas.press("+")
    canvas.press("0")
    tab.mouse.move(*at(canvas, 0.5))
    tab.mouse.move(5, 5)
    assert ink(canvas) == before


def test_an_entry_of_the_legend_hides_what_it_explains(tab: Any) -> None:
    canvas = drawn(tab, "linked").first
    before = ink(canvas)
    assert tab.locator("#linked-live .gr-legend li").all_inner_texts() == ["falling", "other"]
    entry = tab.locator("#linked-live .gr-legend").get_by_role("button")
    assert entry.all_inner_texts() == ["falling"]
    entry.click()
    assert entry.get_attribute("aria-pressed") == "false"
    tab.mouse.move(*at(canvas, 0.5))
    assert "fall" not in readout(tab, "linked")
    entry.click()
    tab.mouse.move(5, 5)
    assert ink(canvas) == before


def test_maps_bars_and_cells_are_read_too(tab: Any) -> None:
    words = []
    for k, canvas in enumerate(drawn(tab, "areas").all()):
        tab.mouse.move(*at(canvas, 0.5, 0.45))
        words.append(readout(tab, "areas", k))
    assert words[0].endswith("dB 7")
    assert words[1] == "count 0 to 1 → 5"
    assert words[2] == "quiet"


def test_many_points_are_quick(tab: Any) -> None:
    """A cursor takes no longer than a few frames; drawing anew stays below a second or two."""
    noise, cloud = drawn(tab, "large").all()
    moved = """(canvas) => {
        const box = canvas.getBoundingClientRect(), begin = performance.now();
        for (let k = 0; k < 20; k++) {
            const at = { clientX: box.left + 200 + 10 * k, clientY: box.top + 60 };
            canvas.dispatchEvent(new PointerEvent("pointermove", at));
        }
        canvas.getContext("2d").getImageData(0, 0, 1, 1);
        return (performance.now() - begin) / 20;
    }"""
    reset = """(canvas) => {
        const begin = performance.now();
        canvas.dispatchEvent(new MouseEvent("dblclick"));
        canvas.getContext("2d").getImageData(0, 0, 1, 1);
        return performance.now() - begin;
    }"""
    for canvas in (noise, cloud):
        assert canvas.evaluate(moved) < 150.0
        assert canvas.evaluate(reset) < 4000.0


def test_without_scripts_and_in_print_the_static_figure_is_shown(file: Path) -> None:
    with page_of_a_file(file, java_script_enabled=False) as tab:
        assert tab.locator("#linked-figure img.static").is_visible()
        assert tab.locator("#linked-figure .legend").is_visible()
    with page_of_a_file(file) as tab:
        drawn(tab, "linked")
        assert not tab.locator("#linked-figure img.static").is_visible()
        tab.emulate_media(media="print")
        assert tab.locator("#linked-figure img.static").is_visible()
        assert not tab.locator("#linked-live").is_visible()
        assert tab.locator("#linked-figure .legend").is_visible()
