"""``gearrattle advise``, and the advice in what ``gearrattle run`` writes."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from gearrattle.cli import main


def test_advice_in_words_and_as_json(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["advise", str(model), "--cycles", "40", "--up-to", "75 Hz"]) == 0
    out, _ = capsys.readouterr()
    heads = [line.split()[0] for line in out.splitlines()[2:] if not line.startswith("  ")]
    assert heads[:2] == ["topic", "lumping"]
    assert heads[-2:] == ["predictability", "other"]
    assert "the band asked for: 75 Hz" in out
    assert main(["advise", str(model), "--cycles", "40", "--json"]) == 0
    actual = json.loads(capsys.readouterr().out)
    assert {entry["quantity"] for entry in actual["forecasts"]} >= {"regime", "mean slope", "predictable cycles"}
    assert list(Path().iterdir()) == [model.relative_to(Path.cwd())]


@pytest.mark.parametrize("words", [("--cycles", "-3"), ("--up-to", "75 kg"), ("--algorithm", "magic")])
def test_bad_input_is_refused(model: Path, words: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["advise", str(model), *words]) == 2
    assert re.search("^error: ", capsys.readouterr().err, re.MULTILINE)


def test_run_keeps_the_advice_and_its_scores(model: Path) -> None:
    assert main(["run", str(model), "--cycles", "40", "--samples-per-cycle", "32", "-o", "out"]) == 0
    actual = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    assert [line["topic"] for line in actual["advice"]["lines"]][:2] == ["lumping", "scaling"]
    scores = {(entry["quantity"], entry["subject"], entry["by"]): entry for entry in actual["scores"]}
    regime = scores["regime", "gear", "pilot of 32 cycles"]
    gear = next(part for part in actual["parts"] if part["name"] == "gear")
    assert regime["happened"] == gear["regime"]
    assert regime["right"] == (regime["value"] == gear["regime"])
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert "Known before the run" in page
    assert "Forecasts that came true" in page
