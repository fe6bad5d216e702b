"""Delays that were put in are found."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from gearrattle.signals.synchrony import delay_by_correlation, delay_by_phase

RATE = 2000.0


def _noise(count: int) -> np.ndarray:
    """Noise up to a tenth of the rate."""
    return sosfiltfilt(butter(6, 200.0, fs=RATE, output="sos"), np.random.default_rng(5).standard_normal(count))


@pytest.mark.parametrize("lag", [-700, -3, 0, 41, 900])
def test_whole_samples(lag: int) -> None:
    wave = _noise(12_000)
    first, second = wave[2000:8000], wave[2000 + lag : 7000 + lag]
    actual = delay_by_correlation(first, second, 1.0 / RATE, (-0.6, 0.6))
    assert actual.value == pytest.approx(lag / RATE, abs=1e-3 / RATE)
    assert actual.agreement > 0.999
    assert actual.rival < 0.9


@pytest.mark.parametrize("part", [0.25, 0.4, -0.3])
def test_parts_of_a_sample(part: float) -> None:
    """To a hundredth of a sample, against samples taken from a finer signal."""
    fine = _noise(200_000)
    smooth = sosfiltfilt(butter(6, 10.0, fs=RATE, output="sos"), fine)
    first = smooth[20_000:180_000:20]
    second = smooth[20_000 + round(20 * part) : 180_000 : 20]
    actual = delay_by_correlation(first, second, 20.0 / RATE, (-1.0, 1.0))
    assert actual.value * RATE / 20.0 == pytest.approx(part, abs=1e-2)


def test_bounds_and_a_signal_that_repeats_itself() -> None:
    t = np.arange(4000) / RATE
    first, second = np.sin(2 * np.pi * 25.0 * t), np.sin(2 * np.pi * 25.0 * (t + 0.004))
    actual = delay_by_correlation(first, second, 1.0 / RATE, (-0.3, 0.3))
    assert actual.rival > 0.99 * actual.agreement
    near = delay_by_correlation(first, second, 1.0 / RATE, (-0.015, 0.015))
    assert near.value == pytest.approx(0.004, abs=1e-5)
    assert delay_by_correlation(first, second, 1.0 / RATE, (50.0, 60.0)).agreement == 0.0


@pytest.mark.parametrize("delay", [-0.009, 0.0, 0.0031])
def test_phases(delay: float) -> None:
    """Different sampling, a mean, another frequency beside: the nearest delay; its share of the power is told."""
    one, two = np.arange(0.0, 2.0, 1 / 1000.0), np.arange(0.3, 2.3, 1 / 777.0)

    def motion(t: np.ndarray) -> np.ndarray:
        return 3.0 + 2.0 * np.sin(2 * np.pi * 50.0 * t + 0.4) + np.sin(2 * np.pi * 21.0 * t)

    actual = delay_by_phase((one, motion(one)), (two, 5.0 * motion(two + delay)), 50.0)
    assert actual.value == pytest.approx(delay, abs=2e-6)
    assert actual.agreement == pytest.approx(0.8, abs=2e-3)
    assert delay_by_phase((one, one * 0.0), (two, motion(two)), 50.0).agreement == 0.0
