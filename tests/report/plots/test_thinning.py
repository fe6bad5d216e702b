"""Thinning keeps what an engineer looks for."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gearrattle.report.plots.thinning import thin


def test_short_curves_are_kept_whole() -> None:
    assert thin(np.zeros(40), 40).tolist() == list(range(40))


@given(
    count=st.integers(500, 20_000),
    at_most=st.integers(16, 400),
    spikes=st.lists(st.tuples(st.floats(0.0, 1.0), st.sampled_from([-1.0, 1.0])), min_size=1, max_size=3),
)
def test_every_isolated_spike_survives(count: int, at_most: int, spikes: list[tuple[float, float]]) -> None:
    values = 0.01 * np.sin(np.linspace(0.0, 60.0, count))
    buckets = np.linspace(0, count, (at_most - 2) // 2 + 1).astype(int)
    expected: dict[tuple[int, float], int] = {}
    for number, (position, sign) in enumerate(spikes):
        at = min(count - 1, int(position * count))
        values[at] = sign * (2.0 + number)
        bucket = int(np.searchsorted(buckets, at, side="right"))
        expected = {key: k for key, k in expected.items() if k != at} | {(bucket, sign): at}
    kept = thin(values, at_most)
    assert kept.size <= at_most
    assert np.all(np.diff(kept) > 0)
    assert {kept[0], kept[-1]} == {0, count - 1}
    assert set(expected.values()) <= set(kept.tolist())


def test_the_envelope_of_every_bucket_is_exact() -> None:
    values = np.random.default_rng(7).normal(size=100_000)
    kept = thin(values, 2002)
    edges = np.linspace(0, values.size, 1001).astype(int)
    for low, high in pairwise(edges.tolist()):
        inside = kept[(kept >= low) & (kept < high)]
        assert values[inside].max() == values[low:high].max()
        assert values[inside].min() == values[low:high].min()


@pytest.mark.parametrize("count", [18, 19, 37, 38, 39])
def test_buckets_of_two_samples_and_less_keep_their_order(count: int) -> None:
    """As many samples as points, or few more: every bucket has a sample, and none is kept twice."""
    kept = thin(np.sin(np.arange(count, dtype=float)), 17)
    assert kept.size <= 17
    assert np.all(np.diff(kept) > 0)


def test_a_missing_value_in_a_bucket_does_not_stop_the_others() -> None:
    values = np.sin(np.linspace(0.0, 9.0, 1000))
    values[500] = np.nan
    kept = thin(values, 102)
    assert 500 in kept
    assert np.nanmax(values[kept]) == np.nanmax(values)


def test_too_few_points_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 16"):
        thin(np.zeros(100), 15)
