"""``exact`` against the dense check: sixty systems always, ten thousand when asked, and whatever hypothesis thinks of.

A failure names family and seed: ``case = seeded(family, seed, MAKERS[family])``, then ``check(case, run(case))``.
"""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.dense.case import run
from tests.dense.families import seeded
from tests.dense.grazing import MAKERS
from tests.dense.judge import Verdict, check

ALWAYS = range(3)
PARTS = range(5)
IN_A_PART = 100
BLURRED = 1e-7
"""Of a clearance's scale. A check that allows more is blunt; that few are is itself checked."""


def attack(family: str, seeds: range) -> list[Verdict]:
    """Check the cases of some seeds; fail with every fault, and if nothing was crossed or too much allowed."""
    verdicts, faults = [], []
    for seed in seeds:
        case = seeded(family, seed, MAKERS[family])
        verdict = check(case, run(case))
        verdicts.append(verdict)
        faults += [f"{family} {seed}: {fault}" for fault in verdict.faults[:2]]
    assert not faults, "\n".join([f"{len(faults)} faults", *faults[:20]])
    assert sum(v.crossings for v in verdicts) > len(seeds)
    assert sum(v.blur > BLURRED for v in verdicts) <= max(1, len(seeds) // 10)
    return verdicts


@pytest.mark.parametrize("family", MAKERS)
def test_every_crossing_and_instant(family):
    attack(family, ALWAYS)


@pytest.mark.long
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("family", MAKERS)
def test_every_crossing_and_instant_of_ten_thousand(family, part):
    attack(family, range(part * IN_A_PART, (part + 1) * IN_A_PART))


@pytest.mark.long
@settings(max_examples=50)
@given(family=st.sampled_from(sorted(MAKERS)), rng=st.randoms(use_true_random=False))
def test_whatever_the_numbers(family, rng):
    case = MAKERS[family](family, rng)
    verdict = check(case, run(case))
    assert not verdict.faults, "\n".join([repr(case), *verdict.faults[:5]])
