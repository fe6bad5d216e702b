"""A move within a finest step against the matrix exponential."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from gearrattle.engine.kernels.march_arrays import step_of
from gearrattle.engine.kernels.taylor_window import move_within, window_scratch
from gearrattle.engine.system.flow import flow_of
from gearrattle.engine.system.region import region_in
from gearrattle.engine.system.region_store import Store, aligned, strips_for
from tests.engine.system.drivelines import random_chain, random_pieces


@pytest.mark.parametrize("x", [0.0, 1e-9, 0.01, 0.1, 0.37, 0.6, 0.85, 1.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_move_within_a_finest_step_is_the_exponential(seed: int, x: float) -> None:
    system = random_chain(seed)
    store = Store(flow_of(system))
    store.add(random_pieces(system, seed))
    region = region_in(store, 0)
    a = store.packed
    size = store.size
    width, count = len(region.generator), len(region.carried)
    rng = np.random.default_rng(seed)
    y, carried = aligned(4 * strips_for(size.longest)), aligned(4 * strips_for(size.carried))
    y[:width], carried[:count] = rng.normal(size=width), rng.normal(size=count)
    square = np.zeros((width + count, width + count))
    square[:width, :width], square[width:, :width] = region.generator, region.carried
    want = expm(square * step_of(region.fine) * x) @ np.concatenate([y[:width], carried[:count]])
    size_of = np.abs(y[:width]).max() * max(1.0, np.abs(region.carried).max() * step_of(region.fine))
    move_within(a.powers, 0, width, (0, 1, 0.0), x, y, carried, window_scratch(carried.size, y.size))
    assert np.abs(np.concatenate([y[:width], carried[:count]]) - want).max() <= 3e-14 * size_of
