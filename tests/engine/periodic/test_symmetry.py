"""The half-period map: its square is the period map, its fixed points are symmetric, its multiplier -1 breaks that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.families import HalfPeriodFamily
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.multipliers import multipliers_of
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.shooting import shoot
from gearrattle.engine.periodic.symmetry import HalfPeriodMap, is_symmetric
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.orbits.value_family import family_of
from tests.orbits.test_laws import symmetric

FRICTION = {
    "schema": 1,
    "inertia": [{"name": "hub", "J": 0.3, "drag": 0.05}, {"name": "wheel", "J": 0.1}],
    "coupling": [
        {"name": "clutch", "between": ["hub", "wheel"], "stiffness": 800.0, "damping": 0.4, "hysteresis": 3.0},
        {"name": "gap", "between": ["wheel", "ground"], "stiffness": 900.0, "damping": 0.3, "clearance": 0.005},
    ],
    "excitation": {"speed": 60.0},
    "torque": [{"on": "hub", "harmonics": [{"order": 1, "amplitude": 9.0}, {"order": 3, "amplitude": 2.0}]}],
}


STAGES = [
    {"stiffness": 80.0, "damping": 0.2, "until": "0.3 rad", "hysteresis": 0.6},
    {"stiffness": 500.0, "damping": 0.4, "hysteresis": 3.0},
]
STAGED = FRICTION | {
    "coupling": [{"name": "clutch", "between": ["hub", "wheel"], "stages": STAGES}, FRICTION["coupling"][1]]
}


def system_of(tables: object) -> PiecewiseSystem:
    model = tables if isinstance(tables, gr.Model) else gr.Model.from_tables(tables)
    return assemble(model).system


@pytest.mark.parametrize("tables", [FRICTION, STAGED])
def test_twice_the_half_map_is_the_period_map_with_sliders(tables: dict[str, object]) -> None:
    """The sliders of the drive side and of the coast side are each other's mirror images."""
    system = system_of(tables)
    period_map, half = PeriodMap(system), HalfPeriodMap(system)
    start = period_map.later(period_map.state_of(np.array([0.35, -0.01]), np.array([2.0, -3.0])), 3)
    whole, first = period_map(start), half(start)
    second = half(first.end)
    sliders = {watch for watch in whole.crossings.watch.tolist() if watch >= len(system.clearances)}
    assert len(sliders) >= min(2, len(system.auxiliaries))
    assert second.end.y == pytest.approx(whole.end.y, rel=1e-11, abs=1e-12)
    assert whole.end.auxiliary_pieces is not None
    assert second.end.auxiliary_pieces is not None
    assert second.end.auxiliary_pieces.tolist() == whole.end.auxiliary_pieces.tolist()
    scale = period_map.scale
    product = scale[:, None] * (second.gradient @ first.gradient) / scale
    assert product == pytest.approx(scale[:, None] * whole.gradient / scale, abs=1e-11)


@pytest.mark.parametrize("n", [4, 32])
@pytest.mark.parametrize("cycles", [1, 3])
def test_twice_the_half_map_is_the_period_map(n: int, cycles: int) -> None:
    """From any state: H(H(y)) = P(y) and the product of both gradients is that of P."""
    names = [f"body{i}" for i in range(n)]
    tables = {
        "schema": 1,
        "inertia": [{"name": name, "J": 0.1 + 0.01 * i, "drag": 0.02} for i, name in enumerate(names)],
        "coupling": [
            {"name": f"gap{i}", "between": names[i : i + 2], "stiffness": 900.0 + 40.0 * i, "damping": 0.4}
            | ({"clearance": 0.002} if i in (0, n // 2) else {})
            for i in range(n - 1)
        ],
        "excitation": {"speed": 60.0},
        "torque": [{"on": names[0], "harmonics": [{"order": 1, "amplitude": 9.0}, {"order": 3, "amplitude": 4.0}]}],
    }
    system = system_of(tables)
    period_map, half = PeriodMap(system, cycles), HalfPeriodMap(system, cycles)
    seed = np.random.default_rng(1).normal(size=len(period_map.scale))
    start = State(0.7 * period_map.size * seed / period_map.scale)
    whole, first = period_map(start), half(start)
    second = half(first.end)
    scale = period_map.scale
    assert len(whole.crossings.time) == len(first.crossings.time) + len(second.crossings.time) > 2
    np.testing.assert_allclose(second.end.y * scale, whole.end.y * scale, rtol=0, atol=1e-10 * period_map.size)
    product = scale[:, None] * (second.gradient @ first.gradient - whole.gradient) / scale
    assert np.abs(product).max() < 1e-9 * np.abs(scale[:, None] * whole.gradient / scale).max()
    np.testing.assert_allclose(
        half.later(start, 2).y * scale, whole.end.y * scale, rtol=0, atol=1e-10 * period_map.size
    )


def test_a_slider_is_mirrored_with_the_rest() -> None:
    system = system_of(FRICTION)
    period_map, half = PeriodMap(system), HalfPeriodMap(system)
    start = period_map.later(State(np.zeros(len(period_map.scale))), 40)
    whole, twice = period_map(start), half(half(start).end)
    np.testing.assert_allclose(
        twice.end.y * period_map.scale, whole.end.y * period_map.scale, rtol=0, atol=1e-10 * period_map.size
    )
    assert np.array_equal(np.asarray(twice.end.auxiliary_pieces), np.asarray(whole.end.auxiliary_pieces))


@pytest.mark.parametrize("cycles", [1, 3])
@pytest.mark.parametrize("model", [symmetric(0.6), gr.Model.from_tables(FRICTION)], ids=["compiled", "friction"])
def test_the_half_map_over_a_parameter_is_that_of_every_driveline(model: gr.Model, cycles: int) -> None:
    """Ends and gradients are those of the half-period map; the slope is a difference of its ends."""
    path, value = "torque.0.harmonics.0.amplitude", model.torques[0].harmonics[0].amplitude
    family = HalfPeriodFamily(family_of(model, path, value, cycles, value))
    half = HalfPeriodMap(assemble(model).system, cycles)
    start = half.later(State(np.zeros(len(half.scale))), 7)
    motion, slope = family.follow(start, value)
    same = half(start)
    np.testing.assert_allclose(motion.end.y * half.scale, same.end.y * half.scale, rtol=0, atol=1e-12 * half.size)
    balanced, own = (half.scale[:, None] * one.gradient / half.scale for one in (motion, same))
    np.testing.assert_allclose(balanced, own, rtol=0, atol=1e-10)
    step = 1e-5 * value
    ends = [family.map_at(value + side * step).later(start).y for side in (1.0, -1.0)]
    difference = (ends[0] - ends[1]) / (2.0 * step)
    np.testing.assert_allclose(slope, difference, rtol=0, atol=1e-6 * np.abs(difference).max())


def test_shooting_with_the_half_map_gives_symmetric_motions_alone() -> None:
    """Where the symmetric motion is unstable, settling leads to one without symmetry; the half map finds the saddle."""
    system = system_of(symmetric(0.4))
    settled = shoot(PeriodMap(system), PeriodMap(system).later(State(np.array([0.3, 0.1])), 400))
    half = HalfPeriodMap(system)
    assert np.linalg.norm(half(settled.motion.start).gap) > 1e-2
    saddle = shoot(half, State(np.array([1.5, 0.0])))
    again = PeriodMap(system)(saddle.motion.start)
    assert np.linalg.norm(again.gap) < 1e-11
    squares = multipliers_of(saddle.motion.gradient) ** 2
    np.testing.assert_allclose(squares, multipliers_of(again.gradient), rtol=1e-9)
    assert saddle.multipliers[0].real < -1.0


def test_symmetry_ends_where_a_multiplier_of_the_half_map_is_minus_one() -> None:
    branch = gr.continuation(symmetric(0.6), "excitation.frequency", (0.6, 0.3))
    event = next(event for event in branch.curves[0].events if event.kind == "symmetry breaking")
    orbit = branch.orbit_at(event.point, 1)
    assert orbit.symmetric
    assert np.abs(orbit.half_period_multipliers + 1.0).min() < 1e-6


def test_at_a_fold_of_symmetric_motions_it_is_plus_one() -> None:
    model = symmetric(0.4, 0.3).with_({"coupling.gap.stiffness_ratio": 0.1})
    branch = gr.continuation(model, "excitation.frequency", (0.4, 1.3))
    folds = [event for event in branch.curves[0].events if event.kind == "fold"]
    assert len(folds) == 2
    for fold in folds:
        orbit = branch.orbit_at(fold.point, 1)
        assert np.abs(orbit.half_period_multipliers - 1.0).min() < 1e-6


def test_what_is_not_symmetric_is_refused() -> None:
    system = system_of(symmetric(0.6))
    assert is_symmetric(system)
    with pytest.raises(ValueError, match="odd number"):
        HalfPeriodMap(system, 2)
    loaded = replace(system, inputs=replace(system.inputs, mean=np.array([0.1])))
    second = system_of(symmetric(0.6).with_({"torque.0.harmonics.0.order": 2}))
    both = replace(second, inputs=replace(second.inputs, cycles=np.array([2.0])))
    for other in (loaded, both):
        assert not is_symmetric(other)
    with pytest.raises(ValueError, match="symmetric"):
        HalfPeriodMap(loaded)


def test_friction_on_one_side_alone_is_not_symmetric() -> None:
    """The law is an odd function; the slider acts in its drive stage and not in its coast stage."""
    stages = [{"stiffness": 400.0, "until": 0.01}, {"stiffness": 800.0, "hysteresis": 3.0}]
    coast = [{"stiffness": 400.0, "until": 0.01}, {"stiffness": 800.0}]
    clutch = {"name": "clutch", "between": ["hub", "wheel"], "stages": stages}
    couplings = [{**clutch, "coast_stages": coast}, FRICTION["coupling"][1]]
    assert not is_symmetric(system_of({**FRICTION, "coupling": couplings}))
    assert is_symmetric(system_of(FRICTION))


def test_several_periods_of_the_half_map_are_not_taken_apart() -> None:
    """Its motions stay symmetric however fast disturbances grow."""
    half = HalfPeriodMap(system_of(symmetric(0.25)), 9)
    assert not half.repeats_one_period
    assert PeriodMap(half.system, 9).repeats_one_period
