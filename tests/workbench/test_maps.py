"""Maps of studies on the screen: cells keep the colours of their legend, and those without a value are hatched."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from tests.browser import MARKS
from tests.workbench.jobs import make_job
from tests.workbench.page import opened_page
from tests.workbench.server import Server, serving
from tests.workbench.test_results import model

pytest.importorskip("uvicorn")
playwright = pytest.importorskip("playwright.sync_api")
pytestmark = MARKS
AXES = {"mesh.gear.backlash": ["0.05 mm", "0.1 mm"], "coupling.clutch.stiffness": [1400.0, 1500.0]}


def without(data: xr.Dataset) -> xr.Dataset:
    """Return a study whose last case has no values."""
    holes = data.copy(deep=True)
    last = dict.fromkeys(AXES, 1)
    for name, values in data.items():
        if set(AXES) <= set(map(str, values.dims)) and values.dtype.kind in "fi":
            holes[name][last] = np.nan if values.dtype.kind == "f" else -1
    return holes


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    root = tmp_path_factory.mktemp("maps")
    study = without(gr.study(model(), AXES, workers=1))
    make_job(root, "study", study, model(), task="study", options={"axes": AXES})
    with serving(root) as running:
        yield running


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
        tab.goto(f"{server.address}/#/runs/study")
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
