"""The whole reproduction, shortened: every row has a status, and what does not depend on length has its figure."""

from __future__ import annotations

import json
import math

import pytest

from gearrattle.cli import main
from gearrattle.errors import Cancelled
from gearrattle.reproduction import reproduce
from gearrattle.reproduction.page import fill
from gearrattle.reproduction.record import DIFFERS, NOISE, STATUSES, UNAVAILABLE
from gearrattle.solvers import SOLVERS


@pytest.fixture(scope="module")
def found():
    shares: list[float] = []
    result = reproduce(quick=True, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    return result


def test_every_row_says_what_became_of_it(found):
    assert len({row.item for row in found.rows}) == len(found.rows)
    for row in found.rows:
        assert row.status in STATUSES
        assert row.paper
        assert row.ours
        assert row.why or row.status != DIFFERS, row.item
    assert sum(found.counts().values()) == len(found.rows)


def test_rk4_s_step_is_outside_its_stability_region(found):
    row = found.row("Tables 3 and 4, RK4's step")
    assert row.status == DIFFERS
    assert round(row.figures["growth"], 2) == 1.69
    assert row.figures["limit"] == pytest.approx(0.0119757, abs=5e-8)


@pytest.mark.parametrize("case", [1, 2, 3])
def test_rk4_invents_rattle_that_exact_and_rk2_do_not_show(found, case):
    figures = found.row(f"Sec. 9, RK4 gives compatible solutions, loaded case {case}").figures
    assert figures["exact"] == figures["rk2"] == 0
    assert figures["rk4"] > 100
    assert 1.8 < figures["reach"] < 2.3


def test_coherences_that_chance_gives_are_called_so(found):
    told = {row.item: row for row in found.rows if "coherence of RK" in row.item}
    assert len(told) == 8
    noise = {float(row.paper) for row in told.values() if row.status == NOISE}
    assert noise == {0.23, 0.35, 0.37}


def test_what_is_not_on_the_shelf_is_said_to_be_missing(found):
    missing = "gear" not in SOLVERS
    assert (found.row("Table 3, GRS").status == UNAVAILABLE) == missing


def test_rejections_come_with_crossings(found):
    for row in found.rows:
        if "trial steps fail" in row.item:
            assert min(row.figures["rkf"], row.figures["rkv"]) > row.figures["rkv-events"]


def test_page_and_file_carry_every_row(found, tmp_path):
    fill(found, tmp_path)
    content = json.loads((tmp_path / "reproduction.json").read_text(encoding="utf-8"))
    assert sum(len(section["rows"]) for section in content["sections"]) == len(found.rows)
    page = (tmp_path / "reproduction.html").read_text(encoding="utf-8")
    assert page.count("<h2>") == len(found.sections) + 1
    assert "A quick run" in page
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org", "")
    charts = [chart.key for section in found.sections for chart in section.charts]
    assert sorted(path.stem for path in (tmp_path / "figures").glob("*.svg")) == sorted(charts)


def test_progress_can_end_it():
    def stop(share: float) -> None:
        assert not math.isnan(share)
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        reproduce(quick=True, progress=stop)


def test_the_command_line_knows_one_paper(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["reproduce", "another", "--quick"]) == 2
    assert "paper" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
