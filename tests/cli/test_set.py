"""``--set`` and factors of the command line: what they read, which commands take them, what they refuse."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import COMMANDS, main
from gearrattle.cli.assignments import changes, texts
from gearrattle.errors import ModelError
from tests.studies.drivelines import TOML

STUDY = (
    'model = "two.toml"\noutputs = ["regime"]\n[fixed]\n"torque.0.mean" = 0.2\n[axis]\n"torque.*.amplitude" = [6.0]\n'
)
WITHOUT = {
    "import",
    "share",
    *("validate", "reproduce", "look", "orders", "spectra", "figures", "criteria", "metrics", "listen"),
    *("loop", "serve", "examples", "schema"),
}
"""Commands that take measured or saved motions, or no model."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("two.toml").write_text(TOML, encoding="utf-8")
    Path("study.toml").write_text(STUDY, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("word", "value"),
    [
        ("x3", gr.factor(3)),
        ("x0.5", gr.factor(0.5)),
        ("60", 60),
        (".5", 0.5),
        ("1e-3", 1e-3),
        ("0.3 N*m", "0.3 N*m"),
        ("steady", "steady"),
        ('"x3"', "x3"),
        ("xray", "xray"),
        ("[0.1, '20 mm']", [0.1, "20 mm"]),
        ("{ from = 1, to = 2, over = 3 }", {"from": 1, "to": 2, "over": 3}),
    ],
)
def test_a_value_is_read_as_in_a_file(word: str, value: object) -> None:
    (read,) = changes("--set", [f"inertia.*.J={word}"]).values()
    assert read == value
    assert type(read) is type(value)


def test_lists_of_loads_take_factors() -> None:
    assert texts("--load", ["a=x1,x3,2 N*m,4"]) == {"a": [gr.factor(1), gr.factor(3), "2 N*m", 4.0]}


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_that_take_a_model_take_set(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--help"]) == 0
    assert ("--set" in capsys.readouterr().out) == (name not in WITHOUT)


@pytest.mark.usefixtures("folder")
def test_the_model_has_the_values(capsys: pytest.CaptureFixture[str]) -> None:
    """Twice the drag and the mean: the dimensionless model that is written is that of a model changed in Python."""
    words = ["scale", "two.toml", "--set", "*.drag_torque=x2", "--set", "torque.0.mean=0.8 N*m", "-o", "out.toml"]
    assert main(words) == 0
    changed = gr.loads(TOML).with_({"inertia.wheel.drag_torque": 0.8, "torque.0.mean": 0.8})
    assert gr.load("out.toml").to_tables() == gr.nondimensionalize(changed).model.to_tables()
    capsys.readouterr()


@pytest.mark.usefixtures("folder")
def test_a_study_takes_them_over_what_is_fixed(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["study", "study.toml", "-o", "out", "--workers", "1", "--set", "torque.0.mean=x3", "--json"]
    assert main(words) == 0
    capsys.readouterr()
    assert gr.loads(gr.open_study("out").attrs["model"])["torque.0.mean"] == pytest.approx(0.6, rel=1e-15)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("check two.toml --set inertia.*.drag=x2 --set inertia.engine.drag=1", "is changed twice"),
        ("check two.toml --set inertia.*.inertia=1", "matches no value"),
        ("check two.toml --set inertia.*.J", "must be NAME=VALUE"),
        ("check two.toml --set inertia.wheel.J=xinf", "must be a finite number"),
        ("run two.toml --set inertia.wheel.drag=x2", "says nothing here"),
        ("study study.toml --set inertia.wheel.drag=x2", "says nothing here"),
        ("continue two.toml --path inertia.*.J --range x1:x2", "here one is needed"),
        ("continue two.toml --path inertia.wheel.J --range x1:0.1", "one end is a factor"),
    ],
)
def test_what_has_no_meaning_is_refused(
    folder: Path, words: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(path.name for path in folder.iterdir())
    assert main(words.split()) == 2
    assert message in capsys.readouterr().err
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.usefixtures("folder")
def test_a_branch_runs_between_factors(capsys: pytest.CaptureFixture[str]) -> None:
    """And its scatter under a tenth of a value is that under the value's tenth."""
    example = Path(__file__).parents[2] / "examples" / "backlash_oscillator.toml"
    model = gr.load(example)
    branch = gr.continuation(model, "excitation.speed", (gr.factor(1), gr.factor(1.1)))
    ends = [model["excitation.speed"], 1.1 * model["excitation.speed"]]
    assert [float(branch.data["value"][i]) for i in (0, -1)] == pytest.approx(ends, rel=1e-12)
    by_factor = branch.scatter(0, {"coupling.*.damping": gr.factor(0.1)})
    assert by_factor == branch.scatter(0, {"coupling.mesh.damping": 0.1 * model["coupling.mesh.damping"]})
    assert list(branch.gradients(0, ["coupling.*.damping"])["path"]) == ["coupling.mesh.damping"]
    words = ["continue", str(example), "--path", "excitation.speed", "--range", "x1:x1.1", "--json"]
    assert main([*words, "--scatter", "coupling.*.damping=x0.1"]) == 0
    assert json.loads(capsys.readouterr().out)["title"]


def test_a_word_without_a_value_is_refused() -> None:
    with pytest.raises(ModelError, match="must be NAME=VALUE"):
        changes("--set", ["inertia.wheel.J="])
