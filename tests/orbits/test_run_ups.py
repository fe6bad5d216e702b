"""Run-ups beside the folds: jumps behind them, and the law of their delay."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.orbits import Branch, Orbit, run_ups, stability_ranges
from gearrattle.orbits.run_up_jumps import RunUpJump
from gearrattle.orbits.run_ups import with_peaks
from gearrattle.report.result_kinds import presentation_of
from tests.orbits.test_friction import oscillator as with_friction

SPEED = "excitation.speed"
UP, DOWN = 0.828463984388, 0.708031618722
"""Folds of examples/backlash_oscillator.toml, going up and going down."""


@cache
def over_speed() -> Branch:
    return gr.continuation(gr.example("backlash_oscillator"), SPEED, (0.6, 0.9))


@cache
def down_from(speed: float) -> Branch:
    """The branch of the large motion from a speed on, past the fold at which it ends, to the quiet motion."""
    model = gr.example("backlash_oscillator").with_({SPEED: speed})
    large: Orbit = gr.periodic(model, every=True)[-1]
    assert large.stable
    return gr.continuation(model, SPEED, (speed, 0.69), start=large, isolated=True)


def test_it_jumps_behind_both_folds() -> None:
    runs = over_speed().run_up(1e-4)
    assert [(jump.upward, jump.clearance, jump.words) for jump in runs.jumps] == [
        (True, "mesh", ""),
        (False, "mesh", ""),
    ]
    up, down = runs.jumps
    assert (up.end, down.end) == pytest.approx((UP, DOWN), abs=1e-11)
    assert up.value > UP
    assert down.value < DOWN
    assert (up.delay, down.delay) == pytest.approx((up.value - UP, DOWN - down.value), rel=1e-9)


def test_the_delay_in_periods_is_the_phase_between_fold_and_jump() -> None:
    rate = 1e-4
    for jump in over_speed().run_up(rate).jumps:
        turned = abs(jump.value**2 - jump.end**2) / (2.0 * rate) / (2.0 * np.pi)
        assert jump.periods == pytest.approx(turned, rel=1e-9)


def test_a_jump_is_where_the_swing_passes_the_middle() -> None:
    """The swing before and after a jump lies on both sides of the middle, and the jump between both periods."""
    runs = over_speed().run_up(2e-4)
    data = over_speed().data
    for jump, run in zip(runs.jumps, runs.envelopes, strict=True):
        at = int(np.argmin(np.abs(run.value - jump.value)))
        before, after = run.peak_to_peak[at - 12, 0], run.peak_to_peak[at + 12, 0]
        assert (after > before) == jump.upward
        settled = int(np.argmin(np.abs(data["value"].values - run.value[-1]) + ~data["stable"].values))
        assert run.peak_to_peak[-2, 0] == pytest.approx(float(data["peak_to_peak"][settled, 0]), rel=0.05)


def test_slow_runs_follow_the_stable_motion() -> None:
    (up, _) = over_speed().run_up(2e-5).envelopes
    data = over_speed().data.isel(point=slice(0, 12))
    values = data["value"].values
    expected = np.interp(values[2:10], up.value, up.peak_to_peak[:, 0])
    np.testing.assert_allclose(expected, data["peak_to_peak"].values[2:10, 0], rtol=2e-3)


def test_peaks_between_samples_are_those_of_a_sine() -> None:
    for phase in np.linspace(0.0, 1.0, 7):
        sine = np.sin(2.0 * np.pi * (np.arange(130) + phase) / 64.0)[:, None]
        assert abs(float(with_peaks(sine).max()) - 1.0) < 3e-6
        assert with_peaks(sine).min() == sine.min()


@pytest.mark.long
def test_the_delay_falls_with_the_rate_to_the_power_two_thirds() -> None:
    """The fold of the large motion is smooth: the exponent is 2/3 (Jung et al. 1990), but for a constant in periods.

    So in periods the delay grows from rate to rate as the power -1/3.
    """
    rates = 6.4e-5 / 4.0 ** np.arange(4)
    jumps = [down_from(0.712).run_up(float(rate)).jumps[-1] for rate in rates]
    delays, growth = np.array([jump.delay for jump in jumps]), np.diff([jump.periods for jump in jumps])
    exponents = np.log(delays[:-1] / delays[1:]) / np.log(4.0)
    assert np.all(np.diff(np.abs(exponents - 2.0 / 3.0)) < 0.0)
    assert np.log(growth[-1] / growth[0]) / np.log(16.0) == pytest.approx(1.0 / 3.0, abs=0.02)


@pytest.mark.long
def test_a_slow_run_is_as_late_as_the_normal_form_of_the_fold_says() -> None:
    """Near the fold the multiplier is 1 - 2 sqrt(a b (w - w*)); Airy's function gives the delay 2.338 (r T)^(2/3) /
    (a b)^(1/3).
    """
    branch = gr.continuation(
        down_from(0.712).model, SPEED, (0.711, 0.7), start=down_from(0.712).orbit(0), step_limit=2e-4
    )
    fold = float(branch.events["value"][branch.events["kind"] == "fold"].iloc[0])
    before = branch.data.isel(point=branch.data["stable"].values & (branch.data["value"].values < fold + 4e-4))
    away = before["value"].values - fold
    products = np.log(np.abs(before["multiplier"].values[:, 0])) ** 2 / (4.0 * away)
    product = np.polynomial.Polynomial.fit(np.sqrt(away), products, 1)(0.0)
    rate = 1e-6
    expected = 2.33811 * (rate * 2.0 * np.pi / fold) ** (2.0 / 3.0) / product ** (1.0 / 3.0)
    assert down_from(0.712).run_up(rate).jumps[-1].delay == pytest.approx(expected, rel=0.06)


def test_the_reasons_why_there_is_no_jump() -> None:
    (_, down) = over_speed().run_up(0.02).jumps
    assert np.isnan(down.value)
    assert "ends before it jumps" in down.words
    alone = gr.continuation(over_speed().model, SPEED, (0.8, 0.86), start="linear").run_up(1e-3)
    assert [jump.words for jump in alone.jumps] == ["no other stable motion is known there"]
    assert alone.notes == ("No stable motion is known at excitation.speed = 0.86: no run begins there.",)
    seen, down = "At the rate 0.001 no jump is known: no other stable motion is known there.", "No run down begins"
    assert alone.sentence == f"{seen} {down}: no stable motion is known at 0.86."


def test_where_no_run_can_begin_the_sentence_says_so_and_why() -> None:
    """At both ends of the range the one branch known is between its folds."""
    unstable = np.flatnonzero(~over_speed().data["stable"].values)
    first = int(unstable[len(unstable) // 2])
    begin = float(over_speed().data["value"][first])
    branch = gr.continuation(over_speed().model, SPEED, (begin, begin + 2e-3), start=over_speed().orbit(first))
    runs = branch.run_up(1e-5)
    assert runs.jumps == runs.envelopes == ()
    ends = f"{begin:.5g} and {begin + 2e-3:.5g}"
    assert runs.sentence == f"No run begins: no stable motion is known at either end of the range, {ends}."


def test_rates_with_units() -> None:
    model = gr.example("case1")
    branch = gr.continuation(model, SPEED, ("1432 rpm", "1431 rpm"))
    runs = branch.run_up("10 rpm/s")
    assert runs.rate == pytest.approx(np.pi / 3.0)
    assert runs.jumps == ()


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), "1 rpm/s", "fast", True])
def test_bad_rates_are_refused(rate: float | str) -> None:
    """The oscillator is dimensionless: its rates have no unit."""
    with pytest.raises(gr.ModelError, match="rate"):
        over_speed().run_up(rate)


@pytest.mark.parametrize("rate", [0.036, 0.1, 1e9])
def test_a_rate_at_which_nothing_is_left_of_a_run_is_refused(rate: float) -> None:
    refusal = r"rate: .*a run must last at least a period T.*\(0\.0356 or less"
    with pytest.raises(gr.ModelError, match=refusal) as refused:
        over_speed().run_up(rate)
    assert refused.value.problems[0].value == f"{rate:.6g}"
    assert over_speed().run_up(0.0356).data.sizes["up_period"] == 1


def test_a_run_of_exactly_a_period_has_it() -> None:
    """From W1 to W2 at the rate r the shaft turns by (W2^2 - W1^2) / 2 r."""
    runs = over_speed().run_up(0.5 * (0.9**2 - 0.6**2) / (2.0 * np.pi) * (1.0 - 1e-12))
    assert [len(run.value) for run in runs.envelopes] == [1, 1]


def geared(damping: float, drag: float, load: tuple[float, float]) -> gr.Model:
    """A gear on a shaft, under a mean torque and an amplitude."""
    mesh = {"stiffness": 200.0, "damping": damping, "clearance": "1 deg", "damping_ratio": 1.0}
    tables = {
        "schema": 1,
        "name": "geared pair on a shaft",
        "inertia": [{"name": "gear", "J": 0.01, "drag": drag}],
        "coupling": [{"name": "mesh", "between": ["gear", "ground"], **mesh}],
        "excitation": {"speed": "1200 rpm"},
        "torque": [{"on": "gear", "mean": load[0], "harmonics": [{"order": 1, "amplitude": load[1]}]}],
    }
    return gr.Model.from_tables(tables)


@pytest.mark.parametrize("ends", [(300, 600), (400, 600), (301, 599), (600, 240)])
def test_a_run_has_as_many_periods_as_the_shaft_turns(ends: tuple[int, int]) -> None:
    """From a to b rpm at r rpm/s the shaft turns (b^2 - a^2) / 120 r times, a whole number or not.

    In contact the swing is that of a linear oscillator, behind which a run lags in proportion to the rate.
    """
    branch = gr.continuation(geared(1.5, 0.0, (10.0, 0.1)), SPEED, (f"{ends[0]} rpm", f"{ends[1]} rpm"))
    turns_times_rate = Fraction(abs(ends[1] ** 2 - ends[0] ** 2), 120)
    few = Fraction(1, 250)
    numbers = [*map(Fraction, (2, 7, 19, 60, 120)), 20 - few, 70 - few, 50 + few, Fraction(161, 2)]
    rates = [*map(Fraction, (15, 20, 50, 100)), *(turns_times_rate / number for number in numbers)]
    for rate in rates:
        up, down = branch.run_up(f"{float(rate)!r} rpm/s").envelopes
        assert len(up.value) == len(down.value) == int(turns_times_rate / rate)
        for run in (up, down):
            swing = 0.2 / np.abs(200.0 + 1.5j * run.value - 0.01 * run.value**2)
            np.testing.assert_allclose(run.peak_to_peak[:, 0], swing, rtol=6e-6 * float(rate))


@pytest.mark.parametrize("rate", [1e-9, 1e-12])
def test_a_rate_at_which_a_run_lasts_too_long_is_refused_by_its_name(rate: float) -> None:
    with pytest.raises(gr.ModelError, match=r"^rate: found 1e-.*periods T: .*\(a faster rate") as refused:
        over_speed().run_up(rate)
    assert len(refused.value.problems) == 1


def test_a_run_of_less_than_a_period_is_saved(tmp_path: Path) -> None:
    """Case 1 is driven by a load of order 2 and one of order 1: a run may last half a period."""
    runs = gr.continuation(gr.example("case1"), SPEED, ("1432 rpm", "1431 rpm")).run_up("40 rpm/s")
    assert [len(run.value) for run in runs.envelopes] == [0, 0]
    assert runs.notes[0] == "Going up, the run lasts no whole period T: its swing is not shown."
    assert "Run-up and run-down" in runs.save(tmp_path / "out").read_text(encoding="utf-8")
    runs.save(tmp_path / "runs.nc")
    assert list(gr.figures(runs)) == ["run-ups"]


def test_the_progress_of_both_runs_ends_with_the_whole() -> None:
    shares = list[float]()
    over_speed().run_up(1e-3, progress=shares.append)
    assert shares[-1] == 1.0
    assert shares == sorted(shares)
    without_down = list[float]()
    gr.continuation(over_speed().model, SPEED, (0.8, 0.86), start="linear").run_up(1e-3, progress=without_down.append)
    assert without_down[-1] == 1.0


def test_other_branches_have_no_run_up() -> None:
    branch = gr.continuation(gr.example("backlash_oscillator"), "torque.0.mean", (0.1, 0.11))
    with pytest.raises(gr.ModelError, match=r"a run-up changes excitation\.speed"):
        branch.run_up(1e-3)


def test_it_is_a_result_with_a_page_a_table_and_numbers(tmp_path: Path) -> None:
    runs = over_speed().run_up(1e-3)
    page = runs.save(tmp_path / "out").read_text(encoding="utf-8")
    assert "Jumps beside those of the branches" in page
    assert "Run-up and run-down" in page
    runs.save(tmp_path / "runs.nc")
    assert runs.data["end"].values == pytest.approx([UP, DOWN], abs=1e-11)


def oscillator(damping: float, amplitude: float, mean: float) -> gr.Model:
    """x'' + damping x' + b(x) = mean + amplitude sin(W t), b(x) without force between -1 and 1."""
    coupling = {"name": "mesh", "between": ["gear", "ground"], "stiffness": 1.0, "damping": damping}
    load = {"on": "gear", "mean": mean, "harmonics": [{"order": 1, "amplitude": amplitude}]}
    tables = {
        "schema": 1,
        "name": "oscillator",
        "units": "dimensionless",
        "inertia": [{"name": "gear", "J": 1.0}],
        "coupling": [{**coupling, "damping_ratio": 1.0, "clearance": 1.0}],
        "excitation": {"speed": 0.7},
        "torque": [load],
    }
    return gr.Model.from_tables(tables)


NOT_ON = "the run was not on the motion that ends there"


@pytest.mark.long
@pytest.mark.parametrize(
    ("numbers", "ends", "expected"),
    [
        ((0.08, 0.24, 0.23), (0.5, 0.7), {0.508223: None, 0.649949: None}),
        ((0.08, 0.33, 0.22), (0.68, 0.9), {0.691508: None, 0.693038: None, 0.863096: 0.877449}),
        ((0.05, 0.2, 0.3), (0.59, 0.72), {0.609046: None, 0.669622: 0.676226, 0.665418: None}),
    ],
)
def test_jumps_are_of_motions_that_the_run_was_on(
    numbers: tuple[float, float, float], ends: tuple[float, float], expected: dict[float, float | None]
) -> None:
    """Runge-Kutta runs with 4000 steps a period: their swings before the folds are those of other motions (4.07 beside
    1.04, 6.05 beside 3.04, 0.639 beside 0.698), or the mean square of the difference becomes less from the motion that
    they end in, settled at the speed of the run, than from the fold's, where it says.
    """
    jumps = gr.continuation(oscillator(*numbers), SPEED, ends, isolated=True).run_up(1e-4).jumps
    seen = {round(jump.end, 6): jump for jump in jumps}
    assert seen.keys() >= expected.keys()
    assert len(seen) == len(jumps)
    for fold, value in expected.items():
        assert seen[fold].words == (NOT_ON if value is None else "")
        if value is not None:
            assert seen[fold].value == pytest.approx(value, abs=3e-5)


@pytest.mark.parametrize("rounding", [-1e-13, 0.0, 1e-13])
def test_a_grazing_at_a_fold_does_not_turn_its_direction(rounding: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """At a corner of the branch a node beside the fold lies at its value, but for rounding."""
    branch = over_speed()
    expected = [(loss.value, loss.upward) for loss in stability_ranges.losses_of(branch)]
    assert expected == [(pytest.approx(DOWN), False), (pytest.approx(UP), True)]
    courses = list[stability_ranges.Course]()
    for course in stability_ranges.courses_of(branch):
        value = course.value.copy()
        for i in (i for i, kind in enumerate(course.kinds) if kind == "fold"):
            value[[i - 1, i + 1]] = value[i] + rounding
        courses.append(replace(course, value=value))
    monkeypatch.setattr(stability_ranges, "courses_of", lambda _: courses)
    assert [(loss.value, loss.upward) for loss in stability_ranges.losses_of(branch)] == expected


def test_a_fold_of_copies_is_passed_once() -> None:
    branch = over_speed()
    twice = replace(branch, curves=branch.curves * 2)
    assert twice.run_up(1e-3).jumps == branch.run_up(1e-3).jumps


@pytest.mark.long
def test_a_period_of_many_load_cycles_changes_no_jump() -> None:
    """A load of order 16 beside a negligible one of order 1: T holds 16 load cycles."""
    model = gr.example("backlash_oscillator")
    load = [
        {"order": 16, "amplitude": 0.05, "phase": np.pi / 2.0},
        {"order": 1, "amplitude": 1e-4},
    ]
    model = model.with_({"coupling.mesh.kinematic_error": load, SPEED: 0.75 / 16.0})
    runs = gr.continuation(model, SPEED, (0.6 / 16.0, 0.9 / 16.0)).run_up(2e-4 / 16.0)
    for jump, alone in zip(runs.jumps, over_speed().run_up(2e-4).jumps, strict=True):
        assert 16.0 * jump.value == pytest.approx(alone.value, abs=2e-5)
        assert 16.0 * jump.delay == pytest.approx(alone.delay, abs=2e-5)
    assert [len(run.value) for run in runs.envelopes] == [11, 11]  # a row a period T


@pytest.mark.parametrize("upward", [True, False])
def test_a_run_begins_with_the_sliders_as_the_motion_has_them(upward: bool) -> None:
    """In its first periods a slow run has the swing of the motion; from unloaded sliders it differs by 2 %."""
    joint = {"stiffness": 1.0, "damping": 0.06, "damping_ratio": 1.0, "clearance": 1.0}
    slider = {"hysteresis": 0.6, "stick_stiffness": 2.0}
    tables = {
        "inertia": [{"name": "body", "J": 1.0}],
        "coupling": [{"name": "joint", "between": ["body", "ground"], **joint, **slider}],
        "excitation": {"speed": 0.9},
        "torque": [{"on": "body", "mean": 0.2, "harmonics": [{"order": 1, "amplitude": 0.5}]}],
    }
    model = gr.Model.from_tables({"schema": 1, "name": "joint with friction", "units": "dimensionless", **tables})
    branch = gr.continuation(model, SPEED, (0.9, 0.91))
    (run,) = [run for run in branch.run_up(1e-5).envelopes if run.upward == upward]
    at_ends = branch.data["value"].values, branch.data["peak_to_peak"].values[:, 0]
    swing = float(at_ends[1][at_ends[0] == (0.9 if upward else 0.91)][0])
    np.testing.assert_allclose(run.peak_to_peak[:3, 0], swing, rtol=5e-4)


@pytest.mark.long
@pytest.mark.parametrize(("rate", "jump"), [(3e-5, 0.689923), (1e-5, 0.686352)])
def test_a_hard_doubling_is_a_jump(rate: float, jump: float) -> None:
    """At 0.684286 the period doubles; what leaves is unstable, leads backwards and folds within 1e-5.

    In Runge-Kutta runs with 4000 steps a period the mean square of the difference becomes less from the motion with the
    swing 6, settled at the speed of the run, than from the unstable motion where it says.
    """
    model = oscillator(0.078, 0.346, 0.179)
    wide = gr.continuation(model, SPEED, (0.45, 0.9))
    away = np.abs(wide.data["value"].values - 0.6833) + 0.1 * wide.data["peak_to_peak"].values[:, 0]
    quiet = int(np.argmin(np.where(wide.data["stable"].values, away, np.inf)))
    first = gr.periodic(model.with_({SPEED: 0.6833}), start=wide.orbit(quiet))
    runs = gr.continuation(model, SPEED, (0.6833, 0.7), start=first, isolated=True).run_up(rate)
    (seen,) = [one for one in runs.jumps if not one.words]
    assert (seen.kind, seen.upward) == ("period doubling", True)
    assert seen.end == pytest.approx(0.6842856605, abs=1e-9)
    assert seen.value == pytest.approx(jump, abs=5e-6)
    assert "T behind the period doubling" in runs.sentence


@pytest.mark.long
def test_whether_a_run_was_on_a_motion_does_not_depend_on_its_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between folds 1.2e-4 apart the swings of three motions differ by 4e-3, and the run lags behind by more.

    A Runge-Kutta run at 1e-6 with 8000 steps a period becomes nearer to the other motion at 0.313950.
    """
    branch = gr.continuation(with_friction(0.30), SPEED, (0.30, 0.33))
    for rate in (1e-5, 1e-6):
        jumps = []
        for samples in (16, 64, 256):
            monkeypatch.setattr(run_ups, "_SAMPLES", samples)
            up, down = branch.run_up(rate).jumps
            assert (up.words, down.words) == ("", "")
            assert (up.end, down.end) == pytest.approx((0.313614087, 0.313492773), abs=1e-9)
            jumps.append(up.value)
        assert jumps[1] == pytest.approx(jumps[2], abs=3e-6)
    assert jumps[2] == pytest.approx(0.313950, abs=3e-6)


def one_body(numbers: tuple[float, float, float], coupling: dict[str, float], load: tuple[float, float]) -> gr.Model:
    """A body with inertia, drag and a speed, on a coupling to the ground, under a mean torque and an amplitude."""
    inertia, drag, speed = numbers
    torque = {"on": "body", "mean": load[0], "harmonics": [{"order": 1, "amplitude": load[1]}]}
    tables = {
        "schema": 1,
        "name": "one body",
        "units": "dimensionless",
        "inertia": [{"name": "body", "J": inertia, "drag": drag}],
        "coupling": [
            {"name": "joint", "between": ["body", "ground"], "damping": 0.07, "damping_ratio": 0.3, **coupling}
        ],
        "excitation": {"speed": speed},
        "torque": [torque],
    }
    return gr.Model.from_tables(tables)


SIMILAR = 0.4688164853
"""A fold whose motion has a swing of 3.20, between that of the motion that runs go on to, 3.13, and 3.25 of runs."""


@cache
def similar_motions(last: float = 0.49) -> Branch:
    coupling = {"stiffness": 3.6, "clearance": 0.6, "stiffness_ratio": 0.01}
    return gr.continuation(one_body((1.22, 0.051, 0.8), coupling, (0.44, 1.48)), SPEED, (0.44, last))


def late_at(rate: float, last: float = 0.49) -> RunUpJump:
    """The jump behind the fold between similar motions, in a range up to a speed."""
    jumps = similar_motions(last).run_up(rate).jumps
    (jump,) = [one for one in jumps if one.upward and abs(one.end - SIMILAR) < 1e-9]
    return jump


@pytest.mark.long
def test_a_jump_to_a_motion_with_nearly_the_same_swing_is_late_as_well() -> None:
    """Runge-Kutta runs with 4000 steps a period, compared with the fold's motion and the one settled at their speed.

    While the run leaves its swing still grows, up to 3.25, and falls some periods later. In periods the delay is
    a r^(-1/3) + b: what it grows by from rate to rate grows by 2^(1/3) when rates are halved.
    """
    periods = list[float]()
    for rate, expected in ((1.6e-5, 6.464), (8e-6, 8.493), (4e-6, 11.067)):
        jump = late_at(rate)
        assert jump.words == ""
        assert jump.periods == pytest.approx(expected, abs=0.02)
        (run,) = [one for one in similar_motions().run_up(rate).envelopes if one.upward]
        swing = np.where(run.value > 0.45, run.peak_to_peak[:, 0], 0.0)
        falls = run.value[np.argmax(swing < np.maximum.accumulate(swing) - 0.03)]
        assert SIMILAR < jump.value < falls < jump.value + 3.0 * rate * 2.0 * np.pi / SIMILAR
        periods.append(jump.periods)
    first, second = np.diff(periods)
    assert second / first == pytest.approx(2.0 ** (1.0 / 3.0), rel=0.02)


@pytest.mark.slow
def test_a_run_whose_swing_is_nearer_to_the_other_motion_at_the_fold_jumps_behind_it() -> None:
    """It lags: its swing is 3.16 at the fold, where the middle lies at 3.165. A Runge-Kutta run is as late."""
    jump = late_at(3.83244e-5, 1.28)
    assert jump.words == ""
    assert jump.periods == pytest.approx(4.468, abs=0.02)


@pytest.mark.slow
def test_a_fast_run_leaves_for_a_motion_that_no_branch_has() -> None:
    """A Runge-Kutta run at the rate that is held at 0.4833 settles with a swing of 3.06; the branch has 2.92."""
    jump = late_at(7.664e-5)
    assert np.isnan(jump.value)
    assert "no stable motion that is known" in jump.words


@pytest.mark.slow
def test_a_jump_is_where_the_run_leaves_and_not_where_it_settles() -> None:
    """The motion of two periods that it goes on to is unstable between its doublings at 2.2815 and 2.1505."""
    coupling = {"stiffness": 7.5, "clearance": 0.81, "stiffness_ratio": 0.08}
    branch = gr.continuation(one_body((1.16, 0.059, 2.08), coupling, (0.57, 0.44)), SPEED, (1.144, 3.328))
    runs = branch.run_up(9.716e-4)
    (jump,) = [one for one in runs.jumps if not one.upward and one.end == pytest.approx(2.3058920, abs=1e-6)]
    (run,) = [one for one in runs.envelopes if not one.upward]
    of_two = np.maximum(run.peak_to_peak[:-1, 0], run.peak_to_peak[1:, 0])
    is_large = of_two[(run.value[:-1] < 2.29) & (run.value[:-1] > jump.value + 0.02)]
    is_small = of_two[(run.value[:-1] < jump.value - 0.02) & (run.value[:-1] > 2.15)]
    assert is_large.min() > 1.2
    assert is_small.max() < 0.7
    assert jump.settles == pytest.approx(2.1504943, abs=1e-6)
    assert [note for note in runs.notes if f"{jump.value:.6g} is stable from 2.15049 on only" in note]


def jumps_one_way(runs: gr.RunUpJumps, upward: bool) -> list[RunUpJump]:
    """Rows of one direction, of which no two have the same jump: none within a period's change of speed."""
    rows = [jump for jump in runs.jumps if jump.upward == upward]
    seen = [jump.value for jump in rows if not jump.words]
    for k, value in enumerate(seen):
        assert np.all(np.abs(np.array(seen[:k]) - value) > 2.0 * np.pi * runs.rate / value)
    return rows


@pytest.mark.parametrize("rate", [100.0, pytest.param(500.0, marks=pytest.mark.long)])
def test_a_fast_run_past_two_folds_jumps_once(rate: float) -> None:
    """The folds at 106.919 of two periods and at 106.481 of one are less than a period apart.

    At 106.484 the run would settle on the motion of one period.
    """
    branch = gr.continuation(geared(0.15, 0.01, (1.0, 1.5)), SPEED, ("800 rpm", "1600 rpm"))
    _, first, second = jumps_one_way(branch.run_up(f"{rate} rpm/s"), upward=False)
    assert (first.end, second.end) == pytest.approx((106.919046, 106.481190), abs=1e-5)
    assert first.words == "the run goes on to another motion, which ends as well before it jumps"
    assert np.isnan(first.value)
    assert second.words == ""
    assert second.value < second.end


def joint_with_friction() -> gr.Model:
    """Two bodies; that at the end hangs on a coupling with a clearance and a slider."""
    inner = {"name": "inner", "between": ["inner", "ground"], "stiffness": 1.96382537, "damping": 0.0662083291}
    outer = {"name": "outer", "between": ["outer", "inner"], "stiffness": 1.88260055, "damping": 0.0508162647}
    slider = {"clearance": 1.0, "damping_ratio": 0.5, "hysteresis": 0.0879412395, "stick_stiffness": 2.10434003}
    load = [{"order": 1, "amplitude": 0.20384705}, {"order": 2, "amplitude": 0.0514619725, "phase": 1.0201989960}]
    bodies = ("inner", 0.879219011, 0.0235167435), ("outer", 1.16513109, 0.0267695636)
    tables = {
        "inertia": [{"name": name, "J": inertia, "drag": drag} for name, inertia, drag in bodies],
        "coupling": [inner, {**outer, **slider}],
        "excitation": {"speed": 0.42},
        "torque": [{"on": "outer", "mean": 0.0861565682, "harmonics": load}],
    }
    return gr.Model.from_tables({"schema": 1, "name": "joint with friction", "units": "dimensionless", **tables})


@pytest.mark.long
def test_a_run_that_is_on_the_motion_again_did_not_jump_at_the_loss_before() -> None:
    """Going down the motion of one period is unstable from 0.3965 to 0.3914, from 0.3860 to 0.3810 and below 0.3735.

    On it all periods have the same swing; those of the stable motions of two periods below 0.386 alternate by 2 %.
    """
    runs = gr.continuation(joint_with_friction(), SPEED, (0.35958, 0.4)).run_up(2.84e-5)
    jumps_one_way(runs, upward=True)
    rows = [jump for jump in jumps_one_way(runs, upward=False) if jump.kind == "period doubling"]
    assert [jump.end for jump in rows] == pytest.approx([0.3965363, 0.3859545, 0.3735481], abs=1e-6)
    folds = {(round(jump.end, 5), jump.upward) for jump in runs.jumps if jump.kind == "fold"}
    assert folds >= {(0.38097, False), (0.38239, True), (0.38605, True), (0.39136, False), (0.39662, True)}
    assert [jump.words for jump in rows] == [*["the run is still on the motion where that is stable again"] * 2, ""]
    assert 0.36 < rows[-1].value < rows[-1].end
    (run,) = [run for run in runs.envelopes if not run.upward]
    swing = run.peak_to_peak[run.value > 0.374]
    assert np.max(np.abs(np.diff(swing, axis=0))) < 0.005 * float(swing.max())


def spline(speed: str = "3000 rpm") -> gr.Model:
    """A gear on a spline with lash: its period doubles at 2900 rpm, going down, softly."""
    contact = {"stiffness": "100 N*m/deg", "damping": "0.5 N*m*s/rad", "clearance": "1 deg", "stiffness_ratio": 0.05}
    harmonics = [{"order": 1, "amplitude": "60 N*m"}]
    return gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": "gear", "J": "0.01 kg*m^2", "drag": "0.3 N*m*s/rad"}],
            "coupling": [{"name": "spline", "between": ["gear", "ground"], **contact}],
            "excitation": {"speed": speed},
            "torque": [{"on": "gear", "mean": "12 N*m", "harmonics": harmonics}],
        }
    )


def test_a_run_on_a_motion_that_became_unstable_before_has_a_note() -> None:
    """Going down at 100 rpm/s the run stays on the motion of one period behind its doubling, and jumps at 2705 rpm."""
    runs = gr.continuation(spline(), "excitation.speed", ("6000 rpm", "2500 rpm")).run_up("100 rpm/s")
    assert [one.words for one in runs.jumps if one.upward].count("") == 1
    assert all(np.isnan(one.value) for one in runs.jumps if not one.upward)
    assert runs.notes[-1].startswith("Going down, the run was on none of the motions that end")


def test_the_sentence_of_a_branch_ends_its_stable_motions_where_the_range_without_one_begins() -> None:
    sentence = gr.continuation(spline(), "torque.0.mean", (0.0, 50.0)).sentence
    assert "one stable motion from 0 to 5.408 N" in sentence
    assert "No branch leads through the range from 5.408 to 50 N" in sentence


def test_the_page_has_every_event_and_the_terminal_the_first_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gearrattle.report.branches_page._MOST_EVENTS", 1)
    runs = gr.continuation(gr.example("backlash_oscillator"), SPEED, (0.6, 0.9)).run_up(1e-3)
    page = presentation_of(runs)
    on_page, printed = (
        next(table for table in tables if table.title == "Events") for tables in (page.tables(), page.answer())
    )
    assert len(on_page.rows) == len(runs.branch.events) > 1
    assert len(printed.rows) == 1
