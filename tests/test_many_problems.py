"""Thousands of problems: every place lists twenty and counts the others."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import MOST_SHOWN, Problem, shown_problems
from gearrattle.measured.readers import read_raw
from gearrattle.workbench.checking import checked
from gearrattle.workbench.routes.json_answers import problems

COUNT = 3000
TEXT = "schema = 1\n[excitation]\nspeed = 1\n" + "".join(
    f'[[inertia]]\nname = "body{k}"\nJ = -1\n' for k in range(COUNT)
)
LAST = "and 2 980 more"


def test_the_error_has_all_and_lists_twenty() -> None:
    with pytest.raises(gr.ModelError) as caught:
        gr.loads(TEXT)
    assert len(caught.value.problems) == COUNT
    *first, last = str(caught.value).splitlines()
    assert first == [str(problem) for problem in caught.value.problems[:MOST_SHOWN]]
    assert last == LAST


def test_the_command_line_lists_twenty(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "many.toml"
    model.write_text(TEXT, encoding="utf-8")
    assert main(["check", str(model), "--json"]) == 2
    out, err = capsys.readouterr()
    assert len(err.splitlines()) == MOST_SHOWN + 1
    assert err.splitlines()[-1] == f"error: {LAST}"
    content = json.loads(out)
    assert content["count"] == COUNT
    assert len(content["problems"]) == MOST_SHOWN + 1
    assert content["problems"][-1]["rule"] == LAST


def test_the_workbench_lists_twenty() -> None:
    entries = checked(TEXT)["problems"]
    assert len(entries) == MOST_SHOWN + 1
    assert (entries[-1]["rule"], entries[-1]["path"], entries[-1]["line"]) == (LAST, [], None)
    answer = problems(400, [Problem("row", str(k), "is wrong") for k in range(COUNT)])
    assert json.loads(bytes(answer.body))["problems"][-1]["rule"] == LAST


@pytest.mark.parametrize("count", [0, 1, MOST_SHOWN])
def test_few_are_all_listed(count: int) -> None:
    every = [Problem("row", str(k), "is wrong") for k in range(count)]
    assert shown_problems(every) == every


@pytest.mark.parametrize("wrong", ["x", "1,2,3"])
def test_the_wrong_rows_of_a_record_are_counted(tmp_path: Path, wrong: str) -> None:
    rows = "".join(f"{k / 1000},{k % 7}\n" for k in range(10))
    (tmp_path / "record.csv").write_text(f"t [s],n [rpm]\n{rows}" + f"0.5,{wrong}\n" * COUNT, encoding="utf-8")
    with pytest.raises(gr.ModelError, match=r"record.csv:12.*; 2 999 lines more are wrong: 13, 14, .*, \.\.\."):
        read_raw(tmp_path / "record.csv")


def test_one_more_wrong_row_is_named(tmp_path: Path) -> None:
    (tmp_path / "record.csv").write_text("t [s],n [rpm]\n0,1\n1,x\n2,1\n3,\n4,y\n5,1\n", encoding="utf-8")
    with pytest.raises(gr.ModelError, match=r"record.csv:3: n: .*; one line more is wrong: 6"):
        read_raw(tmp_path / "record.csv")
