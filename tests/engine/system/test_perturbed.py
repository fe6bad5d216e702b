"""Perturbations carried without tables: the same gradient, and its growth from a few of them."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.system import perturbation_growth as tabled
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.perturbation_growth import Variation, variation
from gearrattle.engine.system.perturbations import Perturbed
from tests.engine.solvers.tasks import oscillator, run, task
from tests.engine.system.drivelines import clearance, random_chain
from tests.oracles.dressed import dressed_problem


def both(system, angle, velocity, cycles: int) -> tuple[Variation, Perturbed]:
    problem = task(system, list(angle), list(velocity), cycles=cycles)
    march, log = ExactMarch(problem), run(problem).crossings
    upward = (log.to_piece > log.from_piece).astype(np.int64)
    passages = Passages(log.time, log.clearance, upward, log.velocity, np.zeros((len(log.time), 0)))
    start, end = march.slots.pieces[march.march.counts[1]], cycles * system.inputs.period
    dense = variation(march.flow, start, passages, end=end)
    sparse = variation(march.flow, start, passages, end=end, most_tables=0)
    assert isinstance(dense, Variation)
    assert isinstance(sparse, Perturbed)
    return dense, sparse


def hold_equal(dense: Variation, sparse: Perturbed) -> None:
    np.testing.assert_array_equal(dense.time, sparse.time)
    eye = np.eye(len(dense.scale))
    for i, segment in enumerate(dense.segments):
        assert np.abs(sparse.carried(i, eye) - segment).max() <= 1e-11 * max(1.0, np.abs(segment).max())


@pytest.mark.parametrize("seed", range(12))
def test_segments_are_those_of_the_tables(seed: int) -> None:
    system, rng = random_chain(seed), np.random.default_rng(seed)
    largest = np.array([np.abs(law.corners).max(initial=0.0) for law in system.laws])
    coordinates = ExactMarch(task(system, [0.0] * system.size, [0.0] * system.size, cycles=1)).flow.coordinates
    deflection = rng.uniform(0.3, 1.6, len(coordinates.elements)) * largest[list(coordinates.elements)]
    hold_equal(*both(system, coordinates.angle_from_basis @ deflection, rng.normal(size=system.size), 2))


@pytest.mark.parametrize(("family", "seed"), [("chain", 0), ("staged", 1), ("tree", 1), ("mesh", 0), ("staged", 3)])
def test_segments_are_those_of_the_tables_with_sliders_and_limits(
    family: str, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = dressed_problem(family, seed).model
    start = {"angle": [float(x) for x in model.angle], "velocity": [float(x) for x in model.velocity]}
    motion = gr.simulate(gr.loads(model.toml()), cycles=1, samples_per_cycle=8, discard=0, initial=start, audit=False)
    dense = motion.variation
    again = gr.simulate(gr.loads(model.toml()), cycles=1, samples_per_cycle=8, discard=0, initial=start, audit=False)
    monkeypatch.setattr(tabled.variation, "__kwdefaults__", {"most_tables": 0})
    assert isinstance(again.variation, Perturbed)
    hold_equal(dense, again.variation)


def test_growth_from_random_sums_is_that_of_the_gradient() -> None:
    """No later than the largest of ``periods`` beginnings reaches half the growth, no earlier than their sum may."""
    system, periods = oscillator(clearance(400.0, 0.2, 0.05), drag=0.05, force=5.0), 400
    dense, sparse = both(system, np.array([0.2]), np.array([0.0]), periods)
    for growth in (1e3, 1e5, 1e7, 1e9):
        assert dense.horizon(0.5 * growth / np.sqrt(periods)) <= sparse.horizon(growth) <= dense.horizon(2.0 * growth)
    assert sparse.horizon(1e7) == pytest.approx(dense.horizon(1e7), rel=0.05)
    assert sparse.largest_exponent(100.0) == pytest.approx(dense.largest_exponent(100.0), rel=0.01)


def test_a_quiet_linear_motion_has_no_horizon() -> None:
    dense, sparse = both(oscillator(drag=0.1), np.array([1.0]), np.array([0.0]), 50)
    assert dense.horizon(1e3) == sparse.horizon(1e3) == float("inf")
    assert sparse.largest_exponent() == pytest.approx(-0.05, rel=0.05)
