"""What the sweep promises of large drivelines: the tables' motion, a bounded neighbourhood, an audit that closes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.growth.plant import task, train

from gearrattle.engine.solvers import SOLVERS, scheme_choice, window_solver
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.window_solver import SweepMarch, plan_of
from gearrattle.engine.system.flow import flow_of
from gearrattle.engine.system.sparse_arrays import Majorant
from gearrattle.outcome import Outcome
from tests.engine.solvers.tasks import GAP, finished, oscillator
from tests.engine.solvers.tasks import task as small
from tests.oracles.compare import assert_exact
from tests.oracles.random_drivelines import FAMILIES, random_problem

QUICK = ("chain", "loop", "staged", "everything")
"""Of the families of random drivelines."""
SHAPES = pytest.mark.parametrize("shape", ["chain", "tree"])


@pytest.mark.compiled
@SHAPES
def test_a_long_train_moves_as_its_tables_say(shape):
    """Sixteen inertias over a period: crossings far apart as well as near."""
    whole = task(shape, 16, 1, samples=64)
    tables, swept = finished(ExactMarch(whole)), finished(SweepMarch(whole))
    assert len(swept.crossings.time) > 40
    assert np.array_equal(tables.crossings.clearance, swept.crossings.clearance)
    assert np.allclose(tables.crossings.time, swept.crossings.time, rtol=0, atol=1e-11)
    assert np.allclose(tables.deflection, swept.deflection, rtol=0, atol=1e-11 * np.abs(tables.deflection).max())


@SHAPES
def test_correcting_near_a_crossing_is_making_everything_afresh(monkeypatch, shape):
    """In a train far longer than a neighbourhood."""
    motions = []
    for most in (0, 1000):
        monkeypatch.setattr(window_solver, "MOST_CORRECTED", most)
        motions.append(finished(SweepMarch(task(shape, 64, 1, samples=8))))
    one, other = motions
    assert len(one.crossings.time) > 200
    assert np.array_equal(one.crossings.clearance, other.crossings.clearance)
    assert np.allclose(one.crossings.time, other.crossings.time, rtol=0, atol=1e-11)
    assert np.allclose(one.angle, other.angle, rtol=0, atol=1e-11 * np.abs(one.angle).max())


def test_a_neighbourhood_does_not_grow_with_the_train():
    sizes = [np.diff(plan_of(train("chain", n)).driveline.near.inertia_start).max() for n in (64, 128)]
    assert sizes[0] == sizes[1] < 32


@SHAPES
def test_the_bound_on_all_regions_is_above_every_rate_and_not_far(shape):
    system = train(shape, 8)
    bound, rng = Majorant(system).radius(), np.random.default_rng(1)
    flow = flow_of(system)
    actual = []
    for _ in range(20):
        pieces = tuple(int(rng.integers(law.pieces)) for law in system.laws)
        matrix = flow.generator(pieces)[: flow.states, : flow.states]
        actual.append(np.abs(np.linalg.eigvals(matrix)).max())
    stiffest = tuple(law.pieces - 1 for law in system.laws)
    actual.append(np.abs(np.linalg.eigvals(flow.generator(stiffest)[: flow.states, : flow.states])).max())
    assert max(actual) <= bound <= 1.3 * max(actual)


@SHAPES
def test_the_energy_audit_closes(shape):
    motion = finished(SweepMarch(task(shape, 32, 1, audit=True)))
    assert motion.energy is not None
    assert motion.energy.relative_residual < 1e-13
    assert motion.energy.element_loss.min() >= 0 < motion.energy.element_loss.max()


def test_the_audit_agrees_with_the_tables():
    values = replace(small(oscillator(GAP, drag=0.2, force=3.0), [0.9], [0.0], cycles=8), audit=True)
    tables, swept = finished(ExactMarch(values)).energy, finished(SweepMarch(values)).energy
    assert tables is not None
    assert swept is not None
    for name in ("torque_work", "drag_loss", "element_loss", "error_work"):
        assert np.allclose(getattr(tables, name), getattr(swept, name), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize(
    "family", [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in FAMILIES]
)
def test_against_fifty_digits(monkeypatch, family):
    monkeypatch.setattr(scheme_choice, "is_large", lambda _system: True)
    problem = random_problem(family, 0)
    assert_exact(problem.model, min(problem.cycles, 2), problem.samples_per_cycle)


def test_a_train_without_clearances():
    values = replace(small(oscillator(drag=0.2, force=3.0), [0.9], [0.0], cycles=8), audit=True)
    tables, swept = finished(ExactMarch(values)), finished(SweepMarch(values))
    assert len(swept.crossings.time) == 0
    assert np.allclose(tables.angle, swept.angle, rtol=0, atol=1e-13)


def test_the_choice():
    """Stiff and small: tables. Many clearances: the sweep."""
    assert isinstance(SOLVERS["exact"](task("chain", 4, 1)), ExactMarch)
    assert isinstance(SOLVERS["exact"](task("chain", 64, 1)), SweepMarch)


def test_an_unstable_motion_is_not_finite():
    """Anti-damping of 1e3 a period, from a displacement."""
    march = SweepMarch(small(oscillator(drag=-1000.0), [1.0], [0.0], cycles=10))
    while (outcome := march.advance()) is Outcome.SLICE_SPENT:
        pass
    assert outcome is Outcome.NON_FINITE
    assert march.position().time > 0
