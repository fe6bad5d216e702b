"""Impacts from event logs written by hand."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals import find_impacts, steady
from gearrattle.trajectory import Layout
from tests.signals.handmade import Row, chain, staged, trajectory, two_gaps

BOTH_FLANKS: list[Row] = [
    (0.25, 0, 0, 1, 0.5, 0.0),
    (0.75, 0, 1, 0, -0.4, 3.0),
    (1.50, 0, 0, -1, -0.7, 3.0),
    (1.75, 0, -1, 0, 0.6, 1.0),
    (3.50, 0, 0, 1, 0.3, 1.0),
]


def test_every_impact_with_its_contact_and_impulse() -> None:
    actual = find_impacts(trajectory(rows=BOTH_FLANKS, final=1.25))
    assert actual.time.tolist() == [0.25, 1.5, 3.5]
    assert actual.region.tolist() == [1, -1, 1]
    assert actual.drive.tolist() == [True, False, True]
    assert actual.velocity.tolist() == [0.5, -0.7, 0.3]
    assert actual.duration.tolist() == [0.5, 0.25, 0.5]
    assert actual.impulse.tolist() == [3.0, -2.0, 0.25]
    assert actual.censored.tolist() == [False, False, True]


def test_window_takes_the_impacts_that_begin_in_it() -> None:
    motion = trajectory(rows=BOTH_FLANKS, final=1.25, discard=1)
    mine = find_impacts(motion).within(steady(motion))
    assert mine.time.tolist() == [1.5, 3.5]
    assert len(mine) == 2


def test_contact_closed_at_the_start_is_no_impact() -> None:
    actual = find_impacts(trajectory(rows=chain([1, 0, 1], [0.5, 1.0]), initial=[1]))
    assert actual.time.tolist() == [1.0]


def test_no_events_no_impacts() -> None:
    actual = find_impacts(trajectory())
    assert len(actual) == 0
    assert actual.impulse.shape == actual.censored.shape == (0,)


def test_nested_stages_are_contacts_of_their_own() -> None:
    plate = staged([-2.0, -1.0, 1.0, 2.0], -2, [9.0, 4.0, 1.0, 4.0, 9.0])
    rows: list[Row] = [
        (0.1, 0, 0, 1, 1.0, 10.0),
        (0.2, 0, 1, 2, 0.8, 11.0),
        (0.3, 0, 2, 1, -0.8, 15.0),
        (0.4, 0, 1, 2, 0.5, 16.0),
        (0.5, 0, 2, 1, -0.5, 18.0),
        (0.6, 0, 1, 0, -1.0, 19.0),
    ]
    actual = find_impacts(trajectory(plate, rows))
    assert actual.region.tolist() == [1, 2, 2]
    assert actual.impulse.tolist() == [9.0, 4.0, 2.0]
    assert actual.duration.tolist() == pytest.approx([0.5, 0.1, 0.1], rel=1e-14)
    assert not actual.censored.any()


def test_an_outer_stage_may_return_while_the_inner_stays_closed() -> None:
    plate = staged([-2.0, -1.0, 1.0, 2.0], -2, [9.0, 4.0, 1.0, 4.0, 9.0])
    rows: list[Row] = [(0.5, 0, 0, 1, 1.0, 1.0), (1.0, 0, 1, 2, 1.0, 2.0), (1.5, 0, 2, 1, -1.0, 4.0)]
    actual = find_impacts(trajectory(plate, rows, final=10.0))
    assert actual.censored.tolist() == [True, False]
    assert actual.duration.tolist() == [3.5, 0.5]
    assert actual.impulse.tolist() == [9.0, 2.0]


@pytest.mark.parametrize(
    ("plate", "regions", "hits"),
    [
        (staged([-2.0, 0.0, 1.0], -2, [8.0, 2.0, 1.0, 9.0]), [0, -1, 0, -1, -2, -1, 0, 1], [-2, 1]),
        (staged([0.0, 1.0], -1, [5.0, 0.0, 7.0]), [0, -1, 0, 1], [-1, 1]),
        (staged([-1.0, 0.0], -2, [5.0, 0.0, 7.0]), [0, -1, 0, -1, -2], [0, -2]),
    ],
    ids=["two springs meet at zero", "gap on the drive side", "gap on the coast side"],
)
def test_corner_at_zero_is_an_impact_only_next_to_a_gap(plate: Layout, regions: list[int], hits: list[int]) -> None:
    times = [0.1 * (k + 1) for k in range(len(regions) - 1)]
    assert find_impacts(trajectory(plate, chain(regions, times))).region.tolist() == hits


def test_simultaneous_impacts_of_two_clearances_stay_apart() -> None:
    plate = two_gaps()
    rows: list[Row] = [
        (1.0, 0, 0, 1, 1.0, 5.0),
        (1.0, 1, 0, 1, 2.0, 7.0),
        (2.0, 0, 1, 0, -1.0, 6.0),
        (3.0, 1, 1, 0, -2.0, 9.0),
    ]
    actual = find_impacts(trajectory(plate, rows))
    assert actual.of(0).impulse.tolist() == [1.0]
    assert actual.of(1).impulse.tolist() == [2.0]
    assert actual.of(1).duration.tolist() == [2.0]


def test_contact_that_lasts_to_the_end_takes_no_return_of_another_clearance() -> None:
    plate = two_gaps()
    rows: list[Row] = [(1.0, 0, 0, 1, 1.0, 5.0), (1.5, 1, 0, 1, 2.0, 7.0), (2.0, 1, 1, 0, -2.0, 9.0)]
    actual = find_impacts(trajectory(plate, rows, final=6.0))
    assert actual.of(0).duration.tolist() == [3.0]
    assert actual.of(0).impulse.tolist() == [1.0]


def test_touch_and_go_at_one_instant() -> None:
    actual = find_impacts(trajectory(rows=chain([0, 1, 0, 1, 0], [1.0, 1.0, 2.0, 2.5])))
    assert actual.duration.tolist() == [0.0, 0.5]
    assert not actual.censored.any()


def test_unknown_force_integral_stays_unknown() -> None:
    rows = [(*row[:5], float("nan")) for row in BOTH_FLANKS]
    actual = find_impacts(trajectory(rows=rows))
    assert np.isnan(actual.impulse).all()
    assert actual.duration.tolist() == [0.5, 0.25, 0.5]
