"""One among others: right levels by chance, distances by hand and against SciPy, power against real differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import ks_2samp

from gearrattle.signals import density_distances, distribution_distances, number_distances, rank

M = 22


def test_the_first_of_equals_is_the_farthest_out_as_often_as_any_other() -> None:
    rng = np.random.default_rng(0)
    p = np.array([rank(number_distances(rng.standard_cauchy(M))) for _ in range(2000)])
    assert np.mean(p < 0.05) == pytest.approx(1 / M, abs=0.014)
    assert np.mean(p) == pytest.approx(0.5 + 0.5 / M, abs=0.02)
    assert rank(number_distances(np.r_[50.0, rng.normal(size=M - 1)])) == 1 / M
    assert rank(np.zeros(M)) == 1.0


def test_number_distances_are_from_the_mean_of_the_others() -> None:
    np.testing.assert_allclose(number_distances(np.array([1.0, 2.0, 6.0])), [3.0, 1.5, 4.5])


def test_density_distances_by_hand() -> None:
    flat = np.ones((3, 8))
    flat[0] *= 4.0
    far, share = density_distances(flat)
    np.testing.assert_allclose(far, 10 * np.log10([4.0, 2.5, 2.5]))
    assert share.tolist() == [1.0, 0.0, 0.0]
    assert density_distances(np.ones((3, 8)))[1].tolist() == [0.0, 0.0, 0.0]
    assert np.isnan(density_distances(np.zeros((3, 8)))[0]).all()


def test_densities_of_noise_are_extreme_in_two_of_m_bins_and_another_colour_is_found() -> None:
    rng = np.random.default_rng(1)
    noise = rng.chisquare(16, size=(M, 400))
    far, share = density_distances(noise)
    assert np.mean(share) == pytest.approx(2 / M, abs=1e-3)  # every bin has one largest and one least
    noise[0] *= np.linspace(0.5, 1.5, 400)
    far, share = density_distances(noise)
    assert rank(far) == rank(share) == 1 / M


def test_bins_below_the_floor_hold_nothing() -> None:
    noise = np.random.default_rng(2).chisquare(16, size=(M, 40))
    noise[:, 20:] *= 1e-12
    cut, _ = density_distances(noise[:, :21])
    np.testing.assert_array_equal(density_distances(noise)[0], cut)


def test_distribution_distances_are_those_of_scipy_where_nothing_may_move() -> None:
    rng = np.random.default_rng(3)
    samples = [rng.normal(size=n) for n in rng.integers(8, 60, size=6)]
    samples[2][:4] = samples[3][:4] = 0.25  # ties
    actual = distribution_distances(samples, 0.0)
    for i, distance in enumerate(actual):
        rest = np.concatenate([sample for j, sample in enumerate(samples) if j != i])
        assert distance == pytest.approx(ks_2samp(samples[i], rest, method="asymp").statistic, abs=1e-12)


def test_a_tolerated_shift_is_none_and_another_distribution_is_found() -> None:
    rng = np.random.default_rng(4)
    regular = [np.tile([1.0, 2.0], 20)] * M
    shifted = [regular[0] + 1e-6, *regular[1:]]
    assert distribution_distances(shifted, 0.0)[0] == 0.5
    assert distribution_distances(shifted, 1e-3).tolist() == [0.0] * M
    for shift in (1.0, -1.0):
        actual = distribution_distances([rng.normal(size=400) + shift, *rng.normal(size=(M - 1, 400))], 0.01)
        assert rank(actual) == 1 / M
        assert actual[0] == pytest.approx(0.383, abs=0.06)  # 2 Phi(1/2) - 1
