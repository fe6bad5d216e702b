"""``gearrattle fit``: the report, the file, JSON, wrong input, Ctrl-C."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main
from tests.measured.fitting import made as rigs
from tests.measured.identification import made

DATA = """
[[mode]]
number = 2
frequency = "46.2 Hz"
relative_error = 0.001
[[mode]]
number = 3
frequency = "3012 rad/s"
relative_error = 0.001
"""
FREE = ("--free", "coupling.clutch.stiffness", "--free", "coupling.spline.stiffness")


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("start.toml").write_text(made.TRAIN.replace("15000.0", "12000.0"), encoding="utf-8")
    Path("data.toml").write_text(DATA, encoding="utf-8")


def test_the_report_and_the_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fit", "start.toml", "data.toml", *FREE, "-o", "fitted.toml", "--starts", "4"]) == 0
    out, _ = capsys.readouterr()
    assert out.startswith("2 parameters fitted to 2 numbers: chi-square ")
    assert out.splitlines()[3].split() == ["parameter", "start", "fitted", "standard", "error", "bounds"]
    assert "coupling.spline.stiffness  12000" in out
    assert "the data determine every parameter" in out
    assert out.splitlines()[-1] == "saved: fitted.toml"
    assert sorted(path.name for path in Path().iterdir()) == ["data.toml", "fitted.toml", "start.toml"]
    fitted = gr.load("fitted.toml")
    assert gr.modes(fitted).frequencies[1:3] == pytest.approx([46.2 * 6.283185307179586, 3012], rel=1e-9)
    free = list(FREE[1::2])
    assert fitted == gr.identification.fit(gr.load("start.toml"), "data.toml", free, starts=4).model


def test_a_model_that_does_not_explain_the_data_says_so_first(capsys: pytest.CaptureFixture[str]) -> None:
    wrong = DATA + '[[mode]]\nnumber = 4\nfrequency = "9000 Hz"\nrelative_error = 0.001\n'
    Path("wrong.toml").write_text(wrong, encoding="utf-8")
    assert main(["fit", "start.toml", "wrong.toml", *FREE, "--starts", "2"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("The model does not explain the data: residuals are ")
    assert "the data determine every parameter" not in out
    assert main(["fit", "start.toml", "wrong.toml", *FREE, "--starts", "2", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["explains"] is False
    assert printed["chance"] < 1e-3


def test_the_table_is_in_the_units_of_the_model_file(capsys: pytest.CaptureFixture[str]) -> None:
    text = made.TRAIN.replace("stiffness = 15000.0", 'stiffness = "12 kN*m/rad"')
    text = text.replace("stiffness = 1500.0", 'stiffness = "26 N*m/deg"')
    Path("written.toml").write_text(text, encoding="utf-8")
    assert main(["fit", "written.toml", "data.toml", *FREE, "--starts", "4"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "coupling.spline.stiffness 12 kN*m/rad" in out
    assert "coupling.clutch.stiffness 26 N*m/deg" in out
    assert "mode 2: frequency 46.2 Hz 46.2 Hz" in out


def test_json_on_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--free", "inertia.*.J", "--free", "*.stiffness", "--starts", "2", "--prior", "0.5", "--json"]
    assert main(["fit", "start.toml", "data.toml", *words]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert [p["path"] for p in printed["parameters"]][:2] == ["inertia.flywheel.J", "inertia.hub.J"]
    assert printed["undetermined"][0]["structural"] is True
    assert printed["undetermined"][0]["factor"] is None
    assert printed["residuals"][0]["unit"] == "rad/s"
    assert printed["output"] is None


def test_bounds_and_profile(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--bounds", "coupling.clutch.stiffness=1 kN*m/rad..1.4 kN*m/rad", "--starts", "1", "--profile"]
    assert main(["fit", "start.toml", "data.toml", *FREE, *words]) == 2  # the start lies outside
    assert "must hold the start, 1500" in capsys.readouterr().err
    words[1] = "coupling.clutch.stiffness=1 kN*m/rad..1.6 kN*m/rad"
    assert main(["fit", "start.toml", "data.toml", *FREE, *words]) == 0
    out = capsys.readouterr().out
    assert "1000 ... 1600" in out
    assert "95 % interval" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "no parameter is free"),
        (("--free", "coupling.nothing.stiffness"), "no coupling is named nothing"),
        ((*FREE, "-o", "fitted.json"), "or a file that ends in .nc, .csv, .pdf, .pptx, .xlsx or .toml"),
        ((*FREE, "-o", "start.toml"), "is read and would be lost"),
        ((*FREE, "-o", "data.toml"), "is read and would be lost"),
        ((*FREE, "--bounds", "coupling.clutch.stiffness=3"), "must be PATH=LOW..HIGH"),
        ((*FREE, "--contact-ratio", "clutch=x"), "must be a number"),
        ((*FREE, "--starts", "none"), "starts"),
    ],
)
def test_wrong_input_is_told_and_writes_nothing(
    words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.read_bytes() for path in Path().iterdir()}
    output = () if "-o" in words else ("-o", "fitted.toml")
    assert main(["fit", "start.toml", "data.toml", *words, *output]) == 2
    assert said in capsys.readouterr().err
    assert {path: path.read_bytes() for path in Path().iterdir()} == before


def test_a_measured_file_is_fitted_as_a_motion(capsys: pytest.CaptureFixture[str]) -> None:
    gr.write(rigs.recording(names=("gear",)), "rig.csv")
    Path("gap.toml").write_text(rigs.MODEL.replace("900.0", "1100.0"), encoding="utf-8")
    words = [
        "--free",
        "coupling.gap.stiffness",
        "--starts",
        "1",
        "--cycles",
        "32",
        "--start",
        "0.5",
        "-o",
        "fitted.toml",
    ]
    assert main(["fit", "gap.toml", "rig.csv", *words, "--match", "n_gear=velocity.gear"]) == 0
    out, _ = capsys.readouterr()
    assert "n_gear: order 1" in out
    fitted = gr.load("fitted.toml")
    assert rigs.value(fitted, "coupling.gap.stiffness") == pytest.approx(900.0, rel=0.01)
    assert main(["fit", "gap.toml", "rig.csv", *words, "--match", "n_gear=velocity.geer"]) == 2
    assert "velocity.geer" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_ctrl_c_leaves_nothing() -> None:
    program = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from gearrattle.cli import main; sys.exit(main())"
    )
    words = ["fit", "start.toml", "data.toml", "--free", "*.stiffness", "--starts", "100000", "-o", "fitted.toml"]
    with subprocess.Popen([sys.executable, "-c", program, *words], stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        assert b"fitting" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == b"interrupted: nothing was written"
    assert sorted(path.name for path in Path().iterdir()) == ["data.toml", "start.toml"]
