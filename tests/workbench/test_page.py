"""The page in a real browser: a run is read and zoomed, variants compared, with no error and no foreign request."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.workbench import widgets
from tests.browser import BROWSER, MARKS
from tests.workbench.jobs import make_job
from tests.workbench.test_results import model

pytest.importorskip("starlette")
uvicorn = pytest.importorskip("uvicorn")
playwright = pytest.importorskip("playwright.sync_api")
pytestmark = MARKS

POLICY = "default-src 'self'; base-uri 'none'; object-src 'none'; img-src 'self' data:"


def application(root: Path) -> Any:
    """The routes of results, and of what else the page asks for the least that it does with."""
    from types import SimpleNamespace

    from starlette.applications import Starlette
    from starlette.responses import FileResponse, JSONResponse, Response
    from starlette.routing import Mount, Route, WebSocketRoute
    from starlette.staticfiles import StaticFiles

    from gearrattle.workbench.routes.results import ROUTES

    static = widgets.FOLDER.parent

    def jobs(_: Any) -> Any:
        folders = sorted((root / ".gearrattle" / "jobs").iterdir())
        return JSONResponse([json.loads((folder / "job.json").read_text()) for folder in folders])

    async def events(socket: Any) -> None:
        await socket.accept()
        await socket.receive()

    made = Starlette(
        routes=[
            Route("/", lambda _: FileResponse(static / "page.html", headers={"content-security-policy": POLICY})),
            Route("/api/jobs", jobs),
            Route("/api/files", lambda _: JSONResponse([])),
            Route("/static/editor.css", lambda _: Response("", media_type="text/css")),
            WebSocketRoute("/api/events", events),
            *ROUTES,
            Mount("/static", StaticFiles(directory=static)),
        ]
    )
    made.state.folder = SimpleNamespace(root=root)
    return made


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    root = tmp_path_factory.mktemp("page")
    states = {"state": "done", "created": "2026-01-01T10:00:00Z", "started": "2026-01-01T10:00:00Z"}
    make_job(root, "first", gr.run(model()), model(), name="wide", **states)
    narrow = model().with_({"mesh.gear.backlash": "0.05 mm"})
    make_job(root, "second", gr.run(narrow), narrow, name="narrow", parent="first", **states)
    server = uvicorn.Server(uvicorn.Config(application(root), port=0, log_level="error"))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    for _ in range(200):
        if server.started:
            break
        time.sleep(0.05)
    yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    server.should_exit = True
    thread.join(5)


@pytest.fixture
def tab(address: str) -> Iterator[Any]:
    """A tab that fails the test for an error on its console or a request that leaves the machine."""
    wrong: list[str] = []
    with playwright.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        opened = browser.new_page(viewport={"width": 1280, "height": 800})
        opened.on("console", lambda line: wrong.append(line.text) if line.type == "error" else None)
        opened.on("pageerror", lambda error: wrong.append(str(error)))
        opened.on("request", lambda sent: None if sent.url.startswith(address) else wrong.append(sent.url))
        yield opened
        browser.close()
    assert wrong == []


def test_a_run_is_read_and_zoomed_to_one_impact(tab: Any, address: str) -> None:
    tab.goto(f"{address}/#/runs/first")
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
    for name in ("Phase plane", "Spectra", "Impacts", "Mode shapes", "Criteria"):
        tab.get_by_role("tab", name=name, exact=True).click()
        tab.wait_for_selector(".gr-tabpanel :is(canvas, svg, table)")


def test_tabs_are_walked_by_keys(tab: Any, address: str) -> None:
    tab.goto(f"{address}/#/runs/first")
    tab.get_by_role("tab", name="Verdict").focus()
    tab.keyboard.press("ArrowRight")
    playwright.expect(tab.get_by_role("tab", name="Histories")).to_have_attribute("aria-selected", "true")


def test_variants_stand_side_by_side(tab: Any, address: str) -> None:
    tab.goto(f"{address}/#/compare?jobs=first,second")
    tab.wait_for_selector("text=mesh.gear.backlash")
    tab.wait_for_selector("section canvas")
    assert tab.locator("table .best").count() > 3
