"""The command line: results on stdout, messages on stderr, exit codes, nothing half-written."""

from __future__ import annotations

import errno
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import h5netcdf
import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import COMMANDS, app, main
from gearrattle.cli.failures import explain
from gearrattle.errors import Cancelled, ConvergenceError
from gearrattle.model import json_schema
from gearrattle.quantities.criteria import criteria as judged
from gearrattle.writing import Staging
from tests import synthetic
from tests.architecture.places import EXAMPLES

SHORT = ("--cycles", "4", "--samples-per-cycle", "64")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_run_writes_everything_and_prints_the_verdict(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(model), *SHORT]) == 0
    out, err = capsys.readouterr()
    folder = model.parent / "train-results"
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    lines = out.splitlines()
    assert lines[0] == f"{summary['verdict']}: {summary['sentence']}"
    head = next(i for i, line in enumerate(lines) if line.startswith("part "))
    assert lines[1:head] == ["", summary["cause"]["sentence"], ""]
    assert [line.split()[0] for line in lines[head:-1]] == ["part", *(part["name"] for part in summary["parts"])]
    assert lines[-1] == f"page: {Path('train-results') / 'report.html'}"
    assert names(folder) == ["figures", "report.html", "results.nc", "summary.json"]
    assert names(model.parent) == ["train-results", "train.toml"]
    reported = [line for line in err.splitlines() if line.startswith("note: ")]
    assert reported == [f"note: {note}" for note in summary["notes"]]
    with h5netcdf.File(folder / "results.nc", "r") as file:
        assert file["angle"].shape == (4 * 64 + 1, 4)


def test_run_prints_the_summary_as_json(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(model), *SHORT, "-o", "here", "--json"]) == 0
    out, _ = capsys.readouterr()
    written = json.loads(Path("here/summary.json").read_text(encoding="utf-8"))
    assert json.loads(out) == {**written, "output": str(Path("here/report.html"))}


def test_settings_reach_the_simulation(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = {
        "algorithm": "rk4",
        "cycles": 2,
        "discard": 0,
        "samples-per-cycle": 8,
        "step": "10 us",
        "initial": "zero",
    }
    words = [word for key, value in settings.items() for word in (f"--{key}", str(value))]
    assert main(["simulate", str(model), *words, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert (content["cycles"], content["discard"], content["samples_per_cycle"]) == (2, 0, 8)
    assert content["cost"]["algorithm"] == "rk4"
    assert content["cost"]["average_step"] == pytest.approx(1e-5, rel=0.01)


@pytest.mark.parametrize("ending", ["nc", "csv"])
def test_simulate_saves_what_the_call_gives(model: Path, ending: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", str(model), *SHORT, "-o", f"out.{ending}"]) == 0
    assert f"saved: out.{ending}" in capsys.readouterr().out
    run = gr.simulate(gr.load(model), cycles=4, samples_per_cycle=64)
    if ending == "nc":
        saved = gr.open_run("out.nc").trajectory.angle
    else:
        head, *rows = Path("out.csv").read_text(encoding="utf-8").splitlines()
        columns = head.split(",")
        assert columns[:2] == ["time", "angle.flywheel"]
        assert {"velocity.hub", "acceleration.output_gear", "deflection.gear", "force.clutch"} <= set(columns)
        table = np.array([row.split(",") for row in rows], dtype=float)
        saved = table[:, [columns.index(f"angle.{name}") for name in synthetic.NAMES]]
    assert np.array_equal(saved, run.trajectory.angle)
    assert names(model.parent) == [f"out.{ending}", "train.toml"]


def test_simulate_counts_crossings(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", str(model), *SHORT, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    events = gr.simulate(gr.load(model), cycles=4, samples_per_cycle=64).events
    counted = {name: int((events["clearance"] == name).sum()) for name in content["crossings"]}
    assert content["crossings"] == counted
    assert content["output"] is None
    assert main(["simulate", str(model), *SHORT]) == 0
    assert capsys.readouterr().out.splitlines()[2].split() == ["clearance", "crossings"]


def test_criteria_judges_a_saved_run(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", str(model), *SHORT, "-o", "out.nc"]) == 0
    capsys.readouterr()
    assert main(["criteria", "out.nc", "--json"]) == 0
    verdict = judged(gr.open_run("out.nc"))
    printed = json.loads(capsys.readouterr().out)
    assert {key: printed[key] for key in verdict.to_dict()} == json.loads(json.dumps(verdict.to_dict()))
    assert main(["criteria", "out.nc"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == str(verdict)
    assert [line.split()[0] for line in lines[3:]] == [part.name for part in verdict.parts]


def test_modes_agree_with_the_call(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", str(model), "--contact-ratio", "clutch=0.1", "--region", "spline=0", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    actual = gr.modes(gr.load(model), contact_ratio={"clutch": 0.1}, region={"spline": 0})
    assert printed["frequencies"] == actual.frequencies.tolist()
    assert printed["shapes"][1] == dict(zip(actual.inertia_names, actual.shapes[:, 1].tolist(), strict=True))
    assert main(["modes", str(model)]) == 0
    _, table, words = (part.splitlines() for part in capsys.readouterr().out.split("\n\n"))
    assert table[0].split() == ["mode", "frequency", "[Hz]", "damping", "[%]", *synthetic.NAMES]
    closed = gr.modes(gr.load(model)).frequencies / (2.0 * np.pi)
    assert [float(line.split()[1]) for line in table[1:]] == pytest.approx(closed, rel=1e-5)
    assert [line.split()[0] for line in words[1:]] == ["1", "2", "3", "4"]


def test_check_says_ok_and_what_is_there(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(model)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "ok"
    assert "meshes      gear" in lines
    assert "speed       150 rad/s" in lines
    assert main(["check", str(model), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["ok"] is True
    assert content["clearances"] == ["clutch", "spline", "gear"]


def test_columns_of_check_stand_apart_for_every_example(capsys: pytest.CaptureFixture[str]) -> None:
    """A key, two blanks at least, and what it has: also where a kind of component has a long name."""
    for file in (EXAMPLES / "planetary_set.toml", EXAMPLES / "run_up.toml", EXAMPLES / "paper" / "case3.toml"):
        assert main(["check", str(file)]) == 0
        lines = capsys.readouterr().out.splitlines()[1:]
        values = [re.match(r"[a-z]+( [a-z]+)* {2,}(?=\S)", line) for line in lines]
        assert len({match.end() for match in values if match}) == 1
        assert all(values), lines


def test_check_tells_every_problem(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = synthetic.MODEL.replace("J = 0.3", "J = -0.3").replace('["flywheel", "hub"]', '["flywheel", "hob"]')
    model.write_text(text, encoding="utf-8")
    assert main(["check", str(model), "--json"]) == 2
    out, err = capsys.readouterr()
    content = json.loads(out)
    assert content["ok"] is False
    assert len(content["problems"]) == 2
    assert {set(problem) == {"place", "value", "rule", "remedy"} for problem in content["problems"]} == {True}
    assert [line.startswith(f"error: {model}:") for line in err.splitlines()] == [True, True]
    assert 'did you mean "hub"?' in err


def test_schema_is_that_of_the_classes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(json_schema()))


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == gr.__version__


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    for name, (_, words) in COMMANDS.items():
        assert f" {name} " in out
        assert words in out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == 0
    assert capsys.readouterr().out.startswith(f"Usage: gearrattle {command}")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_argument_of_a_command_has_words(command: str) -> None:
    silent = [
        argument.name
        for argument in app()[command].assemble_argument_collection(parse_docstring=True)
        if argument.name != "*" and not argument.parameter.help  # "*": a group of them
    ]
    assert silent == []


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_the_words_of_every_argument_and_fills_its_lines(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No mark of the docstring is taken for markup, and none of its line ends breaks a line on a wide terminal."""
    monkeypatch.setenv("COLUMNS", "600")
    assert main([command, "--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for argument in app()[command].assemble_argument_collection(parse_docstring=True):
        words = " ".join((argument.parameter.help or "").split())
        assert any(words in line for line in lines), (argument.name, words)


def whole_options() -> list[tuple[str, str]]:
    """Every option of every command that takes a whole number."""
    return [
        (command, argument.name)
        for command in COMMANDS
        for argument in app()[command].assemble_argument_collection()
        if re.search(r"\bint\b", str(argument.hint))
    ]


def test_there_are_options_that_take_whole_numbers() -> None:
    assert {("run", "--cycles"), ("orders", "--turns"), ("screen", "--workers")} <= set(whole_options())


@pytest.mark.parametrize(("command", "option"), whole_options())
@pytest.mark.parametrize("text", ["3.5", "3.0", "1e1"])
def test_an_option_that_counts_takes_whole_numbers_alone(
    command: str, option: str, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    needed = {"fit": ["data.toml"], "validate": ["record.csv"], "orders": ["n"], "spectra": ["--channel", "n"]}
    needed["continue"] = needed["threshold"] = ["--path", "excitation.speed", "--range", "1:2"]
    assert main([command, "absent.toml", *needed.get(command, []), option, text]) == 2
    assert f'{option}: "{text}" must be a whole number' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run"], "requires an argument"),
        (["rum"], '"rum"'),
        (["run", "train.toml", "--cycles", "many"], "--cycles"),
        (["run", "train.toml", "--cycle", "3"], "--cycle"),
        (["run", "train.toml", "--cycles", "3.5"], '--cycles: "3.5" must be a whole number'),
        (["run", "train.toml", "--cycles", "-3"], "simulation.cycles"),
        (["run", "train.toml", "--cycles", "4", "--discard", "4"], "discard"),
        (["run", "train.toml", "--algorithm", "exct"], 'did you mean "exact"?'),
        (["run", "train.toml", "--step", "3 kg"], "step"),
        (["run", "train.toml", "--initial", "moving"], "initial"),
        (["run", "missing.toml"], "missing.toml: no such file"),
        (["run", "."], "a folder"),
        (["run", "train.toml", "-o", "train.toml"], "or a file that ends in .nc, .csv, .pdf, .pptx or .xlsx"),
        (["simulate", "train.toml", "-o", "out.mat"], "or a file that ends in .nc, .csv, .pdf, .pptx or .xlsx"),
        (["simulate", "train.toml", "-o", "folder.nc"], "is a folder"),
        (["criteria", "train.toml"], "gearrattle run train.toml"),
        (["criteria", "missing.nc"], "missing.nc"),
        (["criteria", "broken.nc"], "broken.nc"),
        (["modes", "train.toml", "--contact-ratio", "clutch"], "must be NAME=VALUE"),
        (["modes", "train.toml", "--contact-ratio", "clutch=some"], "must be a number"),
        (["modes", "train.toml", "--contact-ratio", "cluch=0.5"], "cluch"),
        (["modes", "train.toml", "--region", "gear=7"], "gear"),
        (["modes", "train.toml", "--region", "gear=0.6"], "must be a whole number"),
        (["modes", "train.toml", "--contact-ratio", "gear=0.1", "--contact-ratio", "gear=0.9"], "has a value already"),
        (["modes", "train.toml", "--over", "gear=0.1,x"], "must be a number"),
        (["modes", "train.toml", "--speeds", "3000 rpm:800 rpm", "-o", "out"], "a lowest and a highest speed"),
        (["modes", "train.toml", "--speeds", "20 Hz:30 Hz"], "angular velocity"),
        (["modes", "train.toml", "-o", "train.toml"], "or a file that ends in .nc, .csv, .pdf, .pptx or .xlsx"),
    ],
    ids=" ".join,
)
def test_bad_usage_is_told_and_writes_nothing(
    model: Path, words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (model.parent / "folder.nc").mkdir()
    (model.parent / "broken.nc").write_bytes(b"\x89HDF no")
    before = names(model.parent)
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert re.search("^error: ", err, re.MULTILINE)  # on a busy machine a line of progress comes before it
    assert "Traceback" not in err
    assert names(model.parent) == before


@pytest.mark.parametrize(
    ("error", "code", "error_message"),
    [
        (OSError(errno.ENOSPC, "No space left on device", "x"), 1, "disk is full"),
        (RuntimeError("Unable to flush file's cached information (No space left on device)"), 1, "disk is full"),
        (
            PermissionError(errno.EACCES, "Permission denied", "/x/y"),
            1,
            "/x/y: permission denied; choose another place",
        ),
        (OSError(errno.EROFS, "Read-only file system", "/x"), 1, "choose another place"),
        (OSError(errno.EIO, "Input/output error", "/x"), 1, "/x: input/output error"),
        (MemoryError(), 1, "out of memory"),
        (ConvergenceError("no root", time=0.1, remedy="a smaller step"), 1, "no root; try: a smaller step"),
        (Cancelled("stop"), 130, "nothing was written"),
        (KeyboardInterrupt(), 130, "nothing was written"),
        (ZeroDivisionError("oops"), 1, "internal error, ZeroDivisionError: oops"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else None,
)
def test_failures_have_a_code_and_a_remedy(error: BaseException, code: int, error_message: str) -> None:
    actual, message = explain(error)
    assert actual == code
    assert error_message in message


def test_an_internal_error_says_what_it_came_from() -> None:
    error = ImportError("cannot import the command")
    error.__cause__ = NameError("name 'torque' is not defined")
    assert "cannot import the command, because of NameError: name 'torque' is not defined\n" in explain(error)[1]


def test_a_failing_simulation_writes_nothing(
    model: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ConvergenceError("the step is unstable", time=0.5, remedy='algorithm "exact"')

    monkeypatch.setattr("gearrattle.run", fail)
    assert main(["run", str(model)]) == 1
    assert capsys.readouterr().err == 'error: the step is unstable; try: algorithm "exact"\n'
    assert names(model.parent) == ["train.toml"]


def test_debugging_shows_where(
    model: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("GEARRATTLE_DEBUG", "1")
    assert main(["check", "missing.toml"]) == 2
    assert "Traceback" in capsys.readouterr().err


def test_the_folder_is_tried_before_anything_is_simulated(
    model: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(_: Staging) -> Staging:
        raise PermissionError(errno.EACCES, "Permission denied", "/locked")

    def simulate(*_: object, **__: object) -> None:
        raise AssertionError("simulated before the folder was tried")

    monkeypatch.setattr(Staging, "__enter__", refuse)
    monkeypatch.setattr("gearrattle.run", simulate)
    assert main(["run", str(model), "-o", "/locked"]) == 1
    assert capsys.readouterr().err == "error: /locked: permission denied; choose another place with -o\n"


@pytest.mark.skipif(os.name != "posix", reason="permissions are POSIX")
@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write anywhere")
def test_a_locked_folder(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    locked = model.parent / "locked"
    locked.mkdir(mode=0o500)
    assert main(["run", str(model), *SHORT, "-o", str(locked / "out")]) == 1
    assert "permission denied" in capsys.readouterr().err


def test_a_closed_pipe_is_no_error_message(model: Path) -> None:
    code = "import sys; from gearrattle.cli import main; sys.exit(main(['schema']))"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait(timeout=60) == 1
