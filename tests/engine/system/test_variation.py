"""The flow's gradient against finite differences and exact traces, and the horizon against perturbed motions."""

from dataclasses import replace

import numpy as np
import pytest

from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.perturbation_growth import Variation, variation
from gearrattle.engine.system.piecewise import PiecewiseSystem
from tests.engine.solvers.tasks import oscillator, run, task
from tests.engine.system.drivelines import clearance, random_chain


def of(system: PiecewiseSystem, angle: np.ndarray, velocity: np.ndarray, cycles: int) -> Variation:
    problem = task(system, list(angle), list(velocity), cycles=cycles)
    march = ExactMarch(problem)
    motion = run(problem)
    log = motion.crossings
    first = march.slots.pieces[march.march.counts[1]]
    end = cycles * system.inputs.period
    upward = (log.to_piece > log.from_piece).astype(np.int64)
    passages = Passages(log.time, log.clearance, upward, log.velocity, np.zeros((len(log.time), 0)))
    return variation(march.flow, first, passages, end=end)


def relative_state(system: PiecewiseSystem, angle: np.ndarray, velocity: np.ndarray, cycles: int) -> np.ndarray:
    problem = task(system, list(angle), list(velocity), cycles=cycles)
    motion = run(problem)
    basis = ExactMarch(problem).flow.coordinates.basis
    return np.concatenate([basis @ motion.angle[-1], motion.velocity[-1]])


@pytest.mark.parametrize("seed", range(12))
def test_gradient_is_the_finite_difference_of_the_flow(seed: int) -> None:
    system = random_chain(seed)
    system = replace(
        system, inputs=replace(system.inputs, period=0.01)
    )  # short: growth stays within what differences see
    rng = np.random.default_rng(seed)
    largest = np.array([np.abs(law.corners).max(initial=0.0) for law in system.laws])
    coordinates = ExactMarch(task(system, [0.0] * system.size, [0.0] * system.size, cycles=1)).flow.coordinates
    x0 = rng.uniform(0.3, 1.6, len(coordinates.elements)) * largest[list(coordinates.elements)]
    v0 = rng.normal(size=system.size)
    matrix = of(system, coordinates.angle_from_basis @ x0, v0, 1).gradient()
    y0 = np.concatenate([x0, v0])
    unit = np.concatenate([largest[list(coordinates.elements)], np.abs(v0) + 1.0])
    grown = np.abs(matrix * unit[None, :] / unit[:, None]).max()
    assert grown < 1e6
    for j in range(len(y0)):
        eps = 1e-5 / max(10.0, grown) * unit[j]
        ends = []
        for sign in (1, -1):
            y = y0 + sign * eps * (np.arange(len(y0)) == j)
            angle = coordinates.angle_from_basis @ y[: len(x0)]
            ends.append(relative_state(system, angle, y[len(x0) :], 1))
        difference = (ends[0] - ends[1]) / (2 * eps)
        assert np.all(np.abs(difference - matrix[:, j]) <= 1e-5 * grown * unit / unit[j])


@pytest.mark.parametrize("alpha", [0.0, 0.5])
def test_sum_of_exponents_is_minus_two_zeta(alpha: float) -> None:
    system = oscillator(clearance(4.0, 0.0, 0.5, alpha), drag=0.1, force=2.5, turns=1.0)
    exponents = of(system, np.array([0.9]), np.array([0.0]), 200).exponents()
    assert exponents.sum() == pytest.approx(-0.1, rel=1e-10)


def test_damping_that_jumps_at_a_corner_sums_to_the_time_it_acts() -> None:
    law = clearance(40.0, 0.8, 0.5)
    system = oscillator(law, force=9.0)
    motion = run(task(system, [0.9], [0.0], cycles=60))
    log = motion.crossings
    edges = np.concatenate([[0.0], log.time, [60.0]])
    contact = np.concatenate([motion.initial_piece, log.to_piece]) != 1
    acting = float(np.diff(edges)[contact].sum())
    total = of(system, np.array([0.9]), np.array([0.0]), 60).exponents().sum() * 60.0
    assert total == pytest.approx(-0.8 * acting, rel=1e-9)


def test_a_quiet_linear_motion_has_no_horizon_and_a_rattling_one_has_a_true_one() -> None:
    assert of(oscillator(drag=0.1), np.array([1.0]), np.array([0.0]), 50).horizon() == float("inf")
    system = oscillator(clearance(400.0, 0.2, 0.05), drag=0.05, force=6.0)
    angle, velocity = np.array([0.2]), np.array([0.0])
    growth = 1e5
    horizon = of(system, angle, velocity, 400).horizon(growth)
    assert 0 < horizon < 400
    cycles = int(np.ceil(horizon))
    a, b = (run(task(system, [0.2 + e], [0.0], cycles=cycles, samples=8)).angle for e in (0.0, 1e-9))
    apart = np.abs(a - b).max()
    assert 1e-9 * 0.01 * growth < apart < 1e-9 * 100 * growth


def test_joining_segments_changes_the_horizon_by_no_more_than_their_length() -> None:
    steady = np.array([[1.02, 0.0], [0.0, 0.9]])
    count = 1500
    long = Variation(np.arange(count + 1.0), np.broadcast_to(steady, (count, 2, 2)).copy(), np.ones(2))
    want = np.log(1e7) / np.log(1.02)
    assert want <= long.horizon() <= want + 4
    slow = Variation(np.arange(count + 1.0), np.broadcast_to(np.diag([1.012, 0.9]), (count, 2, 2)).copy(), np.ones(2))
    want = np.log(1e7) / np.log(1.012)
    assert want > 512  # only joined segments reach it
    assert want <= slow.horizon() <= want + 8


@pytest.mark.parametrize("part", [-1e-6, -1e-10, -1e-14, 1e-14, 1e-10, 1e-6])
def test_grazing_a_corner_at_which_the_damping_jumps_leaves_the_gradient_continuous(part: float) -> None:
    """x'' + x = 0 inside |x| < 1/2 peaks at 1/2 (1 + part); beyond, stiffness and damping act for about sqrt(part)."""
    system = oscillator(clearance(4.0, 0.8, 0.5, alpha=0.25))
    start, end = 0.5 * (1.0 + part), 3
    log = run(task(system, [0.0], [start], cycles=end)).crossings
    assert len(log.time) == (2 if part > 1e-13 else 0) or abs(part) < 1e-13
    free = np.array([[np.cos(end), np.sin(end)], [-np.sin(end), np.cos(end)]])
    matrix = of(system, np.array([0.0]), np.array([start]), end).gradient()
    assert np.abs(matrix - free).max() <= (1e-13 if part < 0 else 9.0 * np.sqrt(part + 1e-14))  # the rounding band
    if part > 1e-13:
        assert np.abs(matrix - free).max() >= 0.1 * np.sqrt(part)
        step = 1e-3 * part
        ends = [relative_state(system, np.zeros(1), np.array([start + sign * step]), end) for sign in (1, -1)]
        difference = (ends[0] - ends[1]) / (2 * step)
        assert np.abs(difference - matrix[:, 1]).max() <= 1e-6 + 1e-14 / step
