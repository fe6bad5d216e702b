"""Torque records: what is read, what is refused, and a model that needs its file no more."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.model import Model, json_schema, loads

DRIVELINE = """
schema = 1
[[inertia]]
name = "engine"
J = 0.1
[[inertia]]
name = "load"
J = 0.2
[[coupling]]
name = "shaft"
between = ["engine", "load"]
stiffness = "100 N*m/rad"
[excitation]
speed = "1500 rpm"
[[torque]]
on = "engine"
signal = {signal}
"""
FILE = '{ file = "torque.csv", time = "t", value = "T" }'
RECORD = (
    "# a test bench\n t [ms] , speed [rpm], T [kN*m]\n0, 800, 0.001\n1, 801, 0.002\n\n2, 802, 0.004\n3, 803, 0.003\n"
)
JUMP = "time = [0, 1, 1, 3], value = [1, 2, 3, 4]"


def read(signal: str, folder: Path = Path()) -> Model:
    return loads(DRIVELINE.replace("{signal}", signal), str(folder / "car.toml"))


def recorded(folder: Path, text: str = RECORD) -> Model:
    (folder / "torque.csv").write_text(text, encoding="utf-8")
    return read(FILE, folder)


def told(signal: str, folder: Path = Path()) -> str:
    with pytest.raises(gr.ModelError) as caught:
        read(signal, folder)
    assert len(caught.value.problems) == 1
    return str(caught.value)


def test_a_record_is_read_in_si_relative_to_the_model_file(tmp_path: Path) -> None:
    signal = recorded(tmp_path).torques[0].signal
    assert signal is not None
    assert signal.time.tolist() == pytest.approx([0.0, 1e-3, 2e-3, 3e-3], rel=1e-15)
    assert signal.value.tolist() == [1.0, 2.0, 4.0, 3.0]
    assert signal.source == "torque.csv: T over t"


@pytest.mark.parametrize("mark", [";", "\t"])
def test_columns_may_be_parted_otherwise(tmp_path: Path, mark: str) -> None:
    signal = recorded(tmp_path, RECORD.replace(",", mark)).torques[0].signal
    assert signal is not None
    assert signal.value.tolist() == [1.0, 2.0, 4.0, 3.0]


def test_points_may_stand_in_the_model_file() -> None:
    signal = read('{ time = [0, "1 ms", 0.002, 0.003], value = [1, 2.0, "4 N*m", 3], scale = -2.0 }').torques[0].signal
    assert signal is not None
    assert signal.time.tolist() == [0.0, 1e-3, 2e-3, 3e-3]
    assert (signal.value.tolist(), signal.scale) == ([1.0, 2.0, 4.0, 3.0], -2.0)


def test_the_file_is_needed_once(tmp_path: Path) -> None:
    model = recorded(tmp_path)
    (tmp_path / "torque.csv").unlink()
    assert loads(model.to_toml()) == model
    assert model.with_({"torque.0.signal.scale": 1.0}) == model
    assert model.with_({"torque.0.signal.scale": 2.0}) != model
    assert pickle.loads(pickle.dumps(model)) == model
    assert copy.deepcopy(model) == model
    text, points = model.to_stored()
    assert "0.004" not in text
    assert loads(text, stored=points) == model
    assert hash(loads(text, stored=points)) == hash(model)


@pytest.mark.parametrize("interpolation", ["linear", "step", "cubic"])
def test_interpolation_stays_with_the_points(tmp_path: Path, interpolation: str) -> None:
    (tmp_path / "torque.csv").write_text(RECORD, encoding="utf-8")
    model = read(f'{FILE[:-1]}, interpolation = "{interpolation}" }}', tmp_path)
    assert model.torques[0].signal is not None
    assert model.torques[0].signal.interpolation == interpolation
    assert ("interpolation" in model.to_toml()) == (interpolation != "cubic")
    text, points = model.to_stored()
    for again in (
        loads(model.to_toml()),
        loads(text, stored=points),
        pickle.loads(pickle.dumps(model)),
        copy.deepcopy(model),
        recorded(tmp_path).with_({"torque.0.signal.interpolation": interpolation}),
    ):
        assert again == model
        assert hash(again) == hash(model)
    assert (model == recorded(tmp_path)) == (interpolation == "cubic")


@pytest.mark.parametrize(
    ("time", "value", "interpolation"),
    [
        ([0, 1], [0, 50], "linear"),
        ([0, 1, 1, 3], [0, 1, 2, 3], "linear"),
        ([0], [5], "step"),
        ([0, 0, 1], [0, 5, 5], "linear"),
    ],
)
def test_few_points_and_jumps(time: list[float], value: list[float], interpolation: str) -> None:
    signal = read(f'{{ time = {time}, value = {value}, interpolation = "{interpolation}" }}').torques[0].signal
    assert signal is not None
    assert (signal.time.tolist(), signal.value.tolist(), signal.interpolation) == (time, value, interpolation)


def test_a_jump_may_stand_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "torque.csv").write_text("t [s], T [N*m]\n0, 1\n1, 1\n1, 5\n2, 5\n", encoding="utf-8")
    signal = read(f'{FILE[:-1]}, interpolation = "linear" }}', tmp_path).torques[0].signal
    assert signal is not None
    assert signal.time.tolist() == [0.0, 1.0, 1.0, 2.0]
    assert '"step"' in told(FILE, tmp_path)


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (f"speed = {{ {JUMP}, interpolation = 'step' }}", ("speed", "must not jump", '"cubic" or "linear"', "steep")),
        (f"speed = {{ {JUMP}, interpolation = 'linear' }}", ("motion.0.speed", "ascend", "entry 2 is 1")),
        (f"angle = {{ {JUMP}, interpolation = 'linear' }}", ("slope may jump", 'must be "cubic"', "give the speed")),
        (f"angle = {{ {JUMP}, interpolation = 'step' }}", ("angle", "slope may jump", "give the speed")),
    ],
)
def test_a_motion_without_jumps_of_its_speed(motion: str, words: tuple[str, ...]) -> None:
    text = DRIVELINE.replace("[[torque]]", "[[motion]]").replace("signal = {signal}", motion)
    with pytest.raises(gr.ModelError) as caught:
        loads(text, "car.toml")
    assert str(caught.value).startswith("car.toml:17: motion.0.")
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_the_schema_says_what_may_stand_between_points() -> None:
    definitions = json_schema()["$defs"]
    assert isinstance(definitions, dict)
    options = {
        "Torque": ("signal", ["cubic", "linear", "step"], 1),
        "Motion": ("speed", ["cubic", "linear"], 2),
        "Engine": ("pressure", ["cubic", "linear"], 2),
    }
    for noun, (key, interpolations, fewest) in options.items():
        forms = definitions[noun]["properties"][key]["anyOf"]
        assert [form["properties"]["interpolation"]["enum"] for form in forms] == [interpolations] * 2
        assert forms[1]["properties"]["value"]["minItems"] == fewest


def test_the_example_of_the_schema_is_a_record() -> None:
    """A form begins with it."""
    definitions = json_schema()["$defs"]
    assert isinstance(definitions, dict)
    forms = definitions["Torque"]["properties"]["signal"]["anyOf"]
    time, value = (forms[1]["properties"][key]["examples"][0] for key in ("time", "value"))
    assert read(f"{{ time = {time}, value = {value} }}").torques[0].signal is not None


def test_points_cannot_be_changed(tmp_path: Path) -> None:
    model = recorded(tmp_path)
    for entry in (model, pickle.loads(pickle.dumps(model))):
        with pytest.raises(ValueError, match="read-only"):
            entry.torques[0].signal.value[0] = 7.0


def test_a_long_record_costs_little(tmp_path: Path) -> None:
    """A hundred seconds at a kilohertz: too long for a model file's text, which must stay small and not be refused."""
    time = np.arange(100_000) * 1e-3
    rows = np.column_stack([time, np.sin(time)])
    with open(tmp_path / "torque.csv", "w") as stream:
        stream.write("t [s], T [N*m]\n")
        np.savetxt(stream, rows, delimiter=",", fmt="%.6g")
    model = read(FILE, tmp_path)
    text, points = model.to_stored()
    assert len(text) < 1000
    assert loads(text, stored=points) == model
    with pytest.raises(gr.ModelError, match="at most 1 MB"):
        loads(model.to_toml())


def test_a_dimensionless_model_has_plain_columns(tmp_path: Path) -> None:
    (tmp_path / "torque.csv").write_text("t, T\n0, 1\n1, 2\n2, 3\n3, 5\n")
    plain = DRIVELINE.replace('"100 N*m/rad"', "1").replace('"1500 rpm"', "1").replace("{signal}", FILE)
    model = loads('units = "dimensionless"\n' + plain, str(tmp_path / "car.toml"))
    assert model.torques[0].signal is not None
    (tmp_path / "torque.csv").write_text(RECORD)
    with pytest.raises(gr.ModelError, match="must have no unit"):
        loads('units = "dimensionless"\n' + plain, str(tmp_path / "car.toml"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (RECORD.replace("802, 0.004", "802, nan"), ('torque.csv:6: T: found "nan"', "finite number")),
        (RECORD.replace("802, 0.004", "802, x"), ('torque.csv:6: T: found "x"', "finite number")),
        (RECORD.replace("802, 0.004", "802"), ("torque.csv:6: found 2 entries", "must have 3")),
        (RECORD.replace("2, 802", "1, 802"), ("torque.csv:6: t: found 0.001 s", "ascend", "sort")),
        (RECORD.replace("2, 802", "0.5, 802"), ("torque.csv:6: t", "the one before is 0.001 s")),
        (RECORD.replace("T [kN*m]", "T"), ("torque.csv:2: found T", "name its unit of torque", "T [N*m]")),
        (RECORD.replace("t [ms]", "t [N]"), ("torque.csv:2: found t [N]", "must be a time")),
        (RECORD.replace("T [kN*m]", "T [N/m]"), ("torque.csv:2: found T [N/m]", "must be a torque")),
        (RECORD.replace("T [kN*m]", "torque [N*m]"), ('torque.csv:2: found "T"', "no column has this name", "torque")),
        (RECORD.replace("3, 803, 0.003\n", ""), ("torque.csv: t: found 3 points", "4 points or more")),
        (RECORD.replace("0, 800", "0.5, 800"), ("goes from 0.0005 s to 0.003 s", "start = 0.0005")),
        (RECORD.replace(",", ";").replace("0.004", "0,004"), ('torque.csv:6: T: found "0,004"', "point")),
        ("t [s], T [N*m]\n", ("found 0 points",)),
        ("", ("torque.csv: must begin with a line of column names",)),
        (RECORD.replace("0.004", "0,004"), ("torque.csv:6: found 4 entries", "must have 3", "point")),
    ],
)
def test_a_bad_record_is_told_with_its_place(tmp_path: Path, text: str, words: tuple[str, ...]) -> None:
    (tmp_path / "torque.csv").write_text(text, encoding="utf-8")
    message = told(FILE, tmp_path)
    assert all(word in message for word in words), message


def test_a_file_that_is_none(tmp_path: Path) -> None:
    assert "torque.csv: no such file (a path is relative to the model file)" in told(FILE, tmp_path)
    (tmp_path / "torque.csv").mkdir()
    assert "must be a CSV file" in told(FILE, tmp_path)
    (tmp_path / "torque.csv").rmdir()
    (tmp_path / "torque.csv").write_bytes(b"\x00\x01\x02")
    assert "torque.csv: must be a text" in told(FILE, tmp_path)


@pytest.mark.parametrize(
    ("signal", "words"),
    [
        ("5", ("must be a table of a record",)),
        ("{ tim = [1] }", ("unknown key", 'did you mean "time"')),
        ('{ file = "torque.csv" }', ("time is required",)),
        ('{ file = 5, time = "t", value = "T" }', ("file must be a text",)),
        ('{ time = "t", value = "T" }', ("time must be a list", "add file")),
        ("{ time = [0, 1, 2], value = [1, 2, 3] }", ("4 points or more",)),
        ("{ time = [0, 1, 2, 3], value = [1, 2, 3] }", ("equal length", "4 and 3")),
        ("{ time = [0, 1, 1, 3], value = [1, 2, 3, 4] }", ("ascend", "entry 2 is 1", '"linear"', '"step"')),
        ("{ time = [0, 1, 2], value = [1, 2, 3] }", ('interpolation = "linear" needs 2', '"step" needs 1')),
        (f"{{ {JUMP}, interpolation = 'linar' }}", ('"cubic" or "linear" or "step"', 'did you mean "linear"')),
        (f"{{ {JUMP}, interpolation = 1 }}", ("interpolation = 1", '"cubic" or "linear" or "step"')),
        (f"{{ {JUMP}, interpolation = 'step' }}", ("ascend", "entry 2 is 1")),
        (f"{{ {JUMP.replace('3]', '1]')}, interpolation = 'linear' }}", ("two points at one time", "entry 3 is 1")),
        ("{ time = [1, 1], value = [1, 2], interpolation = 'linear' }", ("a straight line needs 2 points",)),
        ("{ time = [2, 1], value = [1, 2], interpolation = 'linear' }", ("ascend", "sort the record")),
        ("{ time = [], value = [], interpolation = 'step' }", ("a step needs 1 point",)),
        ("{ time = [1], value = [1], interpolation = 'step' }", ("begins at 1 s", "start = 1.0")),
        ("{ time = [0, 1, 2, 3], value = [1, nan, 3, 4] }", ("entry 1 of value", "finite")),
        ('{ time = [0, 1, 2, 3], value = [1, "2 N", 3, 4] }', ("entry 1 of value", "must be a torque")),
        ("{ time = [5, 6, 7, 8], value = [1, 2, 3, 4] }", ("goes from 5 s to 8 s", "start = 5.0")),
        ("{ time = [0, 1, 2, 3], value = [1, 2, 3, 4], start = 3 }", ("begins at its 3 s",)),
        ('{ time = [0, 1, 2, 3], value = [1, 2, 3, 4], static = "1 s" }', ("static", "must be a torque")),
        ("{ time = [0, 1, 2, 3], value = [1, 2, 3, 4], scale = nan }", ("scale", "finite")),
    ],
)
def test_bad_keys_are_told_with_the_line(signal: str, words: tuple[str, ...]) -> None:
    message = told(signal)
    assert message.startswith("car.toml:17: torque.0.signal: found ")
    assert all(word in message for word in words), message


def test_the_sweep_of_the_speed() -> None:
    model = loads(DRIVELINE.replace("{signal}", "{ time = [0, 1, 2, 3], value = [1, 2, 3, 4] }"))
    swept = model.with_({"excitation.sweep": {"from": "800 rpm", "to": 300.0, "over": "10 s"}})
    assert swept.excitation.speed is None
    assert swept.excitation.omega == pytest.approx(800.0 * np.pi / 30.0, rel=1e-15)
    assert loads(swept.to_toml()) == swept
    assert swept.with_({"excitation.sweep.over": 2.0}).excitation.sweep.over == 2.0  # type: ignore[union-attr]
    assert swept.with_({"excitation.speed": "1500 rpm"}) == model


@pytest.mark.parametrize(
    ("excitation", "words"),
    [
        ('sweep = { from = "800 rpm", to = "3000 rpm" }', ("sweep.over", "required")),
        ('sweep = { from = "800 rpm", to = 0, over = 1 }', ("sweep.to", "greater than zero")),
        ('sweep = { from = "800 Hz", to = 1, over = 1 }', ("sweep.from", "Hz belongs to frequency")),
        ("speed = 1\nsweep = { from = 1, to = 2, over = 1 }", ("speed and sweep exclude each other",)),
        ("sweep = { from = 90, to = 210, over = 1 }", ("mean", "the sweep ends at 210", "extend the table")),
        ("sweep = { from = 40, to = 90, over = 1 }", ("mean", "the model's speed is 40")),
    ],
)
def test_a_bad_sweep(excitation: str, words: tuple[str, ...]) -> None:
    tabled = "mean = { speed = [50, 200], value = [1, 2] }"
    text = DRIVELINE.replace("signal = {signal}", tabled).replace('speed = "1500 rpm"', excitation)
    with pytest.raises(gr.ModelError) as caught:
        loads(text)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_column_named_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(gr.ModelError) as caught:
        recorded(tmp_path, "t [s], T [N*m], T [kN*m]\n0, 1, 2\n1, 1, 2\n2, 1, 2\n3, 1, 2\n")
    (problem,) = caught.value.problems
    assert "torque.csv:1" in problem.place
    assert "columns 2 and 3 have this name" in problem.rule
