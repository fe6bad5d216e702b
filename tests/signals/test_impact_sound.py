"""Trains of impulses against phasors, modes against their closed form."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals.impact_sound import modal_path
from gearrattle.signals.impulse_train import HALF, PASS, impulse_train

RATE = 48_000.0


def test_the_spectrum_of_a_train_is_the_sum_of_its_phasors() -> None:
    """In the pass band, to 1e-4 of the impulses' sum: no impulse is moved to a sample, nothing folds back."""
    random = np.random.default_rng(0)
    time, impulse = np.sort(random.uniform(0.01, 0.09, 40)), random.normal(size=40)
    train = impulse_train(time, impulse, RATE, 4800)
    frequency = np.fft.rfftfreq(4800, 1.0 / RATE)
    spectrum = np.fft.rfft(train) / RATE
    exact = (impulse * np.exp(-2j * np.pi * frequency[:, None] * time)).sum(axis=1)
    passed = frequency <= PASS * RATE
    assert np.abs(spectrum - exact)[passed].max() < 1e-4 * np.abs(impulse).sum()
    nearest = np.zeros(4800)
    np.add.at(nearest, np.round(time * RATE).astype(int), impulse * RATE)
    assert np.abs(np.fft.rfft(nearest) / RATE - exact)[passed].max() > 0.05 * np.abs(impulse).sum()


def test_what_folds_back_is_eighty_decibels_down_in_the_pass_band() -> None:
    """One impulse at eight fractions of a sample: magnitudes in the pass band are alike, so images are far below it."""
    frequency = np.fft.rfftfreq(1024, 1.0 / RATE)
    passed = frequency <= PASS * RATE
    for fraction in np.arange(8) / 8.0:
        size = np.abs(np.fft.rfft(impulse_train(np.array([(500 + fraction) / RATE]), np.ones(1), RATE, 1024))) / RATE
        assert np.abs(size[passed] - 1.0).max() < 1e-4


def test_impulses_may_lie_anywhere_and_none_is_no_sound() -> None:
    train = impulse_train(np.array([-0.1, 0.0, 0.01, 5.0]), np.ones(4), RATE, 960)
    assert train.size == 960
    assert np.isfinite(train).all()
    assert train[480 + HALF :].sum() / RATE == pytest.approx(0.0, abs=1e-3)
    assert not impulse_train(np.zeros(0), np.zeros(0), RATE, 100).any()


def test_a_mode_rings_as_its_closed_form() -> None:
    frequency = 1000.0
    damping = 0.02
    gain = 3.0
    path = modal_path([(frequency, damping, gain)], RATE, "one")
    omega = 2.0 * np.pi * frequency
    t = (np.arange(path.response.size) - path.lead) / RATE
    exact = gain * np.exp(-damping * omega * t) * np.sin(omega * np.sqrt(1 - damping**2) * t) * (t >= 0.0)
    part = slice(path.lead + 20, path.lead + 2000)
    assert np.abs(path.response - exact)[part].max() < 2e-3 * gain
