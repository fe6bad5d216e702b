"""Other motions at the load of a run: told with their share and its interval, or not told where that costs too much."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from benchmarks.growth.models import gearbox
from scipy import stats

import gearrattle as gr
from gearrattle.advice.other_motions_advice import (
    ADVISED,
    PASSING,
    PERIODS,
    PILOTS,
    SMALL,
    TOPIC,
    _percent,
    others_of,
    periods_for,
)
from gearrattle.advice.pilot import run_pilot
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.orbits.attractors import settled_motions
from gearrattle.orbits.settling_limits import BLOCK
from gearrattle.orbits.start_states import state_of
from gearrattle.report.summary import findings_content
from tests.comparison.cases import case
from tests.orbits.test_families import train


def test_a_second_motion_is_told_with_its_basin() -> None:
    """Between the folds of its resonance the oscillator has two stable motions; what runs show is the quiet one."""
    advice = gr.advise(gr.example("backlash_oscillator"))
    line = advice.line(TOPIC)
    match = re.fullmatch(r"A second motion exists at this load: (.*), basin about (\d+) %\.", line.words)
    assert match is not None
    assert match[1] == "single-sided rattle, 1 T"
    assert advice.notes == (line.words,)
    shares = r"of (\d+) starts: single-sided rattle, 1 T (\d+), 95 % interval (\S+) % to (\S+) %"
    counts = re.search(shares, line.evidence[0])
    assert counts is not None
    among, count = int(counts[1]), int(counts[2])
    assert float(match[2]) == pytest.approx(100.0 * count / among, rel=0.05)
    theirs = stats.binomtest(count, among).proportion_ci(0.95, method="wilson")
    assert [float(counts[3]), float(counts[4])] == pytest.approx([100.0 * theirs.low, 100.0 * theirs.high], rel=0.05)
    assert "(the pilot's)" in line.evidence[0]


def test_none_is_said_not_to_be_proved() -> None:
    """Above both folds one motion is left."""
    advice = gr.advise(gr.example("backlash_oscillator").with_({"excitation.speed": 1.2}))
    words = advice.line(TOPIC).words
    assert "24 of 24 starts settle in it. That is no proof that there is none." in words
    assert advice.notes == ()


def test_starts_that_have_not_settled_are_counted() -> None:
    """The flywheel's mass settles slowly: 160 periods are too few for any start but the model's own."""
    words = gr.advise(gr.example("dual_mass_flywheel")).line(TOPIC).words
    assert "0 of 24 starts settle in it, 24 had not settled" in words


def test_a_run_says_it_too_where_it_is_nearly_free() -> None:
    findings = gr.run(gr.example("backlash_oscillator"))
    assert findings.advice is not None
    words = findings.advice.line(TOPIC).words
    assert words in findings.notes
    content = findings_content(findings)
    assert words in [line["words"] for line in content["advice"]["lines"]]
    assert words in findings.report


def test_what_costs_more_than_the_bound_is_left_to_advice() -> None:
    model = case("case3")
    pilot = run_pilot(model, 200)
    assert periods_for(pilot, PASSING) < PERIODS <= periods_for(pilot, ADVISED)
    findings = gr.run(model, cycles=40)
    assert findings.advice is not None
    assert TOPIC not in [line.topic for line in findings.advice.lines]


def test_a_long_run_may_ask_for_a_tenth_of_its_own_work() -> None:
    model = gr.example("case1")
    pilot = run_pilot(model, 32)
    assert others_of(model, pilot, is_asked=False) == ((), ())
    lines, notes = others_of(model, replace(pilot, planned=50_000), is_asked=False)
    assert "double-sided rattle, 1 T" in lines[0].words
    assert notes == (lines[0].words,)


def test_advice_says_which_starts_it_left_out() -> None:
    """A period of the planetary set costs so much that the starts do not fit into what advice may spend."""
    line = gr.advise(gr.example("planetary_set")).line(TOPIC)
    assert any("of 24 starts left out" in words for words in line.evidence)
    assert any("gr.basins" in words for words in line.evidence)


def test_a_large_driveline_may_spend_fewer_calls() -> None:
    """By the square of its size, for that is how the cost of a call grows; twice the pilot's periods in any case."""
    model = gearbox(2 * SMALL, 2)
    pilot = run_pilot(model, 8, cycles=8)
    a_period = pilot.run.cost.function_calls / 8
    assert periods_for(pilot, ADVISED) == pytest.approx(max(ADVISED / 4.0, 0.1 * 8 * a_period) / a_period)
    assert PILOTS >= 1.0


def test_starts_end_with_the_periods_that_may_be_followed() -> None:
    """One period too few for the second start: it is left out, not called unsettled."""
    model = case("case3")
    state = state_of(model, PeriodMap(assemble(model).system), gr.simulate(model, cycles=40, initial="static"))
    whole = settled_motions(model, state, 3)
    assert whole.left_out == 0
    some = settled_motions(model, state, 3, most_periods=2 * BLOCK)
    assert some.starts + some.left_out == 3
    assert some.left_out >= 1
    none = settled_motions(model, state, 3, most_periods=BLOCK - 1)
    assert (none.starts, none.left_out, none.own) == (0, 3, -1)


def test_a_state_that_mean_torques_drive_away_has_no_such_line() -> None:
    driven = train(drag=0.0, means=2.0).with_({"torque.1.mean": -1.9})
    assert TOPIC not in [line.topic for line in gr.advise(driven).lines]


@pytest.mark.parametrize(
    ("share", "words"), [(1.0, "100 %"), (0.999, "99.9 %"), (0.994, "99 %"), (0.123, "12 %"), (0.0, "0 %")]
)
def test_shares_are_written_without_a_power_of_ten(share: float, words: str) -> None:
    assert _percent(share) == words
