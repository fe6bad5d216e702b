"""Turning points of an oscillator against its closed form, with plain kernels: instants, depths, slopes, the gain."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from gearrattle.engine.kernels import approaches, turning_points
from gearrattle.engine.kernels._jit import is_compiling
from gearrattle.engine.kernels.workspace import PERIOD

pytestmark = pytest.mark.skipif(is_compiling(), reason="calls plain kernels one by one: make plain")

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


def tables(crossed: tuple[float, ...]) -> dict[str, Any]:
    """What the loop has written of a motion before its turning points are sought; crossings change nothing."""
    shift = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    both = np.block([[GENERATOR[:2, :2], shift], [np.zeros((3, 2)), GENERATOR]])
    levels = [expm(both * 0.5**level) for level in range(13)]
    times = np.array([0.0, *crossed, 1.0])
    carried = [expm(both * time)[:2] for time in times[:-1]]
    columns = np.array([np.column_stack([part[:, :2], part[:, 2:] @ START]) for part in carried])
    events = len(crossed)
    crossings = approaches.Crossings(
        np.zeros(events, np.int64),
        np.arange(1, events + 1) % 2,
        np.zeros(events),
        np.zeros(events),
        np.zeros(events),
        np.empty((2, 1), np.int64),
    )
    turning_points.write_outside(crossings.clearance, crossings.upward, np.zeros(2, np.int64), crossings.outside)
    return {
        "rates": approaches.Rates(
            GENERATOR[None],
            shift[None],
            np.array([[1.0, 0.0, 0.0]]),
            np.zeros((1, 3)),
            np.zeros(2),
            np.array([CORNER_SHIFT, 0.0]),
        ),
        "steps": approaches.Steps(
            np.array([[level[2:, 2:] - np.eye(3) for level in levels]]),
            np.array([[level[:2, 2:] for level in levels]]),
            np.array([len(levels)]),
            np.array([0]),
        ),
        "course": approaches.Course(times, np.zeros(events + 1, np.int64), np.array([at(t) for t in times]), columns),
        "crossings": crossings,
        "laws": SimpleNamespace(
            first=np.array([0]),
            lower=np.array([LOWER, UPPER]),
            upper=np.array([UPPER, np.inf]),
            stiffness=np.array([0.0, 70.0]),
            damping=np.array([0.0, 3.0]),
        ),
        "regions": SimpleNamespace(piece=np.zeros((1, 1), np.int64)),
        "scale": np.ones(2),
    }


def turns_of(crossed: tuple[float, ...], change: np.ndarray) -> np.ndarray:
    parts = tables(crossed)
    turns, count = np.zeros((40, turning_points.TURN_COLUMNS)), np.zeros(1, np.int64)
    turning_points.write_turns(
        parts["laws"],
        np.array([0]),
        parts["regions"],
        parts["rates"],
        parts["steps"],
        parts["course"],
        parts["crossings"],
        change,
        np.array([np.inf]),
        turns,
        count,
    )
    turns = turns[: count[0]]
    return turns[turns[:, turning_points.UPWARD] < turning_points.FALLING]


@pytest.mark.parametrize("crossed", [(), CROSSED], ids=["whole", "crossed"])
@pytest.mark.parametrize("change", [*np.eye(3), np.array([0.3, -2.0, 1.7])], ids=["x", "rate", "p", "all"])
def test_turning_points_have_their_instants_depths_and_slopes(crossed: tuple[float, ...], change: np.ndarray) -> None:
    """Depths are by the corner ahead: the upper one moves with p as well."""
    expected = turning_times()
    assert len(expected) > 4
    turns = turns_of(crossed, change)
    times = turns[:, turning_points.TURN_TIME]
    ahead = turns[[i for i in range(len(turns)) if i == 0 or times[i] != times[i - 1]]]
    np.testing.assert_allclose(ahead[:, turning_points.TURN_TIME], expected, rtol=0, atol=1e-9)
    for row in ahead:
        time, is_upper = row[turning_points.TURN_TIME], row[turning_points.UPWARD] == 1
        depth = at(time)[0] - UPPER if is_upper else LOWER - at(time)[0]
        assert row[turning_points.TURN_DEPTH] == pytest.approx(depth, abs=1e-12)
        moved = slopes(time) - np.array([0.0, 0.0, CORNER_SHIFT]) if is_upper else -slopes(time)
        assert row[turning_points.TURN_SLOPE] == pytest.approx(moved @ change, abs=1e-12)
        assert row[turning_points.TURN_TIME_SLOPE] == pytest.approx(time_slopes(time) @ change, abs=1e-12)


@pytest.mark.parametrize("row", np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.2, 0.1, -3.0]]), ids=["x", "p", "all"])
def test_along_the_direction_a_motion_ends_as_far_from_its_start(row: np.ndarray) -> None:
    ends, scale = expm(GENERATOR)[:2], np.array([2.0, 0.5])
    columns = np.column_stack([ends[:, :2] * scale[:, None] / scale, ends[:, 2] / FORCE * scale])
    direction = turning_points.Direction(np.empty((3, 3)), np.empty(3, np.int64), np.empty(3))
    assert turning_points.write_direction(columns, scale, row, direction)
    change = direction.change / np.append(scale, 1.0)
    later = expm(GENERATOR) @ (START + np.append(change[:2], 0.0)) + expm(GENERATOR)[:, 2] / FORCE * change[2]
    np.testing.assert_allclose(later[:2] - at(1.0)[:2], change[:2], rtol=0, atol=1e-12)
    assert row @ change == pytest.approx(1.0)


def test_where_neighbouring_motions_repeat_anyway_there_is_no_direction() -> None:
    direction = turning_points.Direction(np.empty((3, 3)), np.empty(3, np.int64), np.empty(3))
    assert not turning_points.write_direction(np.eye(2, 3), np.ones(2), np.array([1.0, 0.0, 0.0]), direction)


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
    times = turns[:, turning_points.TURN_TIME]
    behind = turns[[i for i in range(1, len(turns)) if times[i] == times[i - 1]]]
    for row, (time, is_maximum) in zip(behind, visits.items(), strict=True):
        assert row[turning_points.TURN_TIME] == pytest.approx(time, abs=1e-9)
        depth = at(time)[0] - LOWER if is_maximum else UPPER - at(time)[0]
        assert row[turning_points.TURN_DEPTH] == pytest.approx(depth, abs=1e-12)
        moved = slopes(time) if is_maximum else np.array([0.0, 0.0, CORNER_SHIFT]) - slopes(time)
        assert row[turning_points.TURN_SLOPE] == pytest.approx(moved.sum(), abs=1e-12)
        assert row[turning_points.TURN_TIME_SLOPE] == pytest.approx(time_slopes(time).sum(), abs=1e-12)


@pytest.mark.parametrize("crossed", [(), CROSSED], ids=["whole", "crossed"])
def test_an_approach_has_its_depth_and_what_the_gradient_gains_beyond(crossed: tuple[float, ...]) -> None:
    """The gain is -w C (k u + c A u), C the gradient over one period, u = (0, 1), k = 70 and c = 3."""
    parts = tables(crossed)
    common = SimpleNamespace(
        clearances=np.array([0]),
        inertia=np.ones(1),
        rows=np.ones((1, 1)),
        pace=np.ones(1),
        limits=np.ones(PERIOD + 1),
    )
    summit = max(turning_times(), key=lambda time: at(time)[0])
    approach = np.full(approaches.SLOPE + 6, np.nan)
    approach[approaches.TIME] = summit + 5e-3
    approaches.write_approach(
        common,
        parts["laws"],
        parts["regions"],
        parts["rates"],
        parts["steps"],
        parts["course"],
        parts["crossings"],
        np.array([0, 1]),
        parts["scale"],
        approach,
    )
    assert approach[approaches.TIME] == pytest.approx(summit, abs=1e-9)
    assert approach[approaches.DEPTH] == pytest.approx(at(summit)[0] - UPPER, abs=1e-12)
    assert approach[approaches.BEND] == pytest.approx((GENERATOR @ GENERATOR @ at(summit))[0], rel=1e-6)
    assert approach[[approaches.STIFFNESS, approaches.DAMPING]].tolist() == [70.0, 3.0]
    moved = slopes(summit) - np.array([0.0, 0.0, CORNER_SHIFT])
    np.testing.assert_allclose(approach[approaches.SLOPE : -3], moved, rtol=0, atol=1e-12)
    np.testing.assert_allclose(approach[-3:], time_slopes(summit), rtol=0, atol=1e-12)
    matrix, kick = GENERATOR[:2, :2], np.array([0.0, 1.0])
    gain = -(expm(matrix) @ (70.0 * kick + 3.0 * matrix @ kick))[0]
    assert approach[approaches.GAIN] == pytest.approx(gain, rel=1e-10)
