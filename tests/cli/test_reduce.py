"""``gearrattle reduce``: the report, the file, JSON, wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main

EIGHT = Path(__file__).parents[2] / "examples" / "paper" / "eight_dof.toml"
PAPER = ("--keep", "clutch", "--keep", "spline", "--keep", "mesh_34")
BAND = ("--up-to", "75 Hz")


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_report_and_the_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reduce", str(EIGHT), *BAND, *PAPER, "-o", "reduced.toml"]) == 0
    out, _ = capsys.readouterr()
    lines = out.splitlines()
    assert lines[0].startswith("8 bodies become 4, for up to 75 Hz. Frequencies in the band are at most ")
    bodies = lines.index("Bodies")
    assert [line.split() for line in lines[bodies + 2 : bodies + 6]] == [
        ["gear_3", f"gear_{number}", "1"] for number in (5, 6, 7, 8)
    ]
    assert "allowed 5 %" in out
    assert out.splitlines()[-1] == "saved: reduced.toml"
    assert list(Path().iterdir()) == [Path("reduced.toml")]
    saved = gr.load("reduced.toml")
    assert saved == gr.reduce(gr.load(EIGHT), "75 Hz", keep=PAPER[1::2]).model
    assert gr.modes(saved).frequencies == pytest.approx([0, 346, 7937, 48091], abs=0.5)
    assert main(["simulate", "reduced.toml", "--cycles", "2", "--samples-per-cycle", "16"]) == 0


def test_json_on_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reduce", str(EIGHT), *BAND, "--merge", "mesh_56", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["groups"] == {"gear_3": {"gear_5": 1.0, "gear_6": 1.0, "gear_7": 1.0}}
    assert printed["elements"]["mesh_56"]["reason"] == "asked to be merged"
    assert printed["error"]["frequency"] < 0.001
    assert printed["output"] is None
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--up-to", "75 rpm"), "up_to"),
        (("--up-to", "fast"), "up_to"),
        ((), "up-to"),
        ((*BAND, "--keep", "nothing"), 'keep: found "nothing"; there is no such element'),
        ((*BAND, "--merge", "clutch"), "% is allowed"),
        ((*BAND, "--limit", "2"), "limit"),
        ((*BAND, "--check", "twice"), "check"),
        ((*BAND, "-o", "reduced.json"), "or a file that ends in .nc, .csv, .pdf, .pptx, .xlsx or .toml"),
    ],
)
def test_wrong_input_is_told_and_writes_nothing(
    words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    output = () if "-o" in words else ("-o", "reduced.toml")
    assert main(["reduce", str(EIGHT), *words, *output]) == 2
    assert said in capsys.readouterr().err
    assert list(Path().iterdir()) == []


def test_check_simulate_prints_what_differs(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    model = gr.load(EIGHT).with_({"simulation.cycles": 12, "simulation.discard": 6, "simulation.samples_per_cycle": 64})
    (tmp_path / "short.toml").write_text(model.to_toml(), encoding="utf-8")
    words = ["reduce", str(tmp_path / "short.toml"), *BAND, *PAPER, "--check", "simulate"]
    assert main([*words, "--json"]) == 0
    entries = json.loads(capsys.readouterr().out)["simulated"]["entries"]
    assert main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    begin = next(i for i, line in enumerate(lines) if "quantities differ" in line)
    assert f"of {len(entries)} quantities differ, numbers by more than 1 %" in lines[begin]
    rows = lines[begin + 2 :]
    for entry in entries:
        full, reduced = entry["full"], entry["reduced"]
        if entry["criterion"] == "spectrum" or full is None or reduced is None:
            continue
        if isinstance(full, str):
            different = full != reduced
        else:
            different = abs(full - reduced) > 0.01 * max(abs(full), abs(reduced))
        listed = any(row.startswith(f"{entry['subject']}  ") and f" {entry['quantity']}  " in row for row in rows)
        assert listed == different, entry
