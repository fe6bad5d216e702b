"""What regions share, written in compiled code, against the rows that ``system.flow`` writes with NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.system.energy_scaling import power_of_two
from gearrattle.engine.system.flow import Flow, flow_of
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.plain_arrays import laws_of
from gearrattle.engine.system.region_arrays import RegionBuilder
from tests.dense.families import seeded
from tests.engine.solvers.tasks import oscillator
from tests.engine.system.drivelines import random_chain
from tests.engine.system.numpy_regions import typical_size

FAMILIES = ("chain", "loop", "error", "everything")


def _want(flow: Flow) -> dict[str, np.ndarray]:
    """What regions share, by its names."""
    system, period = flow.system, flow.system.inputs.period
    clearances, unit = list(system.clearances), 1.0 / flow.corner_scale[:, None]
    return {
        "motion": period * flow.scaling.deflection[:, None] * (flow.coordinates.basis @ flow.velocity),
        "balance": flow.torque - system.drag[:, None] * flow.velocity,
        "rows": system.rows,
        "deflection": flow.deflection,
        "rate": flow.rate,
        "references": period * flow.velocity[list(flow.coordinates.references)],
        "seen": np.vstack([flow.deflection[clearances] * unit, flow.rate[clearances] * unit * period]),
        "curvature": flow.curvature_of_error[clearances],
        "inertia": system.inertia,
        "pace": period * flow.scaling.velocity,
        "corner_scale": flow.corner_scale,
        "frequency": flow.frequency,
        "amplitude": flow.scaling.inputs,
        "input_size": flow.input_size,
    }


def _check(system: PiecewiseSystem) -> None:
    """The same bits in every array, and in every law."""
    flow = flow_of(system)
    builder = RegionBuilder(flow)
    common, laws = builder.workspace.common, builder.workspace.laws
    for name, want in _want(flow).items():
        assert np.array_equal(getattr(common, name), want), name
    want = laws_of(system.laws)
    for name in ("first", "stiffness", "damping", "lower", "upper"):
        assert np.array_equal(getattr(laws, name), getattr(want, name)), name
    assert np.array_equal(laws.offset, want.offset / flow.scaling.inputs[0])
    assert builder.typical_size == pytest.approx(typical_size(flow), rel=1e-9)


@pytest.mark.parametrize("family", FAMILIES)
def test_what_regions_share_is_that_of_the_flow(family: str) -> None:
    for seed in range(12):
        _check(seeded(family, seed).system())


def test_chains_and_one_body() -> None:
    for seed in range(10):
        _check(random_chain(seed))
    _check(oscillator())


def test_powers_of_two_are_the_ones_below() -> None:
    values = np.array([1.0, 2.0, np.nextafter(2.0, 0.0), 1e-310, 3.7e305, np.inf])
    assert power_of_two(values).tolist() == [1.0, 2.0, 1.0, 2.0**-1030, 2.0**1015, np.inf]
