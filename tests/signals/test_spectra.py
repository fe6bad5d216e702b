"""Welch's density against the closed form of a sine and the level of noise."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.errors import ModelError
from gearrattle.signals import psd


def test_line_of_a_sine_spreads_over_three_bins() -> None:
    time = np.arange(16 * 64) * (0.5 / 64)
    spectrum = psd(3.0 + 2.0 * np.sin(2 * np.pi * 6.0 * time), 0.5, 64)
    df = spectrum.resolution
    assert df == pytest.approx(1 / (8 * 0.5), rel=1e-14)
    peak = int(np.argmax(spectrum.density))
    assert spectrum.frequency[peak] == pytest.approx(6.0, rel=1e-14)
    assert spectrum.density[peak] == pytest.approx(2.0 / (1.5 * df), rel=1e-12)
    assert spectrum.density[peak + 1] == pytest.approx(spectrum.density[peak] / 4, rel=1e-12)
    assert np.sum(spectrum.density) * df == pytest.approx(2.0, rel=1e-12)


def test_white_noise_has_its_flat_level() -> None:
    noise = np.random.default_rng(7).normal(size=(4000 * 16, 1))
    spectrum = psd(noise, 1.0, 16)
    assert float(np.mean(spectrum.density[2:-2])) == pytest.approx(2.0 / 16, rel=0.02)


def test_segments_are_whole_cycles_and_stated() -> None:
    spectrum = psd(np.ones((20 * 16, 2)), 1.0, 16)
    assert spectrum.segments == 4
    assert spectrum.window == "Hann, 8 cycles a segment, 4 segments, half overlapping, averaged, mean removed"
    assert spectrum.density.shape == (65, 2)


def test_short_signal_is_one_shorter_segment() -> None:
    spectrum = psd(np.sin(np.arange(3 * 16)), 1.0, 16)
    assert spectrum.segments == 1
    assert spectrum.window == "Hann, 3 cycles a segment, 1 segment, mean removed"


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(ModelError, match="at least 4 samples"):
        psd(np.ones(3), 1.0, 1)
