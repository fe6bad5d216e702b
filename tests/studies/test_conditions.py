"""Studies of conditions: every value that of a run by itself, ratings by the user's points alone, and refusals."""

from __future__ import annotations

import json
from base64 import b64decode
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.errors import Cancelled, ModelError
from gearrattle.report.condition_sounds import sounds_in
from gearrattle.signals.sound_loop import SAMPLES
from gearrattle.studies.case_batches import batched, can_follow
from gearrattle.studies.conditions_study import MOST_HEARD, RATING, calibration_points, prepare, rated
from gearrattle.studies.study import prepare as prepare_grid
from gearrattle.studies.study_cost import keeping
from gearrattle.studies.study_file import read_study
from tests.architecture.places import EXAMPLES
from tests.laws.test_sideways import driven
from tests.studies.drivelines import model as two_bodies

OIL = {"path": "inertia.*_gear.drag_torque", "values": {"factor": [8.0, 1.0]}}
LOAD = {"path": "torque.0.harmonics.*.amplitude", "values": {"factor": [0.6, 1.0]}}
SPEED = ["750 rpm", "800 rpm"]
SHORT = {"simulation.cycles": 24, "simulation.discard": 12, "simulation.samples_per_cycle": 64}
POINTS = [(70.0, 5.0), (50.0, 8.0)]
FILE = """
model = "idle.toml"
kind = "conditions"
[temperature]
path = "inertia.*_gear.drag_torque"
values = { factor = [8, 1] }
[load]
path = "torque.0.harmonics.*.amplitude"
values = { factor = [0.6, 1.0] }
[speed]
values = ["750 rpm", "800 rpm"]
"""


def idle() -> gr.Model:
    return gr.load(EXAMPLES / "manual_transmission.toml").with_(SHORT)


@pytest.fixture(scope="module")
def data() -> xr.Dataset:
    return gr.conditions(idle(), OIL, SPEED, LOAD, rating=POINTS, workers=1)


def impact_energies(verdict: gr.typing.Verdict, parts: list[str]) -> dict[str, float]:
    """The largest impact energy of parts that are hit, as criteria tell it."""
    entries = [entry for entry in verdict.entries if entry.quantity == "largest impact energy"]
    return {entry.subject: float(entry.value) for entry in entries if entry.subject in parts}


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, which holds a model file and a study of it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "idle.toml").write_text(idle().to_toml(), encoding="utf-8")
    (tmp_path / "idle_conditions.toml").write_text(FILE, encoding="utf-8")
    return tmp_path


def test_every_condition_is_its_own_run(data: xr.Dataset) -> None:
    """Severity, hardest impact and its part, the level of ``listen``, and drag over the torque needed."""
    assert data.sizes == {
        "torque.0.harmonics.*.amplitude": 2,
        "inertia.*_gear.drag_torque": 2,
        "excitation.speed": 2,
        "part": data.sizes["part"],
        "sound sample": SAMPLES,
    }
    severities = data["verdict severity"].attrs["flag_meanings"].split()
    parts = data["hardest part"].attrs["flag_meanings"].split()
    seen = set()
    for at in np.ndindex(2, 2, 2):
        changes = {
            LOAD["path"]: gr.factor(LOAD["values"]["factor"][at[0]]),  # type: ignore[index]
            OIL["path"]: gr.factor(OIL["values"]["factor"][at[1]]),  # type: ignore[index]
            "excitation.speed": SPEED[at[2]],
        }
        run = gr.simulate(idle().with_(changes))
        verdict = gr.criteria(run)
        assert severities[int(data["verdict severity"].values[at])] == verdict.severity
        energies = impact_energies(verdict, parts)
        hardest = max(energies.values(), default=0.0)
        assert float(data["hardest impact"].values[at]) == pytest.approx(hardest, rel=1e-12)
        margins = [entry.value for entry in verdict.entries if entry.quantity == "margin"]
        assert float(data["threshold margin"].values[at]) == pytest.approx(10.0 ** (-max(margins) / 20.0), rel=1e-9)
        level = gr.listen(run).levels["A"]
        code = int(data["hardest part"].values[at])
        if hardest > 0.0:
            assert energies[parts[code]] == hardest
            assert float(data["sound level"].values[at]) == pytest.approx(level, abs=1e-9)
        else:
            assert code == -1
            assert level == -np.inf
            assert np.isnan(data["sound level"].values[at])
        seen.add(verdict.severity)
    assert {"quiet", "rattles"} <= seen


def test_the_level_of_a_driveline_with_bearings_is_that_of_its_casing() -> None:
    """In the loop over variants and by ``listen`` of single runs: the path rings from the discarded cycles in both."""
    model = driven().with_({**SHORT, "simulation.cycles": 16, "simulation.discard": 10})
    speeds = [98.0, 100.0, 102.0, 104.0]
    prepared = prepare_grid(model, {"excitation.speed": speeds}, ["sound level"])
    plan = replace(prepared.plan, chunk_size=len(speeds))
    values, done = batched(plan, prepared.outputs, 0)
    assert done.all()
    for speed, level in zip(speeds, values["sound level"], strict=True):
        run = gr.simulate(model.with_({"excitation.speed": speed}))
        assert level == pytest.approx(gr.listen(run).levels["A"], abs=1e-6)
        assert level != pytest.approx(gr.listen(run, source="impacts").levels["A"], abs=1.0)


def test_the_margin_of_a_quiet_condition_is_above_one(data: xr.Dataset) -> None:
    quiet = data["verdict severity"].values == 0
    assert np.all(data["threshold margin"].values[quiet] > 1.0)
    assert np.all(data["threshold margin"].values[data["verdict severity"].values == 2] < 1.0)


def test_conditions_go_through_the_batches_of_a_grid() -> None:
    prepared = prepare(idle(), OIL, SPEED, LOAD)
    assert can_follow(prepared.outputs, prepared.plan)
    assert prepared.scheduler == "threads"


def test_an_estimate_knows_that_threads_wait_while_python_evaluates() -> None:
    """Sixteen threads take at least the share of the time in which one of them alone goes on; processes do not."""
    prepared = prepare(idle(), OIL, SPEED, LOAD)
    assert 0.0 < prepared.serial <= 1.0
    assert prepared.plan.chunk_size >= 4  # else no case is computed together with others
    assumed = replace(prepared, seconds=0.1, serial=0.7, plan=replace(prepared.plan, chunk_size=1))
    alone, many, processes = (
        assumed.estimate(1).seconds,
        assumed.estimate(16, "threads").seconds,
        assumed.estimate(16, "local").seconds,
    )
    assert alone == pytest.approx(8 * 0.1, abs=0.5)
    assert many - keeping(8) == pytest.approx(0.7 * 8 * 0.1)
    assert processes - keeping(8) == pytest.approx(5.0 + 0.1)


def test_ratings_lie_on_straight_lines_between_the_points_and_nowhere_else(data: xr.Dataset) -> None:
    levels = np.array([40.0, 50.0, 60.0, 62.0, 70.0, 70.1, np.nan])
    expected = [np.nan, 8.0, 6.5, 6.2, 5.0, np.nan, np.nan]
    np.testing.assert_allclose(rated(levels, calibration_points(POINTS)), expected)
    within = rated(data["sound level"].values, calibration_points(POINTS))
    np.testing.assert_array_equal(data[RATING].values, within)
    assert data.attrs["calibration"] == "50 dB: 8, 70 dB: 5"
    assert np.isnan(rated(levels, ())).all()


@pytest.mark.parametrize(
    ("rating", "match"),
    [
        ([(55, 8)], "two calibration points"),
        ([(55, 8), (55, 7)], "one level"),
        ([(55, 11), (70, 5)], "from 1 to 10"),
        ([(55, 5), (70, 8)], "louder sound must not be rated better"),
        ([(55, "8"), (70, 5)], "rating.0.rating"),
        ([55, 70], "list of calibration points"),
        ("8", "list of calibration points"),
    ],
)
def test_calibration_points_without_sense_are_refused(rating: Any, match: str) -> None:
    with pytest.raises(ModelError, match=match):
        gr.conditions(idle(), OIL, SPEED, rating=rating)


def test_a_model_without_oil_is_told_what_to_do() -> None:
    with pytest.raises(ModelError) as caught:
        gr.conditions(idle(), ["20 degC", "80 degC"], SPEED)
    (problem,) = caught.value.problems
    assert problem.place == "temperature.path"
    assert problem.value == "oil.temperature"
    assert "no [oil]" in problem.rule
    assert 'path = "inertia.*.drag_torque"' in problem.remedy


def test_the_temperature_is_that_of_the_oil() -> None:
    """Cold oil drags more: its margin is above 1; both margins are those of runs at these temperatures."""
    model = gr.load(EXAMPLES / "idle_rattle_oil.toml").with_(SHORT)
    model = model.with_({"torque.0.harmonics.*.amplitude": gr.factor(0.6)})
    made = gr.conditions(model, ["-20 degC", "40 degC"], ["800 rpm"], workers=1)
    assert made["outcome"].dims == ("oil.temperature", "excitation.speed")
    assert made["oil.temperature"].values.tolist() == [-20.0, 40.0]
    for temperature, margin in zip(("-20 degC", "40 degC"), made["threshold margin"].values[:, 0], strict=True):
        run = gr.simulate(model.with_({"oil.temperature": temperature}))
        needed = [entry.value for entry in gr.criteria(run).entries if entry.quantity == "margin"]
        assert margin == pytest.approx(10.0 ** (-max(needed) / 20.0), rel=1e-9)
    cold, warm = made["threshold margin"].values[:, 0]
    assert cold > 1.0 > warm


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("[temperature]\npath", "[temperature]\npaht", 'did you mean "path"'),
        ("[temperature]", "[temprature]", 'did you mean "temperature"'),
        ('path = "inertia.*_gear.drag_torque"\n', "", "idle_conditions.toml:4: temperature.path"),
        ('path = "torque.0.harmonics.*.amplitude"\n', "", "no load has a path of its own"),
        ('"750 rpm"', '"750 kg"', "idle_conditions.toml:10: speed: excitation.speed"),
        ("*_gear.drag_torque", "*_gaer.drag_torque", "temperature: path inertia"),
        ("values = { factor = [8, 1] }", "values = 8", "must be a list of values, a range, or a table"),
        ("values = { factor = [8, 1] }", 'values = { "inertia.second_gear.drag" = [1, 2] }', "stands beside values"),
        ("[temperature]", "rating = [ { level = 50 } ]\n[temperature]", "rating.0.rating: this key is required"),
        ("[temperature]", "rating = [ { level = 50, rating = 8 } ]\n[temperature]", "idle_conditions.toml:4: rating"),
        ("[temperature]", "sound_path = [[900.0, 2.0, 1.0]]\n[temperature]", "its damping ratio between 0 and 1"),
        ("[temperature]", "sound_path = [[900.0]]\n[temperature]", "rows of frequency"),
        ("[temperature]", "most = 3\n[temperature]", "more than the 3 allowed"),
    ],
)
def test_a_wrong_file_is_refused_at_its_line(home: Path, old: str, new: str, match: str) -> None:
    assert old in FILE
    (home / "idle_conditions.toml").write_text(FILE.replace(old, new), encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        read_study("idle_conditions.toml").prepare()
    assert match in str(caught.value)


def test_a_file_gives_what_the_call_gives(home: Path, data: xr.Dataset) -> None:
    arguments = read_study(home / "idle_conditions.toml").arguments
    actual = gr.conditions(**{**arguments, "rating": POINTS}, workers=1)
    xr.testing.assert_identical(actual.drop_attrs(), data.drop_attrs())


def test_a_stopped_study_goes_on_to_the_same_bits(home: Path, data: xr.Dataset) -> None:
    """Stopped after its first chunk; resumed, and resumed again with other points, which need no new computation."""

    def stop(share: float) -> None:
        if share > 0.0:
            raise Cancelled

    how: dict[str, Any] = {"output": home / "kept", "workers": 1, "scheduler": "threads"}
    with pytest.raises(Cancelled):
        gr.conditions(idle(), OIL, SPEED, LOAD, rating=POINTS, progress=stop, **how)
    resumed = gr.conditions(idle(), OIL, SPEED, LOAD, rating=POINTS, resume=True, **how)
    for name in data.data_vars:
        np.testing.assert_array_equal(resumed[name].values, data[name].values, err_msg=str(name))
    xr.testing.assert_identical(gr.open_study(home / "kept"), resumed)
    other = gr.conditions(idle(), OIL, SPEED, LOAD, resume=True, **how)
    assert other.attrs["calibration"] == ""
    assert np.isnan(other[RATING].values).all()


def test_several_paths_together_and_no_load() -> None:
    """The temperature changes drag torque and drag; the load is the model's, and is no axis."""
    together = {
        "values": {
            "inertia.*_gear.drag_torque": {"factor": [2.0, 1.0]},
            "inertia.*_gear.drag": {"factor": [2.0, 1.0]},
        }
    }
    made = gr.conditions(idle(), together, ["800 rpm"], workers=1)
    assert made["outcome"].dims == ("temperature", "excitation.speed")
    assert (made.attrs["load"], made.attrs["temperature"]) == ("", "temperature")
    cold = idle().with_({path: gr.factor(2.0) for path in together["values"]} | {"excitation.speed": "800 rpm"})
    energies = impact_energies(gr.criteria(gr.simulate(cold)), made["part"].values.tolist())
    energies.pop("damper", None)  # its stages are no gap
    assert float(made["hardest impact"].values[0, 0]) == pytest.approx(max(energies.values()), rel=1e-12)


def test_a_path_of_ones_own_is_the_path_of_listen() -> None:
    modes = [(900.0, 0.05, 2.0), (2000.0, 0.02, 0.5)]
    made = gr.conditions(idle(), OIL, ["800 rpm"], sound_path=modes, workers=1)
    run = gr.simulate(idle().with_({"excitation.speed": "800 rpm"}))
    assert float(made["sound level"].values[1, 0]) == pytest.approx(gr.listen(run, modes).levels["A"], abs=1e-9)
    assert made.attrs["sound_path"].startswith("900 Hz")


def test_a_driveline_without_gears_has_no_level_and_no_margin() -> None:
    """One coupling with a gap: severity and hardest impact, and nothing of gears."""
    drag = {"path": "inertia.wheel.drag_torque", "values": [0.4, 3.0]}
    made = gr.conditions(two_bodies(), drag, [70.0, 80.0], workers=1)
    assert {"verdict severity", "hardest impact", "hardest part"} <= set(made.data_vars)
    assert not {"sound level", "threshold margin", RATING} & set(made.data_vars)
    with pytest.raises(ModelError, match="no such output"):
        gr.study(two_bodies(), {"inertia.wheel.drag_torque": [0.4, 3.0]}, ["sound level"], workers=1)


def test_a_driveline_without_a_gap_is_quiet() -> None:
    drag = {"path": "inertia.wheel.drag_torque", "values": [0.4, 3.0]}
    made = gr.conditions(two_bodies().with_({"coupling.joint.clearance": 0.0}), drag, [70.0], workers=1)
    assert np.all(made["verdict severity"].values == 0)
    assert np.all(made["hardest impact"].values == 0.0)
    assert "hardest part" not in made


def loops_in(data: xr.Dataset) -> np.ndarray[Any, Any]:
    return data["sound loop"].values.reshape(data["outcome"].size, -1)


def test_every_condition_that_is_heard_has_a_loop_of_its_level(data: xr.Dataset) -> None:
    """The loop is the end of the sound: its level is that of the condition to some decibels, silence has none."""
    levels = data["sound level"].values.ravel()
    assert np.isfinite(levels).any()
    assert np.isnan(levels).any()
    for level, loop in zip(levels, loops_in(data), strict=True):
        heard = loop[np.isfinite(loop)]
        assert bool(heard.size) == np.isfinite(level)
        if heard.size:
            assert 10.0 * np.log10(np.mean(heard**2) / 4e-10) == pytest.approx(level, abs=3.0)


def test_the_page_plays_all_conditions_at_one_gain(data: xr.Dataset) -> None:
    """Differences of levels are kept in the page; 120 conditions take less than 6 MB."""
    sounds, full = sounds_in(data)
    loops = loops_in(data)
    peaks = []
    for text, loop in zip(sounds, loops, strict=True):
        played = np.frombuffer(b64decode(text), "<i2") / 32767.0
        assert played.size == np.isfinite(loop).sum()
        assert np.abs(played * full - loop[: played.size]).max(initial=0.0) <= 0.51 * full / 32767.0
        peaks.append(np.abs(played).max(initial=0.0))
    assert max(peaks) == pytest.approx(0.5, abs=1e-4)
    assert 120 * 4 * np.ceil(2 * SAMPLES / 3) < 6e6
    assert MOST_HEARD == 120


def test_the_map_of_the_page_has_every_condition_with_its_row(data: xr.Dataset, tmp_path: Path) -> None:
    page = gr.save(data, tmp_path / "page").read_text(encoding="utf-8")
    said = json.loads(page.partition('id="conditions-data">')[2].partition("</script>")[0])
    places = [k for panel in said["panels"] for line in panel["cells"] for k in line]
    assert sorted(places) == list(range(8))
    assert [len(said[name]) for name in ("rows", "cells", "colours", "rattles", "sounds")] == [8] * 5
    first = said["panels"][0]["cells"][0][0]  # the highest value of the temperature stands on top
    assert said["rows"][first][:3] == ["0.6", "8", "750"] or said["rows"][first][:3] == ["0.6", "1", "750"]
    assert said["row_titles"] == [said["rows"][line[0]][1] for line in said["panels"][0]["cells"]]
    assert page.count("<script") == 2
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_sounds_can_be_left_out_and_are_of_many_conditions(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    without = gr.conditions(idle(), OIL, SPEED, sounds=False, workers=1)
    assert "sound loop" not in without
    assert "sound level" in without
    page = gr.save(without, tmp_path / "page").read_text(encoding="utf-8")
    assert '"sounds":[]' in page
    assert "to hear it" not in page
    monkeypatch.setattr("gearrattle.studies.conditions_study.MOST_HEARD", 3)
    assert "sound loop" not in gr.conditions(idle(), OIL, SPEED, workers=1)
    with pytest.raises(ModelError, match="sounds"):
        gr.conditions(idle(), OIL, SPEED, sounds="no")  # type: ignore[arg-type]


def test_a_table_of_conditions_has_no_sounds(data: xr.Dataset, tmp_path: Path) -> None:
    table = gr.save(data, tmp_path / "conditions.csv").read_text(encoding="utf-8")
    assert "sound level" in table
    assert "sound loop" not in table


def test_no_other_study_keeps_sounds() -> None:
    with pytest.raises(ModelError, match="no such output"):
        gr.study(idle(), {"excitation.speed": SPEED}, outputs=["sound loop"])
