"""Period numbers and orbits: maps whose periods are known, and sequences that have none."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals.strobe import apart, grouped, orbit_distances, period_number, room

RNG = np.random.default_rng(3)


def logistic(r: float, count: int, x: float = 0.3) -> np.ndarray:
    """x -> r x (1 - x), whose periods double at r = 3, 1 + sqrt 6, ... (R. M. May, Nature 261, 1976, 459)."""
    actual = []
    for _ in range(count):
        x = r * x * (1.0 - x)
        actual.append(x)
    return np.array(actual)[:, None]


@pytest.mark.parametrize(("r", "n"), [(2.9, 1), (3.2, 2), (3.44, 2), (3.5, 4), (3.55, 8), (3.566, 16), (3.9, 0)])
def test_the_period_of_the_logistic_map(r: float, n: int) -> None:
    assert period_number(logistic(r, 4000), 1e-9, 16) == n


def test_its_window_of_period_three() -> None:
    """1 + sqrt 8 < r < 3.8415: period three (May 1976)."""
    assert period_number(logistic(1.0 + np.sqrt(8.0) + 1e-3, 4000), 1e-9, 16) == 3


def test_what_does_not_repeat_has_no_period() -> None:
    k = np.arange(400.0)
    turning = np.column_stack([np.cos(k), np.sin(k)])  # quasi-periodic: one radian a period
    creeping = (1.0 + 1e-3) ** -k[:, None]  # 1e-3 a period at first
    assert period_number(turning, 1e-6, 16) == 0
    assert period_number(creeping, 1e-6, 16) == 0
    assert period_number(np.full((40, 2), np.nan), 1e-6, 16) == 0


def test_a_period_needs_to_be_seen_twice() -> None:
    points = np.tile(RNG.random((10, 2)), (4, 1))  # 40 points: the last 20 hold ten-periods twice
    assert period_number(points, 1e-12, 16) == 10
    assert period_number(points[:38], 1e-12, 16) == 0
    assert period_number(points, 1e-12, 9) == 0


def test_only_the_last_half_counts() -> None:
    points = np.concatenate([RNG.random((50, 1)), np.zeros((50, 1))])
    assert period_number(points, 1e-12, 16) == 1
    assert period_number(points[:-2], 1e-12, 16) == 0


def test_a_turned_orbit_is_the_same() -> None:
    orbit = RNG.random((5, 2))
    others = np.array([np.roll(orbit, turn, axis=0) for turn in range(5)] + [orbit[::-1]])
    distances = orbit_distances(others, orbit)
    assert np.all(distances[:5] == 0.0)
    assert distances[5] > 0.0


def test_orbits_of_different_length_are_compared_through_their_common_one() -> None:
    one, pair = np.array([[0.5]]), np.array([[0.4], [0.7]])
    assert apart(one, pair) == pytest.approx(0.2)
    assert apart(pair, np.tile(pair, (3, 1))) == 0.0


def test_groups_are_found_in_any_order_with_their_room() -> None:
    near = [np.array([[x]]) + 1e-5 * RNG.standard_normal((1, 1)) for x in RNG.permutation([0.0] * 6 + [1.0] * 3)]
    actual = grouped([*near, None, np.array([[0.0], [3.0]])], 1e-3)
    sizes = [int(np.count_nonzero(actual.label == g)) for g in range(3)]
    assert sizes == [6, 3, 1]
    assert actual.label[9] == -1
    assert actual.within < 1e-4
    standing = [near[i] for i in actual.first[:2]]
    assert room(standing, [0, 1]) == pytest.approx(1.0, abs=1e-4)
    assert room(standing, [0, 0]) == np.inf
    assert [actual.label[i] for i in actual.first] == [0, 1, 2]
