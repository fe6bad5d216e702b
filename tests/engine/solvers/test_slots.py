"""Regions are remembered within a bound of memory; forgetting them changes no bit."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.solvers import region_slots
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.region_slots import slots_of
from gearrattle.engine.system import region_store
from tests.dense.case import Case
from tests.dense.families import seeded
from tests.engine.solvers.tasks import finished, same_bits


def case(family: str, seed: int) -> Case:
    return seeded(family, seed)


@pytest.mark.parametrize(("family", "seed"), [("chain", 1), ("loop", 2), ("everything", 1), ("error", 0)])
@pytest.mark.parametrize("most", [0, 100_000])
def test_a_tiny_bound_gives_the_same_bits(monkeypatch, family, seed, most):
    monkeypatch.setattr(region_store, "_SMALL", 0)
    monkeypatch.setattr(region_slots, "_KEPT", type(region_slots._KEPT)())
    free = ExactMarch(case(family, seed).task())
    motion = finished(free)
    assert len(free.slots.pieces) > 2
    monkeypatch.setattr(region_slots, "MOST_BYTES", most)
    monkeypatch.setattr(region_slots, "_KEPT", type(region_slots._KEPT)())
    bound = ExactMarch(case(family, seed).task())
    first = bound.slots
    again = finished(bound)
    assert bound.slots is not first
    assert len(bound.slots.pieces) < len(free.slots.pieces)
    same_bits(motion, again)


def test_a_run_under_way_keeps_the_slots_it_holds(monkeypatch):
    """A second run of one system forgets everything half way through the first; neither notices."""
    task = case("chain", 1).task()
    want = finished(ExactMarch(task))
    monkeypatch.setattr("gearrattle.engine.solvers.exact._BUDGET", 7)
    one = ExactMarch(task)
    for _ in range(10):
        one.advance()
    held = one.slots
    assert slots_of(task.system).renewed() is not held
    other = finished(ExactMarch(task))
    same_bits(want, finished(one))
    same_bits(want, other)
    assert np.isfinite(want.angle).all()


def test_the_regions_of_all_systems_share_a_bound(monkeypatch):
    monkeypatch.setattr(region_slots, "_KEPT", type(region_slots._KEPT)())
    systems = [case(family, 1).task().system for family in ("chain", "everything")]
    for system in systems:
        slots_of(system)
    assert len(region_slots._KEPT) == 2
    monkeypatch.setattr(region_slots, "MOST_BYTES", region_slots._bytes_kept() - 1)
    kept = slots_of(systems[0])
    assert [shelf.slots for shelf in region_slots._KEPT.values()] == [kept]
