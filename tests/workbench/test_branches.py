"""Branches of periodic motions: the motion of a point over HTTP, in a notebook, and under the pointer."""

from __future__ import annotations

import re
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.orbits import Branch
from gearrattle.workbench.jobs.tasks import carry_out
from gearrattle.workbench.kept_results import MOTIONS, PARTIAL, partial_view
from gearrattle.workbench.notebook_widget import Answers
from tests.browser import MARKS
from tests.orbits.test_branch import over_frequency
from tests.report.examples import result
from tests.report.live_page import point_on
from tests.studies import oscillator
from tests.workbench.jobs import client, make_job
from tests.workbench.page import boxes_of, opened_page, violations
from tests.workbench.server import Server

pytestmark = pytest.mark.slow

pytest.importorskip("starlette")
browser = [pytest.param((), marks=MARKS)]


@pytest.fixture(scope="module")
def root(finished: Path) -> Path:
    return finished


@pytest.fixture(scope="module")
def motions(root: Path) -> dict[str, Any]:
    known: dict[str, Any] = client(root).get("/api/jobs/branches/motions").json()
    return known


def test_motions_are_those_of_the_branch(motions: dict[str, Any]) -> None:
    branch = over_frequency()
    assert motions["path"] == branch.path
    clearance = motions["clearances"][0]
    curves = np.frombuffer(b64decode(clearance["curves"]), dtype="<i2").reshape(-1, 2)
    low, high = clearance["x_range"]
    whole = low + (curves[:, 0] + 32767.0) / 65534.0 * (high - low)
    deflection = np.split(whole, np.cumsum(clearance["counts"])[:-1])
    for entry, curve in zip(motions["points"], deflection, strict=True):
        data = branch.data.isel(point=entry["point"])
        assert entry["value"] == float(data["value"])
        assert entry["stable"] == bool(data["stable"])
        assert curve.max() == pytest.approx(float(data["highest"][0]), abs=5e-3)
        assert curve.min() == pytest.approx(float(data["lowest"][0]), abs=5e-3)


def test_the_model_of_a_motion_starts_in_it(root: Path, motions: dict[str, Any]) -> None:
    """Simulated, it repeats at once: no cycle is left out, and the extremes are those of the branch."""
    stable = [entry for entry in motions["points"] if entry["stable"]]
    for entry in (stable[0], stable[len(stable) // 2], stable[-1]):
        text = client(root).get(f"/api/jobs/branches/motions/{entry['point']}/model.toml").text
        run = gr.simulate(gr.loads(text), cycles=4, discard=0, samples_per_cycle=512)
        data = over_frequency().data.isel(point=entry["point"])
        assert float(run.data["deflection"].max()) == pytest.approx(float(data["highest"][0]), abs=1e-3)
        assert float(run.data["deflection"].min()) == pytest.approx(float(data["lowest"][0]), abs=1e-3)


@pytest.mark.parametrize(
    "path", ["modes/motions", "branches/motions/100000/model.toml", "branches/motions/-1/model.toml"]
)
def test_what_has_no_motion_is_a_problem_in_words(root: Path, path: str) -> None:
    answer = client(root).get(f"/api/jobs/{path}")
    assert answer.status_code == 404


def test_branches_without_a_clearance_have_none(tmp_path: Path) -> None:
    linear = gr.loads(
        'schema = 1\nunits = "dimensionless"\n[[inertia]]\nname = "body"\nJ = 1.0\n[[coupling]]\nname = "spring"\n'
        'between = ["body", "ground"]\nstiffness = 1.0\ndamping = 0.1\n[excitation]\nspeed = 0.5\n'
        '[[torque]]\non = "body"\nharmonics = [{ order = 1, amplitude = 1.0 }]\n'
    )
    branch = gr.continuation(linear, "excitation.speed", (0.5, 0.6))
    folder = make_job(tmp_path, "linear", branch, linear, task="continuation")
    assert (folder / MOTIONS).is_file()
    page = client(tmp_path)
    assert page.get("/api/jobs/linear/motions").json() is None
    assert page.get("/api/jobs/linear/motions/0/model.toml").status_code == 404


def test_a_notebook_is_answered_the_same(motions: dict[str, Any]) -> None:
    content, _ = Answers(over_frequency()).answer({"ask": "motions"})
    assert content["motions"] == motions
    assert Answers(result("modes")).answer({"ask": "motions"})[0]["problems"]


@pytest.fixture
def server(finished_server: Server) -> Server:
    return finished_server


def _pixel(tab: Any, chart: dict[str, Any], value: float, level: float) -> tuple[float, float]:
    """Where a point of the one panel of the first figure is on the screen."""
    (box,) = boxes_of(tab.locator(".gr-beside .gr-canvas").first)
    return point_on(box, chart, value, level)


@pytest.mark.parametrize("_marks", browser)
def test_the_motion_under_the_pointer_is_shown_kept_and_run(
    _marks: tuple[()], server: Server, motions: dict[str, Any]
) -> None:
    playwright = pytest.importorskip("playwright.sync_api")
    points, value = motions["points"], motions["value"]
    unstable = [k for k, entry in enumerate(points) if not entry["stable"]]
    chosen = unstable[len(unstable) // 2]
    chart = server.client.get("/api/jobs/branches/figures/extremes.json").json()
    with opened_page(server) as tab:
        tab.goto(f"{server.address}/#/runs/branches")
        words = tab.locator(".gr-motion-words")
        playwright.expect(words).to_have_text(points[0]["words"])
        (low, _) = motions["levels"]["extremes"][0]
        tab.mouse.move(*_pixel(tab, chart, value[chosen], low[chosen]))
        playwright.expect(words).to_contain_text(": unstable")
        shown = re.match(r"frequency = ([\d.]+): unstable", words.inner_text())
        assert shown is not None
        assert float(shown[1]) == pytest.approx(value[chosen], abs=0.02)
        tab.mouse.move(5, 5)
        playwright.expect(words).to_have_text(points[0]["words"])
        tab.mouse.click(*_pixel(tab, chart, value[chosen], low[chosen]))
        tab.mouse.move(5, 5)
        playwright.expect(words).to_contain_text(": unstable")
        keys = tab.locator(".gr-legend").first.locator("canvas")
        pictures = keys.evaluate_all("all => all.map((one) => one.toDataURL())")
        assert len(set(pictures)) == len(pictures) > 3  # stable, unstable, and kinds of events
        tab.locator(".gr-motion input").fill("3")
        playwright.expect(words).to_have_text(points[3]["words"])
        tab.locator(".gr-beside .gr-canvas").first.focus()
        tab.keyboard.press("ArrowRight")
        playwright.expect(words).to_have_text(points[4]["words"])
        tab.keyboard.press("Enter")
        assert violations(tab) == []
        tab.get_by_role("button", name="Edit its model").click()
        playwright.expect(tab.locator(".toml-area")).to_have_value(re.compile(rf"frequency = {points[4]['value']}"))
        tab.go_back()
        tab.locator(".gr-motion input").fill("4")
        tab.get_by_role("button", name="Run this motion").click()
        tab.wait_for_selector(".gr-headline")
        job = tab.url.rpartition("/runs/")[2].partition("/")[0]
    assert server.state(job)["parent"] == "branches"
    text = server.client.get(f"/api/jobs/{job}/model.toml").text
    assert gr.loads(text).excitation.omega == pytest.approx(points[4]["value"])


@pytest.mark.parametrize("_marks", browser)
def test_motions_are_followed_over_a_value(_marks: tuple[()], server: Server) -> None:
    """From the page of studies to the motion at an end of the branch."""
    playwright = pytest.importorskip("playwright.sync_api")
    with opened_page(server) as tab:
        tab.goto(f"{server.address}/#/studies")
        tab.get_by_label("Model of").select_option("branches")
        tab.get_by_label("Vary").select_option("excitation.frequency")
        for label, value in (("from", "0.4"), ("to", "0.5")):
            tab.get_by_label(label, exact=True).fill(value)
            tab.get_by_label(label, exact=True).press("Enter")
        tab.get_by_role("button", name="Follow periodic motions").click()
        words = tab.locator(".gr-motion-words")
        playwright.expect(words).to_contain_text("frequency = 0.4: stable", timeout=120_000)
        job = tab.url.rpartition("/runs/")[2].partition("/")[0]
    state = server.state(job)
    assert (state["task"], state["options"]["path"]) == ("continuation", "excitation.frequency")


def test_branches_are_told_as_they_grow() -> None:
    """Every time a step further, up to the branches that are returned; points stay what they were."""
    known: list[Branch] = []
    model, path, ends = over_frequency().model, "excitation.frequency", (0.4, 0.5)
    branch = gr.continuation(model, path, ends, so_far=known.append)
    sizes = [len(one.points) for one in known]
    assert sizes[0] == 2
    assert sizes == sorted(sizes)
    assert sizes[-1] == len(branch.points)
    for one in known:
        assert one.points == branch.points[: len(one.points)]


@pytest.mark.parametrize(("ends", "isolated"), [((3.6, 6.3), False), ((5.9, 6.3), True)])
def test_every_branch_is_told_from_its_first_points_on(ends: tuple[float, float], isolated: bool) -> None:
    known: list[Branch] = []
    branch = gr.continuation(
        oscillator.model(), oscillator.AMPLITUDE, ends, start="linear", isolated=isolated, so_far=known.append
    )
    assert len(branch.curves) > 1
    assert known[-1].points == branch.points
    for number, curve in enumerate(branch.curves):
        sizes = [len(one.curves[number].points) for one in known if len(one.curves) > number]
        assert sizes[0] <= 3
        assert sizes == sorted(sizes)
        assert len(set(sizes)) > len(curve.points) / 2


def test_a_branch_is_seen_while_it_grows(tmp_path: Path) -> None:
    model = over_frequency().model
    options = {"path": "excitation.frequency", "range": [0.4, 0.5]}
    seen: list[int] = []

    def look(share: float) -> None:
        del share
        partial = partial_view(tmp_path)
        if partial is not None:
            (panel,) = partial["charts"]["extremes"]["panels"]
            lines = [line for line in panel["lines"] if line["mark"] == "line"]
            seen.append(max(line["x"]["shape"][0] for line in lines))

    carry_out("continuation", model, options, (tmp_path, tmp_path / PARTIAL), look)
    assert seen
    assert seen == sorted(seen)


@pytest.mark.parametrize("_marks", browser)
def test_what_is_followed_is_on_the_screen(_marks: tuple[()], server: Server) -> None:
    """Of a job that a killed server left half done: as while it runs."""
    playwright = pytest.importorskip("playwright.sync_api")
    with opened_page(server) as tab:
        tab.goto(f"{server.address}/#/runs/half")
        region = tab.get_by_role("region", name="Computed so far")
        playwright.expect(region.locator("canvas").first).to_be_visible(timeout=60_000)
        playwright.expect(region.locator(".gr-legend").first).to_contain_text("stable")
