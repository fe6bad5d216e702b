"""Turning points of an oscillator against its closed form, with plain kernels: instants, depths, slopes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from gearrattle.engine.kernels import perturbed_motion, turning_point_depths
from gearrattle.engine.kernels.branch_direction import Direction, write_direction
from gearrattle.engine.kernels.corner_approach import Touched, write_touch
from gearrattle.engine.kernels.perturbed_motion import Driven, Path, Trace

STIFFNESS, DRAG, FORCE = 400.0, 2.0, 30.0
START = np.array([0.3, -4.0, 1.0])
GENERATOR = np.array([[0.0, 1.0, 0.0], [-STIFFNESS, -DRAG, FORCE], [0.0, 0.0, 0.0]])
"""x'' = -400 x - 2 x' + p over one period, p = 30: z = (x, x', 1)."""
LOWER, UPPER, CORNER_SHIFT = -0.25, 0.35, 0.2
CROSSED = (0.2, 0.45)
"""Instants at which nothing changes."""


def at(time: float) -> np.ndarray:
    return expm(GENERATOR * time) @ START


def turning_times() -> list[float]:
    grid = np.linspace(0.0, 1.0, 401)
    rates = np.array([at(time)[1] for time in grid])
    return [
        float(brentq(lambda t: at(t)[1], grid[i], grid[i + 1], xtol=1e-15))
        for i in np.flatnonzero(rates[:-1] * rates[1:] < 0.0)
    ]


def slopes(time: float) -> np.ndarray:
    """Derivatives of x(t) by x(0), x'(0) and p."""
    gradient = expm(GENERATOR * time)[0]
    return np.array([gradient[0], gradient[1], gradient[2] / FORCE])


def time_slopes(time: float) -> np.ndarray:
    """Derivatives of the instant of a turning point by x(0), x'(0) and p."""
    gradient = expm(GENERATOR * time)[1]
    return -np.array([gradient[0], gradient[1], gradient[2] / FORCE]) / (GENERATOR @ at(time))[1]


def course_of(crossed: tuple[float, ...]) -> tuple[Driven, Path]:
    """The motion over one period; crossings change nothing."""
    events = len(crossed)
    alike, nothing = np.ones((events + 1, 1)), np.empty((events + 1, 0))
    path = Path(
        time=np.array([0.0, *crossed, 1.0]),
        slot=np.zeros(events + 1, np.int64),
        lower=LOWER * alike,
        upper=UPPER * alike,
        lower_shift=0.0 * alike,
        upper_shift=CORNER_SHIFT * alike,
        known=nothing,
        known_shift=nothing,
        clearance=np.zeros(events, np.int64),
        upward=np.arange(1, events + 1) % 2,
        row=np.tile([1.0, 0.0, 0.0], (events, 1)),
        row_shift=np.zeros((events, 3)),
        bound_shift=np.zeros(events),
        tick=np.full(events, np.nan),
        is_law=np.ones(events, np.int64),
        outside=np.empty((2, 1), np.int64),
    )
    turning_point_depths.write_outside(path.clearance, path.upward, np.zeros(2, np.int64), path.outside)
    shift = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return Driven(GENERATOR[None], shift[None], np.array([[1.0, 0.0, 0.0]]), np.zeros((1, 3))), path


def room(path: Path, rows: int) -> Trace:
    count = len(path.slot)
    return Trace(
        z=np.empty((count + 1, 3)),
        v=np.empty((count + 1, 2)),
        delay=np.empty(count - 1),
        jump=np.empty((count - 1, 2)),
        reach=np.array([np.inf]),
        turns=np.zeros((rows, turning_point_depths.COLUMNS)),
        number=np.zeros(1, np.int64),
    )


def turns_of(crossed: tuple[float, ...], change: np.ndarray) -> np.ndarray:
    driven, path = course_of(crossed)
    trace = room(path, 40)
    perturbed_motion.write_course(driven, path, START, change, trace)
    turns = trace.turns[: trace.number[0]]
    return turns[turns[:, turning_point_depths.UPWARD] < turning_point_depths.FALLING]


@pytest.mark.parametrize("crossed", [(), CROSSED], ids=["whole", "crossed"])
@pytest.mark.parametrize("change", [*np.eye(3), np.array([0.3, -2.0, 1.7])], ids=["x", "rate", "p", "all"])
def test_turning_points_have_their_instants_depths_and_slopes(crossed: tuple[float, ...], change: np.ndarray) -> None:
    """Depths are by the corner ahead: the upper one moves with p as well."""
    expected = turning_times()
    assert len(expected) > 4
    turns = turns_of(crossed, change)
    times = turns[:, turning_point_depths.TIME]
    ahead = turns[[i for i in range(len(turns)) if i == 0 or times[i] != times[i - 1]]]
    np.testing.assert_allclose(ahead[:, turning_point_depths.TIME], expected, rtol=0, atol=1e-9)
    for row in ahead:
        time, is_upper = row[turning_point_depths.TIME], row[turning_point_depths.UPWARD] == 1
        depth = at(time)[0] - UPPER if is_upper else LOWER - at(time)[0]
        assert row[turning_point_depths.DEPTH] == pytest.approx(depth, abs=1e-12)
        moved = slopes(time) - np.array([0.0, 0.0, CORNER_SHIFT]) if is_upper else -slopes(time)
        assert row[turning_point_depths.SLOPE] == pytest.approx(moved @ change, abs=1e-12)
        assert row[turning_point_depths.TIME_SLOPE] == pytest.approx(time_slopes(time) @ change, abs=1e-12)


@pytest.mark.parametrize("row", np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.2, 0.1, -3.0]]), ids=["x", "p", "all"])
def test_along_the_direction_a_motion_ends_as_far_from_its_start(row: np.ndarray) -> None:
    ends, scale = expm(GENERATOR)[:2], np.array([2.0, 0.5])
    columns = np.column_stack([ends[:, :2] * scale[:, None] / scale, ends[:, 2] / FORCE * scale])
    direction = Direction(np.empty((3, 3)), np.empty(3, np.int64), np.empty(3))
    assert write_direction(columns, scale, row, 0, direction)
    change = direction.change / np.append(scale, 1.0)
    later = expm(GENERATOR) @ (START + np.append(change[:2], 0.0)) + expm(GENERATOR)[:, 2] / FORCE * change[2]
    np.testing.assert_allclose(later[:2] - at(1.0)[:2], change[:2], rtol=0, atol=1e-12)
    assert row @ change == pytest.approx(1.0)


def test_where_neighbouring_motions_repeat_anyway_there_is_no_direction() -> None:
    direction = Direction(np.empty((3, 3)), np.empty(3, np.int64), np.empty(3))
    assert not write_direction(np.eye(2, 3), np.ones(2), np.array([1.0, 0.0, 0.0]), 0, direction)


def test_between_two_crossings_of_a_corner_a_turning_point_counts_by_that_one_too() -> None:
    """Crossed upwards, then downwards: maxima in between lie beyond the lower corner, other minima beyond the upper."""
    turns, whole = turns_of(CROSSED, np.ones(3)), turns_of((), np.ones(3))
    visits = {
        time: is_maximum
        for time in turning_times()
        if (is_maximum := at(time)[0] > at(time + 1e-3)[0]) == (CROSSED[0] < time < CROSSED[1])
    }
    assert sorted(visits.values()) == [False, False, True]
    assert len(turns) == len(whole) + len(visits)
    times = turns[:, turning_point_depths.TIME]
    behind = turns[[i for i in range(1, len(turns)) if times[i] == times[i - 1]]]
    for row, (time, is_maximum) in zip(behind, visits.items(), strict=True):
        assert row[turning_point_depths.TIME] == pytest.approx(time, abs=1e-9)
        depth = at(time)[0] - LOWER if is_maximum else UPPER - at(time)[0]
        assert row[turning_point_depths.DEPTH] == pytest.approx(depth, abs=1e-12)
        moved = slopes(time) if is_maximum else np.array([0.0, 0.0, CORNER_SHIFT]) - slopes(time)
        assert row[turning_point_depths.SLOPE] == pytest.approx(moved.sum(), abs=1e-12)
        assert row[turning_point_depths.TIME_SLOPE] == pytest.approx(time_slopes(time).sum(), abs=1e-12)


@pytest.mark.parametrize("crossed", [(), CROSSED], ids=["whole", "crossed"])
def test_an_approach_has_its_depth_and_how_it_moves(crossed: tuple[float, ...]) -> None:
    driven, path = course_of(crossed)
    summit = max(turning_times(), key=lambda time: at(time)[0])
    touched = Touched(np.array([summit + 5e-3, np.nan, np.nan]), np.empty(3), np.empty(3))
    write_touch(driven, path, START, np.array([0, 1]), np.ones(2), room(path, 0), touched)
    assert touched.number[0] == pytest.approx(summit, abs=1e-9)
    assert touched.number[1] == pytest.approx(at(summit)[0] - UPPER, abs=1e-12)
    assert touched.number[2] == pytest.approx((GENERATOR @ GENERATOR @ at(summit))[0], rel=1e-6)
    moved = slopes(summit) - np.array([0.0, 0.0, CORNER_SHIFT])
    np.testing.assert_allclose(touched.slope, moved, rtol=0, atol=1e-12)
    np.testing.assert_allclose(touched.time_slope, time_slopes(summit), rtol=0, atol=1e-12)
