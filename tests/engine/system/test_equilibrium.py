"""Static equilibrium: hand-solved drivelines, and the balance itself on random ones."""

import numpy as np
import pytest

from gearrattle.engine.system.equilibrium import Runaway, equilibrium
from gearrattle.engine.system.law import Stage, staged
from gearrattle.engine.system.piecewise import PiecewiseSystem
from tests.engine.system.drivelines import clearance, inputs, linear, random_chain


def chain(laws: list, mean: list[float], inertia: list[float] | None = None) -> PiecewiseSystem:
    size = len(mean)
    rows = np.array([np.eye(size)[i] - np.eye(size)[i + 1] for i in range(len(laws))])
    return PiecewiseSystem(
        np.array(inertia or [1.0] * size),
        np.zeros(size),
        rows,
        tuple(laws),
        inputs(size, len(laws), mean=np.array(mean)),
    )


def test_a_loaded_gap_rests_against_its_flank_and_the_last_inertia_of_a_free_train_is_at_zero() -> None:
    rest = equilibrium(chain([clearance(100.0, 0.0, 0.2), linear(50.0)], [6.0, 0.0, -6.0]))
    assert rest.deflection == pytest.approx([0.26, 0.12], rel=1e-14)
    assert rest.angle == pytest.approx([0.38, 0.12, 0.0], rel=1e-14, abs=1e-16)
    assert rest.pieces == (2, 0)
    assert not rest.acceleration.any()


def test_a_gap_without_load_is_taken_at_its_middle_and_named() -> None:
    coast = [Stage(0.0, 0.0, 0.1), Stage(9.0, 0.0, None)]
    drive = [Stage(0.0, 0.0, 0.3), Stage(9.0, 0.0, None)]
    rest = equilibrium(chain([linear(50.0), staged(drive, coast)], [3.0, -3.0, 0.0]))
    assert rest.deflection == pytest.approx([0.06, 0.1], rel=1e-13)
    assert rest.middled == (1,)


def test_a_load_below_1e12_of_the_means_counts_as_zero_one_above_does_not() -> None:
    for load, side in ((5e-13, 0.0), (1e-10, 0.2)):
        rest = equilibrium(chain([linear(50.0), clearance(100.0, 0.0, 0.2)], [1.0, -1.0 + load, -load]))
        assert rest.deflection[1] == pytest.approx(side, rel=1e-9, abs=1e-15)


def test_means_that_do_not_balance_accelerate_the_train_uniformly() -> None:
    rest = equilibrium(chain([linear(10.0)], [8.0, 0.0], [1.0, 3.0]))
    assert rest.acceleration == pytest.approx([2.0, 2.0])
    assert rest.deflection == pytest.approx([0.6])  # the spring accelerates 3 kg m^2 by 2 rad/s^2


def test_a_load_beyond_what_a_last_slope_of_zero_carries_is_a_runaway_that_is_named() -> None:
    soft = staged([Stage(10.0, 0.0, 0.5), Stage(0.0, 0.0, None)], [Stage(10.0, 0.0, 0.5), Stage(0.0, 0.0, None)])
    assert equilibrium(chain([linear(50.0), soft], [4.0, 0.0, -4.0])).deflection[1] == pytest.approx(0.4)
    with pytest.raises(Runaway) as caught:
        equilibrium(chain([linear(50.0), soft], [6.0, 0.0, -6.0]))
    assert caught.value.elements == (1,)


def test_preload_and_ground() -> None:
    law = staged([Stage(10.0, 0.0, None)], [Stage(10.0, 0.0, None)], preload=2.0)
    system = PiecewiseSystem(np.ones(1), np.zeros(1), np.ones((1, 1)), (law,), inputs(1, 1, mean=np.array([5.0])))
    assert equilibrium(system).angle == pytest.approx([0.3])


def test_parallel_elements_share_the_load_across_their_corners() -> None:
    rows = np.array([[1.0, -1.0], [1.0, -1.0]])
    laws = (clearance(100.0, 0.0, 0.1), linear(50.0))
    system = PiecewiseSystem(np.ones(2), np.zeros(2), rows, laws, inputs(2, 2, mean=np.array([20.0, -20.0])))
    delta = (20.0 + 100.0 * 0.1) / 150.0
    assert equilibrium(system).deflection == pytest.approx([delta, delta], rel=1e-14)


def test_two_trains_and_a_pure_damper_between_them() -> None:
    rows = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 1.0, -1.0, 0.0], [0.0, 0.0, 1.0, -1.0]])
    damper = linear(0.0, 3.0)
    mean = np.array([2.0, -2.0, 7.0, -7.0])
    system = PiecewiseSystem(
        np.ones(4), np.zeros(4), rows, (linear(10.0), damper, linear(10.0)), inputs(4, 3, mean=mean)
    )
    rest = equilibrium(system)
    assert rest.angle == pytest.approx([0.2, 0.0, 0.7, 0.0])


@pytest.mark.parametrize("seed", range(60))
def test_every_inertia_is_in_balance(seed: int) -> None:
    system = random_chain(seed)
    rest = equilibrium(system)
    force = np.array([law.elastic(float(d)) for law, d in zip(system.laws, rest.deflection, strict=True)])
    left = system.inputs.mean - system.inertia * rest.acceleration - system.rows.T @ force
    stiffest = max(float(law.stiffness.max() * np.abs(law.corners).max(initial=0.0)) for law in system.laws)
    assert np.abs(left).max() <= 1e-12 * (np.abs(system.inputs.mean).sum() + stiffest)
    for k, law in enumerate(system.laws):
        assert rest.deflection[k] == pytest.approx(system.rows[k] @ rest.angle, rel=1e-9, abs=1e-12)
        assert rest.pieces[k] == law.piece_at(float(rest.deflection[k]))
