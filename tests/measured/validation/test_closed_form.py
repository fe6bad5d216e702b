"""Every number of a validation against a record written down in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.measured.validation import of_printed, sigma
from gearrattle.measured.validation.simulated_recording import recorded
from tests.measured.validation import made

PASS_BAND = 1e-4  # what the resampling kernel promises


def test_the_papers_table_5_from_its_printed_values() -> None:
    from gearrattle.reproduction.printed_values import TABLE_5

    ours = [f"{sigma(measured, simulated):.2f}" for _, _, measured, simulated, _ in TABLE_5]
    assert ours == ["6.56", "-1.99", "14.92", "10.91", "6.26", "-3.64"]
    printed = of_printed(1510, 1540)  # printed as -1.95
    assert printed.low < -1.95 < printed.high
    assert not np.isfinite(sigma(0.0, 1.0))


def test_a_gain_alone_is_sigma_everywhere() -> None:
    actual = gr.validate(made.run(), made.record(gain=1.1))
    wanted = 100.0 * (1.0 - 1.0 / 1.1)
    pair = actual["a"]
    assert pair.level("rms").sigma == pytest.approx(wanted, rel=20 * PASS_BAND)
    for order, amplitude in ((1, 5.0), (3, 2.0)):
        line = next(entry for entry in pair.orders if entry.order == order)
        assert line.measured == pytest.approx(1.1 * amplitude, rel=PASS_BAND)
        assert line.simulated == pytest.approx(amplitude, rel=PASS_BAND)
        assert line.sigma == pytest.approx(wanted, rel=20 * PASS_BAND)
        assert line.phase == pytest.approx(0.0, abs=1e-5)
    loud = max(pair.bands, key=lambda band: band.share)
    assert loud.decibels == pytest.approx(20.0 * np.log10(1.1), abs=1e-3)
    assert pair.agreement == pytest.approx(1.0, abs=1e-9)
    level = pair.level("rms")
    assert level.measured == pytest.approx(1.1 * np.sqrt((5.0**2 + 2.0**2) / 2.0), rel=PASS_BAND)
    assert abs(level.remainder) == pytest.approx(wanted, rel=0.01)
    assert "look first at a: its rms is simulated 9.09 % low" in actual.verdict


def test_peak_to_peak_is_that_of_the_closed_form() -> None:
    fine = made.acceleration(np.linspace(0.0, made.PERIOD, 100_001))
    level = gr.validate(made.run(), made.record(rate=20_480.0))["a"].level("peak-to-peak")
    between = next(entry.value for entry in level.budget if entry.source == "sampling")
    off = 100.0 * abs(level.simulated / np.ptp(fine) - 1.0)
    assert off < 3.0 * between  # the budget says how much the samples miss
    assert off < 1.0


@pytest.mark.parametrize("delay", [0.0123, -0.0031, 0.0249])
@pytest.mark.parametrize("method", ["cycle", "phase"])
def test_a_shifted_clock_is_found(delay: float, method: str) -> None:
    actual = gr.validate(made.run(), made.record(delay=delay), clock=method)
    assert actual.clock.delay == pytest.approx(delay, abs=1e-9)
    assert all(abs(order.phase) < 1e-5 for order in actual["a"].orders)


def test_a_known_delay_leaves_the_phase_error_that_is_there() -> None:
    actual = gr.validate(made.run(), made.record(delay=0.004), clock=0.003)
    for order in actual["a"].orders:
        assert order.phase == pytest.approx(360.0 * 20.0 * order.order * 0.001, abs=1e-4)


def test_another_length_of_the_cycle_is_found() -> None:
    actual = gr.validate(made.run(), made.record(slow=1.003))
    assert actual.clock.measured_period / made.PERIOD == pytest.approx(1.003, rel=1e-6)
    assert abs(actual["a"].level("rms").sigma) < 0.01
    assert any("0.3 % longer" in sentence for sentence in actual.findings)


def test_an_order_of_its_own_is_told_and_nothing_else() -> None:
    pair = gr.validate(made.run(), made.record(second=0.3))["a"]
    extra = next(order for order in pair.orders if order.order == 2)
    assert extra.measured == pytest.approx(0.3, rel=1e-4)
    assert extra.sigma == pytest.approx(100.0, abs=1e-3)
    assert np.isnan(extra.phase)
    others = [order for order in pair.orders if order.order != 2]
    assert [order.order for order in others] == [1, 3]
    assert all(abs(order.sigma) < 0.01 for order in others)


def test_an_identical_pair_differs_by_nothing() -> None:
    run = made.run()
    actual = gr.validate(run, recorded(run), start=run.trajectory.discard * made.PERIOD)
    assert actual.measured_cycles == actual.simulated_cycles
    assert {pair.name for pair in actual.pairs} == set(recorded(run).names)
    assert all(level.sigma == 0.0 and level.remainder == 0.0 for pair in actual.pairs for level in pair.levels)
    assert all(order.sigma == 0.0 and order.phase == 0.0 for pair in actual.pairs for order in pair.orders)
    assert all(band.decibels == 0.0 for pair in actual.pairs for band in pair.bands)
    assert actual.clock.delay == 0.0
    assert actual.verdict.startswith("Simulation and measurement agree in 3 of 3 channels")


def test_noise_raises_the_rms_as_its_square_and_the_budget_says_so() -> None:
    noise, clean = 1.0, np.sqrt((5.0**2 + 2.0**2) / 2.0)
    rate = 1280.0  # as the run: the kernel passes 0.45 of 0.5
    passed = np.sqrt(0.9) * noise
    actual = gr.validate(made.run(), made.record(noise=noise, rate=rate, seconds=20.0), noise={"a": passed})
    level = actual["a"].level("rms")
    assert level.measured == pytest.approx(np.hypot(clean, passed), rel=3e-3)
    stated = next(entry.value for entry in level.budget if entry.source == "stated noise")
    assert stated == pytest.approx(100.0 * (1.0 - clean / np.hypot(clean, passed)), rel=0.05)
    assert level.remainder == 0.0
    assert not level.by_chance  # scatter alone does not explain it: noise is a bias


def test_a_band_leaves_out_what_lies_outside_on_both_sides() -> None:
    actual = gr.validate(made.run(), made.record(), band=(0.0, 20.0))
    assert actual.band == pytest.approx((0.0, 32.0))  # four samples a cycle: 80 Hz
    assert [order.order for order in actual["a"].orders] == [1]
    assert actual["a"].level("rms").measured == pytest.approx(5.0 / np.sqrt(2.0), rel=PASS_BAND)
    high = gr.validate(made.run(), made.record(seconds=4.0), band=(45.0, 250.0))
    gain = 1.0 / (1.0 + (np.tan(np.pi * 45 / high.rate) / np.tan(np.pi * 60 / high.rate)) ** 8)
    third = next(order for order in high["a"].orders if order.order == 3)
    assert third.measured == pytest.approx(2.0 * gain, rel=2e-3)
    assert third.sigma == pytest.approx(0.0, abs=0.02)


def test_parameters_move_the_level_as_the_closed_form_says() -> None:
    actual = gr.validate(made.run(), made.record(), parameters={"inertia.wheel.J": 0.1}, draws=40, seed=3)
    level = actual["a"].level("rms")
    reported = next(entry.value for entry in level.budget if entry.source == "parameters")
    wide = 100.0 * np.sqrt(np.log1p((0.1 / 2.0) ** 2))  # a level is proportional to 1 / J
    assert abs(reported / wide - 1.0) < 3.5 / np.sqrt(2.0 * 39.0)
    assert level.expanded == pytest.approx(1.96 * reported, rel=0.01)
