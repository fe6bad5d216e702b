"""Periodic motions that irregular ones nearly repeat, and what is said where there are none."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.known_motions import at_mean_speed, orbit_of_returns
from gearrattle.orbits.start_states import state_of
from tests.orbits.test_laws import symmetric


def at(name: str, speed: float) -> tuple[gr.Model, PeriodMap]:
    model = gr.example(name).with_({"excitation.speed": speed})
    return model, PeriodMap(assemble(model).system)


def test_an_unstable_motion_of_a_gearbox_that_never_settles() -> None:
    """Case 2 at 150 rad/s: disturbances grow more than a thousand times within a period."""
    model, once = at("case2", 150.0)
    orbit = gr.periodic(model.with_({"simulation.initial": "static"}))
    assert orbit.cycles == 1
    assert orbit.residual < 1e-12
    assert not orbit.stable
    assert abs(orbit.multipliers[0]) > 1e3
    displaced = State(orbit.motion.start.y * (1.0 + 1e-13))
    away = np.linalg.norm((once.later(displaced).y - orbit.motion.start.y) * once.scale) / once.size
    assert away < 1e-12 * abs(orbit.multipliers[0])


def test_motions_of_a_chaotic_oscillator() -> None:
    once = PeriodMap(assemble(symmetric(0.25).with_({"torque.0.mean": 0.05})).system)
    start = once.later(State(np.array([0.3, 0.1])), 100)
    for cycles in (1, 2, 4):
        orbit = orbit_of_returns(PeriodMap(once.system, cycles), start)
        assert orbit.residual < 1e-10
        assert abs(orbit.multipliers[0]) > 1.0
        y = once.later(orbit.motion.start, cycles).y
        assert np.linalg.norm(y - orbit.motion.start.y) < 1e-9


def test_what_repeats_after_another_number_of_periods_is_told_with_the_number() -> None:
    once = PeriodMap(assemble(symmetric(0.2).with_({"torque.0.mean": 0.05})).system)
    start = once.later(State(np.array([0.3, 0.1])), 100)
    for cycles in (1, 2, 6):
        with pytest.raises(ConvergenceError, match="settles in one that repeats after 4 periods") as caught:
            orbit_of_returns(PeriodMap(once.system, cycles), start)
        assert "cycles=4" in str(caught.value)
    assert orbit_of_returns(PeriodMap(once.system, 4), start).residual < 1e-12


def test_a_train_comes_to_its_mean_speed() -> None:
    model, once = at("case3", 150.0)
    start = state_of(model, once, "static")

    def mean_speed(state: State) -> float:
        march = once.marched(state, 256)
        return float((once.turned(march, -1) - once.turned(march, 128))[0] / (128 * once.length))

    later = at_mean_speed(once, start)
    assert abs(mean_speed(later)) < 0.01 * abs(mean_speed(start))
