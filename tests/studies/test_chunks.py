"""How studies are cut: few enough chunks that keeping them costs little, enough of them to share out."""

from __future__ import annotations

import pytest

from gearrattle.studies.prepared import CHUNK_SECONDS, MOST_IN_CHUNK, SHORTEST_CHUNK, fit_size


@pytest.mark.parametrize("seconds", [1e-4, 1.1e-3, 0.02, 0.3, 4.0, 70.0])
@pytest.mark.parametrize("count", [1, 7, 64, 1000, 30_000, 1_000_000, 10**9])
def test_chunks_are_neither_too_short_nor_too_few(seconds: float, count: int) -> None:
    size = fit_size(seconds, count)
    length, chunks = size * seconds, count / size
    assert size.bit_count() == 1
    assert size == 1 or (length <= CHUNK_SECONDS and size <= MOST_IN_CHUNK)
    assert size == 1 or chunks >= 8
    if count * seconds >= 64 * CHUNK_SECONDS:  # what remains of a long study cut to a power of two
        assert length > 0.5 * CHUNK_SECONDS or size > 0.5 * MOST_IN_CHUNK or size == 1
    assert chunks <= 128 or length > 0.5 * SHORTEST_CHUNK or 2 * size > MOST_IN_CHUNK or size == 1


def test_a_study_of_a_minute_is_cut_into_chunks_of_two_seconds() -> None:
    assert fit_size(1.0 / 256, 64 * 256) == 512
    assert fit_size(1.0 / 256, 8 * 256) == 256  # eight seconds: eight chunks
    assert fit_size(1.0 / 256, 640 * 256) == 1024  # ten minutes: as long as they may be
