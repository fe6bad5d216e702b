"""What came out of a job, over HTTP: view, figures, histories, impacts, sound, and what is handed over."""

from __future__ import annotations

import io
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.report.plots.thinning import thin
from gearrattle.workbench.script import script
from tests.workbench.jobs import client, make_job, model

pytest.importorskip("starlette")


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("workspace")
    make_job(folder, "first", gr.run(model()), model(), name='Case "3"')
    narrow = model().with_({"mesh.gear.backlash": "0.05 mm"})
    make_job(folder, "second", gr.run(narrow), narrow, parent="first")
    make_job(folder, "modes", gr.modes(model()), model(), task="modes")
    rows = "\n".join(f"{k * 1e-3:g},{np.sin(k):g}" for k in range(2000))
    (folder / "rig.csv").write_text(f"time [s],speed [rad/s]\n{rows}\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def page(root: Path) -> Any:
    return client(root)


def arrays(content: bytes, of_part: int) -> list[list[Any]]:
    """What the page unpacks."""
    values = np.frombuffer(content, "<f8")
    lengths = values[1 : 1 + int(values[0])].astype(int)
    at, parts = 1 + len(lengths), []
    for length in lengths:
        parts.append([values[at + k * length : at + (k + 1) * length] for k in range(of_part)])
        at += of_part * length
    return parts


@pytest.mark.slow
def test_view_and_figures(page: Any) -> None:
    view = page.get("/api/jobs/first/view").json()
    assert view["verdict"]["verdict"] == "double-sided"
    figures = [figure for section in view["sections"] for figure in section["figures"]]
    assert len(figures) >= 8
    for figure in figures:
        name = figure["key"]
        svg = page.get(f"/api/jobs/first/figures/{name}.svg")
        assert svg.headers["content-type"] == "image/svg+xml"
        assert b"<svg" in svg.content[:200]
        assert page.get(f"/api/jobs/first/figures/{name}.json").json()["key"] == name
    pdf = page.get(f"/api/jobs/first/figures/{figures[0]['key']}.pdf")
    assert pdf.content.startswith(b"%PDF")


@pytest.mark.slow
def test_pictures_of_modes_are_there(page: Any) -> None:
    view = page.get("/api/jobs/modes/view").json()
    assert view["modes"]["names"] == ["flywheel", "hub", "input_gear", "output_gear"]
    pictures = [f for section in view["sections"] for f in section["figures"] if not f["is_chart"]]
    for picture in pictures:
        assert page.get(f"/api/jobs/modes/figures/{picture['key']}.svg").status_code == 200


def test_histories_are_those_of_the_run(page: Any) -> None:
    run = gr.simulate(model())
    known = page.get("/api/jobs/first/traces").json()
    assert known["period"] == run.trajectory.layout.period
    units = {channel["name"]: channel["unit"] for channel in known["channels"]}
    assert (units["deflection.gear"], units["deflection.clutch"], units["force.gear"]) == ("m", "rad", "N")
    query = {"channel": ["deflection.gear", "velocity.hub"], "points": 300}
    (gear, hub) = arrays(page.get("/api/jobs/first/trace", params=query).content, 2)
    for (time, values), of in ((gear, run.trajectory.deflection[:, 2]), (hub, run.trajectory.velocity[:, 1])):
        chosen = thin(of, 300)
        np.testing.assert_array_equal(values, of[chosen])
        np.testing.assert_allclose(time, run.trajectory.time[chosen], rtol=1e-12)


def test_impacts_of_a_window(page: Any) -> None:
    events = gr.simulate(model()).events
    entered = events[events.to_region.abs() > events.from_region.abs()]
    query = {"from": 0.1, "to": 0.4, "points": 20}
    ((time, _, velocity, _, count),) = arrays(page.get("/api/jobs/first/impacts", params=query).content, 5)
    inside = entered[(entered.time >= 0.1) & (entered.time <= 0.4)]
    assert count.sum() == len(inside)
    assert time.min() >= 0.1
    assert np.abs(velocity).max() == pytest.approx(inside.velocity.abs().max())


def test_a_sound_is_a_wav(page: Any) -> None:
    content = page.get("/api/jobs/first/sound.wav").content
    assert (content[:4], content[8:12]) == (b"RIFF", b"WAVE")


def test_sounds_that_are_compared_have_one_gain(page: Any) -> None:
    """As ``gr.listen`` gives it to both, to the byte; a job without a motion says why it is not heard."""
    wide = gr.simulate(model())
    narrow = gr.simulate(model().with_({"mesh.gear.backlash": "0.05 mm"}))
    expected = gr.listen({"first": wide, "second": narrow})
    made = page.get("/api/sound", params={"jobs": "first,second,modes"}).json()
    assert made["gain"] == expected.gain
    first, second, modes = made["designs"]
    assert [first["level"], second["level"]] == pytest.approx(list(expected.levels.values()))
    assert (modes["level"], len(modes["problems"])) == (None, 1)
    for job in ("first", "second"):
        content = page.get(f"/api/jobs/{job}/sound.wav", params={"gain": made["gain"]}).content
        assert content == expected.wav(job, 24)
    alone = {job: gr.listen(run) for job, run in (("first", wide), ("second", narrow))}
    lower = min(alone, key=lambda job: np.abs(alone[job].pressure[0]).max())  # its own gain is larger
    content = page.get(f"/api/jobs/{lower}/sound.wav").content
    assert content == alone[lower].wav("A", 24) != expected.wav(lower, 24)


def test_differences_of_two_runs_are_named(page: Any) -> None:
    rows = page.get("/api/compare", params={"jobs": "first,second"}).json()
    assert [row["path"] for row in rows["model"]] == ["mesh.gear.backlash"]
    assert rows["model"][0]["values"] == pytest.approx([1e-4, 5e-5])
    assert rows["model"][0]["unit"] == "m"
    rates = next(row for row in rows["numbers"] if (row["part"], row["quantity"]) == ("gear", "impacts per second"))
    narrow = gr.criteria(gr.simulate(model().with_({"mesh.gear.backlash": "0.05 mm"})))
    assert rates["values"][1] == pytest.approx(next(p for p in narrow.parts if p.name == "gear").impacts_per_second)


def test_spectra_of_run_and_recording(page: Any) -> None:
    simulated = page.get("/api/jobs/first/spectrum", params={"channel": "velocity.hub"}).json()
    assert simulated["shaft"] == pytest.approx(model().excitation.omega)
    assert len(simulated["frequency"]) == len(simulated["psd"]) > 10
    known = page.get("/api/measured", params={"file": "rig.csv"}).json()
    name = known["channels"][0]["name"]
    measured = page.get("/api/measured/spectrum", params={"file": "rig.csv", "channel": name}).json()
    peak = measured["frequency"][int(np.argmax(measured["psd"]))]
    assert peak == pytest.approx(1000.0 / (2.0 * np.pi), abs=3.0)
    ((time, values),) = arrays(page.get("/api/measured/trace", params={"file": "rig.csv", "channel": name}).content, 2)
    np.testing.assert_allclose(values, np.sin(np.rint(time * 1e3)), atol=1e-5)


@pytest.mark.long
def test_the_archive_does_the_same(page: Any, tmp_path: Path) -> None:
    """Its script, run in its folder, computes the numbers that it holds."""
    content = page.get("/api/jobs/first/archive.zip").content
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        names = set(archive.namelist())
        archive.extractall(tmp_path)
    assert {"model.toml", "script.py", "result/report.html", "result/results.nc", "result/summary.json"} <= names
    (tmp_path / "result").rename(tmp_path / "handed-over")
    subprocess.run([sys.executable, "script.py"], cwd=tmp_path, check=True, capture_output=True)
    first, again = (gr.open_run(tmp_path / folder / "results.nc") for folder in ("handed-over", "result"))
    np.testing.assert_array_equal(first.trajectory.deflection, again.trajectory.deflection)
    assert (tmp_path / "print" / "phase_plane.pdf").is_file()


@pytest.mark.parametrize("task", ["run", "modes"])
def test_the_script_says_what_was_done(page: Any, task: str) -> None:
    text = page.get(f"/api/jobs/{'first' if task == 'run' else task}/script.py").text
    compile(text, "script.py", "exec")
    assert f"gr.{task}(model)" in text


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/api/jobs/nobody/view", 404),
        ("/api/jobs/..%2f..%2fetc/view", 404),
        ("/api/jobs/first/figures/none.svg", 404),
        ("/api/jobs/first/figures/none.json", 404),
        ("/api/jobs/first/figures/phase_plane.exe", 404),
        ("/api/jobs/first/trace?channel=angle.nobody", 400),
        ("/api/jobs/first/trace?channel=angle.hub&from=2&to=1", 400),
        ("/api/jobs/first/trace?channel=angle.hub&from=nan", 400),
        ("/api/jobs/modes/traces", 400),
        ("/api/jobs/modes/sound.wav", 400),
        ("/api/jobs/first/sound.wav?gain=-1", 400),
        ("/api/jobs/first/sound.wav?gain=loud", 400),
        ("/api/jobs/first/sound.wav?gain=1e9", 400),
        ("/api/sound?jobs=first,nobody", 404),
        ("/api/measured?file=../../etc/passwd", 400),
        ("/api/measured?file=/etc/passwd", 400),
        ("/api/measured?file=none.csv", 404),
        ("/api/compare?jobs=first,nobody", 404),
        ("/widgets/nothing.js", 404),
    ],
)
def test_what_is_not_there_is_a_problem_in_words(page: Any, path: str, status: int) -> None:
    answer = page.get(path)
    assert answer.status_code == status
    if "%2f" not in path:
        (problem,) = answer.json()["problems"]
        assert set(problem) == {"place", "value", "rule", "remedy"}


def test_widgets_are_served_as_modules(page: Any) -> None:
    answer = page.get("/widgets/result.js")
    assert answer.headers["content-type"].startswith("text/javascript")
    assert 'import plot from "./plot.js";' in answer.text
    assert page.get("/widgets/plot.js").status_code == 200
    assert page.get("/widgets/widgets.css").headers["content-type"].startswith("text/css")


@pytest.mark.slow
def test_a_recording_is_shifted_to_where_it_agrees(page: Any, root: Path) -> None:
    """A stretch of the run itself, with noise, at a rate of its own, its time counted from elsewhere."""
    run = gr.simulate(model())
    t, rng = run.trajectory, np.random.default_rng(3)
    begin, step = 9.3 * t.layout.period, 1.7 * float(t.time[1])
    time = np.arange(800) * step
    values = np.interp(begin + time, t.time, t.velocity[:, 3])
    values += rng.normal(size=800) * 0.1 * values.std()
    rows = "\n".join(f"{5.0 + a:.12g},{b:.9g}" for a, b in zip(time, values, strict=True))
    (root / "stretch.csv").write_text(f"time [s],speed [rad/s]\n{rows}\n", encoding="utf-8")
    name = page.get("/api/measured", params={"file": "stretch.csv"}).json()["channels"][0]["name"]
    query = {"job": "first", "file": "stretch.csv", "simulated": "velocity.output_gear", "measured": name}
    shift = page.get("/api/measured/shift", params=query).json()["shift"]
    assert shift == pytest.approx(begin - 5.0, abs=step)


def test_a_view_that_was_not_written_is_made_from_the_files(page: Any, root: Path) -> None:
    for job in ("second", "modes"):
        path = root / ".gearrattle" / "jobs" / job / "view.json"
        before = page.get(f"/api/jobs/{job}/view").json()
        path.unlink()
        again = page.get(f"/api/jobs/{job}/view").json()
        assert again["title"] == before["title"]
        assert again["sentence"] == before["sentence"]
        charts = [
            [f["key"] for s in view["sections"] for f in s["figures"] if f["is_chart"]] for view in (before, again)
        ]
        assert charts[0] == charts[1]


@pytest.mark.parametrize(
    ("task", "options", "call"),
    [
        ("run", {"cycles": 20}, "gr.run(model, cycles=20)"),
        (
            "continuation",
            {"path": "excitation.speed", "range": [10, 20]},
            "gr.continuation(model, 'excitation.speed', [10, 20])",
        ),
        ("validate", {"measurement": "rig.toml"}, "gr.validate(model, gr.read('rig.toml'))"),
        ("fit", {"data": "d.toml", "free": ["a"]}, "gr.identification.fit(model, 'd.toml', ['a'])"),
    ],
)
def test_a_script_calls_what_the_task_called(task: str, options: dict[str, Any], call: str) -> None:
    text = script(task, options, 'with """ in its name', "1")
    compile(text, "script.py", "exec")
    assert f"result = {call}\n" in text
