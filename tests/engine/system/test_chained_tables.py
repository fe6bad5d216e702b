"""Tables of regions along a sweep: one chain stands for all of them, and no table moves chains."""

from __future__ import annotations

import mpmath
import numpy as np
from scipy.linalg import expm

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.kernels.march_arrays import step_of
from gearrattle.engine.kernels.oscillators import shift_chains
from gearrattle.engine.kernels.workspace import CHAIN_PACE
from gearrattle.engine.system.flow import flow_of
from gearrattle.engine.system.region_store import Store, strips_for

MODEL = """
schema = 1
inertia = [ { name = "shaft", J = 0.1, drag = 0.2 }, { name = "gear", J = 0.02, drag = 0.01, drag_torque = 1.0 } ]
excitation = { sweep = { from = 100.0, to = 300.0, over = 0.05 } }
torque = [ { on = "shaft", harmonics = [ { order = 2, amplitude = 40.0 } ] } ]

[[coupling]]
name = "spring"
between = ["shaft", "ground"]
stiffness = 6000.0
damping = 0.5

[[mesh]]
name = "mesh"
between = ["shaft", "gear"]
radii = [0.06, 0.03]
stiffness = 2e7
damping = 200.0
backlash = 1e-4
transmission_error = [ { order = 17, amplitude = 3e-6 } ]
"""


def region() -> tuple[Store, np.ndarray]:
    """A store with one region, and the rates of what is carried and of y, square."""
    system = assemble(gr.loads(MODEL)).system
    store = Store(flow_of(system))
    store.add((0,) * len(system.laws))
    free, carried = store.builder.workspace.free, store.size.carried
    width = int(free.width[0])
    rates = np.zeros((carried + width, carried + width))
    rates[:, carried:] = free.rates[: carried + width, :width]
    return store, rates


def exponentials(rates: np.ndarray, levels: int) -> list[np.ndarray]:
    """Return the exponentials of the steps of all levels less the unit matrix, in fifty digits, rounded once.

    Every step is twice that of two levels further: its exponential is a square.
    """
    powers: dict[int, mpmath.matrix] = {}
    with mpmath.workdps(50):
        for level in reversed(range(levels)):
            if level + 2 in powers:
                assert step_of(level) == 2.0 * step_of(level + 2)
                powers[level] = powers[level + 2] ** 2
            else:
                powers[level] = mpmath.expm(mpmath.matrix(rates.tolist()) * mpmath.mpf(step_of(level)))
        unit = mpmath.eye(len(rates))
        return [np.array((powers[level] - unit).tolist(), dtype=float) for level in range(levels)]


def test_tables_are_exponentials_but_for_the_chains() -> None:
    store, rates = region()
    carried, width = store.size.carried, store.builder.width
    chained = width - store.size.chain
    assert store.size.chain > 16  # more than one chain
    behind = 4 * strips_for(carried)
    tables = store.packed.tables
    assert tables.shape[1] < strips_for(carried) + strips_for(width)
    levels = store.fine(0) + 1
    for level, exponential in enumerate(exponentials(rates, levels)):
        expected = exponential[: carried + chained, carried:]
        rows = tables[level].transpose(0, 2, 1).reshape(-1, tables.shape[2])[:, :width]
        actual = np.vstack([rows[:carried], rows[behind : behind + chained]])
        size = np.abs(expected).max(axis=1, keepdims=True)
        # 6.4e-16 is measured, three roundings; of the same rows SciPy's scaling and squaring misses 9e-13
        np.testing.assert_allclose(actual / size, expected / size, rtol=0, atol=2e-15)


def test_chains_are_moved_by_their_own_series() -> None:
    store, rates = region()
    first = store.builder.width - store.size.chain
    flow, pace = store.flow, float(store.builder.workspace.common.limits[CHAIN_PACE])
    assert flow.system.signals is not None
    before = np.random.default_rng(1).normal(size=store.builder.width)
    after = before.copy()
    shift_chains(after, first, store.size.chain, flow.system.signals.degree + 1, 0.3 * pace)
    chains = rates[-store.size.chain :, -store.size.chain :]
    np.testing.assert_array_equal(after[:first], before[:first])
    np.testing.assert_allclose(after[first:], expm(0.3 * chains) @ before[first:], rtol=1e-13)
