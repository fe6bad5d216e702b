"""A region's tables against an independent matrix exponential, its bound against the motion itself."""

import mpmath
import numpy as np
import pytest
from scipy.linalg import expm

from gearrattle.kernels.packed import LONGEST
from gearrattle.system.blocks import block_diagonalise
from gearrattle.system.flow import Flow, flow_of
from gearrattle.system.majorant import ELIMINATION, _triangular_form
from gearrattle.system.region import Region, build_region, exponential_increments
from tests.system.drivelines import random_chain, random_pieces

SEEDS = range(25)


def case(seed: int) -> tuple[Flow, Region]:
    system = random_chain(seed)
    flow = flow_of(system)
    return flow, build_region(flow, random_pieces(system, seed))


def random_state(flow: Flow, seed: int) -> np.ndarray:
    rng = np.random.default_rng(1000 + seed)
    return np.concatenate([rng.normal(size=flow.states), flow.inputs_at(np.zeros(1), rng.random(1))[0]])


@pytest.mark.parametrize("seed", range(4))
def test_tables_are_the_exponential_at_50_digits(seed: int) -> None:
    flow, region = case(seed)
    matrix, carried = flow.generator(region.pieces), flow.carried_rows(region.pieces)
    square = np.zeros((flow.width + len(carried),) * 2)
    square[: flow.width, : flow.width], square[flow.width :, : flow.width] = matrix, carried
    with mpmath.workdps(50):
        for level in (0, region.fine // 2, region.fine):
            exact = mpmath.expm(mpmath.matrix(square.tolist()) * (mpmath.mpf(LONGEST) / 2**level))
            want = np.array((exact - mpmath.eye(len(square))).tolist(), dtype=float)[:, : flow.width]
            kept = np.r_[0 : flow.states, flow.width : len(square)]
            size = np.abs(want[kept]).max(axis=1, keepdims=True)
            assert np.all(np.abs(region.tables[level] - want[kept]) <= 2e-13 * size)


def test_doubling_keeps_small_increments_accurate_to_their_own_size() -> None:
    stiff = np.array([[0.0, 1e4], [-1e4, -30.0]])
    out = exponential_increments(stiff, np.zeros((0, 2)), 1e-6, 10)
    with mpmath.workdps(40):
        for level in range(11):
            step = mpmath.mpf(1e-6) * 2 ** (10 - level)
            want = mpmath.expm(mpmath.matrix(stiff.tolist()) * step) - mpmath.eye(2)
            error = out[level] - np.array(want.tolist(), dtype=float)
            assert np.abs(error).max() <= 4e-15 * float(mpmath.norm(want, mpmath.inf)) * (1 + 1e4 * float(step))


@pytest.mark.parametrize("seed", SEEDS)
def test_blocks_are_invariant_subspaces_that_rebuild_the_matrix(seed: int) -> None:
    flow, region = case(seed)
    matrix = flow.generator(region.pieces)
    blocks = block_diagonalise(*_triangular_form(matrix, flow.states, flow.frequency), ELIMINATION)
    rebuilt = sum(block.right @ block.triangle @ block.left for block in blocks)
    assert np.abs(rebuilt - matrix).max() <= 1e-9 * np.abs(matrix).max()
    assert sum(block.left.shape[0] for block in blocks) == flow.width


@pytest.mark.parametrize("seed", SEEDS)
def test_the_majorant_bounds_the_third_derivative_all_along_the_longest_step(seed: int) -> None:
    flow, region = case(seed)
    z = random_state(flow, seed)
    matrix = flow.generator(region.pieces)
    bound = region.bound.bound(z)
    third = region.deflection @ matrix @ matrix @ matrix
    rows, fastest = 4000, np.abs(np.linalg.eigvals(matrix)).max()
    step = min(LONGEST / rows, 0.2 / fastest)
    move, largest, state = expm(matrix * step), np.zeros(len(bound)), z
    for _ in range(rows):
        largest = np.maximum(largest, np.abs(third @ state))
        state = move @ state
    assert np.all(largest <= bound)
    assert np.all(bound <= 1e5 * largest + 1e-9)  # a bound that says nothing would pass the line above


def test_a_free_flying_part_without_drag_is_bounded_by_its_elastic_motion_alone() -> None:
    system = random_chain(3)
    flow = flow_of(system)
    gap = tuple(1 if law.corners.size else 0 for law in system.laws)
    region = build_region(flow, gap)
    assert region.bound.weights.shape[0] == len(system.clearances)
    assert np.all(np.isfinite(region.bound.weights))
