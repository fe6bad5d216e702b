"""Patterns as words, against lists of pairs turned round one by one."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.periodic import patterns
from gearrattle.engine.system.passages import Passages

Order = list[tuple[int, int]]


def crossings(order: Order) -> Passages:
    count = len(order)
    watch, upward = np.array(order, dtype=np.int64).reshape(count, 2).T
    return Passages(np.arange(count, dtype=float), watch, upward, np.zeros(count), np.zeros((count, 0)))


def rotations(order: Order) -> list[Order]:
    return [order[i:] + order[:i] for i in range(len(order))] or [order]


def some_order(seed: int, count: int) -> Order:
    rng = np.random.default_rng(seed)
    return [(int(watch), int(upward)) for watch, upward in rng.integers(0, 2, (count, 2))]


@pytest.mark.parametrize("seed", range(20))
def test_a_pattern_is_the_smallest_rotation(seed: int) -> None:
    order = some_order(seed, seed % 7)
    word = patterns.word_of(crossings(order))
    assert patterns.pairs_of(word) == tuple(order)
    assert patterns.pairs_of(patterns.rotated(word)) == tuple(min(rotations(order)))
    for turned in rotations(order):
        assert patterns.is_rotation(patterns.word_of(crossings(turned)), word)


@pytest.mark.parametrize("seed", range(20))
def test_a_touch_and_an_exchange_are_seen_wherever_the_motions_begin(seed: int) -> None:
    order, rng = some_order(seed, 6), np.random.default_rng(seed)
    at, side = int(rng.integers(0, 6)), int(rng.integers(0, 2))
    more = [*order[:at], (1, side), (1, 1 - side), *order[at:]]
    swapped = [*order[:2], order[3], order[2], *order[4:]]
    is_possible = order[2][0] != order[3][0] or swapped in rotations(order)  # no clearance crosses down before up
    fewer_word = patterns.word_of(crossings(order))
    for turned in rotations(more):
        word = patterns.word_of(crossings(turned))
        by_lists = []
        for i in range(len(turned)):
            j = (i + 1) % len(turned)
            rest = [crossing for k, crossing in enumerate(turned) if k not in (i, j)]
            if turned[i][0] == turned[j][0] and turned[i][1] != turned[j][1] and rest in rotations(order):
                by_lists.append(i)
        assert patterns.touches(fewer_word, word) == by_lists != []
        assert patterns.is_one_change(fewer_word, word)
        assert patterns.is_one_change(word, fewer_word)
    for turned in rotations(swapped):
        word = patterns.word_of(crossings(turned))
        assert patterns.is_one_change(fewer_word, word) == is_possible
        assert not patterns.touches(fewer_word, word)
