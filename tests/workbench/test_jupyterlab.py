"""``gr.view`` in JupyterLab, in a real browser: the widget of the workbench's page, over the notebook's kernel."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import gearrattle as gr
from tests.browser import BROWSER, MARKS
from tests.workbench.test_results import model

playwright = pytest.importorskip("playwright.sync_api")
LACKS = next((name for name in ("jupyterlab", "anywidget") if find_spec(name) is None), "")
pytestmark = [pytest.mark.long, pytest.mark.skipif(bool(LACKS), reason=f"needs {LACKS}"), *MARKS]

CELLS = ('import gearrattle as gr\nmodel = gr.load("model.toml")', "gr.view(gr.run(model))")
BRANCHES = (
    'import gearrattle as gr\nmodel = gr.example("rattle_oscillator")',
    'shown = gr.view(gr.continuation(model, "torque.0.harmonics.0.amplitude", (4.0, 7.0)))\nshown',
    "print(shown.chosen)",
)
PATIENCE = 300_000


def notebook(cells: tuple[str, ...]) -> str:
    """The text of a notebook whose cells have not been run."""
    code = [
        {"cell_type": "code", "id": f"c{i}", "metadata": {}, "execution_count": None, "outputs": [], "source": source}
        for i, source in enumerate(cells)
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return json.dumps({"cells": code, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5})


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[str]:
    """The address of a JupyterLab whose folder holds a model and a notebook; its settings are its own."""
    (tmp_path / "model.toml").write_text(model().to_toml(), encoding="utf-8")
    (tmp_path / "view.ipynb").write_text(notebook(CELLS), encoding="utf-8")
    (tmp_path / "branches.ipynb").write_text(notebook(BRANCHES), encoding="utf-8")
    places = {
        name: str(tmp_path / name.lower()) for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR")
    }
    command = [
        sys.executable,
        "-m",
        "jupyterlab",
        "--no-browser",
        "--allow-root",
        "--port=0",
        "--ServerApp.ip=127.0.0.1",
    ]
    log = tmp_path / "lab.log"
    with (
        log.open("w", encoding="utf-8") as written,
        subprocess.Popen(command, cwd=tmp_path, stderr=written, env={**os.environ, **places}) as process,
    ):
        try:
            yield address(log, process)
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(30)


def address(log: Path, process: subprocess.Popen[bytes]) -> str:
    """Wait for the address that JupyterLab writes when it has started."""
    while (match := re.search(r"http://127\.0\.0\.1:[1-9]\d*/lab\?token=\w+", log.read_text(encoding="utf-8"))) is None:
        assert process.poll() is None, log.read_text(encoding="utf-8")
        time.sleep(0.1)
    return match[0]


def run_cell(tab: Any, index: int) -> None:
    """Run a cell of a notebook until it has ended; JupyterLab may lose a request that comes just after the start."""
    cell = tab.locator(".jp-Cell").nth(index)
    prompt = cell.locator(".jp-InputPrompt")
    while not re.search(r"\d", prompt.inner_text()):
        cell.locator(".cm-content").click()
        tab.get_by_role("button", name="Run this cell and advance").click()
        tab.wait_for_timeout(5000)
        playwright.expect(prompt).not_to_have_text("[*]:")


@contextmanager
def opened(lab: str, name: str) -> Iterator[Any]:
    """Open a notebook; an error of the page fails the test."""
    errors: list[str] = []
    with playwright.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": 1280, "height": 800})
        tab.set_default_timeout(PATIENCE)
        playwright.expect.set_options(timeout=PATIENCE)
        tab.on("pageerror", lambda error: errors.append(str(error)))
        tab.goto(lab.replace("/lab?", f"/lab/tree/{name}?"))
        yield tab
        browser.close()
    assert errors == []


def test_a_run_is_read_and_zoomed_in_a_notebook(lab: str) -> None:
    with opened(lab, "view.ipynb") as tab:
        run_cell(tab, 0)
        run_cell(tab, 1)
        verdict = re.compile(gr.run(model()).verdict.verdict, re.IGNORECASE)
        playwright.expect(tab.locator(".gr-headline")).to_have_text(verdict)
        tab.get_by_role("tab", name="Histories").click()
        events = gr.simulate(model()).events
        count = int((events.to_region.abs() > events.from_region.abs()).sum())
        playwright.expect(tab.locator(".gr-state")).to_have_text(f"20 cycles, {count} impacts")
        tab.get_by_role("button", name="Hardest").click()
        playwright.expect(tab.locator(".gr-state")).to_contain_text("0.5 cycles")


def test_a_motion_of_branches_is_kept_in_a_notebook(lab: str) -> None:
    """Arrow keys move along the branches; what Enter keeps is known to Python."""
    with opened(lab, "branches.ipynb") as tab:
        run_cell(tab, 0)
        run_cell(tab, 1)
        words = tab.locator(".gr-motion-words")
        playwright.expect(words).to_contain_text("stable")
        first = words.inner_text()
        tab.locator(".gr-beside .gr-canvas").first.focus()
        for key in ("ArrowRight", "ArrowRight", "Enter"):
            tab.keyboard.press(key)
        playwright.expect(words).not_to_have_text(first)
        run_cell(tab, 2)
        playwright.expect(tab.locator(".jp-Cell").nth(2).locator(".jp-OutputArea")).to_contain_text("'point': 2")
