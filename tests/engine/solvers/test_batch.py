"""A batch gives the bits of one run after another, in order, for any number of threads; what fails is an outcome."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from gearrattle.engine.solvers import Motion, Task, slots
from gearrattle.engine.solvers.scheme_choice import is_large
from gearrattle.engine.solvers.variant_threads import march_all
from gearrattle.outcome import Outcome
from tests.dense.families import seeded
from tests.engine.solvers.tasks import oscillator, run, same_bits, task
from tests.engine.system.drivelines import clearance, linear

SEEDS = range(6)


def tasks() -> Iterator[Task]:
    """Yield drivelines of several sizes, in turn with one that a spring without damping drives out of all bounds."""
    for seed in SEEDS:
        yield seeded("chain", seed).task()
        yield seeded("everything", seed).task()


def whole(motion: Motion) -> Motion:
    return motion


@pytest.mark.parametrize("threads", [2, *(pytest.param(count, marks=pytest.mark.compiled) for count in (1, 5))])
def test_the_bits_are_those_of_single_runs_in_order(threads: int) -> None:
    ended = list(march_all(tasks(), whole, threads))
    assert [one.index for one in ended] == list(range(2 * len(SEEDS)))
    for one, own_task in zip(ended, tasks(), strict=True):
        assert one.outcome is Outcome.DONE
        assert one.kept is not None
        same_bits(run(own_task), one.kept)


def test_a_large_driveline_among_them_is_swept() -> None:
    problem = next(t for t in (seeded("everything", seed).task() for seed in range(200)) if is_large(t.system))
    (ended,) = march_all([problem], whole, 2)
    assert ended.kept is not None
    same_bits(run(problem), ended.kept)


def test_a_variant_that_cannot_be_built_is_an_outcome_among_the_others() -> None:
    good = task(oscillator(clearance(4.0, 0.2, 0.5), force=3.0), [0.9], [0.0], cycles=3)
    broken = replace(good, system=replace(good.system, inertia=np.array([1e-320])))
    endless = replace(good, velocity=np.array([np.nan]))
    ended = list(march_all([good, broken, endless, good], lambda motion: motion.steps, 2))
    assert [one.outcome is Outcome.DONE for one in ended] == [True, False, False, True]
    assert ended[1].outcome is Outcome.NON_FINITE
    assert ended[1].reason
    assert ended[2].outcome is Outcome.NON_FINITE
    assert ended[0].kept == ended[3].kept != 0


def test_a_failure_of_what_keeps_is_raised() -> None:
    def refuse(_: Motion) -> None:
        raise KeyError("no such criterion")

    problem = task(oscillator(linear(4.0, 0.1), force=1.0), [0.0], [0.0], cycles=2)
    for threads in (1, 2):
        with pytest.raises(KeyError, match="no such criterion"):
            list(march_all([problem], refuse, threads))


def test_few_variants_are_in_flight_and_none_reaches_the_shelf() -> None:
    problem = task(oscillator(clearance(4.0, 0.2, 0.5), force=3.0), [0.9], [0.0], cycles=2)
    drawn = 0
    systems = []
    before = list(slots._KEPT)

    def endless() -> Iterator[Task]:
        nonlocal drawn
        while True:
            drawn += 1
            system = replace(problem.system, drag=problem.system.drag + 1e-3 * drawn)
            systems.append(weakref.ref(system))
            yield replace(problem, system=system)

    ended = march_all(endless(), lambda motion: motion.steps, 2)
    gc.disable()
    try:
        for _ in range(60):
            next(ended)
    finally:
        gc.enable()
    assert drawn <= 60 + 2 * 4 + 1
    assert list(slots._KEPT) == before
    assert sum(system() is not None for system in systems) <= 30  # let go of at once, not when garbage is collected
    ended.close()
