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
from tests.architecture.places import EXAMPLES

EIGHT = str(EXAMPLES / "paper" / "eight_dof.toml")


def test_words_tell_what_works_and_what_shakes(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", EIGHT]) == 0
    sentence, frequencies, words = capsys.readouterr().out.split("\n\n")
    assert sentence.startswith("7 modes from ")
    assert frequencies.split()[:3] == ["mode", "frequency", "[Hz]"]
    rows = [re.split(r" {2,}", line.strip()) for line in words.splitlines()]
    assert rows[0] == ["mode", "works in", "excited by"]
    assert rows[1][:2] == ["1", "rigid motion"]
    assert rows[1][2].startswith("torque on flywheel 99 %")
    assert rows[2] == ["2", "clutch 98.8 %", "torque on flywheel 0.98 %"]
    assert rows[8] == ["8", "mesh_78 98 %", "transmission error of mesh_78 98 %"]
    assert list(Path().iterdir()) == [Path("train.toml")]


def test_crossings_are_printed_for_a_range(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", EIGHT, "--speeds", "800 rpm:3000 rpm"]) == 0
    sentence, *_, crossings = capsys.readouterr().out.split("\n\n")
    actual = gr.campbell(gr.load(EIGHT), "800 rpm:3000 rpm")
    assert f"{len(actual.crossings)} crossings with orders between 800 rpm and 3000 rpm" in sentence
    title, _, *rows = crossings.splitlines()
    assert title == "Crossings"
    assert [float(row.split()[0]) for row in rows[: len(actual.crossings)]] == pytest.approx(
        [crossing.speed * 30.0 / pi for crossing in actual.crossings][:12], rel=1e-3
    )
    assert main(["modes", EIGHT, "--speeds", "800:3000"]) == 0
    assert "between 7639 rpm and 28650 rpm" in capsys.readouterr().out
    assert main(["modes", EIGHT, "--speeds", "1 rpm:2 rpm"]) == 0
    assert "No order meets a natural frequency between 1 rpm and 2 rpm." in capsys.readouterr().out


def test_the_page_needs_nothing_else(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", str(model), "-o", "out", "--over", "gear=0.1,0.5,1"]) == 0
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert capsys.readouterr().out.splitlines()[-1] == "page: out/report.html"
    for words in ("Campbell diagram", "Crossings", "Shapes", "Strain energy", "gear 0.5", "default-src 'none'"):
        assert words in page
    for forbidden in ("http:", "https:", "<script"):
        assert forbidden not in page
    assert not re.search(r"\bnan\b", page)
    inlined = [base64.b64decode(data) for data in re.findall(r"data:image/svg\+xml;base64,([^\"]+)", page)]
    names = ["campbell", *(f"mode-{mode}" for mode in range(1, 5))]
    assert inlined[1:] == [Path(f"out/figures/{name}.svg").read_bytes() for name in names[1:]]
    assert b"gear 0.5" in Path("out/figures/campbell.svg").read_bytes(), "a file carries its legend"
    files = sorted(path.name for path in Path("out").iterdir())
    assert files == ["figures", "report.html", "results.nc", "summary.json"]
    for drawing in inlined:
        assert ElementTree.fromstring(drawing).tag.endswith("svg")
        assert not re.search(rb"\bnan\b", drawing)


def test_json_is_the_file_of_the_page(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", str(model), "-o", "out", "--json"]) == 0
    printed = capsys.readouterr()
    content = json.loads(printed.out)
    written = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    assert content == {**written, "output": str(Path("out/report.html"))}
    assert printed.err == ""
    actual = gr.modes(gr.load(model))
    assert content["strain_energy"][0] == {"clutch": None, "spline": None, "gear": None}
    assert list(content["strain_energy"][1].values()) == actual.strain_energy[:, 1].tolist()
    assert list(content["participation"][2].values()) == actual.participation[:, 2].tolist()
    assert content["modal_inertia"] == actual.modal_inertia.tolist()
    assert content["campbell"] == json.loads(json.dumps(gr.campbell(gr.load(model)).to_dict()))


def test_a_page_replaces_the_one_before_and_leaves_the_rest(model: Path) -> None:
    Path("out/figures").mkdir(parents=True)
    Path("out/figures/mode-9.svg").write_text("old", encoding="utf-8")
    Path("out/report.html").write_text("old", encoding="utf-8")
    Path("out/mine.txt").write_text("mine", encoding="utf-8")
    assert main(["modes", str(model), "-o", "out"]) == 0
    assert Path("out/mine.txt").read_text(encoding="utf-8") == "mine"
    assert not Path("out/figures/mode-9.svg").exists()
    assert not list(Path().glob(".gearrattle-*"))


def test_a_failure_leaves_nothing(model: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from gearrattle.report import modes_page as page

    def fails(*_: object) -> bytes:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(page, "mode_sketch", fails)
    assert main(["modes", str(model), "-o", "out"]) == 1
    assert list(Path().iterdir()) == [Path("train.toml")]


def test_a_model_without_units_shows_none(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain = gr.nondimensionalize(gr.load(model)).model
    Path("plain.toml").write_text(plain.to_toml(), encoding="utf-8")
    assert main(["modes", "plain.toml", "-o", "out", "--speeds", "0:3"]) == 0
    printed = capsys.readouterr().out + Path("out/report.html").read_text(encoding="utf-8")
    printed += "".join(path.read_text(encoding="utf-8") for path in Path("out/figures").glob("*.svg"))
    assert "Hz" not in printed
    assert "rpm" not in printed
    assert "kg m²" not in printed


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
    page = Path("out/report.html").read_text(encoding="utf-8")
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
    assert "Modes 2 and 3 have the same frequency" in Path("out/report.html").read_text(encoding="utf-8")
