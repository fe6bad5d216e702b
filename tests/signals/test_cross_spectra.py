"""Densities of two signals: SciPy's, Parseval, a known filter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal as scipy_signal

from gearrattle.signals import cross_spectra as module
from gearrattle.signals.cross_spectra import WINDOWS, cross_spectra, cut, power_density

RATE = 512.0


def noise(count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    x = rng.standard_normal(count)
    return x + 0.7, np.convolve(x, [0.5, 0.3, -0.2], "same") + 0.1 * rng.standard_normal(count)


@pytest.mark.parametrize("length", [64, 75])
@pytest.mark.parametrize("overlap", [0.0, 0.5, 0.75])
@pytest.mark.parametrize("window", WINDOWS)
def test_all_three_densities_are_those_of_scipy(length: int, overlap: float, window: str) -> None:
    x, y = noise(1000)
    segments = cut(1000, length, overlap, window)
    found = cross_spectra(x, y, RATE, segments)
    how = {"fs": RATE, "window": window, "nperseg": length, "noverlap": length - segments.step, "detrend": "constant"}
    frequency, across = scipy_signal.csd(x, y, **how)
    assert found.frequency == pytest.approx(frequency)
    scale = np.abs(across).max()
    assert np.abs(found.cross - across).max() < 1e-13 * scale
    assert found.power_x == pytest.approx(scipy_signal.welch(x, **how)[1], rel=1e-9, abs=1e-15)
    assert found.power_y == pytest.approx(power_density(y, RATE, segments)[1], rel=1e-12)


def test_groups_of_segments_add_up_to_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    x, y = noise(1000)
    segments = cut(1000, 64, 0.5, "hann")
    whole = cross_spectra(x, y, RATE, segments)
    monkeypatch.setattr(module, "_AT_ONCE", 100)
    parts = cross_spectra(x, y, RATE, segments)
    assert parts.cross == pytest.approx(whole.cross, rel=1e-12)


@pytest.mark.parametrize("length", [100, 101])
def test_parseval(length: int) -> None:
    x, _ = noise(length * 7)
    frequency, density = power_density(x, RATE, cut(x.size, length, 0.0, "boxcar"))
    power = np.mean([np.var(part) for part in np.split(x, 7)])
    assert np.sum(density) * frequency[1] == pytest.approx(power, rel=1e-12)


def test_a_gain_and_a_delay_are_found_in_modulus_and_phase() -> None:
    x = np.random.default_rng(5).standard_normal(200_000)
    y = 3.0 * np.concatenate([[0.0, 0.0], x[:-2]])
    found = cross_spectra(x, y, RATE, cut(x.size, 1024, 0.5, "hann"))
    inner = slice(10, -10)
    delayed = 3.0 * np.exp(-2j * np.pi * found.frequency[inner] * 2.0 / RATE)
    assert np.abs(found.response[inner] - delayed).max() < 0.02
    assert found.coherence[inner].min() > 0.999


def test_no_power_is_no_coherence() -> None:
    x = np.zeros(256)
    assert np.isnan(cross_spectra(x, x, 1.0, cut(256, 64, 0.5, "hann")).coherence).all()
