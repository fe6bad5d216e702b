"""No page asks for what is not there: results of every kind, alone and beside each other, with every part opened."""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import Any

import pytest

from tests.browser import MARKS
from tests.workbench.jobs import KINDS
from tests.workbench.page import opened_page
from tests.workbench.server import Server

pytest.importorskip("uvicorn")
playwright = pytest.importorskip("playwright.sync_api")
pytestmark = MARKS

QUIET = 300  # ms: what a page asks for, it asks for at once


@pytest.fixture
def server(finished_server: Server) -> Server:
    return finished_server


def test_every_task_is_here() -> None:
    from gearrattle.workbench.jobs.tasks import TASKS

    assert set(KINDS) == set(TASKS)


def test_every_part_of_a_result_is_there(server: Server) -> None:
    with opened_page(server) as tab:
        refused = _refused(tab)
        for task in KINDS:
            tab.goto("about:blank")
            tab.goto(f"{server.address}/#/runs/{task}")
            tab.wait_for_selector(".gr-tabpanel > *")
            tabs = tab.get_by_role("tab")
            for k in range(tabs.count()):
                tabs.nth(k).click()
                tab.wait_for_load_state("networkidle")
        assert refused == []


@pytest.mark.parametrize(
    "pairs", [[*pairwise(KINDS)], pytest.param([*combinations(KINDS, 2)], marks=pytest.mark.long)], ids=["some", "all"]
)
def test_pairs_are_compared(server: Server, pairs: list[tuple[str, str]]) -> None:
    with opened_page(server) as tab:
        refused = _refused(tab)
        for pair in pairs:
            with tab.expect_response("**/api/compare?*"):
                tab.goto(f"{server.address}/#/compare?jobs={','.join(pair)}")
            _figures_of(tab, pair, server)
        assert refused == []


def _figures_of(tab: Any, pair: tuple[str, ...], server: Server) -> None:
    """Choose every figure that is laid over, and wait until it is drawn."""
    figures = server.client.get(f"/api/compare?jobs={','.join(pair)}").json()["figures"]
    offered = [key for key in ("phase_plane", "spectrum", "impacts") if any(key in keys for keys in figures)]
    tab.wait_for_function(
        "(names) => names.every((name) => document.querySelector('thead')?.textContent.includes(name))", arg=list(pair)
    )
    for key in offered:
        tab.get_by_label("Figure").select_option(key)
        tab.wait_for_selector("section canvas")


@pytest.mark.parametrize(
    ("page", "sign"), [("edit?job={}", ".gr-node"), ("measured?job={}", "option"), ("studies?job={}", "option")]
)
@pytest.mark.parametrize(
    "kinds", [("run", "study", "continuation"), pytest.param([*KINDS], marks=pytest.mark.long)], ids=["some", "all"]
)
def test_every_page_of_a_job_is_there(server: Server, page: str, sign: str, kinds: list[str]) -> None:
    with opened_page(server) as tab:
        refused = _refused(tab)
        for task in kinds:
            tab.goto("about:blank")
            tab.goto(f"{server.address}/#/{page.format(task)}")
            tab.wait_for_selector(f"main {sign}", state="attached")
            tab.wait_for_timeout(QUIET)
        assert refused == []


def _refused(tab: Any) -> list[str]:
    """A list of the requests that are answered by 4xx or 5xx, from now on."""
    refused: list[str] = []
    tab.on("response", lambda answer: refused.append(f"{answer.status} {answer.url}") if answer.status >= 400 else None)
    return refused
