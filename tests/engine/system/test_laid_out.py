"""The pages that regions share, written in compiled code, against the rows that ``system.flow`` writes with NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.kernels import bench
from gearrattle.engine.system.building import Bench
from gearrattle.engine.system.flow import Flow, flow_of
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.scaling import power_of_two
from tests.dense.families import seeded
from tests.engine.solvers.tasks import oscillator
from tests.engine.system.drivelines import random_chain
from tests.engine.system.numpy_regions import typical_size

FAMILIES = ("chain", "loop", "error", "everything")


def _rows(flow: Flow) -> dict[int, np.ndarray]:
    """Every page, by its number, as rows over z."""
    system, period = flow.system, flow.system.inputs.period
    clearances, unit = list(system.clearances), 1.0 / flow.corner_scale[:, None]
    return {
        bench.MOTION: period * flow.scaling.deflection[:, None] * (flow.coordinates.basis @ flow.velocity),
        bench.BALANCE: flow.torque - system.drag[:, None] * flow.velocity,
        bench.ELEMENTS: system.rows,
        bench.DEFLECTION: flow.deflection,
        bench.RATE: flow.rate,
        bench.REFERENCES: period * flow.velocity[list(flow.coordinates.references)],
        bench.SEEN: np.vstack([flow.deflection[clearances] * unit, flow.rate[clearances] * unit * period]),
        bench.CURVATURE: flow.curvature_of_error[clearances],
    }


def _check(system: PiecewiseSystem) -> None:
    """The same bits on every page, in every vector and in every law."""
    flow = flow_of(system)
    work, laws, vectors = Bench(flow).work, Bench(flow).laws, Bench(flow).work[bench.VECTORS]
    for page, rows in _rows(flow).items():
        assert np.array_equal(work[page, : rows.shape[0], : rows.shape[1]], rows), page
    for row, vector in {
        bench.INERTIA: system.inertia, bench.PACE: system.inputs.period * flow.scaling.velocity,
        bench.CORNER_SCALE: flow.corner_scale, bench.FREQUENCY: flow.frequency,
        bench.AMPLITUDE: flow.scaling.inputs, bench.INPUT_SIZE: flow.input_size,
    }.items():  # fmt: skip
        assert np.array_equal(vectors[row, : vector.size], vector), row
    first = 0
    for law in system.laws:
        mine = laws[:, first : first + law.pieces]
        assert np.array_equal(mine[bench.STIFFNESS], law.stiffness)
        assert np.array_equal(mine[bench.DAMPING], law.damping)
        assert np.array_equal(mine[bench.OFFSET], law.offset / flow.scaling.inputs[0])
        assert np.array_equal(mine[bench.LOWER], [-np.inf, *law.corners])
        assert np.array_equal(mine[bench.UPPER], [*law.corners, np.inf])
        first += law.pieces
    assert Bench(flow).typical == pytest.approx(typical_size(flow), rel=1e-9)


@pytest.mark.parametrize("family", FAMILIES)
def test_pages_are_those_of_the_flow(family: str) -> None:
    for seed in range(12):
        _check(seeded(family, seed).system())


def test_pages_of_chains_and_of_one_body() -> None:
    for seed in range(10):
        _check(random_chain(seed))
    _check(oscillator())


def test_powers_of_two_are_the_ones_below() -> None:
    values = np.array([1.0, 2.0, np.nextafter(2.0, 0.0), 1e-310, 3.7e305, np.inf])
    assert power_of_two(values).tolist() == [1.0, 2.0, 1.0, 2.0**-1030, 2.0**1015, np.inf]
