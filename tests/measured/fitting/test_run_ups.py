"""Fits to run-ups: intervals that hold the truth, laws of their parts, and what is refused."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.measured.fitting.angle_offset import angle_offset
from gearrattle.measured.fitting.covariance import Covariance, chance
from gearrattle.measured.fitting.run_up_residuals import SHARED, block_noise
from gearrattle.recording import Channel, Recording
from tests.measured.fitting import run_ups

WHITE = run_ups.KINDS[0]


@pytest.mark.parametrize("kind", run_ups.KINDS, ids=[kind.words for kind in run_ups.KINDS])
def test_intervals_hold_the_truth(kind: run_ups.Kind) -> None:
    """Of every value of 60 measurements, by the binomial law at one in a thousand."""
    away = run_ups.deviations(kind, range(60))
    low, high = binom.ppf([0.0005, 0.9999], 60, 0.95)
    inside = np.count_nonzero(np.abs(away) < 1.96, axis=0)
    assert np.all((low <= inside) & (inside <= high)), dict(zip(run_ups.FREE, inside.tolist(), strict=True))


@pytest.mark.long
@pytest.mark.parametrize("kind", run_ups.KINDS, ids=[kind.words for kind in run_ups.KINDS])
def test_intervals_hold_the_truth_of_many(kind: run_ups.Kind) -> None:
    away = run_ups.deviations(kind, range(300))
    low, high = binom.ppf([0.0005, 0.9995], 300, 0.95)
    inside = np.count_nonzero(np.abs(away) < 1.96, axis=0)
    assert np.all((low <= inside) & (inside <= high)), dict(zip(run_ups.FREE, inside.tolist(), strict=True))


def test_a_whole_fit_holds_the_truth_and_shows_orders_over_speed(tmp_path: Path) -> None:
    """From 20 % off; by the command line from a file as by Python, with a figure a channel."""
    model, _ = run_ups.truth()
    free = list(run_ups.FREE[:2])
    start = model.with_({free[0]: 1.2 * model[free[0]], free[1]: 0.8 * model[free[1]]})
    (record,) = run_ups.recordings(WHITE, 0)
    fit = gr.identification.fit(start, record, free, starts=1)
    for parameter in fit.parameters:
        assert abs(parameter.value - model[parameter.path]) < 4.0 * parameter.standard_error
        assert parameter.relative_error < 0.01
    assert {(track.channel, track.order) for track in fit.tracks} == set(
        itertools.product(("v_engine", "v_gear"), (1.0, 2.0))
    )
    within = [np.abs(track.measured - track.simulated) <= track.reach for track in fit.tracks]
    assert 0.85 < np.mean(within) <= 1.0
    gr.write(record, tmp_path / "rig.csv")
    (tmp_path / "start.toml").write_text(start.to_toml(), encoding="utf-8")
    mapping = tmp_path / "measurement.toml"
    mapping.write_text(gr.measured.look(tmp_path / "rig.csv").mapping(tmp_path), encoding="utf-8")
    words = ["fit", str(tmp_path / "start.toml"), str(mapping), "--free", free[0], "--starts", "1", "--shaft", "n"]
    assert main([*words, "-o", str(tmp_path / "page")]) == 0
    summary = json.loads((tmp_path / "page" / "summary.json").read_text(encoding="utf-8"))
    assert len(summary["tracks"]) == 4
    assert "Orders of v_gear" in (tmp_path / "page" / "report.html").read_text(encoding="utf-8")


def test_a_wrong_model_is_told() -> None:
    """The damping is free, the inertia a fifth off."""
    model, _ = run_ups.truth()
    free = "coupling.damper.stages.1.damping"
    wrong = model.with_({"inertia.gear.J": 0.06})
    fit = gr.identification.fit(wrong, run_ups.recordings(WHITE, 0)[0], [free], starts=1)
    assert any("larger than the standard errors allow" in note for note in fit.notes)


def test_a_shaft_whose_speed_is_read_wrong_drifts() -> None:
    (record,) = run_ups.recordings(WHITE, 0)
    channels = [
        replace(channel, values=1.0005 * channel.values) if channel.name == "n" else channel
        for channel in record.channels
    ]
    model, _ = run_ups.truth()
    free = [run_ups.FREE[0]]
    actual, exact = (
        gr.identification.fit(model, one, free, starts=1).notes
        for one in (replace(record, channels=tuple(channels)), record)
    )
    assert any("drifts" in note for note in actual)
    assert not any("drifts" in note for note in exact)


def test_calibration_is_an_error_of_the_values() -> None:
    model, _ = run_ups.truth()
    (record,) = run_ups.recordings(WHITE, 0)
    free = ["torque.0.harmonics.0.amplitude"]
    exact, uncertain = (
        gr.identification.fit(model, {"recording": {"file": record, **more}}, free, starts=1).parameters[0]
        for more in ({}, {"calibration": 5.0})
    )
    assert uncertain.standard_error > 2.0 * exact.standard_error


def problems(data: object, **changes: float | str) -> str:
    model, _ = run_ups.truth()
    with pytest.raises(gr.ModelError) as caught:
        gr.identification.fit(model.with_(changes), data, ["inertia.gear.J"], starts=1)  # type: ignore[arg-type]
    return str(caught.value)


def test_what_does_not_go_with_a_run_up_is_refused() -> None:
    (record,) = run_ups.recordings(WHITE, 0)
    assert "applies to a motion at one speed" in problems({"recording": {"file": record, "band": ["1 Hz", "9 Hz"]}})
    assert "clocks of run-ups are the shafts" in problems({"recording": {"file": record, "clock": "3 ms"}})
    assert "fewer than 6 blocks" in problems({"recording": {"file": record, "turns": 60.0}})
    assert "simulated run-up has fewer" in problems({"recording": {"file": record, "turns": 500.0}})
    assert "must be positive numbers" in problems({"recording": {"file": record, "orders": []}})
    turned = replace(record, channels=tuple(replace(c, values=c.values[::-1]) for c in record.channels))
    assert "must change the same way" in problems(turned)
    assert "repeat one measurement" in problems([record, replace(record, channels=record.channels[1:])])


def test_what_goes_with_a_run_up_alone_is_refused() -> None:
    steady = gr.example("backlash_oscillator")
    time = np.arange(0.0, 100.0, 0.1)
    record = Recording(time, (Channel("v", "velocity", "gear", "1", np.sin(time)),), "rig")
    for more, words in (({"turns": 4.0}, "applies to a run-up"), ({"orders": [2.0]}, "applies to a run-up")):
        with pytest.raises(gr.ModelError, match=words):
            gr.identification.fit(steady, {"recording": {"file": record, **more}}, ["coupling.mesh.damping"])
    with pytest.raises(gr.ModelError, match="repeats are for run-ups"):
        gr.identification.fit(steady, [record, record], ["coupling.mesh.damping"])


@pytest.mark.parametrize("orders", [(2.0,), (1.0, 2.0), (0.5, 2.0, 21.0), (1.0, 13.0 / 7.0)])
def test_the_angle_between_two_zeros_is_the_one_that_turned_the_orders(orders: tuple[float, ...]) -> None:
    random = np.random.default_rng(0)
    order = np.repeat(orders, 2)
    simulated = random.standard_normal(order.size) + 1j * random.standard_normal(order.size)
    for angle in (-0.7, 0.3, 1.1):
        cross = np.abs(simulated) ** 2 * np.exp(1j * order * angle)
        assert np.exp(1j * order * angle_offset(cross, order)) == pytest.approx(np.exp(1j * order * angle), abs=1e-6)


def test_second_differences_tell_the_noise_of_blocks_beside_a_smooth_misfit() -> None:
    """Neighbours that share a sixth; two columns with a correlation of 0.6 and a turn of phase; beside a parabola."""
    random = np.random.default_rng(1)
    count = 40_000
    covariance = np.array([[4.0, 1.8j], [-1.8j, 2.25]])
    root = np.linalg.cholesky(covariance)
    white = random.standard_normal((count + 1, 2)) + 1j * random.standard_normal((count + 1, 2))
    share = float(np.roots([1.0, -1.0 / SHARED, 1.0]).min())  # x / (1 + x^2) is the correlation
    noise = (white[1:] + share * white[:-1]) @ root.T / np.sqrt(2.0 * (1.0 + share**2))
    smooth = np.linspace(-1.0, 1.0, count)[:, None] ** 2 * np.array([30.0, 10.0j])
    speed = np.full(count, 9.0)
    actual = block_noise(noise + smooth, speed, [slice(0, count)]).mean(axis=0)
    assert actual == pytest.approx(covariance, abs=0.1)


def test_a_covariance_in_blocks_is_the_matrix() -> None:
    random = np.random.default_rng(2)
    root = random.standard_normal((12, 12))
    whole = root @ root.T
    for i, j in itertools.product(range(4), range(4)):
        if abs(i - j) > 1:
            whole[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] = 0.0
    within = np.stack([whole[3 * b : 3 * b + 3, 3 * b : 3 * b + 3] for b in range(4)])
    neighbour = np.stack([whole[3 * b : 3 * b + 3, 3 * b + 3 : 3 * b + 6] for b in range(3)])
    factor = random.standard_normal((2, 12))
    weight = random.uniform(0.5, 2.0, 12)
    actual = Covariance(within, neighbour, factor[:1]).plus(factor[1:]).weighted(weight)
    expected = (whole + factor.T @ factor) * np.outer(weight, weight)
    columns = random.standard_normal((12, 3))
    assert actual.times(columns) == pytest.approx(expected @ columns)
    assert actual.of(columns) == pytest.approx(columns.T @ expected @ columns)
    assert actual.trace == pytest.approx(np.trace(expected))
    assert actual.trace_of_square == pytest.approx(np.sum(expected**2))
    rows = random.standard_normal(12)
    assert chance((rows, columns), actual, (9, 30.0)) == pytest.approx(
        chance((rows, columns), Covariance.dense(expected), (9, 30.0))
    )
