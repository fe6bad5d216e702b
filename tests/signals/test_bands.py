"""Band levels: lines of known amplitude, Parseval, and the limits of the samples."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals import band_rms, rms


@pytest.mark.parametrize("periods", [1, 2, 7, 8])
def test_lines_of_known_amplitude(periods: int) -> None:
    time = np.arange(periods * 32) / 32
    x = 5.0 + 3.0 * np.sin(2 * np.pi * time) + 0.5 * np.cos(2 * np.pi * 3 * time)
    expected = np.array([3.0, 0.0, 0.5, 0.0, 0.0]) / np.sqrt(2)
    np.testing.assert_allclose(band_rms(x, periods, 5), expected, atol=1e-12)


def test_a_line_beside_the_harmonic_counts_to_the_nearer_one() -> None:
    time = np.arange(8 * 32) / 32
    band = band_rms(np.sin(2 * np.pi * 1.375 * time), 8, 3)
    np.testing.assert_allclose(band, [np.sqrt(0.5), 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(band_rms(np.sin(2 * np.pi * 1.5 * time), 8, 2), [0.0, np.sqrt(0.5)], atol=1e-12)


def test_squares_add_up_and_bands_beyond_the_samples_are_unknown() -> None:
    x = np.random.default_rng(0).normal(size=(5 * 16, 2))
    band = band_rms(x, 5, 9)
    slow = np.fft.rfft(x, axis=0)
    slow[3:] = 0.0
    rest = x - np.fft.irfft(slow, n=80, axis=0)
    last = np.fft.rfft(x, axis=0)[38:].copy() / 80
    tail = 2 * np.sum(np.abs(last[:-1]) ** 2, axis=0) + np.abs(last[-1]) ** 2
    closed = rms(np.concatenate([rest, rest[:1]]))
    assert np.isnan(band[7:]).all()
    total = np.sum(band[:7] ** 2, axis=0) + tail
    np.testing.assert_allclose(total, np.mean(rest**2, axis=0), rtol=1e-12)
    assert closed.shape == (2,)


def test_half_the_sampling_rate_is_one_bin() -> None:
    assert band_rms(np.tile([3.0, -3.0], 8), 1, 8)[7] == pytest.approx(3.0)
