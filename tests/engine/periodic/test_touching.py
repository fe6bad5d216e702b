"""The search for a grazing where motions cannot be followed, against the closed form of the motion without contact."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gearrattle.engine.periodic.events import grazing
from gearrattle.engine.periodic.events.grazing import Search
from gearrattle.engine.periodic.events.location import Stretch
from gearrattle.engine.periodic.events.pattern_changes import View
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.periodic_search import periodic
from gearrattle.orbits.value_family import follower_over
from tests.engine.periodic.test_grazing import DRAG, FREQUENCY, MEAN, PATH, oscillator

pytestmark = pytest.mark.compiled

GRAZING = (1.0 - MEAN) * abs(1.0 - FREQUENCY**2 + 1j * DRAG * FREQUENCY)
"""Amplitude at which the linear motion reaches the stop."""
ENDS, SHARE = (0.3, 0.335), 0.91474
"""Of the amplitude, and the share of the way between them at which the motion grazes."""
At = Callable[..., Point]


def search_with(monkeypatch: pytest.MonkeyPatch, at: Callable[[At], At], ends: tuple[float, float] = ENDS) -> Search:
    """The search between the ends of a branch, its motions followed by something else."""
    model = oscillator().with_({PATH: ends[0]})
    curve = follower_over(model, PATH, ends, 1, first=ends[0])
    begin = curve.begin(periodic(model).motion.start, ends[0], upward=ends[1] > ends[0])
    last = list(curve.follow(begin, min(ends), max(ends)))[-1]
    monkeypatch.setattr(Stretch, "at", at(Stretch.at))
    return Search(curve, begin, last, View())


def failing(refused: set[int], share: float = 1.0) -> Callable[[At], At]:
    """Motions of which some cannot be followed: by their number, or from a share of the way on."""

    def replaced(at: At) -> At:
        count = iter(range(10_000))

        def followed(self: Stretch, own: float, **options: Any) -> Point:
            if options.get("is_trial") and (next(count) in refused or own > share):
                raise ConvergenceError("Newton's method does not converge")
            return at(self, own, **options)

        return followed

    return replaced


@pytest.mark.parametrize("ends", [ENDS, ENDS[::-1]])
@pytest.mark.parametrize("refused", [set(), {0}, {1}, {2}, {0, 1}, {1, 2}, {0, 2, 4}])
def test_a_motion_that_cannot_be_followed_does_not_move_the_grazing(
    monkeypatch: pytest.MonkeyPatch, refused: set[int], ends: tuple[float, float]
) -> None:
    point, _ = search_with(monkeypatch, failing(refused), ends).grazing()
    assert point.parameter == pytest.approx(GRAZING, rel=0, abs=1e-10)


def test_where_no_motion_with_contact_can_be_followed_a_grazing_is_located(monkeypatch: pytest.MonkeyPatch) -> None:
    point, _ = search_with(monkeypatch, failing(set(), SHARE + 1e-3)).grazing()
    assert point.parameter == pytest.approx(GRAZING, rel=0, abs=1e-10)


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_where_no_motion_near_the_corner_can_be_followed_nothing_is_located(
    monkeypatch: pytest.MonkeyPatch, share: float
) -> None:
    with pytest.raises(ConvergenceError):
        search_with(monkeypatch, failing(set(), share)).grazing()


@pytest.mark.parametrize("most", [0, 1])
def test_a_search_that_ends_too_early_locates_nothing(monkeypatch: pytest.MonkeyPatch, most: int) -> None:
    monkeypatch.setattr(grazing, "_MOST", most)
    with pytest.raises(ConvergenceError, match="grazes"):
        search_with(monkeypatch, lambda at: at).grazing()
