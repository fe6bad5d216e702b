"""The compiled loop over whole periods against the general way, and levels against samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.assembly.variant_assembly import coefficients
from gearrattle.engine.periodic.families import CompiledFamily, GeneralFamily
from gearrattle.engine.periodic.motion import State
from tests.engine.periodic.test_shooting import OSCILLATOR, pair

TRAIN: dict[str, Any] = {
    "schema": 1,
    "inertia": [{"name": name, "J": j, "drag": 0.01} for name, j in (("a", 0.1), ("b", 0.02), ("c", 0.03))],
    "coupling": [
        {
            "name": "clutch",
            "between": ["a", "b"],
            "stiffness": 900.0,
            "damping": 0.4,
            "clearance": 0.02,
            "stiffness_ratio": 0.2,
            "damping_ratio": 0.3,
        },
        {"name": "spline", "between": ["b", "c"], "stiffness": 4000.0, "damping": 0.2, "clearance": 0.004},
    ],
    "excitation": {"speed": 90.0},
    "torque": [{"on": "a", "mean": 3.0, "harmonics": [{"order": 1, "amplitude": 25.0}]}, {"on": "c", "mean": -3.0}],
}
CASES = {
    "oscillator": (
        {**OSCILLATOR, "excitation": {"frequency": 0.9}, "torque": [{"on": "body", "mean": 0.1}]},
        "torque.0.mean",
        [0.5, 0.3],
    ),
    "train": (TRAIN, "excitation.speed", [0.021, 0.0041, 1.0, 0.5, -0.4]),
}


def both(name: str, cycles: int) -> tuple[GeneralFamily, CompiledFamily, float, State]:
    tables, path, y = CASES[name]
    model = gr.Model.from_tables(tables)
    value = 0.1 if path == "torque.0.mean" else 90.0
    general = GeneralFamily(lambda p: assemble(model.with_({path: p})).system, value, cycles, unit=value)
    compiled = CompiledFamily(
        general, assemble(model).system, lambda values: coefficients(model, {path: values}, len(values))
    )
    return general, compiled, value, State(np.array(y))


@pytest.mark.parametrize("cycles", [1, 3])
@pytest.mark.parametrize("name", CASES)
def test_the_compiled_loop_is_the_general_way(name: str, cycles: int) -> None:
    general, compiled, value, state = both(name, cycles)
    (one, one_slope), (other, other_slope) = general.follow(state, value), compiled.follow(state, value)
    np.testing.assert_array_equal(other.end.y, one.end.y)
    np.testing.assert_array_equal(other.crossings.time, one.crossings.time)
    np.testing.assert_array_equal(other.crossings.watch, one.crossings.watch)
    np.testing.assert_allclose(other.crossings.velocity, one.crossings.velocity, rtol=1e-14)
    np.testing.assert_allclose(other.turned, one.turned, rtol=0, atol=1e-13)
    scale = np.abs(one.gradient).max()
    np.testing.assert_allclose(other.gradient, one.gradient, rtol=0, atol=1e-12 * scale)
    np.testing.assert_allclose(other_slope, one_slope, rtol=0, atol=1e-8 * max(1.0, np.abs(one_slope).max()))
    assert (other.period, other.cycles) == (one.period, one.cycles)
    assert len(one.crossings.time) > 0


def test_the_slope_is_that_of_differences() -> None:
    _, compiled, value, state = both("train", 1)
    h = 1e-3
    ahead, behind = (compiled.map_at(value + side).later(state).y for side in (h, -h))
    _, slope = compiled.follow(state, value)
    np.testing.assert_allclose(slope, (ahead - behind) / (2.0 * h), rtol=0, atol=1e-5 * np.abs(slope).max())


def test_a_start_on_a_corner_goes_the_general_way() -> None:
    general, compiled, value, _ = both("oscillator", 1)
    corner = State(np.array([1.0, 0.2]))
    np.testing.assert_array_equal(compiled.follow(corner, value)[0].end.y, general.follow(corner, value)[0].end.y)


@pytest.mark.parametrize("coupling", [{}, {"hysteresis": 0.8}, {"contact_damping": "clipped"}])
def test_levels_hold_the_samples_and_are_reached(coupling: dict[str, Any]) -> None:
    """From dense samples: never outside, and as near as the sampling allows; the mean is that of the trapezium rule."""
    period_map = pair(drag=0.02, **coupling)
    state = period_map.state_of(np.array([0.012, 0.0]), np.array([2.0, 1.0]))
    low, high, mean = period_map.levels(period_map(state))[:, 0]
    samples = 4096
    march = period_map.marched(state, samples_per_cycle=samples)
    deflection = march.samples.states[:, 0] / period_map.scale[0]
    size = np.ptp(deflection)
    assert low <= deflection.min() + 1e-13
    assert high >= deflection.max() - 1e-13
    assert deflection.min() - low < 1e-5 * size
    assert high - deflection.max() < 1e-5 * size
    trapezium = (deflection[:-1] + deflection[1:]).mean() / 2.0
    assert mean == pytest.approx(trapezium, abs=1e-6 * size)
