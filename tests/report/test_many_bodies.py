"""The report of a large driveline: a page that a browser opens, which says what it leaves out."""

from __future__ import annotations

from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.pipeline import Findings, judged
from gearrattle.report.plots.run_figures import charts
from tests.compositions.kinds import KINDS

BODIES, MOST = 64, 12


@pytest.fixture(scope="module")
def findings() -> Findings:
    return judged(gr.simulate(KINDS["64 bodies"].make()))


def test_a_figure_has_a_dozen_panels_and_says_which(findings: Findings) -> None:
    by_key = {chart.key: chart for chart in charts(findings)}
    for key in ("acceleration", "speed", "angle", "spectrum"):
        chart = by_key[key]
        shown = [panel.title for panel in chart.panels]
        assert len(shown) == MOST
        assert {"engine", "b1", "b62", "wheel"} <= set(shown)  # the driven one, and both ends of both clearances
        assert f"Shown are {MOST} of {BODIES} bodies" in chart.caption
        assert "results.nc holds all of them" in chart.caption
    assert len(by_key["deflection"].panels) == 2
    assert "Shown are" not in by_key["deflection"].caption


def test_the_page_is_small(findings: Findings, tmp_path: Path) -> None:
    findings.save(tmp_path / "o")
    page = (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    assert len(page) < 1_800_000
    assert "48 more" in page  # of a mode shape the bodies that move most are named
