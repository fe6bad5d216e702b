"""Coherence against closed forms: the same signal, independent noise, noise of a known share, its statistics."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.errors import ModelError
from gearrattle.signals import by_chance, coherence_at_harmonics

RATE, FUNDAMENTAL = 16.0, 1.0  # bins are an eighth of the fundamental wide


def many(seeds: int, share: float, ensembles: int = 4, taper: str = "hann") -> np.ndarray:
    """(seeds, 5) values of two noises that share this part of their power."""
    rng = np.random.default_rng(3)
    rows = []
    for _ in range(seeds):
        x, y, common = rng.normal(size=(3, ensembles * 128))
        pair = [np.sqrt(share) * common + np.sqrt(1 - share) * own for own in (x, y)]
        rows.append(coherence_at_harmonics(*pair, RATE, FUNDAMENTAL, ensembles=ensembles, every=1, taper=taper).value)
    return np.array(rows)


def test_a_signal_with_itself_a_gain_or_a_minus_sign_is_fully_coherent() -> None:
    x = np.random.default_rng(0).normal(size=512)
    for y in (x, 7.0 * x, -x):
        actual = coherence_at_harmonics(x, y, RATE, FUNDAMENTAL)
        np.testing.assert_allclose(actual.value, 1.0, atol=1e-12)
        assert actual.mean == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("taper", ["hann", pytest.param("none", marks=pytest.mark.long)])
def test_independent_noise_has_the_stated_bias_threshold_and_range_of_the_mean(taper: str) -> None:
    value, chance = many(500, 0.0, taper=taper), by_chance(4, 5)
    assert chance.bias == 0.25
    assert chance.threshold == pytest.approx(0.6316, abs=1e-4)
    assert value.mean() == pytest.approx(0.25, abs=0.01)
    assert np.mean(value > chance.threshold) == pytest.approx(0.05, abs=0.01)
    kappa = value.mean(axis=1)
    assert np.mean(kappa < chance.mean_low) == pytest.approx(0.05, abs=0.02)
    assert np.mean(kappa > chance.mean_high) == pytest.approx(0.05, abs=0.02)


def test_range_of_the_mean_over_five_bins_is_that_of_a_seeded_monte_carlo() -> None:
    """Independent bins are Beta(1, n - 1)."""
    draws = np.random.default_rng(11).beta(1.0, 3.0, size=(200_000, 5)).mean(axis=1)
    chance = by_chance(4, 5)
    np.testing.assert_allclose([chance.mean_low, chance.mean_high], np.percentile(draws, [5, 95]), atol=1.5e-3)
    assert (round(chance.mean_low, 2), round(chance.mean_high, 2)) == (0.12, 0.40)


def test_the_paper_s_low_coherences_cannot_be_told_from_chance() -> None:
    chance = by_chance(4, 5)
    assert all(chance.mean_low < kappa < chance.mean_high for kappa in (0.23, 0.35, 0.37))


def test_known_share_of_common_noise_gives_its_square() -> None:
    """gamma^2 = share^2; with 64 ensembles the bias (1 - gamma^2)^2 / 64 is below 0.011."""
    value = many(60, 0.8, ensembles=64)
    assert value.mean() == pytest.approx(0.64, abs=0.015)


def test_more_ensembles_lower_what_chance_gives() -> None:
    assert by_chance(16, 5).threshold < by_chance(8, 5).threshold < by_chance(4, 5).threshold
    assert by_chance(8, 1).mean_high == pytest.approx(by_chance(8, 1).threshold, abs=1e-3)


def tones(samples: int, rate: float) -> np.ndarray:
    time = np.arange(samples) / rate
    return sum(np.sin(2 * np.pi * k * time + k) for k in range(1, 6))


def test_default_rate_puts_harmonics_on_bins_inside_the_band_and_uses_what_is_there() -> None:
    actual = coherence_at_harmonics(*[tones(256 * 40, 256.0)] * 2, 256.0, 1.0)
    assert actual.every == 20  # 512 of 10240 samples; the fifth harmonic lies at 0.78 of half the rate
    assert actual.rate == 12.8
    assert actual.bin_width == pytest.approx(0.1, rel=1e-12)
    np.testing.assert_allclose(actual.bin_frequency, actual.frequency, rtol=1e-12)
    assert actual.anti_aliased
    assert actual.notes == ()
    prefers_bins = coherence_at_harmonics(*[tones(256 * 38, 256.0)] * 2, 256.0, 1.0)
    assert prefers_bins.every == 18  # 19 would do, but 18 puts 9 bins to a harmonic
    short = coherence_at_harmonics(*[tones(256 * 8, 256.0)] * 2, 256.0, 1.0)
    assert short.every == 4


def test_doubtful_bins_are_told() -> None:
    x = np.random.default_rng(1).normal(size=512)
    between = coherence_at_harmonics(x, x, 100.0, 10.3, every=1, harmonics=4)
    assert any("between bins" in note for note in between.notes)
    shared = coherence_at_harmonics(x, x, 1000.0, 3.0, every=1)
    assert any("share a bin" in note for note in shared.notes)
    assert any("zero frequency" in note for note in shared.notes)
    close = coherence_at_harmonics(x, x, 128.0, 1.0, every=1)
    assert any("neighbouring" in note for note in close.notes)


def test_no_power_is_no_coherence() -> None:
    time = np.arange(512) / 16.0
    x = np.sin(2 * np.pi * time)
    actual = coherence_at_harmonics(x, x, 16.0, 1.0)
    assert np.isfinite(actual.value).tolist() == [True, False, False, False, False]
    assert actual.mean == pytest.approx(1.0)
    assert "harmonic 2, 3, 4, 5" in actual.notes[0]
    assert actual.chance == by_chance(4, 1)


def test_anti_aliasing_keeps_what_lies_above_the_band_out() -> None:
    """A strong tone at 17 times the fundamental folds onto the first harmonic when every 16th of 256 is kept."""
    rng = np.random.default_rng(5)
    time = np.arange(256 * 40) / 256.0
    pair = [rng.normal(size=time.size) for _ in range(2)]
    loud = [x + 100.0 * np.sin(2 * np.pi * 17.0 * time) for x in pair]
    plain = coherence_at_harmonics(*loud, 256.0, 1.0, every=16, anti_alias=False)
    filtered = coherence_at_harmonics(*loud, 256.0, 1.0, every=16)
    assert plain.value[0] > 0.99
    assert filtered.value[0] < 0.9
    assert not plain.anti_aliased


def test_what_cannot_be_done_is_refused() -> None:
    x = np.zeros(400)
    with pytest.raises(ModelError, match="400 samples"):
        coherence_at_harmonics(x, x, 16.0, 1.0)
    x = np.zeros(600)
    with pytest.raises(ModelError, match="half the rate"):
        coherence_at_harmonics(x, x, 8.0, 1.0)
    with pytest.raises(ModelError, match="at least 2"):
        coherence_at_harmonics(x, x, 16.0, 1.0, ensembles=1)
    with pytest.raises(ModelError, match="samples"):
        coherence_at_harmonics(x, x, 16.0, 1.0, every=2)
