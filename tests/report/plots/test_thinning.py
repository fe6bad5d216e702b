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
    buckets = np.linspace(0, count, (at_most - 2) // 4 + 1).astype(int)
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
    edges = np.linspace(0, values.size, 501).astype(int)
    for low, high in pairwise(edges.tolist()):
        inside = kept[(kept >= low) & (kept < high)]
        assert values[inside].max() == values[low:high].max()
        assert values[inside].min() == values[low:high].min()


def test_too_few_points_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 16"):
        thin(np.zeros(100), 15)
