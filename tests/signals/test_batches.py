"""Batch means: coverage for correlated cycles, and where a naive standard error fails."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals import batch_mean, difference


def autoregressive(rng: np.random.Generator, rows: int, size: int, memory: float) -> np.ndarray:
    x = rng.normal(size=(rows, size + 50))
    for i in range(1, size + 50):
        x[:, i] += memory * x[:, i - 1]
    return x[:, 50:]


def test_interval_covers_the_mean_of_correlated_cycles() -> None:
    rows = autoregressive(np.random.default_rng(2), 1000, 400, 0.6)
    means = [batch_mean(row) for row in rows]
    inside = [low <= 0.0 <= high for low, high in (mean.interval() for mean in means)]
    assert np.mean(inside) == pytest.approx(0.94, abs=0.025)
    naive = np.abs(rows.mean(axis=1)) < 1.96 * rows.std(axis=1) / np.sqrt(400)
    assert np.mean(naive) < 0.75  # what batches are for


def test_equal_means_differ_in_five_of_a_hundred_cases_and_unequal_ones_nearly_always() -> None:
    rng = np.random.default_rng(4)
    a, b = (autoregressive(rng, 600, 200, 0.4) for _ in range(2))
    found = [difference(batch_mean(x), batch_mean(y)) for x, y in zip(a, b, strict=True)]
    assert np.mean([each.p_value < 0.05 for each in found]) == pytest.approx(0.06, abs=0.03)
    assert all((each.p_value < 0.05) == (abs(each.value) > each.reach) for each in found)
    moved = [difference(batch_mean(x + 1.0), batch_mean(y)) for x, y in zip(a, b, strict=True)]
    assert np.mean([each.p_value < 0.05 for each in moved]) > 0.95


def test_too_few_cycles_tell_nothing_and_constants_everything() -> None:
    single = batch_mean(np.array([3.0]))
    assert single.value == 3.0
    assert np.isnan(difference(single, batch_mean(np.ones(10))).p_value)
    same = difference(batch_mean(np.ones(10)), batch_mean(np.ones(20)))
    assert (same.value, same.p_value) == (0.0, 1.0)
    assert difference(batch_mean(2 * np.ones(10)), batch_mean(np.ones(20))).p_value == 0.0
