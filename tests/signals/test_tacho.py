"""Pulses of motions that are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals.kinematics import derived
from gearrattle.signals.tacho import levels, pulse_times, shaft
from gearrattle.signals.wheel_teeth import PulseError, teeth_passed

RATE = 50_000.0
T = np.arange(100_000) / RATE
TEETH = 60


def chirp(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle and speed of a shaft that runs from 10 to 40 turns a second within two seconds, with an order 2 on it."""
    turn = 2.0 * np.pi
    base, speed = turn * (10.0 * t + 7.5 * t**2), turn * (10.0 + 15.0 * t)
    return base + 0.01 * np.sin(2.0 * base), speed * (1.0 + 0.02 * np.cos(2.0 * base))


def test_a_chirp_from_an_analogue_wheel() -> None:
    """A sine of 60 a turn: sub-sample crossings give angle and speed far better than the sample interval."""
    angle, _speed = chirp(T)
    times = pulse_times(T, 2.0 + 3.0 * np.sin(TEETH * angle), 2.0, 0.5)
    assert times.size == int(np.ceil(TEETH * angle[-1] / (2 * np.pi))) - 1  # the pulse at t = 0 has no sample before it
    inside = T[(times[0] <= T) & (times[-1] >= T)]
    actual, rate = shaft(times, 2.0 * np.pi / TEETH * teeth_passed(times, TEETH).passed, inside)
    true, true_rate = chirp(inside)
    np.testing.assert_allclose(actual, true - 2.0 * np.pi / TEETH, atol=2e-5)
    at_pulses = chirp(times)[0] * TEETH / (2 * np.pi)
    np.testing.assert_allclose(at_pulses, np.arange(1, times.size + 1), atol=1e-3)
    np.testing.assert_allclose(rate[500:-500], true_rate[500:-500], rtol=2e-3)


def test_a_square_wave_is_as_good_as_its_sample_interval() -> None:
    angle, speed = chirp(T)
    times = pulse_times(T, np.where(np.sin(TEETH * angle) > 0.0, 5.0, 0.0), 2.5, 1.0)
    error = chirp(times)[0] - 2.0 * np.pi / TEETH * np.arange(times.size)  # here the first sample is low, at angle 0
    assert np.abs(error).max() <= 0.5 * speed.max() / RATE * 1.001


def test_a_wheel_with_a_gap() -> None:
    """60-2: the same angle, through the gaps."""
    angle, _ = chirp(T)
    tooth = np.floor(TEETH * angle / (2 * np.pi)).astype(int) % TEETH
    signal = np.where(tooth < TEETH - 2, np.sin(TEETH * angle), -np.abs(np.sin(TEETH * angle)))
    times = pulse_times(T, signal, 0.0, 0.2)
    pulses = teeth_passed(times, TEETH, (2,))
    true = chirp(times)[0]
    np.testing.assert_allclose(2.0 * np.pi / TEETH * pulses.passed, true - true[0], atol=1e-3)
    with pytest.raises(PulseError, match="no interval is as long as a gap"):
        teeth_passed(pulse_times(T, np.sin(TEETH * angle), 0.0, 0.2), TEETH, (2,))
    lost = teeth_passed(np.delete(times, 200), TEETH, (2,))
    np.testing.assert_allclose(lost.passed, np.delete(pulses.passed, 200))
    np.testing.assert_allclose(lost.lost, times[200], atol=1e-4)


def test_noise_below_the_hysteresis_adds_no_pulse_and_above_it_does() -> None:
    angle, _ = chirp(T)
    clean = np.sin(TEETH * angle)
    noisy = clean + 0.1 * np.random.default_rng(2).uniform(-1.0, 1.0, T.size)
    right = pulse_times(T, clean, 0.0, 0.0).size
    assert pulse_times(T, noisy, 0.0, 0.25).size == right
    assert pulse_times(T, noisy, 0.0, 0.0).size > right


def test_falling_edges_and_guessed_levels() -> None:
    time = np.arange(0.0, 4.0, 0.001)
    square = np.where((time % 1.0) < 0.3, 7.0, 1.0)
    assert levels(square) == (4.0, pytest.approx(1.2))
    np.testing.assert_allclose(pulse_times(time, square, 4.0, 1.2), [1.0, 2.0, 3.0], atol=1e-3)
    np.testing.assert_allclose(pulse_times(time, square, 4.0, 1.2, rising=False), [0.3, 1.3, 2.3, 3.3], atol=1e-3)


@pytest.mark.parametrize("times", [-2, -1, 1, 2])
def test_derivatives_and_integrals_of_a_sine(times: int) -> None:
    """To the accuracy the module states, which is a ratio of amplitudes away from the ends."""
    w, h = 2.0 * np.pi * 50.0, 1e-3
    time = np.arange(2000) * h
    actual = derived(time, np.sin(w * time), times)
    exact = {
        -2: -np.sin(w * time) / w**2 + time / w,
        -1: (1.0 - np.cos(w * time)) / w,
        1: w * np.cos(w * time),
        2: -(w**2) * np.sin(w * time),
    }[times]
    stated = {-2: 2 * (w * h) ** 4 / 720, -1: (w * h) ** 4 / 720, 1: (w * h) ** 4 / 180, 2: (w * h) ** 2 / 12}[times]
    middle = slice(50, -50)
    if times < 0:  # an integral keeps what it gathered at the end
        actual, exact = (np.gradient(x, h)[middle] if times == -2 else x[middle] - x[50] for x in (actual, exact))
    else:
        actual, exact = actual[middle], exact[middle]
    assert np.abs(actual - exact).max() <= 1.6 * stated * np.ptp(exact)
    assert np.abs(actual - exact).max() >= 0.1 * stated * np.ptp(exact)  # the formula is no idle bound
