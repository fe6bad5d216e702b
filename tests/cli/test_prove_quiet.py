"""``gearrattle prove-quiet``: the answer, files of ranges, what is refused, and an interrupted search."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gearrattle.cli import main
from tests.architecture.places import EXAMPLES

MODEL = str(EXAMPLES / "backlash_oscillator.toml")
RANGE = "torque.0.mean=0.02:0.2"


def test_the_answer_and_its_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["prove-quiet", MODEL, "--range", RANGE, "--json", "-o", str(tmp_path / "page")]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["proven"] == pytest.approx(0.759, abs=1e-3)
    assert answer["ranges"] == {"torque.0.mean": {"torque.0.mean": [0.02, 0.2]}}
    assert {row["status"] for row in answer["shares"]} >= {"proven", "refuted"}
    page = (tmp_path / "page" / "report.html").read_text(encoding="utf-8")
    assert "its gap opens or closes" in page
    assert "Largest proven boxes" in page


def test_a_file_of_ranges(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "ranges.toml"
    file.write_text('schema = 1\nboxes = 30\n[range]\n"torque.0.mean" = [0.02, 0.2]\n', encoding="utf-8")
    speed = "excitation.speed=0.5:0.7"
    assert main(["prove-quiet", MODEL, str(file), "--range", speed, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert list(answer["ranges"]) == ["torque.0.mean", "excitation.speed"]
    assert answer["looked_at"] <= 30


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("schema = 1\nrange = 3\n", "must be a table of pairs"),
        ('schema = 2\n[range]\n"torque.0.mean" = [1, 2]\n', "reads schema 1 only"),
        ('schema = 1\nranges = 3\n[range]\n"torque.0.mean" = [1, 2]\n', 'did you mean "range"'),
        ('schema = 1\n[range]\n"torque.0.mean" = [2, 1]\n', "ranges.toml:3"),
        ('schema = 1\n[range]\n"torque.0.men" = [1, 2]\n', "ranges.toml:3"),
    ],
)
def test_wrong_files_are_refused_with_their_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str, words: str
) -> None:
    file = tmp_path / "ranges.toml"
    file.write_text(content, encoding="utf-8")
    assert main(["prove-quiet", MODEL, str(file)]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "a box needs one range"),
        (("--range", "torque.0.mean=1"), "must be two values"),
        (("--range", RANGE, "--resolution", "-1", "--within", "soon"), "--resolution"),
        (("--range", RANGE, "--within", "soon"), "--within"),
    ],
)
def test_wrong_options_are_refused(capsys: pytest.CaptureFixture[str], options: tuple[str, ...], words: str) -> None:
    assert main(["prove-quiet", MODEL, *options]) == 2
    assert words in capsys.readouterr().err


def test_an_interrupted_search_shows_what_is_known(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from gearrattle.cli import emit
    from gearrattle.cli.background import Watch

    seen: list[Any] = []

    def interrupted(work: Callable[[Any], Any], known: Callable[[Any], None]) -> None:
        """Stop the search when it has begun, as Ctrl-C does."""
        watch = Watch()
        watch.enter("first")
        watch.enter = lambda _: watch.stop()  # type: ignore[method-assign]
        seen.append(work(watch))
        known(seen[0])
        raise KeyboardInterrupt

    monkeypatch.setattr(emit, "watched", interrupted)
    options = ["--range", "excitation.speed=0.3:0.7", "--range", RANGE, "--resolution", "0"]
    assert main(["prove-quiet", MODEL, *options]) == 130
    shown = capsys.readouterr()
    assert "would have to be divided further" in shown.out
    assert not seen[0].result.is_complete
