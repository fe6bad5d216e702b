"""Amplitudes and phases at orders against the sines they were made of."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals import harmonics, order_sums, resolved
from gearrattle.signals.orders import repeating_angles

OMEGA = 150.0
PERIOD = 2 * np.pi / OMEGA


def test_amplitude_and_phase_of_every_order() -> None:
    time = 3.0 * PERIOD + np.arange(4 * 64) * (PERIOD / 64)
    parts = {1.0: (2.0, 0.3), 2.0: (1.0, -1.2), 20.0: (0.01, 2.5)}
    signal = 7.0 + sum(a * np.sin(o * OMEGA * time + p) for o, (a, p) in parts.items())
    actual = harmonics(signal, time, OMEGA, np.array(list(parts)))
    assert np.abs(actual) == pytest.approx([2.0, 1.0, 0.01], rel=1e-12)
    assert np.angle(actual) == pytest.approx([0.3, -1.2, 2.5], abs=1e-11)


def test_it_is_the_discrete_fourier_transform_over_whole_periods() -> None:
    noise = np.random.default_rng(5).normal(size=(6 * 32, 2))
    time = np.arange(6 * 32) * (PERIOD / 32)
    actual = np.abs(harmonics(noise, time, OMEGA, np.array([1.0, 3.0, 5.0])))
    expected = 2 * np.abs(np.fft.rfft(noise, axis=0))[[6, 18, 30]] / (6 * 32)
    assert actual == pytest.approx(expected, rel=1e-11)


def test_orders_without_a_common_period_are_separated() -> None:
    time = np.arange(10 * 64) * (PERIOD / 64)
    signal = np.sin(OMEGA * time) + 0.5 * np.sin(np.sqrt(2.0) * OMEGA * time + 1.0)
    actual = harmonics(signal, time, OMEGA, np.array([1.0, np.sqrt(2.0)]))
    assert np.abs(actual) == pytest.approx([1.0, 0.5], rel=1e-11)


def test_what_the_samples_cannot_show_is_not_a_number() -> None:
    time = np.arange(5 * 16) * (PERIOD / 16)
    actual = harmonics(np.sin(OMEGA * time), time, OMEGA, np.array([1.0, 8.0, 20.0]))
    assert abs(actual[0]) == pytest.approx(1.0, rel=1e-12)
    assert np.isnan(actual[1:]).all()


def test_half_the_sampling_rate_is_not_resolved() -> None:
    assert resolved(np.array([0.0, 7.0, 8.0]), OMEGA, PERIOD / 16).tolist() == [False, True, False]


def test_fewer_samples_than_unknowns() -> None:
    time = np.arange(4) * (PERIOD / 4)
    assert np.isnan(harmonics(np.ones(4), time, OMEGA, np.array([0.5, 1.0]))).all()
    assert np.isnan(harmonics(np.ones(1), time[:1], OMEGA, np.array([1.0]))).all()


def test_no_orders_no_amplitudes() -> None:
    assert harmonics(np.ones((8, 3)), np.arange(8.0), OMEGA, np.empty(0)).shape == (0, 3)


def test_a_drift_beside_the_orders_is_fitted_with_them() -> None:
    """A line and a parabola leave the amplitudes as they are; without a trend they leak."""
    time = np.arange(256) / 64.0
    signal = 3.0 * np.sin(2.0 * np.pi * time + 0.4) + 50.0 * time - 7.0 * time**2
    (actual,) = harmonics(signal, time, 2.0 * np.pi, np.array([1.0]), trend=2)
    assert abs(actual) == pytest.approx(3.0, rel=1e-10)
    assert np.angle(actual) == pytest.approx(0.4, rel=1e-10)
    assert abs(harmonics(signal, time, 2.0 * np.pi, np.array([1.0]))[0] - actual) > 0.1


def test_samples_of_equal_phase_are_added_first_where_all_orders_repeat() -> None:
    """Sums over 25 periods, begun in the 1000th or at any time: those of all samples, and of sines kept exactly."""
    orders, noise = np.array([0.5, 1.0, 7.0]), np.random.default_rng(5).normal(size=(25 * 64, 2))
    period = 2.0 * np.pi / (0.5 * OMEGA)
    for begin in (1000.0 * period, 0.3 * period):
        time = begin + np.arange(25 * 64) * period / 64
        folded, whole = (order_sums(noise, time, OMEGA, orders, periods=n) for n in (25, 1))
        for one, other in zip(folded, whole, strict=True):
            assert one == pytest.approx(other, abs=1e-8)
    assert repeating_angles(time, OMEGA, np.array([np.sqrt(2.0)]), 25) is None
    assert repeating_angles(time[:-1], OMEGA, orders, 25) is None
