"""``gearrattle compare``: the table, the page, JSON, wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gearrattle.cli import main

SHORT = ("--cycles", "4", "--samples-per-cycle", "32", "-a", "rk4, rkv")


def test_the_table_and_the_advice(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(model), *SHORT]) == 0
    out, _ = capsys.readouterr()
    lines = out.splitlines()
    assert lines[0].startswith("Use exact")
    begin = next(i for i, line in enumerate(lines) if line.startswith("algorithm"))
    assert [line.split()[0] for line in lines[begin : begin + 4]] == ["algorithm", "exact", "rk4", "rkv"]
    assert list(Path().iterdir()) == [Path("train.toml")]


def test_the_page_needs_nothing_else(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(model), *SHORT, "-o", "out", "--no-work-precision"]) == 0
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert capsys.readouterr().out.splitlines()[-1] == "page: out/report.html"
    for words in ("Recommendation", "What it took", "How true it is", "Growth of errors", "rkv", "default-src 'none'"):
        assert words in page
    assert "http:" not in page
    assert "https:" not in page
    assert "<script" not in page
    content = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    assert [row["label"] for row in content["rows"]] == ["exact", "rk4", "rkv", "exact, 1e-12 away"]
    assert content["work_precision"] is None
    assert Path("out/figures/errors.svg").read_bytes().startswith(b"<svg")


def test_json_on_stdout(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(model), *SHORT, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["reference"] == "exact"
    assert printed["rows"][1]["cost"]["algorithm"] == "rk4"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-a", "rk5"), 'algorithms: found "rk5"; must be one of exact'),
        (("--step", "20 m"), "simulation.step"),
        (("--reference", "truth"), 'algorithms: found "truth"'),
    ],
)
def test_wrong_input_is_told_and_writes_nothing(
    model: Path, words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", str(model), "-o", "out", "--cycles", "2", *words]) == 2
    assert said in capsys.readouterr().err
    assert not Path("out").exists()
