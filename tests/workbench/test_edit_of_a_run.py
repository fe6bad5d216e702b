"""*Edit* of a run in a real browser: the model comes back to its file, and a newer file is not lost."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.browser import MARKS
from tests.workbench.page import fill, opened_page, selected, text_of
from tests.workbench.server import MODEL, Server

pytest.importorskip("uvicorn")
playwright = pytest.importorskip("playwright.sync_api")
pytestmark = MARKS
expect = playwright.expect


@pytest.fixture
def server(empty_server: Server) -> Server:
    return empty_server


@pytest.fixture
def tab(server: Server) -> Iterator[Any]:
    with opened_page(server) as opened:
        opened.wait_for_selector(".ed-start")
        yield opened


def run_of(server: Server, file: str) -> str:
    """Put a model into the folder and run it; return the job."""
    assert server.client.put(f"/api/files/{file}", content=MODEL).is_success
    job: str = server.job(file=file, name=file)["id"]
    assert server.ended(job)["state"] == "done"
    return job


def edited(tab: Any, server: Server, job: str) -> None:
    """Open the model of a run from its page."""
    tab.goto(f"{server.address}/#/runs/{job}")
    tab.get_by_role("link", name="Edit", exact=True).last.click()
    tab.wait_for_selector(".gr-node")


def test_a_run_is_edited_in_its_file(tab: Any, server: Server) -> None:
    job = run_of(server, "of_a_run.toml")
    edited(tab, server, job)
    expect(tab.locator(".ed-file")).to_contain_text("of_a_run.toml")
    expect(tab.get_by_title("not saved")).to_have_count(0)
    selected(tab, "coupling.0")
    fill(tab, "stiffness", "410")
    expect(tab.get_by_title("not saved")).to_have_count(1)
    tab.keyboard.press("Control+s")
    expect(tab.locator(".ed-note")).to_contain_text("Saved of_a_run.toml")
    assert server.client.get("/api/files/of_a_run.toml").text == text_of(tab)
    fill(tab, "stiffness", "420")
    tab.wait_for_function("() => JSON.parse(localStorage.getItem('gearrattle.draft')).text.includes('420')")
    tab.reload()
    tab.wait_for_selector(".gr-node")
    assert "420" in text_of(tab)  # what was edited, not the run again
    expect(tab.locator(".ed-file")).to_contain_text("of_a_run.toml")
    tab.get_by_role("button", name="Run", exact=True).click()
    tab.wait_for_url("**/#/runs/*")
    again = server.state(tab.url.rpartition("/")[2])
    assert (again["file"], again["parent"]) == ("of_a_run.toml", job)
    server.ended(again["id"])


def test_a_file_that_holds_something_else_is_not_replaced_unasked(tab: Any, server: Server) -> None:
    job = run_of(server, "newer.toml")
    newer = MODEL.replace("400.0", "405.0")
    server.client.put("/api/files/newer.toml", content=newer)
    edited(tab, server, job)
    expect(tab.locator(".ed-note")).to_contain_text("newer.toml holds other values")
    tab.keyboard.press("Control+s")
    question = tab.get_by_role("dialog")
    expect(question).to_contain_text("newer.toml exists already")
    question.get_by_role("button", name="Cancel").click()
    assert server.client.get("/api/files/newer.toml").text == newer
