"""Laws of sums over chunks: they are bounded, and give what the whole motion gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from gearrattle.quantities.evaluation import add, judge, verdict_of
from gearrattle.quantities.quantity import Quantity, Row, Sums
from gearrattle.quantities.quantity_table import CRITERIA
from gearrattle.signals import region_at
from gearrattle.trajectory import EventLog, Trajectory
from tests import synthetic
from tests.quantities.reading import evaluate
from tests.signals.handmade import chain, layout, sine, trajectory

ids = [criterion.name for criterion in CRITERIA]
CUTS = [(12,), (5, 12), (4, 6, 11, 12), tuple(range(1, 13))]
LAST_ONLY = "harmonic"
"""Quantities that are of the last cycles only, as their criterion says."""


def chunks(motion: Trajectory, ends: Sequence[int]) -> list[Trajectory]:
    """Cut a motion after these cycles. Force integrals at inner cuts are unknown: nobody may ask for them."""
    made, first = [], 0
    for end in ends:
        rows = slice(first * motion.samples_per_cycle, end * motion.samples_per_cycle + 1)
        a, b = motion.time[rows][0], motion.time[rows][-1]
        mine = (motion.events.time > a) & (motion.events.time <= b)
        regions = [region_at(motion, k, np.nextafter(a, np.inf)) for k in range(motion.layout.clearance.size)]
        sampled = ("time", "angle", "velocity", "acceleration", "deflection", "force", "region", "element_torque")
        made.append(
            replace(
                motion,
                **{name: getattr(motion, name)[rows] for name in sampled},
                events=EventLog(*(getattr(motion.events, name)[mine] for name in EventLog.__dataclass_fields__)),
                initial_region=np.array(regions, dtype=np.int64),
                final_force_integral=motion.final_force_integral * (1.0 if end == motion.cycles else np.nan),
                cycles=end - first,
                discard=min(max(motion.discard - first, 0), end - first),
                first_cycle=first,
            )
        )
        first = end
    return made


def sums_of(criterion: Quantity[Sums], motion: Trajectory, ends: Sequence[int]) -> Sums:
    sums: Sums | None = None
    for chunk in chunks(motion, ends):
        sums = add(chunk, sums, [criterion])
    assert sums is not None
    return sums


def same(have: Sequence[Row], want: Sequence[Row], last_only: str = LAST_ONLY) -> None:
    have, want = ([e for e in entries if last_only not in e.quantity] for entries in (have, want))
    for a, b in zip(have, want, strict=True):
        assert replace(a, value=0.0, error=0.0) == replace(b, value=0.0, error=0.0)
        assert a.error == pytest.approx(b.error, rel=1e-9, abs=1e-12, nan_ok=True)
        rounding = 1e-10 if b.unit == "rad/s^2" else 0.0  # of sums over accelerations of some thousand
        reported = b.value if isinstance(b.value, str) else pytest.approx(b.value, rel=1e-11, abs=rounding, nan_ok=True)
        assert a.value == reported


@pytest.mark.parametrize("ends", CUTS, ids=len)
@pytest.mark.parametrize("kind", synthetic.DEFLECTIONS)
@pytest.mark.parametrize("criterion", CRITERIA, ids=ids)
def test_chunks_give_what_the_whole_gives(criterion: Quantity[Sums], kind: str, ends: tuple[int, ...]) -> None:
    motion = synthetic.trajectory(kind, discard=3)
    same(criterion.rows(sums_of(criterion, motion, ends)), evaluate(criterion, motion))


@pytest.mark.parametrize("criterion", CRITERIA, ids=ids)
def test_every_criterion_says_how_it_merges(criterion: Quantity[Sums]) -> None:
    assert criterion.merging.startswith("exact: ")
    inexact = [e.quantity for e in evaluate(criterion, synthetic.trajectory()) if LAST_ONLY in e.quantity]
    assert bool(inexact) == ("only" in criterion.merging)


@pytest.mark.parametrize("criterion", CRITERIA, ids=ids)
def test_a_sum_does_not_grow_with_the_number_of_chunks(criterion: Quantity[Sums]) -> None:
    def size(cycles: int) -> int:
        motion = synthetic.trajectory(cycles=cycles, samples=16, discard=0)
        sums = sums_of(criterion, motion, range(4, cycles + 1, 4))
        return sum(array.nbytes for state in sums.states.values() for array in state.values())

    assert size(48) == size(24)


@pytest.mark.parametrize("criterion", CRITERIA, ids=ids)
def test_adding_leaves_the_sums_before_as_they_were(criterion: Quantity[Sums]) -> None:
    first, second = chunks(synthetic.trajectory(), (6, 12))
    before = add(first, None, [criterion])
    (state,) = before.states.values()
    copies = {name: array.copy() for name, array in state.items()}
    add(second, before, [criterion])
    assert all(np.array_equal(state[name], copy, equal_nan=True) for name, copy in copies.items())


def test_sums_survive_packing() -> None:
    motion = synthetic.trajectory()
    sums: Sums | None = None
    for chunk in chunks(motion, (5, 9, 12)):
        if sums is not None:
            sums = Sums.unpacked(sums.packed(), motion.layout, motion.cost.algorithm)
        sums = add(chunk, sums)
    assert sums is not None
    have, want = verdict_of(sums), judge(motion)
    same(have.entries, want.entries)
    assert (have.sentence, have.window) == (want.sentence, want.window)
    assert Sums.unpacked({}, motion.layout, "") is None


def test_a_contact_across_chunks_is_one_contact() -> None:
    closes = (3.25, 0, 1, 0, -1.0, 7.0)
    rows = [(0.5, 0, 0, 1, 1.0, 2.0), closes, (3.5, 0, 0, 1, 4.0, 7.5)]
    motion = trajectory(layout(period=1.0), rows, cycles=5, final=9.0)
    (impacts,) = (c for c in CRITERIA if c.name == "impacts")
    sums = sums_of(impacts, motion, (1, 2, 3, 4, 5))
    values = {row.quantity: row.value for row in impacts.rows(sums)}
    assert values["impacts per cycle"] == 2 / 5
    assert values["largest contact impulse"] == 5.0
    assert values["mean contact impulse"] == (5.0 + 1.5) / 2
    assert values["largest exchanged momentum"] == pytest.approx(4.0 / 0.0026)  # of the contact still open: m |v|
    assert values["mean exchanged momentum"] == pytest.approx((1.0 + 1.0 + 4.0) / 2 / 0.0026)
    assert values["largest approach speed"] == 4.0
    same(impacts.rows(sums), evaluate(impacts, motion))


def test_one_side_in_one_chunk_and_the_other_in_another_are_both_sides() -> None:
    rows = chain([0, 1, 0, -1, 0], [0.5, 0.6, 2.5, 2.6])
    motion = trajectory(layout(period=1.0), rows, cycles=4)
    first, second = chunks(motion, (2, 4))
    assert [judge(c).verdict for c in (first, second)] == ["single-sided", "single-sided"]
    assert verdict_of(add(second, add(first))).verdict == "double-sided"


def test_harmonics_of_the_last_cycles_say_so() -> None:
    motion = trajectory(accelerations=(sine(3.0), sine(2.0, 2.0)), cycles=30)
    (spectrum,) = (c for c in CRITERIA if c.name == "spectrum")
    notes = {e.note for e in spectrum.rows(sums_of(spectrum, motion, (20, 30))) if "present" in e.quantity}
    assert notes == {"super- and sub-harmonics are sought in the last 20 of 30 cycles only"}
    assert {e.note for e in evaluate(spectrum, motion) if "present" in e.quantity} == {""}
