"""Laws that every criterion of the table obeys."""

from __future__ import annotations

import dataclasses
import math

import pytest

from gearrattle.quantities.quantity import Quantity, Sums
from gearrattle.quantities.quantity_table import CRITERIA
from tests import synthetic
from tests.quantities.reading import evaluate
from tests.signals.handmade import chain, sine, trajectory

ids = [criterion.name for criterion in CRITERIA]


@pytest.mark.parametrize("criterion", CRITERIA, ids=ids)
@pytest.mark.parametrize("kind", synthetic.DEFLECTIONS)
def test_every_entry_tells_what_it_is_and_whence(criterion: Quantity[Sums], kind: str) -> None:
    motion = synthetic.trajectory(kind)
    entries = evaluate(criterion, motion)
    subjects = {*motion.layout.inertia_names, *motion.layout.element_names}
    assert entries
    for item in entries:
        assert item.name == criterion.name
        assert item.source == criterion.source
        assert item.subject in subjects
        assert item.quantity
        assert item.formula
        assert (item.unit == "") == isinstance(item.value, str)
        assert isinstance(item.value, str) or math.isfinite(item.value) or item.note


@pytest.mark.parametrize("criterion", CRITERIA, ids=ids)
def test_no_quantity_is_said_twice_of_one_subject(criterion: Quantity[Sums]) -> None:
    keys = [(item.subject, item.quantity) for item in evaluate(criterion, synthetic.trajectory())]
    assert len(keys) == len(set(keys))


@pytest.mark.parametrize("criterion", CRITERIA, ids=ids)
def test_criteria_are_frozen_and_name_themselves(criterion: Quantity[Sums]) -> None:
    assert dataclasses.is_dataclass(criterion)
    with pytest.raises(dataclasses.FrozenInstanceError):
        criterion.name = "other"
    assert criterion.title
    assert criterion.formula


def test_names_are_unique() -> None:
    assert len(set(ids)) == len(CRITERIA)


@pytest.mark.parametrize("criterion", CRITERIA, ids=ids)
def test_one_sample_a_cycle_and_one_cycle_do_not_fail(criterion: Quantity[Sums]) -> None:
    evaluate(criterion, trajectory(cycles=1, samples=1))
    evaluate(criterion, trajectory(cycles=20, samples=1))


@pytest.mark.parametrize("criterion", CRITERIA, ids=ids)
def test_what_happens_before_the_window_does_not_matter(criterion: Quantity[Sums]) -> None:
    rows = chain([0, 1, 0, -1, 0], [4.5, 4.6, 5.5, 5.6])
    early = chain([0, -1, 0, 1, 0], [0.1, 0.2, 0.3, 0.4])
    accelerations = (sine(3.0), sine(2.0, 2.0))
    base = trajectory(rows=rows, accelerations=accelerations, cycles=20, discard=4)
    other = trajectory(rows=early + rows, accelerations=accelerations, cycles=20, discard=4)
    other.acceleration[: 4 * 64] = 1e6
    assert evaluate(criterion, base) == evaluate(criterion, other)
