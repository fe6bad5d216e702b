"""Densities of two signals: SciPy's, Parseval, a known filter."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import signal as scipy_signal

from gearrattle.signals import cross_spectra as module
from gearrattle.signals import psd
from gearrattle.signals.cross_spectra import WINDOWS, Segments, cross_spectra, cut, periodograms, power_density
from tests.architecture.places import source_files

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
    actual = cross_spectra(x, y, RATE, segments)
    how = {"fs": RATE, "window": window, "nperseg": length, "noverlap": length - segments.step, "detrend": "constant"}
    frequency, across = scipy_signal.csd(x, y, **how)
    assert actual.frequency == pytest.approx(frequency)
    scale = np.abs(across).max()
    assert np.abs(actual.cross - across).max() < 1e-13 * scale
    assert actual.power_x == pytest.approx(scipy_signal.welch(x, **how)[1], rel=1e-9, abs=1e-15)
    assert actual.power_y == pytest.approx(power_density(y, RATE, segments)[1], rel=1e-12)


@pytest.mark.parametrize(("cycles", "per_cycle"), [(40, 16), (45, 7), (3, 9)])
def test_the_density_over_whole_cycles_is_that_of_scipy(cycles: int, per_cycle: int) -> None:
    signals = np.random.default_rng(4).standard_normal((cycles * per_cycle, 3))
    actual, length = psd(signals, 0.5, per_cycle), min(8, cycles) * per_cycle
    frequency, density = scipy_signal.welch(signals, 2.0 * per_cycle, nperseg=length, noverlap=length // 2, axis=0)
    assert actual.frequency == pytest.approx(frequency)
    assert np.abs(actual.density - density).max() < 1e-14 * density.max()


def test_the_densities_of_every_segment_are_those_of_scipy() -> None:
    signals = np.stack(noise(1000), axis=1)
    entry = np.concatenate(list(periodograms(signals, RATE, cut(1000, 64, 0.5, "hann"))))
    how = {"window": "hann", "nperseg": 64, "noverlap": 32, "detrend": "constant", "axis": 0}
    assert np.abs(entry.T - scipy_signal.spectrogram(signals, RATE, **how)[2]).max() < 1e-14 * entry.max()


def test_means_of_segments_stay_where_they_are_wanted() -> None:
    x, y = noise(1000)
    segments = Segments(np.ones(100), 100, 10, centred=False)
    across = scipy_signal.csd(x, y, RATE, "boxcar", 100, 0, detrend=False)[1]
    assert np.abs(cross_spectra(x, y, RATE, segments).cross - across).max() < 1e-14 * np.abs(across).max()


def test_no_other_file_estimates_densities() -> None:
    library = re.compile(r"\b(welch|csd|spectrogram|periodogram|ShortTimeFFT)\b\(|import .*\b(welch|csd|spectrogram)\b")
    assert [path.name for path in source_files() if library.search(path.read_text(encoding="utf-8"))] == []


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
    actual = cross_spectra(x, y, RATE, cut(x.size, 1024, 0.5, "hann"))
    inner = slice(10, -10)
    delayed = 3.0 * np.exp(-2j * np.pi * actual.frequency[inner] * 2.0 / RATE)
    assert np.abs(actual.response[inner] - delayed).max() < 0.02
    assert actual.coherence[inner].min() > 0.999


def test_no_power_is_no_coherence() -> None:
    x = np.zeros(256)
    assert np.isnan(cross_spectra(x, x, 1.0, cut(256, 64, 0.5, "hann")).coherence).all()
