"""Regimes and shares of time from event logs written by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gearrattle.errors import GearRattleError
from gearrattle.signals import centre, contact_share, in_contact, regime, region_at, region_shares, steady
from gearrattle.trajectory import Layout
from tests.signals.handmade import chain, layout, staged, trajectory, two_gaps

GAP_BOTH_SIDES = layout()
SYMMETRIC_STAGES = staged([-2.0, -1.0, 1.0, 2.0], -2, [9.0, 4.0, 1.0, 4.0, 9.0])
ASYMMETRIC_STAGES = staged([-2.0, 0.0, 1.0], -2, [8.0, 2.0, 1.0, 9.0])
GAP_ON_DRIVE = staged([0.0, 1.0], -1, [5.0, 0.0, 7.0])
GAP_ON_COAST = staged([-1.0, 0.0], -2, [5.0, 0.0, 7.0])


@pytest.mark.parametrize(
    ("plate", "expected"),
    [
        (GAP_BOTH_SIDES, {0}),
        (SYMMETRIC_STAGES, {0}),
        (ASYMMETRIC_STAGES, {0, -1}),
        (GAP_ON_DRIVE, {0}),
        (GAP_ON_COAST, {-1}),
        (staged([-1.0], -1, [5.0, 0.0]), {0}),
    ],
    ids=["gap", "stages", "corner at zero", "gap on drive", "gap on coast", "one corner"],
)
def test_centre(plate: Layout, expected: set[int]) -> None:
    assert centre(plate, 0) == expected


def test_contact_is_all_but_the_centre() -> None:
    assert in_contact(ASYMMETRIC_STAGES, 0, np.array([-2, -1, 0, 1])).tolist() == [True, False, False, True]


def test_region_is_found_by_replaying_the_log() -> None:
    motion = trajectory(rows=chain([0, 1, 0, -1], [0.5, 1.5, 2.5]))
    times = (0.0, 0.5, 0.6, 1.5, 2.0, 2.6)
    assert [region_at(motion, 0, t) for t in times] == [0, 0, 1, 1, 0, -1]


def test_shares_of_time_are_exact_whatever_the_samples() -> None:
    rows = chain([0, 1, 0, -1, 0], [0.1, 0.35, 2.0, 2.0625])
    coarse, fine = (trajectory(rows=rows, samples=n) for n in (1, 1000))
    for motion in (coarse, fine):
        shares = region_shares(motion, 0, steady(motion))
        assert shares == pytest.approx({-1: 0.0625 / 4, 0: (4 - 0.3125) / 4, 1: 0.25 / 4}, rel=1e-15)
        assert contact_share(motion, 0, steady(motion)) == pytest.approx(0.3125 / 4, rel=1e-15)


def test_stay_that_began_before_the_window_counts_from_its_start() -> None:
    motion = trajectory(rows=chain([0, 1, 0], [0.9, 2.25]), cycles=4, discard=2)
    assert region_shares(motion, 0, steady(motion)) == {-1: 0.0, 0: 0.875, 1: 0.125}


def test_no_crossing_at_all_keeps_the_initial_region() -> None:
    motion = trajectory(initial=[-1])
    assert region_shares(motion, 0, steady(motion)) == {-1: 1.0, 0: 0.0, 1: 0.0}
    assert contact_share(motion, 0, steady(motion)) == 1.0
    assert regime(motion, 0, steady(motion)) == "quiet"


def test_crossing_on_the_start_of_the_window() -> None:
    motion = trajectory(rows=chain([0, 1], [1.0]), cycles=2, discard=1)
    assert region_at(motion, 0, 1.0) == 0
    assert region_shares(motion, 0, steady(motion)) == {-1: 0.0, 0: 0.0, 1: 1.0}
    assert regime(motion, 0, steady(motion)) == "single-sided"


@given(st.lists(st.floats(0.001, 3.999), min_size=1, max_size=30, unique=True), st.data())
def test_shares_sum_to_one(times: list[float], data: st.DataObject) -> None:
    regions = [0]
    for _ in times:
        step = data.draw(st.sampled_from([-1, 1]))
        regions.append(regions[-1] + (step if abs(regions[-1] + step) <= 1 else -step))
    motion = trajectory(rows=chain(regions, sorted(times)), discard=data.draw(st.integers(0, 3)))
    shares = region_shares(motion, 0, steady(motion))
    assert sum(shares.values()) == pytest.approx(1.0, rel=1e-14)
    assert min(shares.values()) >= 0.0


@pytest.mark.parametrize(
    ("plate", "regions", "expected"),
    [
        (GAP_BOTH_SIDES, [0, 1, 0, 1], "single-sided"),
        (GAP_BOTH_SIDES, [0, -1, 0], "single-sided"),
        (GAP_BOTH_SIDES, [0, 1, 0, -1], "double-sided"),
        (GAP_BOTH_SIDES, [1, 0, -1], "double-sided"),
        (GAP_BOTH_SIDES, [1, 0], "single-sided"),
        (SYMMETRIC_STAGES, [1, 2, 1], "single-sided"),
        (SYMMETRIC_STAGES, [-1, -2, -1, 0, 1], "double-sided"),
        (ASYMMETRIC_STAGES, [0, -1, 0, -1], "quiet"),
        (ASYMMETRIC_STAGES, [0, -1, -2], "single-sided"),
        (ASYMMETRIC_STAGES, [0, 1, 0, -1], "single-sided"),
        (ASYMMETRIC_STAGES, [-1, 0, 1, 0, -1, -2], "double-sided"),
        (GAP_ON_DRIVE, [0, -1, 0], "single-sided"),
        (GAP_ON_DRIVE, [0, -1, 0, 1], "double-sided"),
        (GAP_ON_COAST, [-1, 0, -1], "single-sided"),
        (GAP_ON_COAST, [0, -1, -2], "double-sided"),
    ],
)
def test_regime(plate: Layout, regions: list[int], expected: str) -> None:
    times = [0.1 * (k + 1) for k in range(len(regions) - 1)]
    motion = trajectory(plate, chain(regions, times), initial=regions[:1])
    assert regime(motion, 0, steady(motion)) == expected


def test_only_the_window_makes_the_regime() -> None:
    motion = trajectory(rows=chain([0, 1, 0, -1, 0], [0.1, 0.2, 1.5, 1.6]), cycles=3, discard=1)
    assert regime(motion, 0, steady(motion)) == "single-sided"


def test_clearances_do_not_mix() -> None:
    plate = two_gaps()
    rows = sorted(chain([0, 1, 0], [0.5, 1.5]) + chain([-1, 0, -1], [1.0, 3.0], clearance=1))
    motion = trajectory(plate, rows, initial=[0, -1])
    assert region_shares(motion, 0, steady(motion)) == {-1: 0.0, 0: 0.75, 1: 0.25}
    assert region_shares(motion, 1, steady(motion)) == {-1: 0.5, 0: 0.5, 1: 0.0}


@pytest.mark.parametrize(("regions", "initial"), [([0, 1, 0], 1), ([0, 1, 0], -1)])
def test_a_log_with_a_gap_is_refused(regions: list[int], initial: int) -> None:
    motion = trajectory(rows=chain(regions, [0.5, 1.5]), initial=[initial])
    with pytest.raises(GearRattleError, match=r"gear at t = 0\.5: found a crossing from region 0"):
        region_shares(motion, 0, steady(motion))


def test_a_lost_crossing_is_noticed() -> None:
    rows = [row for row in chain([0, 1, 0, 1], [0.5, 1.5, 2.5]) if row[0] != 1.5]
    motion = trajectory(rows=rows)
    with pytest.raises(GearRattleError, match=r"t = 2\.5: .* lead to region 1"):
        contact_share(motion, 0, steady(motion))
