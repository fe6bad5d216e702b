"""The exact derivative of the period map over a parameter, against differences of the map."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.families import CompiledFamily, Family, GeneralFamily
from gearrattle.engine.periodic.grazing_depth import depth
from gearrattle.engine.periodic.motion import State, Touch
from gearrattle.engine.solvers.scheme_choice import is_large
from gearrattle.orbits.gradients import number_at
from gearrattle.orbits.start_states import state_of
from gearrattle.orbits.value_family import family_of, family_of_excitation
from tests.orbits.test_friction import oscillator as with_friction

pytestmark = pytest.mark.compiled  # without compiled kernels every family is a general one

PATHS = {
    "excitation.speed": 100.0,
    "coupling.gap.clearance": 0.006,
    "coupling.gap.stiffness": 4000.0,
    "coupling.gap.damping": 0.5,
    "torque.0.mean": 4.0,
    "torque.0.harmonics.1.amplitude": 8.0,
    "torque.0.harmonics.1.phase": 0.4,
    "coupling.gap.kinematic_error.0.amplitude": 8e-4,
    "inertia.b0.J": 0.02,
}
"""Paths of ``train``, and their values."""


def train(inertias: int, gaps: int = 0) -> gr.Model:
    """A gap with an error, and a chain of couplings behind it, the first few of them with gaps as well."""
    couplings: list[dict[str, Any]] = [
        {"name": f"c{i}", "between": [f"b{i}", f"b{i + 1}"], "stiffness": 3000.0 + 500.0 * (i % 5), "damping": 0.5}
        for i in range(1, inertias - 1)
    ]
    for coupling in couplings[:gaps]:
        coupling |= {"clearance": 0.004, "damping_ratio": 0.2}
    ends = ["b0", "b1"] if inertias > 1 else ["b0", "ground"]
    errors = [{"order": 1, "amplitude": 8e-4, "phase": 0.3}, {"order": 3, "amplitude": 2e-4}]
    gap = {"name": "gap", "between": ends, "stiffness": 4000.0, "damping": 0.5, "damping_ratio": 0.1}
    load = [{"on": f"b{inertias - 1}", "mean": -4.0}] if inertias > 1 else []
    harmonics = [{"order": 1, "amplitude": 30.0}, {"order": 2, "amplitude": 8.0, "phase": 0.4}]
    return gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": f"b{i}", "J": 0.02 * (1.0 + i % 3), "drag": 0.02} for i in range(inertias)],
            "coupling": [{**gap, "clearance": 0.006, "kinematic_error": errors}, *couplings],
            "excitation": {"speed": 100.0},
            "torque": [{"on": "b0", "mean": 4.0, "harmonics": harmonics}, *load],
        }
    )


def start(inertias: int) -> State:
    """Some start, the same whenever it is asked for."""
    rng = np.random.default_rng(inertias)
    deflections = max(1, inertias - 1)
    return State(np.concatenate([1e-3 * rng.standard_normal(deflections), 0.3 * rng.standard_normal(inertias)]))


def differences(family: Family, state: State, value: float, step: float) -> np.ndarray:
    """Central differences of the map, extrapolated twice by Richardson."""

    def difference(h: float) -> np.ndarray:
        return (family.map_at(value + h).later(state).y - family.map_at(value - h).later(state).y) / (2.0 * h)

    coarse, middle, fine = (difference(step / 2**k) for k in range(3))
    first, second = (4.0 * middle - coarse) / 3.0, (4.0 * fine - middle) / 3.0
    return (16.0 * second - first) / 15.0


def assert_alike(family: Family, one: np.ndarray, other: np.ndarray) -> None:
    size = np.linalg.norm(family.scale * other)
    assert np.linalg.norm(family.scale * (one - other)) < 1e-8 * size


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("inertias", [1, 4, 32])
def test_the_slope_is_that_of_the_map_through_impacts(inertias: int, path: str) -> None:
    model, value = train(inertias), PATHS[path]
    family = family_of(model, path, value, 1, 2.0 * value)
    assert isinstance(family, CompiledFamily)
    motion, slope = family.follow(start(inertias), value)
    assert len(motion.crossings.time) >= 2
    assert_alike(family, slope, differences(family, start(inertias), value, 2e-4 * value))


@pytest.mark.parametrize("cycles", [2, 5])
def test_over_several_periods(cycles: int) -> None:
    family = family_of(train(3), "excitation.speed", 100.0, cycles, 50.0)
    assert isinstance(family, CompiledFamily)
    motion, slope = family.follow(start(3), 100.0)
    assert motion.crossings.time.max() > (cycles - 1) * motion.period
    assert_alike(family, slope, differences(family, start(3), 100.0, 1e-3))


def test_over_a_factor_of_all_harmonics_from_rest() -> None:
    """At zero too, where a share of the parameter is no step."""
    family = family_of_excitation(assemble(train(3)).system, 1)
    assert isinstance(family, CompiledFamily)
    for factor in (0.0, 1.0):
        _, slope = family.follow(start(3), factor)
        assert_alike(family, slope, differences(family, start(3), factor, 1e-4))


def test_many_regions_are_followed_in_compiled_code() -> None:
    """Five gaps have 243 regions: long runs take the sweep, a period the tables."""
    model = train(6, gaps=4)
    assert is_large(assemble(model).system)
    family = family_of(model, "excitation.speed", 100.0, 1, 50.0)
    assert isinstance(family, CompiledFamily)
    motion, slope = family.follow(start(6), 100.0)
    np.testing.assert_array_equal(motion.end.y, family.map_at(100.0).later(start(6)).y)
    assert len(set(motion.crossings.watch.tolist())) > 1
    assert_alike(family, slope, differences(family, start(6), 100.0, 0.02))


EXAMPLES = {
    "clutch_friction": ("excitation.speed", "inertia.flywheel.J"),
    "dual_mass_flywheel": ("excitation.speed", "torque.0.mean"),
    "alternating_mesh": ("excitation.speed", "torque.0.mean"),
}
"""Examples with memories, sliders and a clock, and some of their values."""


@pytest.mark.parametrize(("name", "path"), [(name, path) for name, paths in EXAMPLES.items() for path in paths])
def test_with_memories_and_alternation_too(name: str, path: str) -> None:
    """The clutch slips and changes its stage 90 times in a period."""
    model = gr.example(name)
    value = number_at(model, "", path)
    family = family_of(model, path, value, 1, abs(value))
    assert isinstance(family, GeneralFamily)
    period_map = family.map_at(value)
    settled = period_map.later(state_of(model, period_map, "zero"), 3)
    motion, slope = family.follow(settled, value)
    assert len(motion.crossings.time) >= 2
    assert_alike(family, slope, differences(family, settled, value, 2e-4 * abs(value)))


def test_friction_decides_what_a_slider_holds_that_slips_at_the_start() -> None:
    """The start holds a stretch too; it is replaced, and the depth of a later turning point does not depend on it."""
    path, speed = "coupling.joint.hysteresis", 0.8
    model = with_friction(speed)
    orbit = gr.periodic(model, cycles=2, start={"angle": [2.5], "velocity": [0.0]})
    start = gr.continuation(model, "excitation.speed", (speed, 0.801), cycles=2, start=orbit).points[0].motion.start
    family = family_of(model, path, 0.1, 2, 0.1)
    motion, slope = family.follow(start, 0.1, Touch(0, 0, 1.186))
    assert not np.isnan(family.map_at(0.1).flow.known(family.map_at(0.1).along(motion)[0])).any()
    assert_alike(family, slope, differences(family, start, 0.1, 2e-5))
    assert motion.approach is not None
    assert motion.approach.slope is not None
    assert motion.approach.slope[2] == 0.0
    low, high = (depth(family.map_at(0.1 + side), start, Touch(0, 0, 1.186))[0] for side in (-1e-6, 1e-6))
    assert motion.approach.slope[3] == pytest.approx((high - low) / 2e-6, rel=1e-7)


@pytest.mark.parametrize("path", PATHS)
def test_for_any_driveline_it_is_that_of_the_compiled_loop(path: str) -> None:
    model, value = train(4, gaps=2), PATHS[path]
    family = family_of(model, path, value, 1, 2.0 * value)
    assert isinstance(family, CompiledFamily)
    expected, slope = (one.follow(start(4), value)[1] for one in (family, family._general))
    assert np.linalg.norm(family.scale * (slope - expected)) < 1e-9 * np.linalg.norm(family.scale * expected)


def test_where_the_driveline_ends_the_difference_is_one_sided() -> None:
    """A clearance closes at zero: beyond it there is no driveline, and at it one of another kind."""
    path = "coupling.gap.clearance"
    general = family_of(train(2), path, 0.006, 1, 0.006)._general  # type: ignore[attr-defined]
    state, step = start(2), 1e-7
    for value in (0.0, 1e-12):
        slope = general.follow(state, value)[1]
        ends = [general.map_at(value + step * k).later(state).y for k in range(3)]
        expected = (-1.5 * ends[0] + 2.0 * ends[1] - 0.5 * ends[2]) / step
        assert np.linalg.norm(general.scale * (slope - expected)) < 1e-4 * np.linalg.norm(general.scale * expected)
