"""The whole reproduction, shortened: every row has a status, and what does not depend on length has its figure."""

from __future__ import annotations

import json
import math
import time

import pytest
from numba.core import event

from gearrattle.cli import main
from gearrattle.comparison import contender_runs
from gearrattle.engine.solvers import SOLVERS
from gearrattle.errors import Cancelled
from gearrattle.report.result_kinds import presentation_of
from gearrattle.report.text import plain_text
from gearrattle.reproduction import measurements, reproduce
from gearrattle.reproduction.bulirsch_stoer import OTHERS
from gearrattle.reproduction.reproduction_record import CONSTRUCTED, DIFFERS, NOISE, STATUSES, UNAVAILABLE

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def shortest():
    """A reproduction whose runs are as short as they may be, and made once: all rows, but no figure of a length."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measurements, "_QUICK", 0.01)
        patch.setattr(contender_runs, "AGAIN", 1)
        return reproduce(quick=True)


@pytest.fixture(scope="module")
def timed():
    """A quick reproduction, and the processor time of every share; once more if kernels had to be compiled."""
    with event.install_recorder("numba:compile") as compilations:
        outcome = _timed()
    return _timed() if compilations.buffer else outcome


def _timed():
    shares = [(0.0, time.thread_time())]
    result = reproduce(quick=True, progress=lambda share: shares.append((share, time.thread_time())))
    return result, shares


@pytest.fixture(scope="module")
def reproduction(timed):
    result, shares = timed
    assert [share for share, _ in shares] == sorted(share for share, _ in shares)
    assert shares[-1][0] == 1.0
    return result


@pytest.mark.long
def test_the_remaining_time_is_true_within_a_factor_of_two(reproduction, timed):
    """By processor time, from a tenth of the way to nine tenths, at the pace so far."""
    _, shares = timed
    begin, end = shares[0][1], shares[-1][1]
    for share, now in shares:
        if 0.1 <= share <= 0.9:
            reported = (now - begin) * (1.0 - share) / share
            assert 0.5 < reported / (end - now) < 2.0, share


@pytest.mark.long
def test_rk2_and_rk4_take_the_printed_steps(reproduction):
    """A tenth of them in a quick run."""
    for table, (rk2, rk4) in ((3, (80_000, 6_400)), (4, (85_000, 6_700))):
        for label, steps, stages in (("RK2", rk2, 2), ("RK4", rk4, 4)):
            row = reproduction.row(f"Table {table}, {label}")
            for kind in ("rattling", "loaded"):
                assert row.figures[f"steps_{kind}"] == steps
                assert row.figures[f"calls_{kind}"] == stages * steps


def test_rows_that_cannot_fail_are_counted_apart(shortest):
    constructed = {row.item for row in shortest.rows if row.status == CONSTRUCTED}
    assert constructed == {
        "Table 1, all but Omega_22^2",
        "Table 2, case 1",
        "Table 2, case 2",
        "Table 2, case 3",
        "Sec. 3, eight natural frequencies",
        "Sec. 3, shape psi_3",
        "Sec. 3, lumping eight inertias below 75 Hz",
        "Table 3, RK2",
        "Table 3, RK4",
        "Table 4, RK2",
        "Table 4, RK4",
    }
    assert shortest.counts()[CONSTRUCTED] == len(constructed)


def test_slips_of_section_3_are_said(shortest):
    assert shortest.row("Sec. 3, the first mode in Hz").figures["hertz"] == pytest.approx(346.0 / 6.283185307, rel=2e-4)
    assert shortest.row("Sec. 3, shape psi_2").figures["entries"] == 9
    assert shortest.row("Sec. 3, shape psi_2").figures["off"] < 0.005
    assert shortest.row("Sec. 3, eight natural frequencies").figures["off"] < 2e-4


@pytest.mark.long
def test_what_others_do_as_well_is_not_reproduced_as_the_only_one(reproduction):
    row = reproduction.row("Sec. 9, BUS gives incompatible solutions")
    times = [row.figures[f"case_{c}_{name}"] / row.figures[f"case_{c}_exact"] for c in (2, 3) for name in OTHERS]
    assert max(times) > 2.0
    assert row.status == DIFFERS


@pytest.mark.long
def test_the_cost_of_a_call_is_that_of_all_printed_lines(reproduction):
    for table, words in ((3, "0.97 (RK2) to 3.99 ms (RK4)"), (4, "0.99 (RK2) to 4.19 ms (RK4)")):
        row = reproduction.row(f"Table {table}, times relative to RK2, loaded")
        assert row.status != DIFFERS or words in row.why


def test_every_row_says_what_became_of_it(shortest):
    assert len({row.item for row in shortest.rows}) == len(shortest.rows)
    for row in shortest.rows:
        assert row.status in STATUSES
        assert row.paper
        assert row.ours
        assert row.why or row.status != DIFFERS, row.item
    assert sum(shortest.counts().values()) == len(shortest.rows)


def test_rk4_s_step_is_outside_its_stability_region(shortest):
    row = shortest.row("Tables 3 and 4, RK4's step")
    assert row.status == DIFFERS
    assert round(row.figures["growth"], 2) == 1.69
    assert row.figures["limit"] == pytest.approx(0.0119757, abs=5e-8)


@pytest.mark.long
@pytest.mark.parametrize("case", [1, 2, 3])
def test_rk4_invents_rattle_that_exact_and_rk2_do_not_show(reproduction, case):
    figures = reproduction.row(f"Sec. 9, RK4 gives compatible solutions, loaded case {case}").figures
    assert figures["exact"] == figures["rk2"] == 0
    assert figures["rk4"] > 100
    assert 1.8 < figures["reach"] < 2.3


@pytest.mark.long
def test_coherences_that_chance_gives_are_called_so(reproduction):
    reported = {row.item: row for row in reproduction.rows if "coherence of RK" in row.item}
    assert len(reported) == 8
    noise = {float(row.paper) for row in reported.values() if row.status == NOISE}
    assert noise == {0.23, 0.35, 0.37}


def test_what_is_not_on_the_shelf_is_said_to_be_missing(shortest):
    missing = "gear" not in SOLVERS
    assert (shortest.row("Table 3, GRS").status == UNAVAILABLE) == missing


@pytest.mark.long
def test_rejections_come_with_crossings(reproduction):
    for row in reproduction.rows:
        if "trial steps fail" in row.item:
            assert min(row.figures["rkf"], row.figures["rkv"]) > row.figures["rkv-events"]


def test_page_and_file_carry_every_row(shortest, tmp_path):
    shortest.save(tmp_path)
    content = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert sum(len(section["rows"]) for section in content["sections"]) == len(shortest.rows)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("<h2>") == len(shortest.sections) + 1
    assert "A quick run" in page
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org", "")
    charts = [chart.key for section in shortest.sections for chart in section.charts]
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


def test_the_terminal_counts_the_rows_and_says_which_differ_and_why(shortest):
    lines = plain_text(presentation_of(shortest)).splitlines()
    counts = shortest.counts()
    table = [line.split(maxsplit=1) for line in lines[2 : len(counts) + 4]]
    assert table == [
        ["rows", "status"],
        *([f"{n}", status] for status, n in counts.items()),
        [f"{len(shortest.rows)}", "in all"],
    ]
    differing = next(k for k, line in enumerate(lines) if line.startswith("what differs"))
    assert lines[differing + counts["differs"] + 1 :] == ["The page has all rows."]
    why = next(line for line in lines if line.startswith("Sec. 3, the first mode in Hz"))
    assert why.endswith("  the printed 346 rad/s are 55.1 Hz, not 22")
    reproduced = next(row.item for row in shortest.rows if row.status == "reproduced")
    assert not any(line.startswith(reproduced) for line in lines)
