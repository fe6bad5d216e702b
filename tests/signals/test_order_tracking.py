"""Orders of a shaft whose speed changes: closed forms, a second route, and what must not fold back."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.kernels.band_limited_signal import banded
from gearrattle.signals.conditioning import resample
from gearrattle.signals.order_tracking import (
    TURN,
    Orders,
    angle_of,
    fitted_orders,
    order_spectra,
    speed_of,
    turned,
    when_at,
)

RATE = 10_000.0
TIME = np.arange(100_000) / RATE
START, RISE = 10.0, 3.0  # turns a second, and a second again
ANGLE = TURN * (START * TIME + 0.5 * RISE * TIME**2)
SPEED = TURN * (START + RISE * TIME)


def spectra_of(values: np.ndarray, highest: float = 20.0, turns: int = 8, window: str = "hann") -> Orders:
    per_turn = 2 * int(np.ceil(highest / 0.8))
    return order_spectra(turned(values, 1.0 / RATE, ANGLE, SPEED, per_turn), turns, 0.5, window, highest)


def at(actual: Orders, order: float) -> np.ndarray:
    (k,) = np.flatnonzero(np.isclose(actual.order, order, rtol=0.0, atol=1e-9))
    return actual.amplitude[:, k]


def test_orders_of_a_chirp_are_those_it_was_made_of() -> None:
    x = 1.5 * np.sin(2.0 * ANGLE + 0.3) + 0.2 * np.sin(5.5 * ANGLE - 1.0) + 0.01 * np.sin(20.0 * ANGLE) + 4.0
    actual = spectra_of(x)
    for order, amplitude, phase in ((2.0, 1.5, 0.3), (5.5, 0.2, -1.0), (20.0, 0.01, 0.0)):
        wanted = amplitude * np.exp(1j * phase)
        inner = at(actual, order)[2:-2]
        assert np.abs(inner - wanted).max() < 1e-4 * amplitude + 1e-6, order  # the stated bound
    assert actual.amplitude[:, 0].real == pytest.approx(4.0, abs=1e-4)
    assert np.abs(at(actual, 12.0)).max() < 1e-5
    assert actual.speed == pytest.approx(np.interp(actual.time, TIME, SPEED), rel=1e-3)


def test_speed_and_time_of_a_block_belong_together_when_the_speed_is_steady() -> None:
    steady = np.full(TIME.size, TURN * 20.0)
    read = turned(TIME, 1.0 / RATE, steady * TIME, steady, 32)
    actual = order_spectra(read, 4, 0.5, "hann", 10.0)
    assert actual.speed == pytest.approx(TURN * 20.0, rel=1e-10)  # rounding of 1257 rad in steps of 0.0126 rad
    assert actual.time[0] == pytest.approx(0.1, abs=1.0 / (20.0 * 32.0))  # the middle of four turns
    assert np.diff(actual.time) == pytest.approx(0.1, rel=1e-9)


def test_fitting_finds_two_orders_closer_than_a_bin_and_the_spectrum_does_not() -> None:
    x = np.sin(2.0 * ANGLE + 0.1) + 0.5 * np.sin(2.1 * ANGLE - 0.7)
    fitted = fitted_orders(x, 1.0 / RATE, ANGLE, SPEED, orders=np.array([2.0, 2.1]), turns=8.0, overlap=0.5)
    assert np.abs(fitted.amplitude - [np.exp(0.1j), 0.5 * np.exp(-0.7j)]).max() < 1e-9
    beating = np.abs(at(spectra_of(x), 2.0))
    assert np.ptp(beating) > 0.5


def test_two_routes_agree_on_what_both_can_tell() -> None:
    rng = np.random.default_rng(11)
    growing = (1.0 + 0.05 * TIME) * np.sin(3.0 * ANGLE + 0.4) + 0.05 * rng.standard_normal(TIME.size)
    one = spectra_of(growing, turns=10)
    other = fitted_orders(growing, 1.0 / RATE, ANGLE, SPEED, orders=np.array([3.0]), turns=10.0, overlap=0.5)
    count = min(one.speed.size, other.speed.size)
    assert np.abs(at(one, 3.0)[:count] - other.amplitude[:count, 0]).max() < 3e-4
    assert one.speed[:count] == pytest.approx(other.speed[:count], rel=1e-5)


@pytest.mark.parametrize("hertz", [700.0, 1500.0, 4000.0])
def test_nothing_folds_back(hertz: float) -> None:
    """A tone lies above half of 16 samples a turn, 8 x 40 = 320 Hz at most, throughout."""
    read = turned(np.sin(TURN * hertz * TIME), 1.0 / RATE, ANGLE, SPEED, 16)
    inner = read.values[200:-200]
    assert np.abs(inner).max() < 2e-4  # 80 dB is 1e-4; the band changes within the reach of the kernel


def test_where_the_record_is_coarser_than_the_angle_nothing_is_lost() -> None:
    """At 64 samples a turn the grid is finer than a record of 1 kHz."""
    time = TIME[::10]
    x = np.sin(6.0 * ANGLE[::10])
    actual = order_spectra(turned(x, 10.0 / RATE, ANGLE[::10], SPEED[::10], 64), 8, 0.5, "hann", 8.0)
    assert time.size == 10_000
    assert np.abs(at(actual, 6.0)[2:-2] - 1.0).max() < 2e-4  # 6 x 40 Hz lies below 0.4 of the rate


def test_at_steady_speed_it_is_the_resampling_of_the_conditioning() -> None:
    rng = np.random.default_rng(2)
    x = rng.standard_normal(3000)
    position = np.linspace(100.0, 2900.0, 777)
    width = (position[1] - position[0]) * np.ones(position.size)
    steady = TURN * 1.0
    read = turned(x, 1e-3, steady * 1e-3 * np.arange(3000), np.full(3000, steady), 360)
    other = resample(x, 1e-3, 0.0, read.time, 360.0)
    assert np.abs(read.values - other).max() < 1e-5
    assert width[0] > 1.0


def test_beyond_its_ends_a_signal_is_its_point_reflection() -> None:
    table = np.concatenate([np.linspace(1.0, 0.0, 11), [0.0]])  # a triangle one sample wide to either side
    x = np.array([1.0, 2.0, 4.0, 8.0])
    assert banded(x, np.array([0.0, 0.5, 3.0]), np.ones(3), table, 10.0) == pytest.approx([1.0, 1.5, 8.0])
    wide = banded(x, np.array([0.0, 3.0]), np.full(2, 2.0), table, 10.0)
    assert wide == pytest.approx([1.0, 8.0])  # odd about its ends: the mean of a symmetric window is the end


def test_the_angle_is_the_integral_of_the_speed_within_its_bound() -> None:
    step, wave = 1e-3, 2.0 * np.pi * 25.0
    time = step * np.arange(1000)
    speed = 100.0 + 5.0 * np.sin(wave * time)
    exact = 100.0 * time + 5.0 / wave * (1.0 - np.cos(wave * time))
    bound = 11.0 / 720.0 * step**5 * 5.0 * wave**4 * time.size
    actual = angle_of(speed, step)
    assert np.abs(actual - exact).max() < bound
    assert np.abs(speed_of(exact, step) - speed)[2:-2].max() < step**4 / 30.0 * 5.0 * wave**4
    assert angle_of(np.full(10, 3.0), 0.5)[-1] == pytest.approx(13.5)


def test_the_time_of_an_angle_is_found_between_samples() -> None:
    step, wave = 1e-3, 2.0 * np.pi * 10.0
    time = step * np.arange(2000)
    angle, speed = 50.0 * time + 0.3 * np.sin(wave * time), 50.0 + 0.3 * wave * np.cos(wave * time)
    true = np.sort(np.random.default_rng(1).uniform(0.0, time[-1], 500))
    position, there = when_at(50.0 * true + 0.3 * np.sin(wave * true), angle, speed, step)
    assert np.abs(position * step - true).max() < 0.3 * wave**4 * step**4 / 384.0 / (50.0 - 0.3 * wave)
    assert there == pytest.approx(50.0 + 0.3 * wave * np.cos(wave * true), rel=1e-5)
