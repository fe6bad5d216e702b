"""Peaks and moments of an exact motion do not depend on its samples; what must be sampled says its error."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly.statistics_by_name import Between
from gearrattle.signals.levels import extremes_missed, missed, rms_missed
from gearrattle.signals.summaries import summary_of

EXAMPLES = Path(__file__).parents[2] / "examples"
PEAKED = ["separation", "force_statistics", "loose_gear_motion", "irregularity"]
SAMPLED = ("above the engine orders", "at order")
LEVELS = ("peak-to-peak acceleration", "TR rms", "TR peak")
ONE_BODY = """
schema = 1
name = "one body"
inertia = [{ name = "body", J = 1.0 }]
excitation = { speed = 1.0 }
[[coupling]]
name = "spring"
between = ["body", "ground"]
stages = [{ until = 10.0, stiffness = 900.0 }, { stiffness = 1800.0 }]
[simulation]
cycles = 2
discard = 1
samples_per_cycle = 90
initial = { angle = [0.1], velocity = [0.0] }
"""


@pytest.mark.parametrize(("example", "cycles"), [("manual_transmission", 12), ("paper/case3", 8), ("paper/case1", 12)])
def test_the_default_sampling_is_within_a_tenth_of_a_per_cent_of_the_finest(example: str, cycles: int) -> None:
    """512 against 4096 samples a cycle: separation ratio, crest, kurtosis, rms and peak accelerations, irregularity."""
    tables = []
    for samples in (512, 4096):
        run = gr.simulate(
            gr.load(EXAMPLES / f"{example}.toml"), cycles=cycles, discard=cycles // 2, samples_per_cycle=samples
        )
        table = gr.metrics(run, names=PEAKED).set_index(["quantity", "subject"]).value.dropna()
        tables.append(table[[not any(word in quantity for word in SAMPLED) for quantity, _ in table.index]])
        margins = [e.value for e in gr.criteria(run).of("loose_gear") if e.quantity == "margin"]
        assert margins == pytest.approx(table.loc["separation margin"].tolist(), rel=1e-12)
    coarse, fine = tables
    assert len(coarse) >= 10
    assert coarse.to_numpy() == pytest.approx(fine.to_numpy(), rel=1e-6)


@pytest.mark.parametrize(
    ("example", "cycles"),
    [
        ("manual_transmission", 6),
        ("clutch_friction", 6),
        ("run_up", 6),
        ("measured_flywheel", 4),
        ("alternating_mesh", 8),
    ],
)
def test_extremes_and_moments_are_those_of_very_dense_samples(example: str, cycles: int) -> None:
    """Friction, run-ups, records, alternation: never inside the dense samples' range, and beyond it by little."""
    model = gr.load(EXAMPLES / f"{example}.toml")
    coarse, dense = (
        gr.simulate(model, cycles=cycles, discard=cycles // 2, samples_per_cycle=samples, audit=False).trajectory
        for samples in (128, 32768)
    )
    assert coarse.exact is not None
    signals, layout = coarse.exact.signals(coarse), coarse.layout
    actual = coarse.exact.statistics(coarse, signals)
    assert actual is not None
    begin = dense.discard * dense.samples_per_cycle
    for i, (kind, name) in enumerate(signals):
        if kind == "force":
            element = layout.element_names.index(name)
            samples = dense.element_torque[begin:, element] / layout.radii[element, 0]
        else:
            samples = getattr(dense, kind)[begin:, layout.inertia_names.index(name)]
        reported = summary_of(samples)
        rounding, beyond = 1e-7 * reported.reach, 0.02 * reported.reach
        assert -rounding <= actual.high[i] - reported.high <= beyond, (kind, name)
        assert -rounding <= reported.low - actual.low[i] <= beyond, (kind, name)
        assert actual.mean[i] == pytest.approx(reported.mean, abs=1e-4 * reported.reach)
        assert actual.second[i] == pytest.approx(reported.second, rel=2e-3)
        assert actual.fourth[i] == pytest.approx(reported.fourth, rel=2e-3)


def test_a_free_oscillation_has_its_closed_form() -> None:
    """A body on a linear spring to ground, 3 samples a period of its motion: peak A w^2, <a^2> = A^2 w^4 / 2."""
    run = gr.simulate(gr.loads(ONE_BODY))
    actual = run.trajectory.exact.statistics(run.trajectory, [("acceleration", "body"), ("velocity", "body")])
    assert actual.high == pytest.approx([90.0, 3.0], rel=1e-11)
    assert actual.low == pytest.approx([-90.0, -3.0], rel=1e-11)
    assert actual.second == pytest.approx([90.0**2 / 2.0, 4.5], rel=1e-10)
    assert actual.fourth == pytest.approx([3.0 * 90.0**4 / 8.0, 3.0 * 81.0 / 8.0], rel=1e-10)
    assert np.abs(actual.mean).max() < 1e-6


def test_signals_asked_for_alone_have_the_extremes_of_all_together() -> None:
    """Moments may be left out, signal by signal: they are NaN then, and the others keep their values."""
    run = gr.simulate(gr.load(EXAMPLES / "paper" / "case3.toml"), cycles=4, discard=2)
    exact = run.trajectory.exact
    signals = exact.signals(run.trajectory)
    together = exact.statistics(run.trajectory, signals)
    wanted = np.array([quantity == "force" for quantity, _ in signals])
    marked = exact.statistics(run.trajectory, signals, with_moments=wanted)
    assert together is not None
    assert marked is not None
    assert np.isnan(marked.second).tolist() == (~wanted).tolist()
    assert marked.second[wanted] == pytest.approx(together.second[wanted], rel=1e-12)
    for i, signal in enumerate(signals):
        alone = exact.statistics(run.trajectory, [signal], with_moments=False)
        assert alone is not None
        assert [alone.low[0], alone.high[0]] == pytest.approx([together.low[i], together.high[i]], rel=1e-11)


def test_chunks_have_the_extremes_of_the_whole() -> None:
    model, settings = gr.load(EXAMPLES / "paper" / "case3.toml"), {"cycles": 8, "discard": 3}
    whole = gr.metrics(gr.simulate(model, **settings), names=PEAKED).set_index(["quantity", "subject"]).value
    parts = gr.metrics(gr.stream(model, chunk=2, **settings), names=PEAKED).set_index(["quantity", "subject"]).value
    both = parts.dropna()
    assert len(both) >= 10
    assert both.to_numpy() == pytest.approx(whole[both.index].to_numpy(), rel=1e-6)


def test_a_saved_motion_still_knows_its_peaks(tmp_path: Path) -> None:
    run = gr.simulate(gr.load(EXAMPLES / "paper" / "case3.toml"), cycles=4, discard=2)
    run.save(tmp_path / "run.nc")
    before, after = (gr.metrics(entry, names=PEAKED) for entry in (run, gr.open_run(tmp_path / "run.nc")))
    assert after.value.to_numpy() == pytest.approx(before.value.to_numpy(), rel=1e-9, nan_ok=True)


def test_samples_say_by_how_much_a_peak_may_be_missed() -> None:
    """Of a sine at 32 samples a period the estimate is an eighth of (2 pi / 32)^2: 0.48 %, as much as can be missed."""
    time = np.arange(33) / 32.0
    values = np.sin(2.0 * np.pi * (time + 0.5 / 32.0))
    assert float(missed(values)) == pytest.approx((2.0 * np.pi / 32.0) ** 2 / 8.0, rel=0.01)
    assert 1.0 - values.max() == pytest.approx(float(missed(values)), rel=0.01)


def test_a_recording_and_another_algorithm_note_the_error_of_their_peaks() -> None:
    from gearrattle.quantities.metric_sources import recording_of

    model = gr.load(EXAMPLES / "paper" / "case3.toml")
    exact = gr.simulate(model, cycles=6, discard=3)
    assert not gr.metrics(exact, names=["separation"]).note.str.contains("samples").any()
    recorded = gr.metrics(recording_of(exact.trajectory), model, names=["separation"])
    stepped = gr.metrics(gr.simulate(model, cycles=6, discard=3, algorithm="rkv"), names=["separation"])
    for table in (recorded, stepped):
        note = table[table.quantity == "separation ratio"].note.item()
        assert "a peak of samples" in note
        assert "% higher" in note


def test_a_motion_restored_to_units_has_the_peaks_of_its_own_model() -> None:
    model = gr.load(EXAMPLES / "paper" / "case3.toml")
    scaled = gr.nondimensionalize(model)
    back = scaled.restore(gr.simulate(scaled.model, cycles=3, discard=1))
    plain = gr.simulate(model, cycles=3, discard=1)
    values = [gr.metrics(run, names=["separation"]).value.tolist() for run in (back, plain)]
    assert values[0] == pytest.approx(values[1], rel=1e-6)


@pytest.mark.parametrize("example", ["paper/case3", "clutch_friction"])
def test_levels_are_those_of_a_hundred_thousand_samples_a_cycle(example: str) -> None:
    """Peak to peak, TR and the force exceeded 5 % of the time: of 512 samples a cycle, against brute force."""
    model, cycles = gr.load(EXAMPLES / f"{example}.toml"), 3
    coarse, dense = (
        gr.simulate(model, cycles=cycles, discard=1, samples_per_cycle=samples, audit=False)
        for samples in (512, 100_000)
    )
    acceleration = dense.trajectory.acceleration[100_000:]
    swing = acceleration.max(axis=0) - acceleration.min(axis=0)
    level = np.sqrt(np.mean(acceleration[:-1] ** 2, axis=0))
    reference = dense.trajectory.layout.reference
    verdict = gr.criteria(coarse)
    actual = {word: np.array([e.value for e in verdict.entries if e.quantity == word]) for word in LEVELS}
    assert actual["peak-to-peak acceleration"] == pytest.approx(swing, rel=2e-3)
    assert np.all(actual["peak-to-peak acceleration"] >= swing * (1.0 - 1e-9))
    assert actual["TR rms"] == pytest.approx(level / level[reference], rel=1e-3)
    assert actual["TR peak"] == pytest.approx(swing / swing[reference], rel=2e-3)
    assert {e.error for e in verdict.entries if e.quantity in LEVELS} == {0.0}
    rows = gr.metrics(coarse, names=["force_statistics"]).query("quantity == 'force exceeded 5 % of the time'")
    assert rows.error.tolist() == [0.0] * len(rows)
    for row in rows.itertuples():
        element = dense.trajectory.layout.element_names.index(row.subject)
        force = dense.trajectory.element_torque[100_000:-1, element] / dense.trajectory.layout.radii[element, 0]
        assert np.mean(np.abs(force) > row.value * (1.0 + 1e-12)) <= 0.05 + 2e-5
        assert np.mean(np.abs(force) >= row.value) >= 0.05 - 2e-5  # 0 where it is 0 for longer


def test_the_level_exceeded_by_a_sine_has_its_closed_form() -> None:
    """|A sin| is above L for 1 - 2/pi arcsin(L/A) of the time; a force that is 0 nearly always exceeds 0."""
    run = gr.simulate(gr.loads(ONE_BODY))
    actual = run.trajectory.exact.exceeded(run.trajectory, [("force", "spring"), ("velocity", "body")], 0.05)
    assert actual == pytest.approx(np.array([90.0, 3.0]) * np.sin(0.95 * np.pi / 2.0), rel=1e-10)
    assert run.trajectory.exact.exceeded(run.trajectory, [("force", "spring")], 0.75) == pytest.approx(
        90.0 * np.sin(0.25 * np.pi / 2.0), rel=1e-10
    )


def test_errors_of_sampling_are_not_passed_by_samples_sixteen_times_as_fine() -> None:
    """Levels above the engine orders and values at orders, at the default sampling: every one within its estimate."""
    model, compared = gr.load(EXAMPLES / "paper" / "case3.toml"), 0
    coarse, fine = (
        gr.metrics(gr.simulate(model, cycles=6, discard=2, samples_per_cycle=samples, audit=False))
        for samples in (512, 8192)
    )
    assert coarse.quantity.tolist() == fine.quantity.tolist()
    for one, other in zip(coarse.itertuples(), fine.itertuples(), strict=True):
        if one.error > 0.0:
            assert abs(one.value - other.value) <= one.error + 1e-9 * abs(one.value), (one.quantity, one.subject)
            compared += "above the engine orders" in one.quantity or "at order" in one.quantity
        elif one.error == 0.0 and one.subject:
            assert one.value == pytest.approx(other.value, rel=1e-7), one.quantity
    assert compared >= 20


def test_levels_of_samples_carry_an_error_that_finer_samples_confirm() -> None:
    """By another algorithm nothing is known between samples: peak to peak and TR say how far they may be off."""
    model = gr.load(EXAMPLES / "paper" / "case3.toml")
    exact = gr.simulate(model, cycles=4, discard=2, audit=False)
    true = {(e.quantity, e.subject): e.value for e in gr.criteria(exact).entries if e.quantity in LEVELS}
    sampled = gr.results.Run(exact.trajectory, exact.model)
    sampled.trajectory = replace(exact.trajectory, exact=None)
    entries = [e for e in gr.criteria(sampled).entries if e.quantity in LEVELS]
    assert sum(e.error > 0.0 for e in entries) >= 8
    for e in entries:
        assert abs(e.value - true[e.quantity, e.subject]) <= e.error + 1e-12, (e.quantity, e.subject)


def test_levels_and_their_errors_of_a_sine() -> None:
    """At 64 samples a period the rms is exact, a peak between samples lies 1 - cos(pi / 64) higher at most."""
    turn = 2.0 * np.pi * (np.arange(129) + 0.5) / 64.0
    low, high = extremes_missed(np.sin(turn))
    assert 1.0 - np.sin(turn).max() < float(high) < 0.05
    assert float(low) == pytest.approx(float(high), rel=1e-9)
    assert float(rms_missed(np.sin(turn))) < 1e-12
    assert float(rms_missed(np.where(np.arange(129) == 64, 1.0, 0.0))) == pytest.approx(1.0 / np.sqrt(128.0), rel=1e-9)


@pytest.mark.parametrize(("example", "few", "rounding"), [("paper/case3", 1, 1e-9), ("paper/eight_dof", 4, 1e-7)])
def test_few_samples_a_cycle_are_enough_and_take_no_long_series(example: str, few: int, rounding: float) -> None:
    """Bifurcation diagrams and basins keep few samples a period, in which a stiff mesh turns thousands of radians.

    Rounding grows from sample to sample as the motion is sensitive, so that more of them know it better.
    """
    model = gr.load(EXAMPLES / f"{example}.toml")
    between, extremes = Between(model), []
    for samples in (few, 512):
        run = gr.simulate(model, cycles=3, discard=1, samples_per_cycle=samples, audit=False)
        statistics = between.statistics(run.trajectory, between.signals(run.trajectory))
        assert statistics is not None
        extremes.append((statistics.low, statistics.high))
        walk = between._walk(run.trajectory)
        assert walk is not None
        assert max(series.count for series in walk.series.values()) <= 16
    (low, high), (fine_low, fine_high) = extremes
    size = np.maximum(np.abs(fine_low), np.abs(fine_high))
    np.testing.assert_allclose(low / size, fine_low / size, rtol=0, atol=rounding)
    np.testing.assert_allclose(high / size, fine_high / size, rtol=0, atol=rounding)
