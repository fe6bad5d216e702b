"""Rates, filters, trends against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals.conditioning import bridged, detrended, evened, filtered, resample

RATE = 10_000.0
T = np.arange(20_000) / RATE


def _gain(signal: np.ndarray, frequency: float, time: np.ndarray) -> complex:
    """Return the complex amplitude of a sine in the middle half of a signal, by least squares."""
    middle = slice(time.size // 4, 3 * time.size // 4)
    w = 2.0 * np.pi * frequency * time[middle]
    basis = np.stack([np.sin(w), np.cos(w), np.ones_like(w)], 1)
    a, b, _ = np.linalg.lstsq(basis, signal[middle], rcond=None)[0]
    return complex(a, b)


@pytest.mark.parametrize("order", [1, 2, 4, 8])
@pytest.mark.parametrize("frequency", [50.0, 300.0, 500.0, 700.0, 1500.0, 4000.0])
def test_a_low_pass_has_the_gain_of_its_formula_and_no_phase(order: int, frequency: float) -> None:
    actual = _gain(filtered(np.sin(2 * np.pi * frequency * T), RATE, "lowpass", (500.0,), order), frequency, T)
    warped = np.tan(np.pi * frequency / RATE) / np.tan(np.pi * 500.0 / RATE)
    assert actual == pytest.approx(1.0 / (1.0 + warped ** (2 * order)), abs=1e-9)


@pytest.mark.parametrize("frequency", [50.0, 300.0, 700.0, 1500.0, 4000.0])
def test_the_other_kinds(frequency: float) -> None:
    """High pass: the ratio turned over. Band pass: the low pass in (x^2 - x1 x2) / (x (x2 - x1))."""
    wave = np.sin(2 * np.pi * frequency * T)
    x, one, two = (np.tan(np.pi * f / RATE) for f in (frequency, 200.0, 900.0))
    low = abs((x * x - one * two) / (x * (two - one)))
    cases = {
        ("highpass", (200.0,)): 1.0 / (1.0 + (one / x) ** 6),
        ("bandpass", (200.0, 900.0)): 1.0 / (1.0 + low**6),
        ("bandstop", (200.0, 900.0)): 1.0 / (1.0 + low**-6),
    }
    for (kind, cutoff), gain in cases.items():
        assert _gain(filtered(wave, RATE, kind, cutoff, 3), frequency, T) == pytest.approx(gain, abs=1e-8)


@pytest.mark.parametrize("rate", [1000.0, 2345.6, 9999.0, 10_000.0, 44_100.0])
@pytest.mark.parametrize("part", [0.01, 0.1, 0.3, 0.4])
def test_what_passes_comes_at_the_new_times_as_it_was(rate: float, part: float) -> None:
    """Within 1e-4, away from the ends by half the kernel."""
    frequency = part * min(rate, RATE)
    wanted = np.arange(int(1.9 * rate)) / rate
    actual = resample(np.sin(2 * np.pi * frequency * T + 0.3), 1.0 / RATE, 0.0, wanted, rate)
    inside = (wanted > 32.0 / min(rate, RATE)) & (wanted < T[-1] - 32.0 / min(rate, RATE))
    np.testing.assert_allclose(actual[inside], np.sin(2 * np.pi * frequency * wanted + 0.3)[inside], atol=1e-4)


@pytest.mark.parametrize("frequency", [500.0, 620.0, 1000.0, 1800.0, 4999.0])
def test_what_would_fold_back_is_lower_by_80_decibels(frequency: float) -> None:
    wanted = 0.1 + np.arange(1700) / 1000.0
    actual = resample(np.cos(2 * np.pi * frequency * T + 0.2), 1.0 / RATE, 0.0, wanted, 1000.0)
    assert np.abs(actual).max() < 1e-4


def test_constants_straight_lines_and_short_signals_stay() -> None:
    """A constant exactly; a line as well, up to its ends, for it is continued by its reflection."""
    wanted = np.linspace(0.0, 1.0, 37)
    time = np.arange(101) / 100.0
    np.testing.assert_allclose(resample(np.full(101, 3.5), 0.01, 0.0, wanted, 36.0), 3.5, rtol=1e-14)
    np.testing.assert_allclose(resample(2.0 * time - 1.0, 0.01, 0.0, wanted, 36.0), 2.0 * wanted - 1.0, atol=1e-3)
    np.testing.assert_allclose(resample(np.full(3, 2.0), 0.5, 0.0, np.array([0.25, 0.5]), 2.0), 2.0, rtol=1e-14)


def test_samples_at_the_same_times_stay() -> None:
    """At its own rate the signal of a low frequency does not move."""
    wave = np.sin(2 * np.pi * 100.0 * T)
    np.testing.assert_allclose(resample(wave, 1.0 / RATE, 0.0, T, RATE)[100:-100], wave[100:-100], atol=1e-4)


def test_uneven_samples_become_even_by_their_spline() -> None:
    time = T[::20] + 2e-4 * np.sin(37.0 * T[::20])
    interval, values = evened(time, np.sin(2 * np.pi * 5.0 * time))
    grid = time[0] + interval * np.arange(values.size)
    np.testing.assert_allclose(values, np.sin(2 * np.pi * 5.0 * grid), atol=1e-5)
    assert grid[-1] == pytest.approx(time[-1])
    assert interval <= np.diff(time).mean()


def test_trends_and_gaps() -> None:
    time = np.arange(50.0)
    wave = np.where(time % 2 == 0, 1.0, -1.0)
    np.testing.assert_allclose(detrended(time, wave + 3.0, 0), wave - wave.mean(), atol=1e-12)
    line = detrended(time, 4.0 * time - 7.0, 1)
    np.testing.assert_allclose(line, 0.0, atol=1e-12)
    noisy = 4.0 * time + wave
    np.testing.assert_allclose(
        detrended(time, noisy, 1), noisy - np.polyval(np.polyfit(time, noisy, 1), time), atol=1e-10
    )
    broken = 2.0 * time
    broken[[3, 4, 9]] = np.nan
    whole, longest = bridged(time, broken)
    np.testing.assert_allclose(whole, 2.0 * time)
    assert longest == 3.0
