"""A region's tables against an independent matrix exponential, its bound against the motion itself."""

from dataclasses import replace
from math import factorial

import mpmath
import numpy as np
import pytest
from scipy.linalg import expm

from gearrattle.engine.kernels.march_arrays import LONGEST, step_of
from gearrattle.engine.system.flow import Flow, flow_of
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.piecewise_signals import Signals
from gearrattle.engine.system.region import Region, build_region, exponential_increments
from gearrattle.engine.system.region_arrays import RegionBuilder
from tests.engine.solvers.tasks import oscillator
from tests.engine.system.drivelines import clearance, inputs, linear, random_chain, random_pieces

SEEDS = [*range(8), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(8, 25))]


def case(seed: int) -> tuple[Flow, Region]:
    system = random_chain(seed)
    flow = flow_of(system)
    return flow, build_region(flow, random_pieces(system, seed))


def random_state(flow: Flow, seed: int) -> np.ndarray:
    rng = np.random.default_rng(1000 + seed)
    return np.concatenate([rng.normal(size=flow.states), flow.inputs_at(np.zeros(1), rng.random(1))[0]])


def exponential(matrix: np.ndarray, carried: np.ndarray, step: mpmath.mpf) -> np.ndarray:
    """Return exp - 1 of a matrix with rows carried beside it, at the working precision."""
    width = len(matrix)
    square = np.zeros((width + len(carried),) * 2)
    square[:width, :width], square[width:, :width] = matrix, carried
    exact = mpmath.expm(mpmath.matrix(square.tolist()) * step) - mpmath.eye(len(square))
    return np.array(exact.tolist(), dtype=float)[:, :width]


@pytest.mark.parametrize("seed", range(4))
def test_tables_are_the_exponential_at_50_digits(seed: int) -> None:
    _, region = case(seed)
    with mpmath.workdps(50):
        for level in {0, min(1, region.fine), region.fine // 2, max(0, region.fine - 1), region.fine}:
            want = exponential(region.generator, region.carried, mpmath.mpf(step_of(level)))
            size = np.abs(want).max(axis=1, keepdims=True)
            assert np.all(np.abs(region.tables[level] - want) <= 2e-13 * size)


@pytest.mark.parametrize("seed", SEEDS)
def test_free_and_forced_motion_add_up_to_the_exponential_of_the_whole(seed: int) -> None:
    flow, region = case(seed)
    z = random_state(flow, seed)
    n, u = flow.states, z[flow.states :]
    whole = exponential(flow.generator(region.pieces), flow.carried_rows(region.pieces), mpmath.mpf(LONGEST))
    free = np.concatenate([z[:n] - region.split.particular @ u, u[region.split.kept]])
    moved = free + region.tables[0][: len(free)] @ free
    later = u + whole[n : flow.width] @ z
    states = moved[:n] + region.split.particular @ later
    assert np.abs(states - (z[:n] + whole[:n] @ z)).max() <= 1e-12 * np.abs(z).max()
    carried = region.tables[0][len(free) :] @ free + region.carried_particular @ (later - u) + region.drift * LONGEST
    want = whole[flow.width :] @ z
    scale = np.abs(flow.carried_rows(region.pieces)) @ np.abs(z)
    assert np.all(np.abs(carried - want) <= 1e-12 * scale)


@pytest.mark.parametrize("share", [0.0, 1e-9, 1e-3, 0.5])
def test_a_mean_torque_is_kept_where_only_a_weak_spring_holds_it(share: float) -> None:
    system = oscillator(clearance(4.0, 0.0, 0.5, alpha=share), drag=1.0, mean=1.0)
    region = build_region(flow_of(system), (1,))
    assert (0 in region.split.kept) == (share < 0.01)


@pytest.mark.parametrize("seed", range(8))
def test_a_train_that_accelerates_for_ever_has_no_particular_solution(seed: int) -> None:
    """Its matrix is singular; in rounded arithmetic a solver may miss that and return any numbers."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 7))
    rows = np.eye(size - 1, size) - np.eye(size - 1, size, 1)
    laws = tuple(clearance(float(k), 0.1, 0.5) for k in rng.uniform(1.0, 9.0, size - 1))
    values = inputs(size, size - 1, mean=rng.normal(size=size))
    system = PiecewiseSystem(rng.uniform(0.5, 2.0, size), np.zeros(size), rows, laws, values)
    for pieces in (tuple(2 for _ in laws), tuple(rng.integers(0, 3, size - 1).tolist())):
        assert 0 in build_region(flow_of(system), pieces).split.kept


def test_resonance_is_kept_as_a_state_and_a_detuned_order_is_not() -> None:
    for turns, kept in ((2 / (2 * np.pi), 2), (2.5 / (2 * np.pi), 0)):
        region = build_region(flow_of(oscillator(linear(4.0), force=1.0, turns=turns)), (0,))
        assert region.split.kept.size == kept


def test_doubling_keeps_small_increments_accurate_to_their_own_size() -> None:
    stiff = np.array([[0.0, 1e4], [-1e4, -30.0]])
    out = exponential_increments(stiff, np.zeros((0, 2)), 34)
    with mpmath.workdps(40):
        for level in range(15, 35):
            step = mpmath.mpf(step_of(level))
            want = mpmath.expm(mpmath.matrix(stiff.tolist()) * step) - mpmath.eye(2)
            error = out[level] - np.array(want.tolist(), dtype=float)
            assert np.abs(error).max() <= 4e-15 * float(mpmath.norm(want, mpmath.inf)) * (1 + 1e4 * float(step))


@pytest.mark.parametrize("seed", SEEDS)
def test_blocks_are_invariant_subspaces_that_rebuild_the_generator(seed: int) -> None:
    system = random_chain(seed)
    builder = RegionBuilder(flow_of(system))
    builder.build(random_pieces(system, seed))
    width, modes = builder.width, builder.workspace.modes
    generator = builder.workspace.free.generator[:width, :width]
    left, right, triangle = (matrix[:width, :width] for matrix in (modes.left, modes.right, modes.triangle))
    assert np.abs(right @ triangle @ left - generator).max() <= 1e-9 * np.abs(generator).max()
    assert np.abs(left @ right - np.eye(width)).max() <= 1e-9
    begins = modes.begins[: 1 + modes.begins.tolist().index(width)]
    assert begins[0] == 0
    assert np.all(np.diff(begins) > 0)
    inside = np.searchsorted(begins, np.arange(width), side="right")
    assert not np.any(triangle[inside[:, None] != inside[None, :]])
    assert not np.any(np.tril(triangle, -1))


def largest_along(rows: np.ndarray, matrix: np.ndarray, y: np.ndarray, until: float = LONGEST) -> np.ndarray:
    """Return the largest |row . y(s)| for each row, on a dense grid over the longest step, or a shorter time."""
    count, fastest = 4000, np.abs(np.linalg.eigvals(matrix)).max()
    step = min(until / count, 0.2 / fastest)
    move = expm(matrix * step)
    largest = np.zeros(len(rows))
    state = y
    for _ in range(count):
        largest = np.maximum(largest, np.abs(rows @ state))
        state = move @ state
    return largest


@pytest.mark.parametrize("seed", SEEDS)
def test_the_majorant_bounds_the_fourth_derivative_and_the_fast_modes_all_along_the_longest_step(seed: int) -> None:
    flow, region = case(seed)
    z = random_state(flow, seed)
    n = flow.states
    matrix = flow.generator(region.pieces)
    free = np.concatenate([z[:n] - region.split.particular @ z[n:], z[n:][region.split.kept]])
    fourth, calm, fast = region.bound.bound(free, np.zeros(0))
    powered = np.linalg.matrix_power(matrix, 4)
    deflection = flow.probe_rows(region.pieces)[0]
    largest = largest_along(deflection @ powered, matrix, z)
    assert np.all(largest <= fourth)
    assert np.all(fourth <= 1e5 * largest + 1e-9)  # a bound that says nothing would pass the line above
    part = largest_along(region.bound.fast, region.generator, free)
    assert np.all(part <= fast)
    assert np.all(fast <= 1e3 * part + 1e-9)
    embedded = np.zeros_like(deflection)
    columns = np.r_[0:n, n + region.split.kept]
    embedded[:, columns] = region.bound.fast
    embedded[:, n:] -= region.bound.fast[:, :n] @ region.split.particular
    assert np.all(largest_along((deflection - embedded) @ powered, matrix, z) <= calm * (1 + 1e-9))
    assert np.all(calm <= fourth)


def with_signals(system: PiecewiseSystem, seed: int) -> PiecewiseSystem:
    """Return a system pushed by two polynomials in every interval, at paces from a tenth to ten times each other's."""
    rng = np.random.default_rng(seed)
    period = system.inputs.period
    order = np.arange(10)
    knots = period * np.cumsum([0.0, *10.0 ** rng.uniform(-3, -1, 6)])
    turning = 10.0 ** rng.uniform(-0.5, 0.5, (6, 2, 1)) / np.diff(knots)[:, None, None]
    size = np.array([3.0, 1e-3])[:, None] / np.array([float(factorial(j)) for j in order])
    coefficients = rng.normal(size=(6, 2, 10)) * size * turning**order
    torque, error = np.zeros((len(system.inertia), 2)), np.zeros((len(system.laws), 2))
    torque[0, 0], error[-1, 1] = 1.0, 1.0
    return replace(system, signals=Signals(knots, coefficients, torque, error))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_majorant_holds_all_through_an_interval_of_signals(seed: int) -> None:
    system = with_signals(random_chain(seed), seed)
    flow, pieces = flow_of(system), random_pieces(system, seed)
    region, interval = build_region(flow, pieces), seed % 6
    z, n = random_state(flow, seed), flow.states
    z[n + flow.inputs :] = flow.chains[interval]
    split = np.concatenate([z[n : n + flow.inputs], np.zeros(flow.chain.size)])
    free = np.concatenate([z[:n] - region.split.particular @ split[: flow.inputs], z[n:][region.split.kept]])
    fourth, calm, _ = region.bound.bound(free, flow.fourth_of_chains[interval])
    rows = flow.probe_rows(pieces)[0] @ np.linalg.matrix_power(flow.generator(pieces), 4)
    length = flow.knots[interval + 1] - flow.knots[interval]
    largest = largest_along(rows, flow.generator(pieces), z, length)
    assert np.all(largest <= fourth)
    assert np.all(fourth <= 1e5 * largest + 1e-9)
    assert np.all(calm <= fourth)
    pushed = region.bound.pushes[0] @ flow.fourth_of_chains[interval]
    assert np.any(pushed > 0.0)


@pytest.mark.parametrize("seed", range(5))
def test_fourth_derivatives_of_chains_are_bounded_tightly(seed: int) -> None:
    flow = flow_of(with_signals(random_chain(seed), seed))
    begin, length = np.repeat(flow.knots[:-1], 400), np.repeat(np.diff(flow.knots), 400)
    times = begin + length * np.tile((np.arange(400) + 0.5) / 400, len(flow.knots) - 1)
    chains = flow.chains_at(np.floor(times), times - np.floor(times))
    fourth = np.abs(chains @ np.linalg.matrix_power(flow.pace_of_chains, 4).T).reshape(-1, 400, flow.chain.size)
    largest, bound = fourth.max(axis=1), flow.fourth_of_chains
    assert np.all(largest <= bound * (1 + 1e-9))
    assert np.all(bound[:, :4] <= 4.0 * largest[:, :4].max() + 1e-9)


def test_a_free_flying_part_without_drag_is_bounded_by_its_elastic_motion_alone() -> None:
    system = random_chain(3)
    flow = flow_of(system)
    gap = tuple(1 if law.corners.size else 0 for law in system.laws)
    region = build_region(flow, gap)
    assert region.bound.weights.shape[1] == len(system.clearances)
    assert np.all(np.isfinite(region.bound.weights))
