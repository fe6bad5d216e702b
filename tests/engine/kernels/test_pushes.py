"""What bounds on derivatives are made of, with plain kernels: exponentials, blocks that follow chains of signals."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mpmath import mp
from scipy.linalg import expm

from gearrattle.engine.kernels import deflection_bounds, signal_drive
from gearrattle.engine.kernels._jit import is_compiling
from gearrattle.engine.kernels.workspace import CHAIN_PACE, HORIZON

pytestmark = pytest.mark.skipif(is_compiling(), reason="calls plain kernels one by one: make plain")

STATES, LINKS, CHAINS, PACE, LENGTH = 3, 4, 2, 0.7, 0.5


@pytest.mark.parametrize("norm", [1e-3, 0.4, 0.9, 3.0, 40.0])
def test_the_exponential_of_a_matrix_without_negative_entries(norm: float) -> None:
    """Against forty digits: SciPy's is off by 5e-12 at the norm 40."""
    matrix = np.random.default_rng(3).uniform(0.0, 1.0, (5, 5))
    matrix *= norm / np.abs(matrix).sum(axis=0).max()
    scratch = SimpleNamespace(one=matrix.copy(), two=np.empty((5, 5)), three=np.empty((5, 5)), four=np.empty((5, 5)))
    deflection_bounds.exponential(scratch, 5)
    with mp.workdps(40):
        want = np.array(mp.expm(mp.matrix(matrix.tolist())).tolist(), dtype=float)
    np.testing.assert_allclose(scratch.one, want, rtol=1e-13)


def block(rate: float) -> dict[str, Any]:
    """A block of fast or slow modes that two chains of four links push."""
    rng, width = np.random.default_rng(7), STATES + LINKS * CHAINS
    triangle = np.zeros((STATES, width), complex)
    triangle[:, :STATES] = np.triu(rng.standard_normal((STATES, STATES)), 1) + rate * np.diag([1j, -1.0, -2.0 + 1j])
    left = np.zeros((STATES, width), complex)
    left[:, :STATES] = rng.standard_normal((STATES, STATES)) + 1j * rng.standard_normal((STATES, STATES))
    limits = np.zeros(max(CHAIN_PACE, HORIZON) + 1)
    limits[CHAIN_PACE], limits[HORIZON] = PACE, LENGTH
    one = np.array([STATES]), np.array([width])
    return {
        "common": SimpleNamespace(limits=limits, links=np.array([LINKS]), corner_scale=np.ones(2)),
        "free": SimpleNamespace(
            chained=one[0],
            width=one[1],
            generator=rng.standard_normal((STATES, width)),
            watched=rng.standard_normal((2, width)),
        ),
        "modes": SimpleNamespace(
            basis=np.eye(STATES), triangle=triangle, left=left, right=np.linalg.inv(left[:, :STATES])
        ),
        "bounds": SimpleNamespace(pushed=np.zeros((6, LINKS * CHAINS)), followed=np.zeros((2, LINKS * CHAINS))),
        "scratch": SimpleNamespace(one=expm(np.abs(triangle[:, :STATES]) * LENGTH)),
    }


def next_links() -> np.ndarray:
    """N: every link's next, times the pace."""
    following = np.zeros((LINKS * CHAINS, LINKS * CHAINS))
    for j in range(LINKS * CHAINS - 1):
        if (j + 1) % LINKS:
            following[j, j + 1] = PACE
    return following


def test_fast_modes_follow_the_chains_as_the_equation_says() -> None:
    """T X - X N = -P, and the deflections take V X beside what they feel of the chains directly."""
    parts = block(200.0)
    modes, free, bounds = parts["modes"], parts["free"], parts["bounds"]
    triangle = modes.triangle[:, :STATES].copy()
    pushed = modes.left[:, :STATES] @ free.generator[:, STATES:]
    signal_drive.begin_pushes(free, bounds)
    signal_drive.push(parts["common"], free, modes, bounds, parts["scratch"], 0, STATES)
    solution = -modes.left[:, STATES:]
    np.testing.assert_allclose(triangle @ solution - solution @ next_links(), -pushed, rtol=0, atol=1e-12)
    assert np.all(modes.triangle[:, STATES:] == 0.0)
    felt = free.watched[:, STATES:] + (free.watched[:, :STATES] @ modes.right @ solution).real
    np.testing.assert_allclose(bounds.followed, felt, rtol=0, atol=1e-12)
    assert np.all(bounds.pushed == 0.0)


def test_slow_modes_are_pushed() -> None:
    parts = block(0.1)
    modes, free, bounds = parts["modes"], parts["free"], parts["bounds"]
    pushed = modes.left[:, :STATES] @ free.generator[:, STATES:]
    signal_drive.begin_pushes(free, bounds)
    signal_drive.push(parts["common"], free, modes, bounds, parts["scratch"], 0, STATES)
    np.testing.assert_allclose(modes.triangle[:, STATES:], pushed, rtol=0, atol=1e-12)
    assert np.all(modes.left[:, STATES:] == 0.0)
    np.testing.assert_array_equal(bounds.followed, free.watched[:, STATES:])
    reached = np.abs(free.watched[:, :STATES] @ modes.right) @ parts["scratch"].one @ np.abs(pushed)
    assert np.all(bounds.pushed[:2] >= LENGTH * reached * (1.0 - 1e-12))
