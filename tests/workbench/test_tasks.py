"""A day's work on a gearbox, by clicks and keys: from nothing to what is handed over."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from tests.architecture.places import EXAMPLES
from tests.browser import MARKS
from tests.workbench.page import boxes_of, fill, name_it, opened_page, selected, text_of, waits
from tests.workbench.server import Server, serving

pytest.importorskip("uvicorn")
playwright = pytest.importorskip("playwright.sync_api")
pytestmark = MARKS
expect = playwright.expect

SHAFT = (("inertia", "flywheel"), ("damper", "hub"), ("spline", "input_shaft"))
GEARS = tuple(f"gear_{number}" for number in range(1, 8))
SHORT = "cycles = 40\ndiscard = 20"
FREE = "coupling.damper.stiffness"
TRUE = 1250.0  # N m/rad, of the rig
ROUGH = 1500.0


@pytest.fixture
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with serving(tmp_path_factory.mktemp("workspace")) as running:  # of its own: files and runs keep their names
        yield running


@pytest.fixture
def tab(server: Server) -> Iterator[Any]:
    with opened_page(server) as opened:
        opened.wait_for_selector(".ed-start")
        yield opened


def attached(tab: Any, body: int, component: str, names: tuple[str, str], number: int) -> None:
    """Join a new inertia, the ``number``-th, to one by a coupling or a mesh, and name element and inertia."""
    element, name = names
    selected(tab, f"inertia.{body}")
    tab.keyboard.press("n")
    tab.get_by_role("dialog").get_by_role("button", name=component.capitalize(), exact=True).click()
    name_it(tab, component, element)
    selected(tab, f"inertia.{number}")
    tab.keyboard.press("F2")
    name_it(tab, "inertia", name)


def built(tab: Any, gears: Sequence[str]) -> gr.Model:
    """Draw a flywheel, a hub and an input shaft with loose gears, and set what matters."""
    area = tab.locator(".toml-area")
    area.fill(
        text_of(tab).replace("New driveline", f"{len(gears)} loose gears").replace("cycles = 100\ndiscard = 50", SHORT)
    )
    tab.get_by_role("button", name="Add an inertia").click()
    name_it(tab, "inertia", "flywheel")
    fill(tab, "J *", "0.2 kg*m^2")
    for number, (element, body) in enumerate(SHAFT[1:], 1):
        attached(tab, number - 1, "coupling", (element, body), number)
    for number, gear in enumerate(gears, 3):
        attached(tab, 2, "mesh", (f"mesh_{gear}", gear), number)
    selected(tab, "coupling.0")
    fill(tab, "stiffness", "1500 N*m/rad")
    selected(tab, "mesh.0")
    fill(tab, "backlash", "0.12 mm")
    selected(tab, "inertia.0")
    tab.get_by_role("toolbar", name="Add").get_by_role("button", name="Torque", exact=True).click()
    waits(tab, "text.includes('[[torque]]')")
    expect(tab.locator(".ed-state.ready")).to_be_visible()
    return gr.loads(text_of(tab))


def run_id(tab: Any) -> str:
    tab.wait_for_url("**/#/runs/*")
    return str(tab.url.partition("#/runs/")[2].partition("/")[0])


def done(tab: Any, server: Server) -> str:
    """Wait for the run that the page shows, and for its result there."""
    job = run_id(tab)
    assert server.ended(job)["state"] == "done"
    tab.wait_for_selector(".gr-tabpanel :is(table, canvas, svg)", timeout=60_000)
    return job


def rig(model: gr.Model, path: Path) -> None:
    """Write what a rig would have measured of the driveline with its true damper."""
    run = gr.simulate(model.with_({FREE: TRUE}), cycles=60, discard=30)
    time, speed = run.trajectory.time[-12_000:], run.data["velocity"].sel(inertia="hub").values[-12_000:]
    noise = 0.01 * speed.std() * np.random.default_rng(1).normal(size=speed.size)
    rows = "\n".join(f"{t:.12g},{v:.7g}" for t, v in zip(time - time[0], speed + noise, strict=True))
    path.write_text(f"time [s],hub [rad/s]\n{rows}\n", encoding="utf-8")


def test_a_map_fills_while_it_is_computed_and_a_click_opens_its_case(tab: Any, server: Server) -> None:
    model = gr.example("case3").with_({"simulation.cycles": 2000, "simulation.discard": 20})
    values = [float(value) for value in np.linspace(0.5, 2.0, 12)]
    axes = {
        "mesh.gear.backlash": [f"{0.1 * value:.4g} mm" for value in values],
        "coupling.clutch.stiffness": [1500.0 * value for value in values],
    }
    job = server.job(task="study", text=model.to_toml(), options={"axes": axes}, name="map")["id"]
    tab.goto(f"{server.address}/#/runs/{job}")
    so_far = tab.locator("section[aria-label='Computed so far']")
    maps = so_far.get_by_role("tab", name="Map of").first
    maps.click(timeout=120_000)
    drawn = so_far.locator(".gr-tabpanel canvas").first
    expect(drawn).to_be_visible()
    assert server.state(job)["state"] == "running"
    (box,) = boxes_of(drawn)
    drawn.click(position={"x": 0.5 * box["width"], "y": 0.5 * box["height"]})
    tab.wait_for_url(f"**/#/studies?job={job}*")
    expect(tab.get_by_role("heading", name="The case of the map")).to_be_visible()
    expect(tab.get_by_role("button", name="Run this case")).to_be_visible()
    server.client.post(f"/api/jobs/{job}/cancel")
    assert server.ended(job)["state"] == "cancelled"
    tab.goto(f"{server.address}/#/runs/{job}")
    expect(maps).to_be_visible()  # what was computed stays
    partial = server.client.get(f"/api/jobs/{job}/partial").json()
    assert partial["view"]["kind"] == "study"
    assert server.client.get("/api/jobs/none/partial").status_code == 404


def test_idle_conditions_become_a_map_whose_cells_open(tab: Any, server: Server) -> None:
    """Oil temperature and speed are offered, a third value is the load; the case of a cell has its three values."""
    model = gr.load(EXAMPLES / "idle_rattle_oil.toml").with_({"simulation.cycles": 8, "simulation.discard": 4})
    server.ended(server.job(task="modes", text=model.to_toml(), name="idle")["id"])
    tab.goto(f"{server.address}/#/studies")
    tab.get_by_label("Model of").select_option(label="idle")
    tab.get_by_label("Kind of study").select_option("conditions")
    temperature = tab.get_by_role("group", name="temperature: oil temperature")
    speed = tab.get_by_role("group", name="speed: ")
    for axis, ends in ((temperature, (0, 80)), (speed, (750, 850))):
        for name, value in zip(("from", "to", "values"), (*ends, 2), strict=True):
            axis.get_by_label(name).first.fill(str(value))
            axis.get_by_label(name).first.press("Tab")
    tab.get_by_label("Vary").select_option("torque.0.harmonics.0.amplitude")
    load = tab.get_by_role("group", name="load: ")
    load.get_by_label("values").fill("2")
    load.get_by_label("values").press("Tab")
    tab.get_by_role("button", name="How long?").click()
    expect(tab.get_by_role("status")).to_contain_text("8 cases", timeout=60_000)
    tab.get_by_role("button", name="Run 8 cases").click()
    job = done(tab, server)
    said = server.state(job)
    assert said["task"] == "conditions"
    assert said["options"]["temperature"] == {"path": "oil.temperature", "values": [0, 80]}
    assert "Of 8 conditions" in said["sentence"]
    # a cell of the second panel: the higher speed and the lower temperature
    drawn = tab.locator(".gr-tabpanel canvas").nth(1)
    (box,) = boxes_of(drawn)
    drawn.click(position={"x": 0.8 * box["width"], "y": 0.6 * box["height"]})
    tab.wait_for_url(f"**/#/studies?job={job}*")
    shown = tab.locator(".slider .path").all_inner_texts()
    assert [text.split(" ")[0] for text in shown[:2]] == ["excitation.speed", "oil.temperature"]
    assert "850" in shown[0]
    assert "0" in shown[1].split()
    assert len(shown) == 3
    report = server.client.get(f"/api/jobs/{job}/report.html").text
    assert 'id="conditions-data"' in report


@pytest.mark.parametrize(
    "gears", [GEARS[:2], pytest.param(GEARS, marks=pytest.mark.long)], ids=["five bodies", "ten bodies"]
)
def test_a_days_work_on_a_gearbox(tab: Any, server: Server, tmp_path: Path, gears: tuple[str, ...]) -> None:
    # From nothing to a verdict.
    model = built(tab, gears)
    assert [body.name for body in model.inertias] == [name for _, name in SHAFT] + list(gears)
    assert len(model.elements) == 2 + len(gears)
    assert model.simulation.cycles == 40
    tab.get_by_role("button", name="Run", exact=True).click()
    first = done(tab, server)
    expect(tab.locator(".gr-headline")).to_be_visible()

    # The measured over the simulated.
    rig(model, tmp_path / "rig.csv")
    tab.get_by_role("link", name="Lay measured over").click()
    tab.get_by_label("Measured file to import").set_input_files(tmp_path / "rig.csv")
    expect(tab.get_by_role("combobox", name="Measured file")).to_have_value("rig.csv")
    tab.get_by_label("Simulated channel").select_option("velocity.hub")
    tab.get_by_role("button", name="Align").click()
    expect(tab.get_by_label("Shift of the measured time")).not_to_have_value("0")
    tab.wait_for_selector("section[aria-label=Histories] canvas")
    spectra = tab.locator("section[aria-label=Spectra]")
    expect(spectra.locator("canvas").first).to_be_visible()
    tab.get_by_label("over orders").check()
    expect(spectra.locator("canvas").first).to_be_visible()

    # One value fitted to the recorded motion.
    measured = tab.url
    form = tab.locator("section[aria-label=Fit]")
    expect(form.get_by_label("Fit to")).to_have_value("motion")
    expect(form.get_by_label("Partner of hub")).to_have_value("velocity.hub")
    expect(form.get_by_role("button", name="Fit 0 values")).to_be_disabled()
    form.get_by_label("Cycles of each simulation").fill("30")
    form.get_by_label("Left out at its start").fill("20")
    form.get_by_label("Free a value").select_option(FREE)
    form.get_by_role("button", name="Fit 1 value").click()
    fit = done(tab, server)
    answer = tab.locator(".gr-tabpanel")
    expect(answer).to_contain_text("the data determine every parameter")
    expect(answer).to_contain_text("hub: order 2")
    (change,) = server.client.get(f"/api/jobs/{fit}/view").json()["changes"]
    assert change["values"] == {FREE: pytest.approx(TRUE, rel=0.01)}

    # The same value fitted to a measured natural frequency.
    tab.goto(measured)
    frequency = gr.modes(model.with_({FREE: TRUE})).frequencies[1] / (2.0 * np.pi)
    form.get_by_label("Fit to").select_option("modes")
    form.get_by_label("Free a value").select_option(FREE)
    form.get_by_label("Frequency", exact=True).fill(f"{frequency:.5g} Hz")
    form.get_by_label("Standard error").fill("0.2 Hz")
    form.get_by_role("button", name="Fit 1 value").click()
    fit = done(tab, server)
    expect(tab.locator(".gr-tabpanel")).to_contain_text("the data determine every parameter")
    (change,) = server.client.get(f"/api/jobs/{fit}/view").json()["changes"]
    assert change["values"] == {FREE: pytest.approx(TRUE, rel=1e-3)}
    tab.get_by_role("button", name="Run with the fitted values").click()
    tab.wait_for_url(lambda url: fit not in url)
    second = done(tab, server)
    expect(tab.locator(".gr-headline")).to_be_visible()
    assert server.state(second)["name"].startswith("stiffness of coupling damper ")

    # Variants side by side; the better one is kept under a name.
    tab.get_by_role("navigation", name="Workbench").get_by_role("link", name="Compare").click()
    for job in (first, second):
        name = server.state(job)["name"]
        tab.get_by_label("Runs to compare").get_by_label(name, exact=True).check()
    expect(tab.get_by_role("rowheader", name=FREE)).to_be_visible()
    expect(tab.get_by_text("1 value differs in the models.")).to_be_visible()
    tab.once("dialog", lambda dialog: dialog.accept("damper as measured"))
    tab.get_by_role("button", name="Keep").last.click()
    expect(tab.get_by_label("Runs to compare").get_by_text("damper as measured")).to_be_visible()
    assert server.state(second)["name"] == "damper as measured"

    # What is handed over.
    tab.goto(f"{server.address}/#/runs/{second}")
    tab.wait_for_selector(".gr-headline")
    contents = {}
    for words in ("Everything", "Report page", "Model file", "Python script"):
        tab.get_by_text("Hand over").click()
        with tab.expect_download() as download:
            tab.get_by_role("link", name=words).click()
        contents[words] = Path(download.value.path()).read_bytes()
        tab.get_by_text("Hand over").click()
    handed = gr.loads(contents["Model file"].decode())
    assert {c.name: c.stiffness for c in handed.couplings}["damper"] == pytest.approx(TRUE, rel=1e-3)
    with zipfile.ZipFile(io.BytesIO(contents["Python script"])) as archive:
        compile(archive.read("script.py"), "script.py", "exec")
    assert contents["Report page"].startswith(b"<!doctype html>")
    with zipfile.ZipFile(io.BytesIO(contents["Everything"])) as archive:
        summary = json.loads(archive.read("result/summary.json"))
        assert server.state(second)["sentence"].endswith(summary["sentence"])
    tab.get_by_role("tab", name="Phase plane", exact=True).click()
    with tab.expect_download() as download:
        tab.get_by_role("link", name="PDF").first.click()
    assert Path(download.value.path()).read_bytes().startswith(b"%PDF")
