"""Cutting the power while results are written leaves the old or the new, or a resumed computation mends it."""

from __future__ import annotations

import sys

import pytest

from gearrattle import writing
from tests.reliability.power import Scene, cuts, scenes

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="what is flushed is told by /proc")


@pytest.fixture(scope="module")
def written() -> list[Scene]:
    return scenes()


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 10])
def test_power_cuts_in_every_scene_leave_nothing_corrupt(written: list[Scene], count: int) -> None:
    assert [(scene.name, cuts(scene, count, seed)) for seed, scene in enumerate(written)] == [
        (scene.name, []) for scene in written
    ]


@pytest.mark.long
def test_without_flushing_the_cuts_are_noticed(written: list[Scene], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing, "flush", lambda _: None)
    assert [bool(cuts(scene, 40, 0)) for scene in written[:3]] == [True, True, True]
