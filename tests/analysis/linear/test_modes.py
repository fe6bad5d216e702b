"""Modes against closed forms, and what makes them modes."""

import numpy as np
import pytest

from gearrattle.analysis.linear.linear_modes import modes
from gearrattle.engine.system.piecewise import PiecewiseSystem
from tests.engine.system.drivelines import inputs, linear, random_chain


def chain(inertia: list[float], stiffness: list[float]) -> PiecewiseSystem:
    size = len(inertia)
    rows = np.array([np.eye(size)[i] - np.eye(size)[i + 1] for i in range(len(stiffness))]).reshape(-1, size)
    laws = tuple(linear(k) for k in stiffness)
    return PiecewiseSystem(np.array(inertia), np.zeros(size), rows, laws, inputs(size, len(stiffness)))


def test_two_inertias_on_a_shaft() -> None:
    data = modes(chain([0.25, 0.04], [1800.0]), np.array([1800.0]), np.array([0.0]))
    assert data.frequencies[0] == 0.0
    assert data.frequencies[1] == pytest.approx(np.sqrt(1800.0 * (1 / 0.25 + 1 / 0.04)), rel=1e-14)
    assert np.isnan(data.damping_ratios[0])
    assert data.shapes[:, 0] == pytest.approx([1.0, 1.0])
    assert data.shapes[:, 1] == pytest.approx([-0.04 / 0.25, 1.0])


def test_damping_ratio_of_proportional_damping_is_exact() -> None:
    system = chain([0.25, 0.04], [1800.0])
    ratio = modes(system, np.array([1800.0]), np.array([1.2])).damping_ratios[1]
    omega = np.sqrt(1800.0 * 29.0)
    assert ratio == pytest.approx(1.2 * 29.0 / (2 * omega), rel=1e-14)


def test_open_gaps_leave_as_many_rigid_motions_as_there_are_parts() -> None:
    system = chain([1.0, 2.0, 3.0, 4.0], [10.0, 20.0, 30.0])
    data = modes(system, np.array([10.0, 0.0, 0.0]), np.zeros(3))
    assert data.frequencies[:3].tolist() == [0.0, 0.0, 0.0]
    assert data.frequencies[3] == pytest.approx(np.sqrt(15.0), rel=1e-14)


def test_a_soft_mode_beside_a_stiff_one_keeps_its_digits() -> None:
    data = modes(chain([1.0, 1.0, 1.0], [1e-6, 1e12]), np.array([1e-6, 1e12]), np.zeros(2))
    assert data.frequencies[0] == 0.0
    assert data.frequencies[1] == pytest.approx(np.sqrt(1e-6 * 1.5), rel=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_modes_diagonalise_mass_and_stiffness(seed: int) -> None:
    system = random_chain(seed)
    stiffness = np.array([law.stiffness[-1] for law in system.laws])
    data = modes(system, stiffness, np.zeros(len(stiffness)))
    mass = data.shapes.T @ (system.inertia[:, None] * data.shapes)
    scale = np.sqrt(np.outer(mass.diagonal(), mass.diagonal()))
    assert np.abs(mass - np.diag(mass.diagonal())).max() <= 1e-10 * scale.max()
    energy = data.shapes.T @ (system.rows.T * stiffness) @ system.rows @ data.shapes
    want = data.frequencies**2 * mass.diagonal()
    assert energy.diagonal() == pytest.approx(want, rel=1e-9, abs=1e-9 * want.max())
