"""Windows are whole periods at the end of the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearrattle.errors import ModelError
from gearrattle.signals import last_cycles, steady
from tests.signals.handmade import layout, trajectory


def test_steady_part_leaves_out_the_discarded_cycles() -> None:
    window = steady(trajectory(cycles=10, discard=3, samples=16))
    assert (window.start, window.end, window.cycles) == (3.0, 10.0, 7)
    assert (window.first, window.last) == (48, 160)
    assert window.duration == 7.0


def test_period_other_than_one() -> None:
    window = steady(trajectory(layout(period=0.25), cycles=8, discard=2, samples=4))
    assert (window.start, window.end, window.cycles) == (0.5, 2.0, 6)


def test_closed_samples_hold_both_bounds_and_periodic_ones_each_phase_once() -> None:
    motion = trajectory(cycles=5, discard=4, samples=8)
    window = steady(motion)
    assert window.closed(motion.time).tolist() == [4 + k / 8 for k in range(9)]
    assert window.periodic(motion.time).tolist() == [4 + k / 8 for k in range(8)]


def test_both_bounds_belong_to_the_window() -> None:
    window = steady(trajectory(cycles=4, discard=1))
    times = np.array([np.nextafter(1.0, 0.0), 1.0, 4.0, np.nextafter(4.0, 5.0)])
    assert window.contains(times).tolist() == [False, True, True, False]


@pytest.mark.parametrize(("cycles", "discard", "expected"), [(100, 50, 8), (12, 4, 8), (10, 4, 6), (1, 0, 1)])
def test_last_cycles_are_eight_or_what_remains(cycles: int, discard: int, expected: int) -> None:
    window = last_cycles(trajectory(cycles=cycles, discard=discard, samples=4), 8)
    assert window.cycles == expected
    assert window.start == cycles - expected
    assert window.last - window.first == 4 * expected


def test_nothing_left_to_judge_is_said() -> None:
    with pytest.raises(ModelError, match="discard: found 4 of 4 cycles; at least one cycle"):
        steady(trajectory(cycles=4, discard=4))


def test_samples_that_are_not_whole_cycles_are_refused() -> None:
    motion = trajectory(cycles=4, samples=8)
    with pytest.raises(ModelError, match="found 32 samples"):
        steady(replace(motion, time=motion.time[:-1]))
