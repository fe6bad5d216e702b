"""Costs said before a study, and the time that remains, against what was needed."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from gearrattle.studies import study_cost
from gearrattle.studies.schedulers import opened
from gearrattle.studies.study_cost import Pace, rounds, spread, spread_indices
from gearrattle.studies.study_file import read_study

EXAMPLES = Path(__file__).parents[2] / "examples" / "studies"


@pytest.mark.parametrize("count", [1, 2, 3, 7, 64, 100, 1000])
def test_every_beginning_of_the_order_is_spread_over_the_range(count: int) -> None:
    order = list(spread(count, count))
    assert sorted(order) == list(range(count))
    for first in (4, 16, 50):
        if first <= count:
            chosen = sorted(order[:first])
            gaps = [b - a for a, b in zip([-1, *chosen], [*chosen, count], strict=True)]
            assert max(gaps) <= 2.0 * count / first + 1.0
    assert list(spread(count, 3)) == order[:3]


def test_cases_that_are_tried_fall_on_every_value_of_every_axis() -> None:
    places = spread_indices((64, 8), 32)
    assert sorted({j for _, j in places}) == list(range(8))
    assert len({i for i, _ in places}) >= 28


def test_the_busiest_worker_decides() -> None:
    assert rounds(8, 3) == 3.0
    assert rounds(2, 16) == 1.0
    assert rounds(64, 1) == 64.0


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    hands = Clock()
    monkeypatch.setattr(study_cost.time, "monotonic", hands)
    return hands


@pytest.mark.parametrize("workers", [1, 2, 16])
@pytest.mark.parametrize("expected", [2.0 / 1.5, 2.0, 3.0])
@pytest.mark.parametrize("message", [True, False])
def test_the_remaining_time_is_true_within_a_factor_of_two_after_a_tenth(
    clock: Clock, workers: int, expected: float, message: bool
) -> None:
    """Chunks of 2 s, expected within a factor of 1.5 as estimates are; all workers in step, which is the worst case."""
    chunks = 64
    length = 2.0
    start = clock.now
    actual = Pace(chunks, workers, expected)
    total = length * rounds(chunks, workers)
    checked = 0
    while actual.reached < chunks:
        clock.now += 0.25
        busy = min(workers, chunks - actual.reached)
        age = (clock.now - start) % length
        if age < 1e-9:
            for _ in range(busy):
                actual.chunk_done()
        left = total - (clock.now - start)
        busy = min(workers, chunks - actual.reached)
        shares = dict.fromkeys(range(busy), age / length) if message else None
        if clock.now - start >= 0.1 * total and left >= 1.0:
            remaining = actual.remaining(shares)
            assert 0.5 * left <= remaining <= 2.0 * left
            checked += 1
    assert checked > 3


def test_a_cheap_beginning_does_not_promise_a_cheap_end(clock: Clock) -> None:
    """A sweep whose first fifth costs a quarter of the mean, as a quiet motion does: one chunk, shares told."""
    actual, start = Pace(1, 1, 10.0), clock.now
    for step in range(1, 100):
        share = step / 100
        spent = 0.25 * 10.0 * share if share < 0.2 else 0.5 + 9.5 * (share - 0.2) / 0.8
        clock.now = start + spent
        if share >= 0.1 and spent < 9.0:
            assert 0.5 * (10.0 - spent) <= actual.remaining({0: share}) <= 2.0 * (10.0 - spent)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("backlash_and_drag", ("count = 8", "count = 64")),
        ("what_decides", ("count = 16", "count = 128")),
        ("rattle_basins", ("count = 100", "count = 25")),
        ("rattle_bifurcation", ("count = 231", "count = 80")),
        ("quiet_idle", ("generations = 10", "generations = 4")),
    ],
)
def test_an_estimate_is_within_half_of_what_the_study_takes(
    name: str, change: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the time of this process: one worker, here. The better of three estimates, for a machine that is busy."""
    text = (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8").replace(*change)
    file = tmp_path / f"{name}.toml"
    file.write_text(text.replace("../", f"{EXAMPLES.parent}/"), encoding="utf-8")
    asked = read_study(file)
    monkeypatch.setattr(study_cost.time, "perf_counter", time.process_time)
    ratios = []
    for attempt in range(3):
        actual = asked.prepare()
        begun = time.process_time()
        with opened("threads", 1, 1) as compute:
            actual.carry_out(tmp_path / f"{attempt}", compute)
        taken = time.process_time() - begun
        ratios.append(actual.estimate(1, "threads").seconds / taken)
    assert 1.0 / 1.5 <= sorted(ratios)[1] <= 1.5, ratios
