"""Alignment of event lists: known shifts, losses and inventions, and a slow oracle that tries every alignment."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from gearrattle.signals import align, alignment


def cheapest(values: np.ndarray, reference: np.ndarray, reach: float) -> float:
    """Cost of the best alignment, by trying all."""

    @cache
    def cost(i: int, j: int) -> float:
        if i == 0 or j == 0:
            return (i + j) * reach / 2
        pair = cost(i - 1, j - 1) + abs(values[i - 1] - reference[j - 1])
        return min(pair, cost(i - 1, j) + reach / 2, cost(i, j - 1) + reach / 2)

    return cost(values.size, reference.size)


def price(values: np.ndarray, reference: np.ndarray, reach: float) -> float:
    actual = align(values, reference, reach)
    alone = actual.missed.size + actual.invented.size
    return float(np.abs(values[actual.candidate] - reference[actual.reference]).sum() + alone * reach / 2)


def test_a_shifted_list_pairs_one_by_one() -> None:
    times = np.arange(1.0, 50.0)
    actual = align(times + 0.03, times, 0.25)
    np.testing.assert_array_equal(actual.candidate, actual.reference)
    assert actual.candidate.size == times.size
    assert actual.missed.size == actual.invented.size == 0


def test_a_lost_double_crossing_is_missed_and_shifts_nothing() -> None:
    times = np.array([1.0, 1.1, 1.2, 1.21, 1.3, 1.4, 1.5])
    actual = align(np.delete(times, [2, 3]) + 0.004, times, 0.25)
    assert actual.missed.tolist() == [2, 3]
    assert actual.invented.size == 0
    assert actual.reference.tolist() == [0, 1, 4, 5, 6]


def test_pairs_are_never_further_apart_than_the_reach() -> None:
    actual = align(np.array([1.0, 2.3]), np.array([1.19, 2.0]), 0.2)
    assert (actual.candidate.tolist(), actual.reference.tolist()) == ([0], [0])
    assert (actual.missed.tolist(), actual.invented.tolist()) == ([1], [1])


def test_empty_lists() -> None:
    none = np.empty(0)
    assert align(none, np.array([1.0, 2.0]), 1.0).missed.tolist() == [0, 1]
    assert align(np.array([1.0]), none, 1.0).invented.tolist() == [0]
    assert align(none, none, 1.0).candidate.size == 0


@pytest.mark.parametrize("seed", range(40))
def test_cost_is_the_least_of_all_alignments(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values, reference = (np.sort(rng.uniform(0.0, 4.0, size=rng.integers(0, 14))) for _ in range(2))
    reach = float(rng.choice([0.05, 0.5, 3.0]))
    assert price(values, reference, reach) == pytest.approx(cheapest(values, reference, reach), abs=1e-12)


def test_greedy_pairing_would_pay_more() -> None:
    """The nearest pair first costs 0.1 and leaves two events alone; both pairs together cost 1.6."""
    values, reference = np.array([0.0, 0.9]), np.array([0.8, 1.7])
    assert align(values, reference, 2.0).candidate.tolist() == [0, 1]
    assert price(values, reference, 2.0) == pytest.approx(1.6)


def test_a_large_cluster_is_split_by_halving_the_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(alignment, "_LARGEST_TABLE", 100)
    times = np.arange(0.0, 200.0)
    actual = align(times + 0.01, times, 1.5)
    assert actual.candidate.size == times.size
