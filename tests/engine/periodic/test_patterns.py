"""Patterns as words, against lists of pairs turned round one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearrattle.engine.periodic import patterns
from gearrattle.engine.system.crossings_in_order import Passages

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


def test_what_crosses_at_one_instant_is_in_the_order_of_watches() -> None:
    order = [(1, 1), (2, 0), (0, 1), (2, 1), (0, 0), (1, 0)]
    known = crossings(order)
    time = 0.1 + np.array([0.0, 1.0, 1.0 + 1e-15, 1.0 + 2e-15, 2.0, 2.0 - 1e-15])
    memory = np.arange(6.0)[:, None]
    together = replace(known, time=time, memory=memory).in_order()
    assert list(zip(together.watch.tolist(), together.upward.tolist(), strict=True)) == [
        (1, 1),
        (0, 1),
        (2, 0),
        (2, 1),
        (0, 0),
        (1, 0),
    ]
    assert together.memory[:, 0].tolist() == [0.0, 2.0, 1.0, 3.0, 4.0, 5.0]
    assert together.time.tolist() == [time[0], time[1], time[1], time[1], time[4], time[4]]
    assert patterns.word_of(replace(known, time=time)) == patterns.word_of(together)
    assert known.in_order() is known


@pytest.mark.parametrize("seed", range(20))
def test_a_crossing_that_comes_alone_is_seen_wherever_the_motions_begin(seed: int) -> None:
    order, rng = some_order(seed, 6), np.random.default_rng(seed)
    fewer = patterns.word_of(crossings(order))
    at, other = sorted(int(i) for i in rng.integers(0, 7, 2))
    alone = [*order[:at], (2, 1), *order[at:]]
    in_both_halves = [*order[:at], (2, 1), *order[at:other], (3, 0), *order[other:]]
    for more in (alone, in_both_halves):
        for turned in rotations(more):
            word = patterns.word_of(crossings(turned))
            assert {patterns.watch_of(letter) for letter in patterns.lone(fewer, word)} == {2, 3}.intersection(
                watch for watch, _ in more
            )
            assert patterns.is_one_change(fewer, word)
            assert patterns.is_one_change(word, fewer)
    out_and_back = patterns.word_of(crossings([*order[:at], (2, 1), *order[at:other], (2, 0), *order[other:]]))
    assert patterns.lone(fewer, out_and_back) == ""
    three = patterns.word_of(crossings([(2, 1), *order, (3, 1), (4, 0)]))
    assert len(patterns.lone(fewer, three)) == 3
    assert not patterns.is_one_change(fewer, three)
