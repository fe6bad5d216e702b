"""Eigenvalues, R_lambda and its class; what scaling changes and what it cannot."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.analysis.linear.condition_number import balanced, condition, conditions, jacobian
from gearrattle.analysis.linear.linear_modes import modes
from gearrattle.analysis.linear.stiffness_ratio import eigenvalues, rigid_motions, stiffness_class
from tests.engine.system.drivelines import random_chain


def slopes(system, last: bool = True) -> tuple[np.ndarray, np.ndarray]:
    piece = -1 if last else 0
    return np.array([law.stiffness[piece] for law in system.laws]), np.array(
        [law.damping[piece] for law in system.laws]
    )


@pytest.mark.parametrize("seed", range(30))
def test_eigenvalues_are_those_of_the_plain_jacobian(seed: int) -> None:
    system = random_chain(seed)
    stiffness, damping = slopes(system)
    actual = eigenvalues(system, stiffness, damping)
    plain = np.linalg.eigvals(jacobian(system, stiffness, damping, np.ones(system.size)))
    every = np.concatenate([actual.elastic, actual.rigid])
    assert every.size == 2 * system.size
    assert actual.rigid.size == 2 * rigid_motions(system, stiffness)
    scale = np.abs(plain).max()
    for value in plain:
        assert np.abs(every - value).min() < 1e-7 * scale


@pytest.mark.parametrize("seed", range(20))
def test_without_damping_they_are_the_modes(seed: int) -> None:
    system = random_chain(seed)
    stiffness, nothing = slopes(system)[0], np.zeros(len(system.laws))
    undamped = type(system)(system.inertia, np.zeros(system.size), system.rows, system.laws, system.inputs)
    actual = eigenvalues(undamped, stiffness, nothing)
    elastic = modes(undamped, stiffness, nothing).frequencies[rigid_motions(undamped, stiffness) :]
    assert np.abs(actual.elastic)[::2] == pytest.approx(elastic, rel=1e-8, abs=1e-10 * elastic.max())
    assert np.abs(actual.rigid).max(initial=0.0) < 1e-9 * elastic.max()


@pytest.mark.parametrize("seed", range(30))
def test_units_do_not_change_r_lambda_but_the_condition(seed: int) -> None:
    system, rng = random_chain(seed), np.random.default_rng(seed)
    stiffness, damping = slopes(system)
    unit, frequency = 2.0 ** rng.integers(-6, 6, system.size), 2.0**7
    plain = np.sort_complex(np.linalg.eigvals(jacobian(system, stiffness, damping, np.ones(system.size))))
    scaled = np.sort_complex(frequency * np.linalg.eigvals(jacobian(system, stiffness, damping, unit, frequency)))
    assert np.abs(plain - scaled).max() < 1e-6 * np.abs(plain).max()


@pytest.mark.parametrize("seed", range(10))
def test_balancing_is_a_similarity_and_does_not_harm(seed: int) -> None:
    system = random_chain(seed)
    matrix = jacobian(system, *slopes(system), np.ones(system.size))
    actual, scale = balanced(matrix)
    assert np.diag(scale) @ matrix @ np.diag(1.0 / scale) == pytest.approx(actual, rel=1e-15)
    rigid = rigid_motions(system, slopes(system)[0])
    assert condition(actual, rigid) <= condition(matrix, rigid)


def test_condition_leaves_the_rigid_angle_out() -> None:
    system = next(s for s in map(random_chain, range(100)) if rigid_motions(s, slopes(s)[0]) == 1)
    actual = conditions(system, *slopes(system), {"plain": (np.ones(system.size), 1.0)})
    assert list(actual) == ["plain", "balanced"]
    assert 1.0 < actual["balanced"] < actual["plain"] < 1e15


@pytest.mark.parametrize(
    ("ratio", "name"),
    [
        (1.0, "mild"),
        (99.0, "mild"),
        (999.0, "mild"),
        (1e3, "strong"),
        (9e5, "strong"),
        (1e6, "extreme"),
        (9e8, "extreme"),
        (1e9, "pathological"),
        (1e20, "pathological"),
        (float("nan"), "rigid"),
    ],
)
def test_classes_have_no_gaps(ratio: float, name: str) -> None:
    assert stiffness_class(ratio) == name


def test_a_heavily_dragged_train_keeps_its_slow_elastic_eigenvalue() -> None:
    """The rigid pair is told by its shape, not by being the smallest."""
    system = random_chain(3)
    two = type(system)(
        np.array([1.0, 1.0]), np.array([5.0, 5.0]), np.array([[1.0, -1.0]]), system.laws[:1], system.inputs
    )
    actual = eigenvalues(two, np.array([1.0]), np.array([0.0]))
    assert actual.rigid.real == pytest.approx([0.0, -5.0])
    assert np.sort(actual.elastic.real) == pytest.approx(np.sort(np.roots([1.0, 5.0, 2.0])))
