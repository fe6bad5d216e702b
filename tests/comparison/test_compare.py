"""Algorithms side by side: rows, windows, the judge, failures as rows, the recommendation that follows."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.comparison.compare import CEILING, Comparison, side_by_side, window_of
from gearrattle.comparison.comparison_table import COLUMNS, table_of
from gearrattle.comparison.contender_runs import PAPER, contenders
from gearrattle.comparison.precision import work_precision
from gearrattle.comparison.recommendation import is_sound, recommendation, with_verdicts
from gearrattle.engine.solvers import SOLVERS, one_step
from gearrattle.report.comparison_page import on_statistics
from gearrattle.report.comparison_tables import verdict_table
from gearrattle.report.plots.comparison_figures import growth_of_errors, shown_until
from tests.comparison.cases import case

RK4 = {"algorithm": "rk4", "step": 0.0128 / 150}  # the 1995 paper's


@pytest.fixture(scope="module")
def loaded() -> Comparison:
    """Return loaded case 1, in which the mesh never separates, by sound and by unsound algorithms."""
    algorithms = {"rk2": {"step": 0.001 / 150}, "the paper's rk4": RK4, "rkv-events": {}, "rkf": {"tolerance": 1e-3}}
    return side_by_side(case("case1_loaded"), algorithms, cycles=24, discard=8, samples_per_cycle=128)


def test_rows_are_the_reference_the_contenders_and_the_ceiling(loaded: Comparison) -> None:
    labels = [row.label for row in loaded.rows]
    assert labels == ["exact", "rk2", "the paper's rk4", "rkv-events", "rkf", CEILING]
    assert loaded.rows[0].error is not None
    assert loaded.rows[0].error.worst == 0.0
    assert all(row.status == "done" for row in loaded.rows)


def test_errors_inside_the_window_are_those_of_the_motions(loaded: Comparison) -> None:
    model = case("case1_loaded")
    grid = {"cycles": 24, "discard": 8, "samples_per_cycle": 128}
    truth = gr.simulate(model, **grid).trajectory
    values = gr.simulate(model, algorithm="rk2", step=0.001 / 150, **grid).trajectory
    until = truth.time <= loaded.window
    half_gaps = np.array([np.abs(corners).max() for corners in truth.layout.corners])
    want = (np.abs(values.deflection - truth.deflection)[until] / half_gaps).max()
    row = loaded.row("rk2")
    assert row.error is not None
    assert row.error.worst == pytest.approx(want, rel=1e-12)
    assert row.history is not None
    assert row.history[1].max() == pytest.approx((np.abs(values.deflection - truth.deflection) / half_gaps).max())


def test_the_papers_rk4_step_is_told_to_be_unstable_and_to_invent_impacts(loaded: Comparison) -> None:
    row = loaded.row("the paper's rk4")
    assert row.growth == pytest.approx(1.688, abs=2e-3)
    assert row.impacts is not None
    assert row.impacts.total.invented > 10
    assert not is_sound(row)
    assert row.verdict == "not sound"
    assert row.reasons[0] == "step outside its stability region (a mode grows by 1.688 a step)"
    assert f"{row.impacts.total.invented} impacts invented" in row.reasons
    assert "the paper's rk4" in loaded.recommendation.split("Do not trust ")[1]
    assert loaded.row("rk2").growth == pytest.approx(1.0, abs=1e-6)
    assert loaded.row("rkf").growth is None


def test_the_cheapest_sound_algorithm_is_recommended_next_to_exact(loaded: Comparison) -> None:
    sound = [row for row in loaded.rows[1:-1] if is_sound(row)]
    assert "rkv-events" in {row.label for row in sound}
    best = min(sound, key=lambda row: row.cost.wall_time if row.cost else math.inf)
    assert f"Use exact; of the algorithms that step, {best.label} is the cheapest sound one" in loaded.recommendation
    none = replace(loaded, rows=(loaded.rows[0], loaded.row("the paper's rk4"), loaded.rows[-1]))
    assert recommendation(none).startswith("Use exact: of the algorithms that step, none is sound here.")


def test_the_recommendation_is_three_sentences_and_a_line_a_row(loaded: Comparison) -> None:
    assert len(loaded.recommendation.split(". ")) == 3
    assert loaded.recommendation.endswith(
        "The motion is predictable to its end: differences are errors of the algorithms."
    )
    table = table_of(loaded)
    assert table.loc["rkv-events", ["verdict", "because"]].tolist() == ["sound", ""]
    assert table.loc["rkf", "verdict"] == "not sound"
    assert table.loc["rkf", "because"].startswith("error of ")
    assert table.loc["exact", "verdict"] == table.loc[CEILING, "verdict"] == ""
    lines = [dict(zip(verdict_table(loaded).head, row, strict=True)) for row in verdict_table(loaded).rows]
    assert [line["algorithm"] for line in lines] == ["exact", "rk2", "the paper's rk4", "rkv-events", "rkf"]
    assert lines[0]["time over exact's"] == "1"
    assert lines[2]["because"] == ", ".join(loaded.row("the paper's rk4").reasons)


def test_the_ceiling_is_exact_from_nearby(loaded: Comparison) -> None:
    error = loaded.rows[-1].error
    assert error is not None
    assert 1e-13 < error.worst < 1e-8
    coherence = loaded.rows[-1].coherence
    assert coherence is not None
    assert min(entry.mean for entry in coherence.values()) > 0.999


def test_the_table_has_a_line_a_row_and_the_comparison_hangs_on_it() -> None:
    model = case("case1_loaded")
    table = gr.compare(model, ["rkv", "rkv-events"], cycles=3, samples_per_cycle=64)
    assert list(table.index) == ["exact", "rkv", "rkv-events", CEILING]
    assert list(table.columns) == list(COLUMNS)
    assert table.loc["rkv-events", "error"] < table.loc["rkv", "error"] < 1e-2
    assert table.loc["rkv", "function_calls"] == (
        8 * table.loc["rkv", "steps"] + 7 * table.loc["rkv", "rejected_steps"]
    )
    actual = table.attrs["comparison"]
    assert isinstance(actual, Comparison)
    json.dumps(actual.to_dict(), allow_nan=False)


@pytest.mark.parametrize(("tolerance", "growth"), [(1.0, 1e3), (1e-2, 1e3), (1e-6, 1e3), (1e-8, 1e5), (1e-13, 1e7)])
def test_the_window_is_no_shorter_for_a_coarse_tolerance_and_ends_at_the_horizon(
    tolerance: float, growth: float
) -> None:
    run = gr.simulate(case("case2_loaded"), cycles=12, samples_per_cycle=32)
    assert window_of(run, tolerance) == min(run.variation.horizon(growth), run.trajectory.end)
    assert window_of(run, tolerance) <= run.predictability_horizon


def test_an_unsound_algorithm_is_none_the_sounder_for_a_coarse_tolerance_of_others() -> None:
    """The default step of RK4 is wrong by a fifteenth of a half-gap here; only the other's tolerance is changed."""
    model = gr.loads("""
    schema = 1
    units = "SI"
    inertia = [{ name = "a", J = 1.0, drag = 0.1 }, { name = "b", J = 2.0 }]
    coupling = [{ name = "s", between = ["a", "b"], stiffness = 100.0, damping = 0.5, clearance = 0.1 }]
    excitation = { speed = 8.0 }
    torque = [{ on = "a", mean = -5.0, harmonics = [{ order = 1, amplitude = 30.0 }] }, { on = "b", mean = 5.0 }]
    simulation = { initial = "static" }
    """)
    for tolerance in (1e-2, 1e-6):
        actual = side_by_side(model, ["rk4", "rkv"], tolerance=tolerance, cycles=8, discard=2, samples_per_cycle=32)
        error = actual.row("rk4").error
        assert error is not None
        assert error.worst == pytest.approx(0.067, abs=2e-3)
        assert not is_sound(actual.row("rk4"))


def test_a_contender_over_its_budget_is_stopped_and_said_to_be() -> None:
    slow = {"rk4": {"step": 1e-8}}
    actual = side_by_side(case("case1_loaded"), slow, cycles=50, samples_per_cycle=16, budget=0.2)
    row = actual.row("rk4")
    assert row.status == "stopped after 0.2 s"
    assert row.cost is None
    assert (row.verdict, row.reasons) == ("no motion", ("stopped after 0.2 s",))
    assert "Do not trust rk4 here" in actual.recommendation


def test_statistics_that_were_not_compared_are_not_said_to_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    model, grid = case("case1_loaded"), {"cycles": 4, "discard": 1, "samples_per_cycle": 32}
    monkeypatch.setattr("gearrattle.comparison.nearby_motions.MANY", 12)  # as where time runs out
    table = gr.compare(model, ["rkf"], **grid)  # type: ignore[arg-type]
    actual = table.attrs["comparison"]
    assert actual.row("rkf").statistics.motions == 12
    assert actual.row("rkf").statistics.decided == 0
    assert math.isnan(table.loc["rkf", "statistics_different"])
    assert on_statistics(actual, differ=False).startswith(
        "Nothing can be said of statistics: time allowed for 12 exact"
    )
    brief = gr.compare(model, ["rkf"], cycles=1, samples_per_cycle=2).attrs["comparison"]
    assert "the runs are too short" in on_statistics(brief, differ=False)


def test_a_failure_is_a_row_with_time_and_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(one_step, "StepLimit", partial(one_step.StepLimit, most=20_000))  # of two million
    actual = side_by_side(case("case1_loaded"), {"rkv": {"tolerance": 1e-30}}, cycles=2, samples_per_cycle=16)
    assert "needs too many steps" in actual.row("rkv").status
    assert "at t = " in actual.row("rkv").status
    assert "try: a larger tolerance" in actual.row("rkv").status


def test_another_reference_and_progress() -> None:
    shares: list[float] = []
    actual = side_by_side(
        case("case1_loaded"),
        ["rk4"],
        reference="rk2",
        step=0.002 / 150,
        cycles=2,
        samples_per_cycle=64,
        progress=shares.append,
    )
    assert actual.rows[0].label == "rk2"
    assert actual.rows[0].cost is not None
    assert actual.rows[0].cost.algorithm == "rk2"
    own = actual.rows[-1].error
    assert own is not None
    exact = side_by_side(case("case1_loaded"), ["rk2"], step=0.002 / 150, cycles=2, samples_per_cycle=64)
    error = exact.row("rk2").error
    assert error is not None
    assert own.worst == pytest.approx(error.worst, rel=1e-6)
    words = f"Errors are relative to rk2, which is itself wrong by {own.worst:.1g} half-gaps"
    assert actual.recommendation.startswith(words)
    assert "Use" not in actual.recommendation
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0, abs=0.05)


def test_an_unknown_algorithm_is_refused_before_anything_runs() -> None:
    with pytest.raises(gr.ModelError, match=r'algorithms: found "rk5"; must be one of exact, rk2'):
        gr.compare(case("case1_loaded"), ["rk4", "rk5"], cycles=10**6)


@pytest.mark.parametrize(
    ("algorithms", "said"),
    [
        ([], "algorithms: must name at least one"),
        ({}, "algorithms: must name at least one"),
        (["rk4", "rkv", "rk4"], r'algorithms: found "rk4" twice; every label once \(a mapping lets'),
        ([["rk4"]], "must be one of exact"),
        ({"rk4": None}, "algorithms.rk4: found None; must be a mapping of settings"),
        ({"rk4": {"tol": 1e-3}}, 'algorithms.rk4: found "tol"; settings are algorithm, tolerance, step'),
        ({"rk4": {"cycles": 9}}, 'algorithms.rk4: found "cycles"'),
        ({"mine": {}}, 'algorithms: found "mine"; must be one of exact'),
        ({CEILING: {"algorithm": "rk4"}}, "label is taken"),
    ],
)
def test_contenders_that_make_no_sense_are_refused(algorithms: object, said: str) -> None:
    with pytest.raises(gr.ModelError, match=said):
        gr.compare(case("case1_loaded"), algorithms, cycles=10**6)  # type: ignore[arg-type]


@pytest.mark.parametrize("budget", [0.0, -1.0, math.nan])
def test_a_budget_is_a_time(budget: float) -> None:
    with pytest.raises(gr.ModelError, match=r"budget: found .*must be greater than zero"):
        gr.compare(case("case1_loaded"), ["rk4"], cycles=10**6, budget=budget)


def test_nothing_is_said_of_algorithms_that_took_no_part() -> None:
    actual = side_by_side(case("case1_loaded"), ["exact"], cycles=2, samples_per_cycle=64)
    assert actual.recommendation.startswith("Use exact. No other algorithm took part. The motion is predictable")


def test_one_name_is_a_list_of_one() -> None:
    assert contenders("rk4") == contenders(["rk4"])


def test_the_papers_seven_are_asked_for_by_name() -> None:
    assert {"rk2", "rk4", "rkf", "rkv", "bulirsch-stoer"} <= set(PAPER) & set(SOLVERS)
    assert len(PAPER) == 7
    assert [c.label for c in contenders(PAPER)] == list(PAPER)


@pytest.mark.parametrize(
    "name",
    [
        "case1",
        "case2_loaded",
        *(pytest.param(name, marks=pytest.mark.long) for name in ("case2", "case3", "case1_loaded", "case3_loaded")),
    ],
)
def test_restarted_at_corners_nothing_is_missed_and_nothing_flies_away(name: str) -> None:
    actual = side_by_side(case(name), ["rkv-events"], tolerance=1e-8, cycles=24, discard=4, samples_per_cycle=128)
    row = actual.row("rkv-events")
    assert row.error is not None
    assert row.crossings is not None
    assert row.error.worst < 1e-2
    assert row.crossings.total.missed == row.crossings.total.invented == 0
    model, grid = case(name), {"cycles": 24, "discard": 0, "samples_per_cycle": 128}
    reach = [
        np.abs(gr.simulate(model, algorithm=algorithm, **grid).trajectory.deflection).max(axis=0)
        for algorithm in ("exact", "rkv-events")
    ]
    assert np.all(reach[1] < 1.3 * reach[0])


@pytest.mark.slow
def test_precision_costs_work_and_restarting_costs_less() -> None:
    actual = work_precision(case("case3_loaded"), ["rk4", "rkv", "rkv-events"], budget=2.0, most_cycles=1)
    curves = {curve.algorithm: curve.points for curve in actual.curves}
    assert actual.exact.function_calls < min(point.function_calls for point in curves["rkv-events"])
    for points in curves.values():
        assert [p.function_calls for p in points] == sorted(p.function_calls for p in points)
        assert points[-1].error < 0.3 * points[0].error
    for blind, held in zip(curves["rkv"][2:], curves["rkv-events"][2:], strict=True):
        assert held.error < 0.2 * blind.error
        assert held.function_calls < 1.5 * blind.function_calls


@pytest.mark.long
def test_work_and_precision_are_of_the_motion_compared() -> None:
    """From zero under a mean torque the first cycle is another motion than from rest."""
    model = case("case1_loaded")
    still = {"angle": [0.0] * 4, "velocity": [0.0] * 4}
    asked = [work_precision(model, ["rk4", "exact"], most_cycles=1, initial=i) for i in (None, "zero", still)]
    assert [curve.algorithm for curve in asked[0].curves] == ["rk4"]
    errors = [[point.error for point in actual.curves[0].points] for actual in asked]
    assert errors[1] == errors[2] != errors[0]


def test_an_algorithm_with_strange_statistics_is_not_sound(loaded: Comparison) -> None:
    row = loaded.row("rkv-events")
    assert is_sound(row)
    assert row.statistics is not None
    strange = replace(row, statistics=replace(row.statistics, different=len(row.statistics.items) // 2))
    assert not is_sound(strange)
    rows = (*(strange if entry is row else entry for entry in loaded.rows),)
    reported = next(row for row in with_verdicts(replace(loaded, rows=rows)) if row.label == "rkv-events")
    counts = f"{strange.statistics.different} of {strange.statistics.decided}"
    assert (reported.verdict, reported.reasons) == (
        "not sound",
        (f"{counts} statistics outside those of all exact motions",),
    )


def test_errors_are_drawn_over_the_cycles_in_which_they_grow_and_to_the_end_of_a_predictable_motion(
    loaded: Comparison,
) -> None:
    assert shown_until(loaded) == loaded.cycles
    model = case("case3").with_({"simulation.initial": "static"})
    chaotic = side_by_side(model, ["rkv"], cycles=40, discard=4, samples_per_cycle=64)
    away, end = chaotic.rows[-1], shown_until(chaotic)
    assert away.error is not None
    assert chaotic.horizon / chaotic.period < end < 20.0
    chart = growth_of_errors(chaotic)
    assert chart.panels[0].x_range == (0.0, end)
    assert f"Of 40 cycles the first {end:g} are shown" in chart.caption
    for line in chart.panels[0].lines:
        assert np.count_nonzero(line.x <= end) > 300
    assert "The motion is predictable for 2.88 cycles; after that only statistics" in chaotic.recommendation
