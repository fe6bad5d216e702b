"""Thresholds and remedies as jobs: they end with what is known, and are asked for on the page of a run."""

from __future__ import annotations

import threading
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.design.threshold import STOPPED
from gearrattle.workbench.jobs import worker
from gearrattle.workbench.kept_results import read_view
from gearrattle.workbench.script import script
from tests.browser import MARKS
from tests.workbench.page import cut_off, opened_page, violations
from tests.workbench.server import Server

PATH = "coupling.mesh.kinematic_error.0.amplitude"
RANGE = [0.02, 0.06]
THRESHOLD = {"path": PATH, "range": RANGE, "count": 7, "width": 1e-4}


def content(folder: Path, task: str, options: dict[str, Any]) -> dict[str, Any]:
    (folder / "inputs").mkdir(parents=True)
    (folder / "inputs" / "model.toml").write_text(gr.example("backlash_oscillator").to_toml(), encoding="utf-8")
    return {"folder": folder, "file": "", "task": task, "options": options}


def stopped_at(here: Any, share: float) -> None:
    """Ask for the end once so much is done."""
    while here.recv()[1] < share:
        pass
    here.send((worker._STOP, None))


@pytest.mark.parametrize(
    ("task", "options"),
    [("threshold", THRESHOLD), ("remedies", {"candidates": {PATH: {"factor": [0.4, 1.2]}}, "speeds": []})],
)
def test_a_job_that_is_stopped_keeps_what_is_known(
    task: str, options: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "_TOLD", 0.0)
    here, there = Pipe()
    threading.Thread(target=stopped_at, args=(here, 0.3), daemon=True).start()
    kind, sentence = worker._answer(there, "job", content(tmp_path / "job", task, options))
    assert kind == "done"
    view = read_view(tmp_path / "job")
    assert view["kind"] == task
    assert view["sentence"] == sentence
    assert STOPPED in view["notes"]


def test_a_threshold_of_a_job_is_that_of_the_function(tmp_path: Path) -> None:
    _, there = Pipe()
    kind, sentence = worker._answer(there, "job", content(tmp_path / "job", "threshold", {**THRESHOLD, "width": 0.01}))
    assert kind == "done"
    assert sentence == gr.threshold(gr.example("backlash_oscillator"), PATH, (0.02, 0.06), workers=1).sentence


def test_a_stop_that_comes_late_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "warm_up", lambda: None)
    here, there = Pipe()
    threading.Thread(target=worker._work, args=(there,), daemon=True).start()
    assert here.recv()[0] == "warm"
    here.send((worker._STOP, None))
    here.send(("nothing that is known", {}))
    kind, problems = here.recv()
    assert kind == "failed"
    assert "nothing that is known" in problems[0].rule
    here.close()


def test_the_script_of_a_threshold_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("model.toml").write_text(gr.example("backlash_oscillator").to_toml(), encoding="utf-8")
    factors = {"path": PATH, "range": [{"factor": 0.4}, {"factor": 1.2}], "count": 3, "width": 0.5, "workers": 1}
    source = script("threshold", factors, "how much", "1").partition("gr.figures")[0]
    names: dict[str, Any] = {}
    exec(compile(source, "script.py", "exec"), names)
    assert names["result"].variable.own == 1.0
    assert Path("result", "report.html").is_file()


@pytest.fixture
def server(empty_server: Server) -> Server:
    return empty_server


@pytest.mark.slow
def test_a_run_without_a_name_is_called_by_what_it_changes(server: Server) -> None:
    model = gr.example("manual_transmission").with_({"simulation.cycles": 5, "simulation.discard": 1})
    cold = model.with_({"inertia.*.drag_torque": gr.factor(3)})
    first = server.job(text=model.to_toml())
    assert first["name"] == model.name
    child = server.job(text=cold.to_toml(), parent=first["id"])
    assert child["name"] == "drag torque of 3 inertias x3"
    assert server.job(text=cold.to_toml(), parent=child["id"])["name"] == model.name
    assert server.job(text=cold.to_toml(), parent=first["id"], name="cold")["name"] == "cold"


@pytest.mark.slow
def test_the_first_cancel_of_a_threshold_stops_it_and_the_second_ends_it(server: Server) -> None:
    model = gr.example("backlash_oscillator").with_({"simulation.cycles": 20_000})
    job = server.job(task="threshold", text=model.to_toml(), options={"path": PATH, "range": RANGE})["id"]
    server.until(job, "running")
    asked = server.client.post(f"/api/jobs/{job}/cancel").json()
    if asked["state"] == "running":
        server.client.post(f"/api/jobs/{job}/cancel")
    assert server.ended(job)["state"] in ("cancelled", "done")


class TestPage:
    """What a user clicks."""

    pytestmark = MARKS

    def test_how_much_and_what_to_change_are_asked_on_a_run(self, server: Server) -> None:
        expect = pytest.importorskip("playwright.sync_api").expect
        model = gr.example("backlash_oscillator")
        run = server.ended(server.job(text=model.to_toml())["id"])["id"]
        with opened_page(server) as tab:
            tab.goto(f"{server.address}/#/runs/{run}")
            tab.get_by_role("button", name="How much?").click()
            form = tab.get_by_role("form", name="How much?")
            value = form.get_by_label("Value")
            expect(value).to_have_value("coupling.mesh.clearance")  # of the part that rattles
            value.select_option(PATH)
            for label, number in (("from", "0.02"), ("to", "0.06")):
                form.get_by_role("textbox", name=f"{label} ", exact=False).fill(number)
                form.get_by_role("textbox", name=f"{label} ", exact=False).press("Tab")
            assert cut_off(tab) == []
            assert violations(tab) == []
            form.get_by_role("button", name="Find how much").click()
            tab.wait_for_url(lambda url: run not in url)
            job = server.ended(tab.url.partition("#/runs/")[2].partition("/")[0])
            assert job["name"].startswith("how much: ")
            assert job["options"] == {"path": PATH, "range": [0.02, 0.06], "until": "quiet"}
            expect(tab.locator(".gr-tabpanel")).to_contain_text(job["sentence"])
            answer = job["id"]
            tab.get_by_role("button", name="Run with ").click()
            tab.wait_for_url(lambda url: answer not in url)
            quiet = server.ended(tab.url.partition("#/runs/")[2].partition("/")[0])
            assert quiet["parent"] == answer
            assert gr.loads(server.model_text(quiet["id"]))[PATH] == pytest.approx(0.04, rel=0.02)

            tab.goto(f"{server.address}/#/runs/{run}")
            tab.get_by_role("button", name="What to change?").click()
            form = tab.get_by_role("form", name="What to change?")
            form.get_by_label("target").select_option("half")
            form.get_by_label("pairs as well").uncheck()
            assert violations(tab) == []
            form.get_by_role("button", name="Search").click()
            tab.wait_for_url(lambda url: run not in url)
            job = server.state(tab.url.partition("#/runs/")[2].partition("/")[0])
            assert (job["task"], job["options"]) == ("remedies", {"target": "half", "pairs": False})
            server.client.post(f"/api/jobs/{job['id']}/cancel")
            server.ended(job["id"])

    def test_own_changes_are_searched_and_one_of_them_is_run(self, server: Server) -> None:
        model = gr.example("backlash_oscillator").with_({"simulation.cycles": 40, "simulation.discard": 20})
        run = server.ended(server.job(text=model.to_toml())["id"])["id"]
        with opened_page(server) as tab:
            tab.goto(f"{server.address}/#/runs/{run}")
            tab.get_by_role("button", name="What to change?").click()
            form = tab.get_by_role("form", name="What to change?")
            for path, low, high, cost in (("torque.0.mean", "0.05", "0.4", "2"), (PATH, "0.02", "0.06", "1")):
                form.get_by_label("Change to search").select_option(path)
                own = form.get_by_role("group").last
                own.get_by_label("from ").fill(low)
                own.get_by_label("to ", exact=False).last.fill(high)
                own.get_by_label("cost").fill(cost)
            assert violations(tab) == []
            form.get_by_role("button", name="Search").click()
            tab.wait_for_url(lambda url: run not in url)
            job = server.ended(tab.url.partition("#/runs/")[2].partition("/")[0])
            expected = {
                "torque.0.mean": {"from": 0.05, "to": 0.4, "cost": 2},
                PATH: {"from": 0.02, "to": 0.06, "cost": 1},
            }
            assert job["options"]["candidates"] == expected
            changes = server.client.get(f"/api/jobs/{job['id']}/view").json()["changes"]
            assert {path for change in changes for path in change["values"]} == set(expected)
            tab.get_by_role("combobox", name="Change").select_option(label=changes[-1]["words"])
            tab.get_by_role("button", name="Run with it").click()
            tab.wait_for_url(lambda url: job["id"] not in url)
            child = server.ended(tab.url.partition("#/runs/")[2].partition("/")[0])
            assert gr.loads(server.model_text(child["id"])) == model.with_(changes[-1]["values"])

    def test_values_that_vary_together_are_one_axis_and_its_cost_is_estimated(self, server: Server) -> None:
        model = gr.example("manual_transmission").with_({"simulation.cycles": 5, "simulation.discard": 1})
        run = server.ended(server.job(text=model.to_toml())["id"])["id"]
        backlashes = model.paths("mesh.*.backlash")
        with opened_page(server) as tab:
            tab.goto(f"{server.address}/#/studies")
            tab.get_by_label("Model of").select_option(run)
            tab.get_by_label("Vary").select_option(backlashes[0])
            tab.get_by_label("together with").select_option("inertia.*.drag_torque")
            tab.get_by_role("textbox", name="values").fill("3")
            tab.keyboard.press("Tab")
            assert cut_off(tab) == []
            assert violations(tab) == []
            tab.get_by_role("button", name="How long?").click()
            status = tab.get_by_role("status").filter(has_text="3 cases, about")
            status.wait_for()
            tab.get_by_role("button", name="Run 3 cases").click()
            tab.wait_for_url("**/#/runs/*")
            job = server.ended(tab.url.partition("#/runs/")[2].partition("/")[0])
            assert job["state"] == "done", job["problems"]
            ((name, members),) = job["options"]["axes"].items()
            assert " and " in name
            assert members["inertia.*.drag_torque"] == {"factor": [0.5, 1.25, 2]}
            assert len(members[backlashes[0]]) == 3
            tab.goto(f"{server.address}/#/studies?job={job['id']}&x=2&y=0")
            tab.get_by_role("button", name="Run this case").click()
            tab.wait_for_url("**/#/runs/*")
            case = server.ended(tab.url.partition("#/runs/")[2].partition("/")[0])
            changed = gr.loads(server.model_text(case["id"]))
            assert changed[backlashes[0]] == pytest.approx(2.0 * model[backlashes[0]])
            drag = model.paths("inertia.*.drag_torque")[0]
            assert changed[drag] == pytest.approx(2.0 * model[drag])

    def test_a_study_takes_factors_log_spacing_and_outputs_and_its_case_runs(self, server: Server) -> None:
        model = gr.example("manual_transmission").with_({"simulation.cycles": 5, "simulation.discard": 1})
        run = server.ended(server.job(text=model.to_toml())["id"])["id"]
        with opened_page(server) as tab:
            tab.goto(f"{server.address}/#/studies")
            tab.get_by_label("Model of").select_option(run)
            tab.get_by_label("Vary").select_option("inertia.*.drag_torque")
            tab.get_by_label("spacing").select_option("log")
            tab.get_by_role("textbox", name="values").fill("3")
            tab.keyboard.press("Tab")
            tab.get_by_label("largest impact energy").check()
            tab.get_by_label("regime", exact=True).uncheck()
            assert cut_off(tab) == []
            assert violations(tab) == []
            tab.get_by_role("button", name="Run 3 cases").click()
            tab.wait_for_url("**/#/runs/*")
            job = server.ended(tab.url.partition("#/runs/")[2].partition("/")[0])
            assert job["state"] == "done"
            assert job["options"]["axes"] == {"inertia.*.drag_torque": {"factor": [0.5, 1, 2]}}
            assert "largest impact energy" in job["options"]["outputs"]
            assert "regime" not in job["options"]["outputs"]
            tab.goto(f"{server.address}/#/studies?job={job['id']}&x=2&y=0")
            tab.get_by_role("button", name="Run this case").click()
            tab.wait_for_url("**/#/runs/*")
            case = server.state(tab.url.partition("#/runs/")[2].partition("/")[0])
            path = model.paths("inertia.*.drag_torque")[0]
            assert gr.loads(server.model_text(case["id"]))[path] == pytest.approx(2.0 * model[path])
