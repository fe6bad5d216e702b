"""Multiple shooting: motions over so many periods that one state at the start cannot hold them."""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.motion import Pass, State, joined
from gearrattle.engine.periodic.multiple_shooting import EIGHTHS, maps_of_parts
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.shooting import shoot, shoot_in_parts
from gearrattle.errors import ConvergenceError
from tests.engine.periodic.test_shooting import oscillator
from tests.orbits.test_laws import symmetric


def saddle() -> tuple[PeriodMap, State, np.ndarray]:
    """The unstable motion of period T at W = 0.75, and its multipliers."""
    once = oscillator(0.75)
    model = gr.example("backlash_oscillator")
    unstable = next(orbit for orbit in gr.periodic(model, every=True) if not orbit.stable)
    orbit = shoot(once, State(unstable.motion.start.y))
    return once, orbit.motion.start, orbit.multipliers


def test_a_motion_that_grows_disturbances_by_more_than_the_rounding() -> None:
    once, state, multipliers = saddle()
    cycles = int(np.ceil(np.log(1e12) / np.log(abs(multipliers[0]))))
    many = PeriodMap(once.system, cycles)
    motion, residual, _ = shoot_in_parts(many, state, 1e-12)
    assert residual < 1e-12
    np.testing.assert_allclose(motion.start.y, state.y, rtol=0, atol=1e-12)
    assert motion.cycles == cycles
    displaced = replace(state, y=state.y + 1e-15)
    assert np.linalg.norm(many(displaced).gap) > 1e-9  # followed from one start, off by its rounding, it does not close
    orbit = shoot(many, state)
    assert orbit.residual < 1e-12
    assert abs(abs(orbit.multipliers[0]) / abs(multipliers[0]) ** cycles - 1.0) < 1e-6


def test_parts_joined_are_the_whole() -> None:
    once = oscillator(0.75)
    many = PeriodMap(once.system, 3)
    start = State(np.array([0.4, 0.2]))
    parts = [once(start)]
    for _ in range(2):
        parts.append(once(parts[-1].end))
    whole, together = many(start), joined(parts, many.system.inputs.period, many.cycles)
    np.testing.assert_allclose(together.end.y, whole.end.y, rtol=0, atol=1e-11)
    np.testing.assert_allclose(together.gradient, whole.gradient, rtol=0, atol=1e-10)
    np.testing.assert_allclose(together.crossings.time, whole.crossings.time, rtol=0, atol=1e-10)
    assert np.array_equal(together.crossings.watch, whole.crossings.watch)


def test_eighths_joined_are_the_whole() -> None:
    """Each eighth begins where the inputs are an eighth of a period later: torques and transmission errors."""
    model = gr.example("case3").with_({"mesh.gear.transmission_error": [{"order": 3, "amplitude": "5 um"}]})
    once = PeriodMap(assemble(model).system)
    start = once.later(once.state_of(np.zeros(4), np.zeros(4)), 20)
    parts = list[Pass]()
    for part_map in maps_of_parts(once, EIGHTHS):
        parts.append(part_map(parts[-1].end if parts else start))
    whole, together = once(start), joined(parts, once.system.inputs.period, once.cycles)
    scale = once.scale
    assert np.linalg.norm((together.end.y - whole.end.y) * scale) < 1e-9 * once.size
    change = scale[:, None] * (together.gradient - whole.gradient) / scale
    assert np.linalg.norm(change) < 1e-9 * np.linalg.norm(scale[:, None] * whole.gradient / scale)
    np.testing.assert_allclose(together.turned, whole.turned, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(together.crossings.time, whole.crossings.time, rtol=0, atol=1e-10 * once.length)
    assert np.array_equal(together.crossings.watch, whole.crossings.watch)
    assert (together.cycles, together.period) == (whole.cycles, whole.period)


@pytest.mark.parametrize("parts", [1, EIGHTHS])
def test_parts_of_a_period_lead_to_the_same_motion(parts: int) -> None:
    once, state, multipliers = saddle()
    orbit = shoot(once, State(state.y + 1e-3), parts_of_period=parts)
    assert orbit.residual < 1e-12
    np.testing.assert_allclose(orbit.motion.start.y, state.y, rtol=0, atol=1e-11)
    np.testing.assert_allclose(orbit.multipliers, multipliers, rtol=1e-8)


def test_parts_are_whole_periods_where_stiffness_alternates_by_the_clock() -> None:
    alternating = PeriodMap(assemble(gr.example("alternating_mesh")).system, 3)
    assert [part_map.length for part_map in maps_of_parts(alternating, EIGHTHS)] == [
        alternating.system.inputs.period
    ] * 3


@pytest.mark.parametrize("cycles", [12, 24])
def test_motions_that_lie_in_a_chaotic_one(cycles: int) -> None:
    """From the six nearest returns of a chaotic motion; a motion found lies near what it was sought from."""
    system = assemble(symmetric(0.25).with_({"torque.0.mean": 0.05})).system
    once, many = PeriodMap(system), PeriodMap(system, cycles)
    march = once.marched(State(np.array([0.3, 0.1])), 400)
    states = [once.sampled(march, k) for k in range(100, 401)]
    y = np.array([state.y for state in states])
    returns = np.linalg.norm(y[cycles:] - y[:-cycles], axis=1)
    orbits = []
    for k in np.argsort(returns)[:6]:
        with contextlib.suppress(ConvergenceError):
            orbits.append((k, shoot(many, states[k])))
    assert len(orbits) >= 2
    for k, orbit in orbits:
        assert orbit.residual < 1e-12
        assert abs(orbit.multipliers[0]) > 10.0
        state = orbit.motion.start
        for _ in range(cycles // 2):
            state = once.later(state)
        assert np.linalg.norm(state.y - y[k + cycles // 2]) < 0.5
