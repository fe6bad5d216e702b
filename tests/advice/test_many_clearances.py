"""Advice on a gearbox of many clearances: counts and ranges in the lines, a row a clearance in a table."""

from __future__ import annotations

import pytest
from benchmarks.growth.models import gearbox

import gearrattle as gr
from gearrattle.advice.clearance_advice import LISTED
from gearrattle.report.advice_page import AdvicePage


@pytest.fixture(scope="module")
def advice() -> gr.typing.Advice:
    return gr.advise(gearbox(2 * LISTED + 4, LISTED + 2, 8))


def test_lines_do_not_name_every_clearance(advice: gr.typing.Advice) -> None:
    names = [f"mesh{i}" for i in range(LISTED + 1)]
    for topic in ("clearances", "contact ratios"):
        line = advice.line(topic)
        for words in (line.words, *line.evidence):
            assert sum(name in words for name in names) <= 1
    assert f"{LISTED + 2} clearances" in advice.line("contact ratios").words


def test_the_table_has_a_row_a_clearance(advice: gr.typing.Advice) -> None:
    lines, clearances = AdvicePage(advice).answer()
    assert len(lines.rows) > len(advice.lines)
    assert [row[0] for row in clearances.rows] == ["clutch", *(f"mesh{i}" for i in range(LISTED + 1))]
    said = {f.subject: f.value for f in advice.forecasts if f.quantity == "regime"}
    assert {row[0]: row[1] for row in clearances.rows} == said
    assert "–" not in [row[3] for row in clearances.rows]


def test_few_clearances_stand_in_the_line() -> None:
    short = gr.advise(gr.example("case3"), cycles=8)
    assert len(AdvicePage(short).answer()) == 1
    assert "gear" in short.line("contact ratios").words
