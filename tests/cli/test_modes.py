"""``gearrattle modes``: words, crossings, the page, JSON, units."""

from __future__ import annotations

import base64
import json
import re
from math import pi
from pathlib import Path
from xml.etree import ElementTree

import pytest

import gearrattle as gr
from gearrattle.cli import main
from tests import synthetic
from tests.architecture.places import EXAMPLES

EIGHT = str(EXAMPLES / "paper" / "eight_dof.toml")


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "train.toml"
    path.write_text(synthetic.MODEL, encoding="utf-8")
    return path


def test_words_tell_what_works_and_what_shakes(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", EIGHT]) == 0
    words = capsys.readouterr().out.split("\n\n")[1].splitlines()
    assert words[0].startswith("mode 1: rigid motion; excited by torque on flywheel 99 %")
    assert words[1] == "mode 2: works in clutch 98.8 %; excited by torque on flywheel 0.98 %"
    assert words[7] == "mode 8: works in mesh_78 98 %; excited by transmission error of mesh_78 98 %"
    assert list(Path().iterdir()) == [Path("train.toml")]


def test_crossings_are_printed_for_a_range(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", EIGHT, "--speeds", "800 rpm:3000 rpm"]) == 0
    lines = capsys.readouterr().out.split("\n\n")[2].splitlines()
    found = gr.campbell(gr.load(EIGHT), "800 rpm:3000 rpm")
    assert lines[0] == "speeds from 800 rpm to 3000 rpm (83.78 to 314.2 rad/s):"
    assert [float(line.split()[0]) for line in lines[2:]] == pytest.approx(
        [crossing.speed * 30.0 / pi for crossing in found.crossings], rel=1e-3
    )
    assert main(["modes", EIGHT, "--speeds", "800:3000"]) == 0
    assert "speeds from 7639 rpm to 28650 rpm (800 to 3000 rad/s):" in capsys.readouterr().out
    assert main(["modes", EIGHT, "--speeds", "1 rpm:2 rpm"]) == 0
    assert capsys.readouterr().out.endswith("no order meets a mode in this range\n")


def test_the_page_needs_nothing_else(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", str(model), "-o", "out", "--over", "gear=0.1,0.5,1"]) == 0
    page = Path("out/modes.html").read_text(encoding="utf-8")
    assert capsys.readouterr().out.splitlines()[-1] == "page: out/modes.html"
    for words in ("Campbell diagram", "Crossings", "Shapes", "Strain energy", "gear 0.5", "default-src 'none'"):
        assert words in page
    for forbidden in ("http:", "https:", "<script"):
        assert forbidden not in page
    assert not re.search(r"\bnan\b", page)
    inlined = [base64.b64decode(data) for data in re.findall(r"data:image/svg\+xml;base64,([^\"]+)", page)]
    names = ["campbell", *(f"mode-{mode}" for mode in range(1, 5))]
    assert inlined == [Path(f"out/figures/{name}.svg").read_bytes() for name in names]
    assert sorted(path.name for path in Path("out").iterdir()) == ["figures", "modes.html", "modes.json"]
    for drawing in inlined:
        assert ElementTree.fromstring(drawing).tag.endswith("svg")
        assert not re.search(rb"\bnan\b", drawing)


def test_json_is_the_file_of_the_page(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", str(model), "-o", "out", "--json"]) == 0
    printed = capsys.readouterr()
    told = json.loads(printed.out)
    written = json.loads(Path("out/modes.json").read_text(encoding="utf-8"))
    assert {"format": "gearrattle modes summary 1", **told} == written
    assert printed.err.splitlines() == ["page: out/modes.html"]
    found = gr.modes(gr.load(model))
    assert told["strain_energy"][0] == {"clutch": None, "spline": None, "gear": None}
    assert list(told["strain_energy"][1].values()) == found.strain_energy[:, 1].tolist()
    assert list(told["participation"][2].values()) == found.participation[:, 2].tolist()
    assert told["modal_inertia"] == found.modal_inertia.tolist()
    assert told["campbell"] == json.loads(json.dumps(gr.campbell(gr.load(model)).to_dict()))


def test_a_page_replaces_the_one_before_and_leaves_the_rest(model: Path) -> None:
    Path("out/figures").mkdir(parents=True)
    Path("out/figures/mode-9.svg").write_text("old", encoding="utf-8")
    Path("out/modes.html").write_text("old", encoding="utf-8")
    Path("out/mine.txt").write_text("mine", encoding="utf-8")
    assert main(["modes", str(model), "-o", "out"]) == 0
    assert Path("out/mine.txt").read_text(encoding="utf-8") == "mine"
    assert not Path("out/figures/mode-9.svg").exists()
    assert not list(Path().glob(".gearrattle-*"))


def test_a_failure_leaves_nothing(model: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from gearrattle.report import modes as page

    def fails(*_: object) -> bytes:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(page, "mode_sketch", fails)
    assert main(["modes", str(model), "-o", "out"]) == 1
    assert list(Path().iterdir()) == [Path("train.toml")]


def test_a_model_without_units_shows_none(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain = gr.nondimensionalize(gr.load(model)).model
    Path("plain.toml").write_text(plain.to_toml(), encoding="utf-8")
    assert main(["modes", "plain.toml", "-o", "out", "--speeds", "0:3"]) == 0
    told = capsys.readouterr().out + Path("out/modes.html").read_text(encoding="utf-8")
    told += "".join(path.read_text(encoding="utf-8") for path in Path("out/figures").glob("*.svg"))
    assert "Hz" not in told
    assert "rpm" not in told
    assert "kg m²" not in told


@pytest.mark.parametrize(
    "text",
    [
        'schema = 1\ninertia = [{ name = "disc", J = 1 }]\nexcitation = { speed = 1 }\n',
        'schema = 1\ninertia = [{ name = "disc", J = 1 }]\ncoupling = [{ name = "k", between = ["disc", "ground"], '
        "stiffness = 4 }]\nexcitation = { speed = 1 }\n",
        'schema = 1\ninertia = [{ name = "a", J = 1 }, { name = "b", J = 1 }]\nexcitation = { speed = 1 }\n'
        'torque = [{ on = "a", harmonics = [{ order = 1, amplitude = 1 }] }]\n',
    ],
    ids=["one", "held", "apart"],
)
def test_small_models_have_a_page_too(text: str, model: Path) -> None:
    Path("small.toml").write_text(text, encoding="utf-8")
    assert main(["modes", "small.toml", "-o", "out"]) == 0
    page = Path("out/modes.html").read_text(encoding="utf-8")
    assert not re.search(r"\bnan\b", page)
    assert "No order line meets a natural frequency in this range." in page


def test_equal_modes_are_noted(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bodies = "".join(f'[[inertia]]\nname = "{name}"\nJ = 0.1\n' for name in ("a", "b", "c"))
    shafts = "".join(
        f'[[coupling]]\nname = "{name}s"\nbetween = ["{name}", "ground"]\nstiffness = 10\n' for name in ("a", "b")
    )
    Path("twins.toml").write_text(f"schema = 1\n{bodies}{shafts}[excitation]\nspeed = 1\n", encoding="utf-8")
    assert main(["modes", "twins.toml", "-o", "out"]) == 0
    assert "modes 2 and 3 have one frequency" in capsys.readouterr().err
    assert "Modes 2 and 3 have the same frequency" in Path("out/modes.html").read_text(encoding="utf-8")
