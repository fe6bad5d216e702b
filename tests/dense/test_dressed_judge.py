"""The dense check of dressed drivelines can fail: falsified switches, stretches, ticks and physics are reported."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

from gearrattle.engine.solvers import Motion
from gearrattle.engine.system.crossings_in_order import Passages
from tests.dense.case import run
from tests.dense.dressed import Dressed
from tests.dense.dressed_judge import check_dressed
from tests.dense.families import seeded
from tests.dense.test_dressed import MAKERS

SEEDS = range(3)
SHIFT = 1e-6
"""Of the period."""


@cache
def cases(family: str) -> tuple[tuple[Dressed, Motion], ...]:
    """Cases of a family and their motions, sound to begin with."""
    made = []
    for seed in SEEDS:
        case = seeded(family, seed, MAKERS[family])
        motion = run(case)
        assert not check_dressed(case, motion).faults
        made.append((case, motion))
    return tuple(made)


def kinds(case: Dressed, motion: Motion) -> set[str]:
    """What kinds of fault are found."""
    return {fault.split(":")[0] for fault in check_dressed(case, motion).faults}


def with_passages(motion: Motion, passages: Passages) -> Motion:
    return replace(motion, auxiliaries=replace(motion.auxiliaries, passages=passages))


def without(passages: Passages, *entries: int) -> Passages:
    """The log without some entries."""
    return Passages(*(np.delete(getattr(passages, f.name), entries, axis=0) for f in fields(Passages)))


def entries_of(case: Dressed, motion: Motion, part: str) -> list[int]:
    """Entries of the log that are about limiters, sliders or pairs; five of them at most."""
    first = len(case.clearances)
    ends = np.cumsum([first, 2 * len(case.clipped), len(case.sliders), len(case.pairs)])
    i = ("limiters", "sliders", "pairs").index(part)
    watch = motion.auxiliaries.passages.watch
    actual = np.flatnonzero((watch >= ends[i]) & (watch < ends[i + 1]))
    return [int(actual[j]) for j in sorted({int(x) for x in np.linspace(0, len(actual) - 1, 5)})] if len(actual) else []


parts = pytest.mark.parametrize(
    ("family", "part"),
    [
        ("friction", "sliders"),
        ("clipped", "limiters"),
        ("alternating", "pairs"),
        pytest.param("all beside", "sliders", marks=pytest.mark.long),
        pytest.param("all on board", "sliders", marks=pytest.mark.long),
    ],
)


@parts
def test_a_missing_switch_is_reported(family, part):
    tried = 0
    for case, motion in cases(family):
        for e in entries_of(case, motion, part):
            assert kinds(case, with_passages(motion, without(motion.auxiliaries.passages, e)))
            tried += 1
    assert tried > 3


@parts
def test_a_moved_switch_is_reported(family, part):
    tried = 0
    for case, motion in cases(family):
        passages = motion.auxiliaries.passages
        for e in entries_of(case, motion, part):
            time = passages.time.copy()
            time[e] += SHIFT * case.period
            after = passages.time[e + 1] if e + 1 < len(time) else case.length * case.period
            if time[e] >= after:
                continue
            actual = kinds(case, with_passages(motion, replace(passages, time=time)))
            assert ("tick" if part == "pairs" else "on the corner") in actual
            tried += 1
    assert tried > 3


def test_a_brief_slip_left_out_carries_more_than_the_limit():
    """Slip and stick again taken from the log: only the stretch can tell."""
    tried = 0
    for case, motion in cases("friction"):
        passages, first = motion.auxiliaries.passages, len(case.clearances) + 2 * len(case.clipped)
        for e in entries_of(case, motion, "sliders"):
            later = [f for f in range(e + 1, len(passages.time)) if passages.watch[f] == passages.watch[e]]
            begins = motion.auxiliaries.initial[passages.watch[e] - len(case.clearances)] == 0
            begins &= not np.any(passages.watch[:e] == passages.watch[e])  # the first slip of a slider that sticks
            owner = case.sliders[passages.watch[e] - first].element
            moved = [
                g
                for g in range(e)
                if passages.watch[g] < len(case.clearances) and case.clearances[passages.watch[g]] == owner
            ]
            if later and begins and not moved:
                assert "slider" in kinds(case, with_passages(motion, without(passages, e, later[0])))
                tried += 1
    assert tried > 0


def test_another_limit_is_reported():
    """A reach that is smaller by 1e-8: every slider that slips carries too much."""
    for case, motion in cases("friction"):
        less = tuple(replace(slider, limit=slider.limit * (1 - 1e-8)) for slider in case.sliders)
        assert kinds(replace(case, sliders=less), motion) & {"slider", "on the corner"} or not entries_of(
            case, motion, "sliders"
        )


def test_a_falsified_stretch_is_reported():
    tried = 0
    for case, motion in cases("friction"):
        memory = motion.auxiliaries.memory.copy()
        j, i = np.unravel_index(np.argmax(np.abs(memory[1:])), memory[1:].shape)
        if memory[j + 1, i] != 0.0:
            memory[j + 1, i] *= 1 + 1e-7
            assert "stretch" in kinds(case, replace(motion, auxiliaries=replace(motion.auxiliaries, memory=memory)))
            tried += 1
    assert tried > 0


def test_a_tick_invented_or_in_two_parts_is_reported():
    for case, motion in cases("alternating"):
        passages = motion.auxiliaries.passages
        (e, *_) = entries_of(case, motion, "pairs")
        twice = Passages(
            *(
                np.insert(getattr(passages, f.name), [e, e], getattr(passages, f.name)[[e]], axis=0)
                for f in fields(Passages)
            )
        )
        assert "tick" in kinds(case, with_passages(motion, twice))


def test_slightly_wrong_alternation_or_polynomials_are_reported():
    for case, motion in cases("alternating"):
        more = tuple(replace(pair, lacking=pair.lacking * (1 - 1e-7)) for pair in case.pairs)
        assert kinds(replace(case, pairs=more), motion)
    for family in ("records", "run-up"):
        for case, motion in cases(family):
            changed = replace(case.signals, coefficients=case.signals.coefficients * (1 + 1e-8))
            assert kinds(replace(case, signals=changed), motion)
