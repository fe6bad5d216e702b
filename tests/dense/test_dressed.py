"""``exact`` with more on board against the dense check: friction, clipped damping, alternation, records, run-ups.

A failure names family and seed: ``case = seeded(family, seed, MAKERS[family])``; ``check_dressed(case, run(case))``.
"""

from __future__ import annotations

import random

import numpy as np
import pytest

from tests.dense.auxiliaries import AUXILIARIES, dressed
from tests.dense.case import run
from tests.dense.dressed_judge import check_dressed
from tests.dense.dressed_plain import inside
from tests.dense.families import FAMILIES, random_case, seeded
from tests.dense.grazing import MAKERS as PLAIN
from tests.dense.judge import check
from tests.dense.modes import Modes
from tests.dense.plain import region_of
from tests.dense.signals import DRIVEN, PROMISED, SIGNALS, off, with_run_up
from tests.dense.test_attack import BLURRED

MAKERS = {**AUXILIARIES, **SIGNALS}
ALWAYS = range(2)
PARTS = range(3)
IN_A_PART = 100


def attack(family: str, seeds: range) -> None:
    """Check the cases of some seeds; fail with every fault, and if little happened or too much was allowed."""
    verdicts, faults = [], []
    for seed in seeds:
        case = seeded(family, seed, MAKERS[family])
        verdict = check_dressed(case, run(case))
        verdicts.append(verdict)
        faults += [f"{family} {seed}: {fault}" for fault in verdict.faults[:2]]
    assert not faults, "\n".join([f"{len(faults)} faults", *faults[:20]])
    assert sum(v.crossings for v in verdicts) > 4 * len(seeds)
    assert sum(v.blur > BLURRED for v in verdicts) <= max(1, len(seeds) // 10)


@pytest.mark.parametrize("family", MAKERS)
def test_every_switch_and_instant(family):
    attack(family, ALWAYS)


@pytest.mark.long
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("family", MAKERS)
def test_every_switch_and_instant_of_two_thousand(family, part):
    attack(family, range(part * IN_A_PART, (part + 1) * IN_A_PART))


@pytest.mark.parametrize("family", ["chain", "loop", "flight", "stages", "error", "graze-first"])
def test_with_nothing_on_board_both_checks_are_one(family):
    """The same matrices, from other formulas, and the same verdict."""
    case = seeded(family, 1, PLAIN[family])
    motion, bare = run(case), dressed(case)
    for pieces in {tuple(int(p) for p in row) for row in motion.piece}:
        of_all = np.zeros(len(case.laws), dtype=int)
        of_all[list(case.clearances)] = pieces
        plain = region_of(case, tuple(of_all))
        other = inside(bare, Modes(tuple(int(p) for p in of_all), (), (), ())).region
        np.testing.assert_allclose(other.matrix, plain.matrix, rtol=1e-14, atol=1e-15 * np.abs(plain.matrix).max())
        assert np.array_equal(other.lower, plain.lower)
        assert np.array_equal(other.upper, plain.upper)
    one, other = check(case, motion), check_dressed(bare, motion)
    assert one.faults == other.faults == []
    assert one.crossings == other.crossings


def test_all_that_can_switch_does_switch():
    """Sliders slip both ways and stick again, dampers are held both ways, stiffness comes and goes; in few seeds."""
    words: set[str] = set()
    for seed in range(12):
        case = seeded("all beside", seed, MAKERS["all beside"])
        passages, first = run(case).auxiliaries.passages, len(case.clearances)
        for watch, upward in zip(passages.watch, passages.upward, strict=True):
            c = int(watch) - first
            if c < 0:
                continue
            kind = "limiter" if c < 2 * len(case.clipped) else "slider"
            kind += f" {c % 2}" if kind == "limiter" else ""
            words.add("pairs" if c >= 2 * len(case.clipped) + len(case.sliders) else f"{kind} {int(upward)}")
    assert words == {"pairs", "slider 0", "slider 1", *(f"limiter {i} {up}" for i in range(2) for up in range(2))}


@pytest.mark.parametrize("seed", range(6))
def test_a_run_up_is_what_it_says(seed):
    """The polynomials the check takes for a run-up, against its sines in forty digits."""
    rng = random.Random(f"dense/run-up {seed}")
    case, ramp, sounds = with_run_up(random_case(rng.choice(DRIVEN), rng), rng)
    assert case.signals is not None
    assert off(case.signals, ramp, sounds, case.length * case.period) <= PROMISED


def test_families_know_their_cases():
    assert set(DRIVEN) <= set(FAMILIES)
    for family, make in MAKERS.items():
        one, other = seeded(family, 5, make), seeded(family, 5, make)
        assert one.system().auxiliaries or one.signals is not None
        assert np.array_equal(one.angle, other.angle)
        assert one.sliders == other.sliders
