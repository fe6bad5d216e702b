"""A page of a result in a real browser, and where things are in its figures.

Takes the file of a page; gives the page, whose errors and requests to elsewhere fail the test.
"""

from __future__ import annotations

import json
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from tests.workbench.page import browser

LEFT, RIGHT, TOP, BOTTOM = 66, 14, 24, 38
"""Margins of plot.js [px]."""


@contextmanager
def page_of_a_file(path: Path, **settings: Any) -> Iterator[Any]:
    """Open a page; what it complains of and what it asks for elsewhere fail the test."""
    wrong: list[str] = []
    with browser().new_context(viewport={"width": 1280, "height": 900}, **settings) as context:
        tab = context.new_page()
        tab.on("console", lambda line: wrong.append(line.text) if line.type == "error" else None)
        tab.on("pageerror", lambda error: wrong.append(str(error)))
        tab.on("request", lambda sent: wrong.append(sent.url) if not sent.url.startswith(("file:", "data:")) else None)
        tab.goto(path.as_uri())
        yield tab
    assert wrong == []


def drawn(tab: Any, key: str) -> Any:
    """Scroll to a figure and wait until it is drawn; return its canvases."""
    tab.locator(f"#{key}-figure").scroll_into_view_if_needed()
    tab.locator(f"#{key}-figure.drawn canvas").first.wait_for()
    return tab.locator(f"#{key}-live .gr-canvas")


def pixel(tab: Any, key: str, x: float, y: float) -> tuple[float, float]:
    """Where a point of the one panel of a figure is on the screen."""
    chart = json.loads(tab.locator(f"#{key}-data").inner_text())
    return point_on(tab.locator(f"#{key}-live .gr-canvas").bounding_box(), chart, x, y)


def point_on(box: dict[str, float], chart: dict[str, Any], x: float, y: float) -> tuple[float, float]:
    """Where a point of a chart of one panel is on the canvas at ``box``; margins and limits are those of plot.js."""
    (panel,) = chart["panels"]
    heights = np.concatenate([np.frombuffer(b64decode(line["y"]["f4"]), "<f4") for line in panel["lines"]])
    low = float(np.nanmin(heights))
    high = float(np.nanmax(heights))
    room = 0.06 * (high - low)
    width = box["width"] - LEFT - RIGHT
    height = box["height"] - TOP - BOTTOM
    across = (x - panel["x_range"][0]) / (panel["x_range"][1] - panel["x_range"][0])
    up = (y - low + room) / (high - low + 2.0 * room)
    return box["x"] + LEFT + across * width, box["y"] + TOP + (1.0 - up) * height
