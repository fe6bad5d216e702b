"""Laws over the whole shelf: every reduction gives a basis that serves every contact state."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.analysis.linear.matrices import frequencies_of, linearised
from gearrattle.analysis.linear.response import accelerance
from gearrattle.assembly import assemble
from gearrattle.reductions import REDUCTIONS, Request, accuracy
from gearrattle.reductions.states import contact_states
from tests.reductions.drivelines import random_driveline

SEEDS = [*range(5), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(5, 12))]


def asked(seed: int, factor: float = 1.2) -> Request:
    system = assemble(random_driveline(seed)).system
    full = linearised(system, *contact_states(system, ())[0][:2]).frequencies()
    elastic = full[full > 0.0]
    return Request(system, factor * float(elastic[min(seed % 3, elastic.size - 1)]), 2.0, system.clearances, (0,))


@pytest.mark.parametrize("name", REDUCTIONS)
@pytest.mark.parametrize("seed", SEEDS)
def test_every_basis_has_full_rank_holds_rigid_motions_and_bounds_frequencies_from_above(name: str, seed: int) -> None:
    request = asked(seed)
    actual = REDUCTIONS[name](request)
    basis = actual.basis
    assert len(actual.coordinates) == actual.size == np.linalg.matrix_rank(basis) <= request.system.size
    for j, i in enumerate(actual.coordinates):
        if i >= 0 and name != "modal":
            assert basis[i, j] == 1.0
            assert np.count_nonzero(basis[i]) == 1
    for state in contact_states(request.system, request.clearances):
        linear = linearised(request.system, state.stiffness, state.damping)
        full, less = linear.frequencies(), linear.within(basis).frequencies()
        assert np.count_nonzero(full == 0.0) == np.count_nonzero(less == 0.0)
        assert np.all(less >= full[: less.size] * (1 - 1e-7) - 1e-9 * full.max())


@pytest.mark.parametrize("name", ["craig-bampton", "modal"])
@pytest.mark.parametrize("seed", SEEDS)
def test_component_modes_converge_with_the_margin(name: str, seed: int) -> None:
    request = asked(seed)
    wide = Request(request.system, request.up_to, 1e6, request.kept, request.driven)
    exact = accuracy(wide, REDUCTIONS[name](wide).basis, (0,))
    assert exact.frequency_error < 1e-8
    assert exact.response_error_peak < 1e-6
    near = accuracy(request, REDUCTIONS[name](request).basis, (0,))
    assert near.frequency_error < 0.05


@pytest.mark.parametrize("seed", SEEDS)
def test_frequencies_of_many_states_are_those_of_one_at_a_time(seed: int) -> None:
    request = asked(seed)
    states, basis = contact_states(request.system, request.clearances), REDUCTIONS["craig-bampton"](request).basis
    together = frequencies_of(request.system, np.array([state.stiffness for state in states]), basis)
    assert together.shape == (len(states), basis.shape[1])
    for state, omega in zip(states, together, strict=True):
        alone = linearised(request.system, state.stiffness, state.damping).within(basis).frequencies()
        np.testing.assert_allclose(omega, alone, rtol=1e-9, atol=1e-9 * alone.max(initial=0.0))


def test_guyan_is_exact_at_rest_and_its_error_is_of_second_order() -> None:
    request = asked(2)
    basis = REDUCTIONS["guyan"](request).basis
    linear = request.without_clearances()
    masters = list(request.masters())
    others = [i for i in range(request.system.size) if i not in masters]
    assert others
    K = linear.stiffness
    # nothing acts on the slaves at rest
    assert np.abs((K @ basis)[others]).max() <= 1e-9 * np.abs(K).max() * np.abs(basis).max()


def test_accelerance_of_one_body_on_a_spring() -> None:
    model = gr.loads("""
        schema = 1
        excitation.speed = 10
        inertia = [{ name = "a", J = 2.0 }]
        coupling = [{ name = "spring", between = ["a", "ground"], stiffness = 50.0, damping = 0.7 }]
        """)
    system = assemble(model).system
    linear = linearised(system, *contact_states(system, ())[0][:2])
    omega = np.array([0.1, 4.9, 5.0, 40.0])
    expected = -(omega**2) / (50 - 2 * omega**2 + 0.7j * omega)
    assert accelerance(linear, omega, np.ones(1), np.eye(1))[:, 0] == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("name", REDUCTIONS)
def test_condense_gives_matrices_whose_frequencies_are_those_it_says(name: str) -> None:
    model = random_driveline(5)
    band = 1.1 * float(gr.modes(model).frequencies[1]) / (2 * pi)
    actual = gr.condense(model, band, method=name, limit=0.2)
    values = np.linalg.eigvals(np.linalg.solve(actual.mass, actual.stiffness))
    assert np.sqrt(np.abs(np.sort(values.real))) == pytest.approx(actual.frequencies(), rel=1e-5, abs=1e-2)
    gap = actual.clearances[0]
    inside = (full := gr.modes(model, contact_ratio={gap: 0.3}).frequencies)[full <= 2 * pi * band]
    assert actual.frequencies({gap: 0.3})[: inside.size] == pytest.approx(
        inside, rel=actual.error.frequency * 1.5 + 1e-9
    )


def test_condense_refuses() -> None:
    model = random_driveline(5)
    with pytest.raises(gr.ModelError, match=r"method: found \"guian\"; must be one of .*did you mean \"guyan\""):
        gr.condense(model, 5.0, method="guian")
    with pytest.raises(gr.ModelError, match="there is no such element"):
        gr.condense(model, 5.0).frequencies({"nothing": 0.5})
