"""Phases and forcing along a run-up, against fifty digits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np
import pytest

from gearrattle.engine.kernels.march_arrays import ORDER
from gearrattle.engine.system import run_up_signals
from gearrattle.engine.system.run_up_phase import PER_RADIAN, Ramp
from gearrattle.engine.system.run_up_signals import TRUNCATION, Sound, Tone, TooLong, bound, channels

RPM = np.pi / 30.0
RAMPS = [Ramp(800 * RPM, 3000 * RPM, 10.0), Ramp(314.0, 31.0, 0.7), Ramp(100.0, 100.0, 2.0)]


@pytest.fixture(autouse=True)
def _fifty_digits() -> Any:
    with mpmath.workdps(50):
        yield


def angle(ramp: Ramp, time: Any) -> Any:
    """Return phi(t) in fifty digits."""
    t, begin, end, over = (mpmath.mpf(x) for x in (time, ramp.begin, ramp.end, ramp.over))
    if t <= over:
        return begin * t + (end - begin) * t * t / (2 * over)
    return (begin + end) * over / 2 + end * (t - over)


def amplitude(tone: Tone, speed: Any) -> Any:
    """Return the amplitude in fifty digits."""
    piece = int(np.clip(np.searchsorted(tone.speeds, float(speed), side="right") - 1, 0, len(tone.amplitudes) - 1))
    since = speed - mpmath.mpf(tone.speeds[piece])
    return sum(mpmath.mpf(a) * since**j for j, a in enumerate(tone.amplitudes[piece].tolist()))


def forcing(ramp: Ramp, tones: Sequence[Tone], time: Any) -> Any:
    """Return f(t) in fifty digits."""
    begin, end, over = (mpmath.mpf(x) for x in (ramp.begin, ramp.end, ramp.over))
    speed = begin + (end - begin) * time / over if time <= over else end
    return sum(
        amplitude(tone, speed) * mpmath.sin(mpmath.mpf(tone.order) * angle(ramp, time) + mpmath.mpf(tone.phase))
        for tone in tones
    )


def constant(ramp: Ramp, order: float, phase: float, size: float) -> Tone:
    speeds = np.array(sorted({min(ramp.begin, ramp.end), max(ramp.begin, ramp.end) * (1.0 + 1e-15)}))
    return Tone(order, phase, speeds, np.array([[size]]))


def tabled(ramp: Ramp, order: float, phase: float) -> Tone:
    low, high = sorted((ramp.begin, ramp.end))
    speeds = np.array([0.9 * low, 0.5 * (low + high) + 1.0, 1.1 * high + 2.0])
    values = np.array([200.0, 60.0, 90.0])
    return Tone(order, phase, speeds, np.column_stack([values[:-1], np.diff(values) / np.diff(speeds)]))


def test_the_factor_of_a_turn() -> None:
    with mpmath.workdps(80):
        assert abs(mpmath.mpf(PER_RADIAN.numerator) / PER_RADIAN.denominator - 1 / (2 * mpmath.pi)) < 1e-74


@pytest.mark.parametrize("ramp", RAMPS)
def test_fractions_of_a_turn_are_rounded_once(ramp: Ramp) -> None:
    times = np.concatenate([[0.0, ramp.over], np.random.default_rng(0).uniform(0.0, 2.0 * ramp.over, 100)])
    orders = [0.5, 1.0, 20.5, 1.0 / 3.0, 187.0]
    for order, actual in zip(orders, ramp.turns(orders, times), strict=True):
        for time, turn in zip(times.tolist(), actual.tolist(), strict=True):
            exact = mpmath.frac(mpmath.mpf(order) * angle(ramp, time) / (2 * mpmath.pi))
            apart = abs(exact - mpmath.mpf(turn))
            assert min(apart, 1 - apart) < 2.0**-53


def test_an_angle_in_doubles_would_not_do() -> None:
    """The reason for whole numbers: after ten seconds a double has lost five digits of a tooth mesh's phase."""
    ramp, time = RAMPS[0], 9.87654321
    plain = 187.0 * (ramp.begin * time + 0.5 * ramp.rate * time**2) / (2.0 * np.pi)
    exact = mpmath.frac(187 * angle(ramp, time) / (2 * mpmath.pi))
    assert abs(mpmath.mpf(plain % 1.0) - exact) > 1e-13
    assert abs(mpmath.mpf(float(ramp.turns([187.0], np.array([time]))[0, 0])) - exact) < 2.0**-53


@pytest.mark.parametrize("ramp", RAMPS)
def test_torques_keep_the_bound(ramp: Ramp) -> None:
    tones = (tabled(ramp, 2.0, 0.3), constant(ramp, 4.0, -1.0, 80.0), constant(ramp, 0.0, np.pi / 2, 10.0))
    (channel,) = channels(ramp, [Sound(tones, smooth=False)], 1.3 * ramp.over, 0.1)
    times = np.sort(np.random.default_rng(1).uniform(0.0, 1.3 * ramp.over, 300))
    actual, size = channel.at(times), 200.0 + 80.0
    worst = max(abs(mpmath.mpf(f) - forcing(ramp, tones, mpmath.mpf(t))) for t, f in zip(times, actual, strict=True))
    assert worst < 1e-12 * size


@pytest.mark.parametrize("ramp", RAMPS)
def test_errors_keep_the_bound_in_both_derivatives(ramp: Ramp) -> None:
    tones = (constant(ramp, 20.0, 0.1, 5e-6), constant(ramp, 41.5, 2.0, 1e-6))
    (channel,) = channels(ramp, [Sound(tones, smooth=True)], 1.1 * ramp.over, 0.1)
    times = np.sort(np.random.default_rng(2).uniform(0.0, 1.1 * ramp.over, 30))
    fastest = max(ramp.begin, ramp.end)
    for derivative in range(3):
        size = sum(t.amplitudes[0, 0] * (t.order * fastest) ** derivative for t in tones)
        for time, actual in zip(times.tolist(), channel.at(times, derivative).tolist(), strict=True):
            exact = mpmath.diff(
                lambda t: forcing(ramp, tones, t), mpmath.mpf(time), derivative, h=mpmath.mpf(10) ** -16
            )
            assert abs(mpmath.mpf(actual) - exact) < 1e-12 * size


def test_errors_meet_in_value_and_slope() -> None:
    ramp = RAMPS[0]
    (channel,) = channels(ramp, [Sound((constant(ramp, 20.0, 0.1, 5e-6),), smooth=True)], 0.5, 0.1)
    length = np.diff(channel.knots)[:-1]
    for derivative, size in ((0, 5e-6), (1, 5e-6 * 20.0 * ramp.end)):
        before = np.zeros_like(length)
        for j in range(channel.coefficients.shape[1] - 1, derivative - 1, -1):
            before = before * length + (j if derivative else 1.0) * channel.coefficients[:-1, j]
        assert np.abs(before - channel.coefficients[1:, derivative]).max() < 1e-14 * size


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("length", [2e-4, 1e-3, 3e-3])
def test_the_bound_is_one_on_intervals_of_any_length(smooth: bool, length: float) -> None:
    """Interpolants differ by less than the stated bound; that of a torque, which counts alone, is no wide one."""
    ramp = Ramp(200.0, 400.0, 0.05)
    sound = Sound((constant(ramp, 6.0, 0.4, 1.0),), smooth)
    left, _ = bound(sound, ramp.begin, ramp.end, ramp.rate, length)
    knots = np.arange(0.0, ramp.over, length)
    turned = {6.0: 2.0 * np.pi * ramp.turns([6.0], knots[:-1])[0]}
    coefficients = run_up_signals._polynomials(run_up_signals._Course(ramp, knots, turned), sound)
    worst = 0.0
    for g in range(0, len(knots) - 1, 1 + len(knots) // 25):
        for x in np.linspace(0.0, length, 9):
            exact = forcing(ramp, sound.tones, mpmath.mpf(knots[g]) + mpmath.mpf(x))
            value = sum(mpmath.mpf(a) * mpmath.mpf(x) ** j for j, a in enumerate(coefficients[g].tolist()))
            worst = max(worst, float(abs(value - exact)))
    turned_last = 6.0 * 0.5 * (ramp.begin + ramp.end) * ramp.over
    rounding = 2.0 * np.finfo(float).eps * turned_last  # of the phase, in the knots and in the sine
    assert worst <= left[0] + rounding
    assert smooth or worst >= 1e-2 * left[0] or left[0] < 1e-12


def test_intervals_are_the_longest_dyadic_parts_of_the_period_allowed() -> None:
    ramp, period = RAMPS[2], 0.1
    sound = Sound((constant(ramp, 2.0, 0.0, 1.0),), smooth=False)
    (channel,) = channels(ramp, [sound], 2.0, period)
    length = np.diff(channel.knots)
    assert np.ptp(length) < 1e-12 * length[0]
    assert float(np.log2(period / length[0])).is_integer()
    assert channel.knots[-1] >= 2.0
    for factor, enough in ((1.125, True), (2.3, False)):
        left, allowed = bound(sound, 100.0, 100.0, 0.0, factor * length[0])
        assert bool(left[0] <= TRUNCATION * allowed[0]) == enough


def test_no_interval_beside_a_corner_is_short_or_longer_than_allowed() -> None:
    """Corners just before and just after multiples of the length, and far from them."""
    ramp, period = Ramp(100.0, 200.0, 1.0), 0.1
    for offset in (1e-12, 1e-9, 1e-4, 0.1, 0.5, 0.9, 0.9999, 1.0 - 1e-9):
        plain = Sound((constant(ramp, 3.0, 0.0, 1.0),), smooth=False)
        length = float(np.diff(channels(ramp, [plain], 1.0, period)[0].knots).max())
        speed = float(ramp.speed(np.array((7.0 + offset) * length)))
        speeds = np.array([99.0, speed, 201.0])
        tone = Tone(3.0, 0.0, speeds, np.array([[1.0, 0.0], [1.0, 1e-3]]))
        knots = channels(ramp, [Sound((tone,), smooth=False)], 1.0, period)[0].knots
        assert np.abs(knots - ramp.time(speed)).min() < 1e-12
        assert np.diff(knots).min() > 0.12 * np.diff(knots).max()
        left, allowed = bound(Sound((tone,), smooth=False), 100.0, 200.0, 100.0, float(np.diff(knots).max()))
        assert left[0] <= TRUNCATION * allowed[0]


def exact_at(ramp: Ramp, tone: Tone, time: float, derivative: int) -> Any:
    """Return f, f' or f'' in fifty digits; f' has a kink at the end of a ramp, so its step is very short."""
    step = mpmath.mpf(10) ** (-28 if derivative < 2 else -20)
    return mpmath.diff(lambda t: forcing(ramp, (tone,), t), mpmath.mpf(time), derivative, h=step)


@pytest.mark.parametrize("share", [1e-10, 1e-6, 0.01, 0.124, 0.126, 0.5, 0.876, 0.99, 1.0 - 1e-9])
@pytest.mark.parametrize("smooth", [False, True])
def test_no_interval_is_lost_at_either_end(share: float, smooth: bool) -> None:
    """The ramp ends a part of an interval after t = 0, or before the end of the run: values and slopes everywhere."""
    length = 0.1 * 0.5**4
    for over, until in ((share * length, 0.1), (0.1 - share * length, 0.1)):
        ramp = Ramp(100.0, 200.0, over)
        tone = constant(ramp, 3.0, 0.4, 1.0)
        (channel,) = channels(ramp, [Sound((tone,), smooth)], until, 0.1)
        assert channel.knots[0] == 0.0
        assert channel.knots[-1] >= until
        assert np.abs(channel.knots - over).min() <= 1e-13 * channel.knots[-1]
        within = channel.knots[:-1, None] + np.diff(channel.knots)[:, None] * np.array([1e-3, 0.3, 0.77, 0.999])
        times = np.concatenate([within[[0, 1, -2, -1]].ravel(), [0.0, over, until]])
        times = times[times <= channel.knots[-1]]
        for derivative in range(3 if smooth else 1):
            if derivative == 2:
                times = times[np.abs(times - over) > 1e-12]  # the acceleration jumps there
            for time, value in zip(times.tolist(), channel.at(times, derivative).tolist(), strict=True):
                exact = exact_at(ramp, tone, time, derivative)
                size = 600.0**derivative + (3.0 * abs(ramp.rate) if derivative == 2 else 0.0)
                assert abs(mpmath.mpf(value) - exact) < 1e-12 * size


def test_a_corner_of_a_table_is_a_knot() -> None:
    ramp = RAMPS[0]
    tone = tabled(ramp, 2.0, 0.0)
    (channel,) = channels(ramp, [Sound((tone,), smooth=False)], 10.0, 0.1)
    assert np.abs(channel.knots - ramp.time(float(tone.speeds[1]))).min() < 1e-12


def test_every_derivative_counts_in_a_taylor_window() -> None:
    """The last link reaches a deflection by way of rates and accelerations: three orders of the window further on."""
    assert run_up_signals.DEGREE <= ORDER - 4


def test_too_long_a_run_is_refused() -> None:
    ramp = RAMPS[2]
    with pytest.raises(TooLong):
        channels(ramp, [Sound((constant(ramp, 40.0, 0.0, 1.0),), smooth=True)], 1e6, 0.1)
