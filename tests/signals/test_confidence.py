"""Limits of spectra: closed forms, other series, and seeded chance with its binomial bound."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import get_window
from scipy.special import betainc, hyp2f1
from scipy.stats import binom, chi2

from gearrattle.signals.confidence import (
    averages,
    coherence_below,
    coherence_limits,
    coherence_threshold,
    density_factors,
    response_radius,
)
from gearrattle.signals.cross_spectra import WINDOWS, cross_spectra, cut, power_density, taper


def within_chance(hits: int, trials: int, level: float) -> bool:
    """Whether hits lie in the central 99.9 % of a binomial distribution."""
    low, high = binom.interval(0.999, trials, level)
    return bool(low <= hits <= high)


@pytest.mark.parametrize(("segments", "expected"), [(1, 1.0), (2, 2 * 36 / 37), (10**6, 10**6 * 18 / 19)])
def test_half_overlapping_hann_segments_count_as_the_closed_form_says(segments: int, expected: float) -> None:
    assert averages(taper("hann", 4096), 2048, segments) == pytest.approx(expected, rel=1e-5)


def test_segments_that_do_not_overlap_count_in_full() -> None:
    assert averages(taper("hann", 64), 64, 17) == pytest.approx(17.0, rel=1e-14)


def test_segments_that_hardly_move_on_count_little() -> None:
    assert averages(np.ones(1000), 1, 50) == pytest.approx(1.0, rel=0.1)  # 50 segments that share 95 % and more


def test_density_factors_are_quantiles_of_chi_square() -> None:
    low, high = density_factors(9.5, 0.9)
    assert 1.0 / low == pytest.approx(chi2.ppf(0.95, 19.0) / 19.0, rel=1e-10)
    assert 1.0 / high == pytest.approx(chi2.ppf(0.05, 19.0) / 19.0, rel=1e-10)


def finite_sum(x: float, truth: float, count: int) -> float:
    """Return Carter's finite sum for the distribution of an estimated coherence."""
    ratio = (1.0 - x) / (1.0 - truth * x)
    terms = sum(ratio**k * hyp2f1(-k, 1 - count, 1, truth * x) for k in range(count - 1))
    return float(x * ((1.0 - truth) / (1.0 - truth * x)) ** count * terms)


@pytest.mark.parametrize("count", [2, 4, 11, 24])
@pytest.mark.parametrize("truth", [0.0, 0.3, 0.9, 0.99])
def test_distribution_of_coherence_is_the_published_finite_sum(count: int, truth: float) -> None:
    x = np.array([0.02, 0.3, 0.7, 0.95])
    expected = [finite_sum(entry, truth, count) for entry in x.tolist()]
    assert coherence_below(x, np.array(truth), count) == pytest.approx(expected, rel=1e-9, abs=1e-11)


def test_distribution_for_a_broken_number_of_averages_is_its_series() -> None:
    count = 7.4
    truth = 0.6
    x = 0.7
    k = np.arange(400)
    weights = np.concatenate([[1.0], np.cumprod((count + k[:-1]) / (k[:-1] + 1.0) * truth)]) * (1.0 - truth) ** count
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    expected = float(weights @ betainc(k + 1.0, count - 1.0, x))
    assert coherence_below(np.array(x), np.array(truth), count) == pytest.approx(expected, rel=1e-10)


def test_without_coherence_the_threshold_is_the_distributions_quantile() -> None:
    level, count = 0.95, 6.5
    actual = coherence_threshold(count, level)
    assert coherence_below(np.array(actual), np.array(0.0), count) == pytest.approx(level, rel=1e-10)
    low, _ = coherence_limits(np.array([0.9 * actual]), count, level)
    assert low == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("count", [1.9, 5.2, 40.0, pytest.param(3000.0, marks=pytest.mark.long)])
def test_limits_are_where_the_distribution_has_its_tails(count: float) -> None:
    value = np.concatenate([np.linspace(0.0, 0.99, 34), [0.999, 0.99999]])
    ends = coherence_limits(value, count, 0.9)
    for end, tail in zip(ends, (0.95, 0.05), strict=True):
        moved = [np.clip(end + 1e-3 * side, 0.0, 1.0 - 1e-15) for side in (-1.0, 1.0)]
        above, below = (coherence_below(value, entry, count) for entry in moved)
        met = (below <= tail) & (tail <= above)  # the exact limit lies within 1e-3
        assert np.all(met | ((end < 1e-3) & (above <= tail)))


def test_missing_coherences_stay_missing_and_one_average_tells_nothing() -> None:
    low, high = coherence_limits(np.array([np.nan, 0.5]), 8.0)
    assert np.isnan(low[0]) and np.isnan(high[0]) and low[1] < 0.5 < high[1]  # noqa: PT018
    low, high = coherence_limits(np.array([np.nan, 1.0]), 1.0)
    assert (low[1], high[1]) == (0.0, 1.0)
    assert np.isinf(response_radius(np.array([0.9]), 1.0)).all()
    assert coherence_threshold(1.0) == 1.0


def test_limits_of_a_density_enclose_white_noise_as_often_as_stated() -> None:
    rng = np.random.default_rng(20261122)
    hits = 0
    trials = 0
    rate = 2000.0
    level = 0.9
    deviation = 1.7
    for _ in range(60):
        segments = cut(4096, 256, 0.5, "hann")
        _, density = power_density(deviation * rng.standard_normal(4096), rate, segments)
        low, high = density_factors(segments.averages, level)
        truth = 2.0 * deviation**2 / rate
        inner = density[4:-4:4]  # bins that share no lobe of the taper
        hits += int(np.sum((inner * low <= truth) & (truth <= inner * high)))
        trials += inner.size
    assert trials == 60 * 31
    assert within_chance(hits, trials, level)


def mixed(rng: np.random.Generator, truth: float, gain: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return two signals whose coherence and transfer function are known at every frequency."""
    x = rng.standard_normal(count)
    noise = gain * np.sqrt((1.0 - truth) / truth) * rng.standard_normal(count)
    return x, gain * x + noise


@pytest.mark.parametrize(
    ("truth", "overlap"),
    [pytest.param(0.3, 0.0, marks=pytest.mark.long), pytest.param(0.8, 0.0, marks=pytest.mark.long), (0.8, 0.5)],
)
def test_limits_of_coherence_and_response_enclose_a_known_mixture(truth: float, overlap: float) -> None:
    rng = np.random.default_rng(7)
    level = 0.9
    gain = 2.5
    values, responses = [], []
    for _ in range(60):
        x, y = mixed(rng, truth, gain, 2560)
        segments = cut(2560, 256, overlap, "hann")
        actual = cross_spectra(x, y, 1.0, segments)
        some = slice(4, -4, 4)
        values.append(actual.coherence[some])
        responses.append(actual.response[some])
    value, response = np.concatenate(values), np.concatenate(responses)
    low, high = coherence_limits(value, segments.averages, level)
    radius = response_radius(value, segments.averages, level) * np.abs(response)
    below = coherence_below(value, np.array(truth), segments.averages)
    assert below.mean() == pytest.approx(0.5, abs=4.0 / np.sqrt(12.0 * value.size))  # uniform: its mean
    assert within_chance(int(np.sum((low <= truth) & (truth <= high))), value.size, level)
    assert within_chance(int(np.sum(np.abs(response - gain) <= radius)), value.size, level)


@pytest.mark.parametrize("name", WINDOWS)
@pytest.mark.parametrize("length", [2, 7, 4096])
def test_tapers_are_those_of_scipy(name: str, length: int) -> None:
    np.testing.assert_allclose(taper(name, length), get_window(name, length, fftbins=True), rtol=0, atol=1e-15)
