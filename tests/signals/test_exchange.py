"""Exchanging blocks: right levels for noise, for bursts, for correlated values, and power against real differences."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals import density_distance, distribution_distance, exchange, segment_densities

CYCLES, SAMPLES = 96, 32


def mean_gap(mine: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    return np.abs(mine - theirs)[:, 0]


def test_p_values_of_equal_motions_are_uniform_and_two_blocks_tell_nothing() -> None:
    rng = np.random.default_rng(0)
    p = [exchange(*rng.normal(size=(2, 10, 1)), mean_gap).p_value for _ in range(300)]
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=0.035)
    assert np.mean(p) == pytest.approx(0.5, abs=0.05)
    assert exchange(rng.normal(size=(10, 1)) + 5.0, rng.normal(size=(10, 1)), mean_gap).p_value == 0.001
    few = exchange(np.zeros((3, 1)), np.ones((9, 1)), mean_gap)
    assert np.isnan(few.p_value)
    assert few.value == 9.0


def noise(rng: np.random.Generator, bursts: bool = False, colour: float = 0.0) -> np.ndarray:
    x = rng.normal(size=CYCLES * SAMPLES)
    x[1:] += colour * x[:-1]
    if bursts:  # every eight cycles has a loudness of its own: all bins rise together
        x *= np.repeat(rng.lognormal(sigma=0.5, size=CYCLES // 8), 8 * SAMPLES)
    return x


def densities(x: np.ndarray) -> np.ndarray:
    return segment_densities(x, 1.0, SAMPLES)


def test_two_realisations_of_gaussian_noise_leave_five_percent_of_the_bins_outside() -> None:
    rng = np.random.default_rng(1)
    found = [density_distance(densities(noise(rng)), densities(noise(rng))) for _ in range(60)]
    assert found[0].bins == 4 * SAMPLES - 2
    assert np.mean([each.outside.value for each in found]) == pytest.approx(0.05, abs=0.008)
    assert np.mean([each.distance.value for each in found]) == pytest.approx(found[0].expected, rel=0.03)
    assert np.mean([each.distance.p_value < 0.05 for each in found]) < 0.15


def test_bursts_leave_the_gaussian_bands_but_are_called_the_same() -> None:
    rng = np.random.default_rng(2)
    found = [density_distance(densities(noise(rng, True)), densities(noise(rng, True))) for _ in range(60)]
    assert np.mean([each.outside.value for each in found]) > 0.08
    assert np.mean([each.distance.p_value < 0.05 for each in found]) < 0.15


def test_another_spectrum_is_found() -> None:
    rng = np.random.default_rng(3)
    found = density_distance(densities(noise(rng, colour=0.5)), densities(noise(rng)))
    assert found.distance.p_value == 0.001
    assert found.outside.value > 0.2
    gain = density_distance(4.0 * densities(x := noise(rng)), densities(x))
    assert gain.distance.value == pytest.approx(10 * np.log10(4.0), rel=1e-12)


def test_band_is_that_of_two_chi_squares() -> None:
    found = density_distance(np.ones((12, 20)), np.ones((12, 20)))
    draws = np.random.default_rng(4).chisquare(24, size=(2, 200_000))
    np.testing.assert_allclose([found.low, found.high], np.percentile(draws[0] / draws[1], [2.5, 97.5]), rtol=0.01)
    assert found.distance.value == 0.0


def test_segments_are_eight_cycles_or_as_few_as_leave_eight() -> None:
    assert segment_densities(np.ones(100 * 16), 1.0, 16).shape == (12, 65)
    assert segment_densities(np.ones(16 * 16), 1.0, 16).shape == (8, 17)
    assert segment_densities(np.ones(3 * 16), 1.0, 16).shape == (3, 9)


def bursty(rng: np.random.Generator, blocks: int = 20, each: int = 15) -> tuple[np.ndarray, np.ndarray]:
    """Values that go with their block."""
    block = np.repeat(np.arange(blocks), each)
    return rng.normal(size=blocks)[block] + 0.5 * rng.normal(size=block.size), block


def test_correlated_values_of_one_distribution_are_the_same_by_blocks_only() -> None:
    rng = np.random.default_rng(5)
    found = []
    for _ in range(80):
        (a, i), (b, j) = bursty(rng), bursty(rng)
        found.append(distribution_distance(a, b, i, j, blocks=20, tolerance=0.0))
    assert np.mean([each.blocks.p_value < 0.05 for each in found]) < 0.13
    assert np.mean([each.independent_p < 0.05 for each in found]) > 0.4


def test_another_distribution_is_found_and_a_tolerated_shift_is_not() -> None:
    rng = np.random.default_rng(6)
    a, block = rng.normal(size=400), np.repeat(np.arange(20), 20)
    found = distribution_distance(a + 1.0, rng.normal(size=400), block, block, blocks=20, tolerance=0.01)
    assert found.blocks.p_value == 0.001
    assert found.value == pytest.approx(0.383, abs=0.06)  # 2 Phi(1/2) - 1
    assert found.beyond_tolerance == pytest.approx(found.value, abs=0.02)
    regular = np.tile([1.0, 2.0], 200)
    shifted = distribution_distance(regular + 1e-6, regular, block, block, blocks=20, tolerance=1e-3)
    assert shifted.value == 0.5
    assert shifted.beyond_tolerance == 0.0
