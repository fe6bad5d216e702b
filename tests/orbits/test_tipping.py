"""The smallest pulse that tips a motion over: on both sides of it, and along the saddle between."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.periodic.period_map import PeriodMap, State
from gearrattle.engine.system.auxiliary import FORWARD, STICK
from gearrattle.orbits import Orbit
from tests.orbits.test_branch import oscillator
from tests.orbits.test_friction import oscillator as with_friction

AT = {"excitation.frequency": 0.75}
"""Three motions repeat after one period here: a small one, a large one, and the saddle between."""


@cache
def quiet() -> Orbit:
    return gr.periodic(oscillator().with_(AT), start="linear")


def swing_after(speed: float) -> float:
    """Peak-to-peak deflection long after the body has been given a speed at t = 0."""
    orbit = quiet()
    state = {"angle": orbit.state["angle"], "velocity": [orbit.state["velocity"][0] + speed]}
    run = gr.simulate(orbit.model, cycles=120, discard=110, samples_per_cycle=64, initial=state, audit=False)
    return float(np.ptp(run.data["deflection"].values[-65:]))


@pytest.mark.parametrize("way", ["forward", "backward"])
def test_a_smaller_pulse_dies_out_and_a_larger_one_does_not(way: str) -> None:
    pulse = float(quiet().tipping("body", instants=1)[way][0])  # the inertia is one
    own = float(np.ptp(quiet().run.data["deflection"].values))
    assert swing_after(0.99 * pulse) == pytest.approx(own, rel=1e-3)
    assert swing_after(1.01 * pulse) > 2.0 * own


def test_on_the_border_the_motion_comes_near_the_saddle() -> None:
    pulse = float(quiet().tipping("body", instants=1)["forward"][0])
    saddle = next(orbit for orbit in gr.periodic(quiet().model, every=True) if not orbit.stable)
    period_map = quiet().period_map
    state = State(quiet().motion.start.y + np.array([0.0, pulse]))
    nearest = np.inf
    for _ in range(40):
        state = period_map.later(state)
        nearest = min(nearest, float(np.linalg.norm(state.y - saddle.motion.start.y)))
    assert nearest < 1e-3


def test_the_instant_is_that_of_the_motion() -> None:
    """At half a period later the pulse acts on the motion shifted by as much: harmonics and state go together."""
    pulses = quiet().tipping("body", instants=2)
    half = quiet().model.with_({"coupling.gap.kinematic_error.0.phase": np.pi / 2 + np.pi})
    shifted = gr.periodic(half, start="linear").tipping("body", instants=1)
    assert pulses["forward"][1] == pytest.approx(shifted["forward"][0], rel=1e-5)


def test_at_the_best_instant_a_smaller_pulse_is_enough_than_at_any_other() -> None:
    rows, evenly = quiet().tipping("body", instants=1, best=True), quiet().tipping("body", instants=16)
    assert rows["share"].is_monotonic_increasing
    assert len(rows) == 3
    for way in ("forward", "backward"):
        size, known = rows[way].abs(), evenly[way].abs()
        best, nearest = size.idxmin(), known.idxmin()
        assert known.min() - 0.01 * known.min() < size[best] < known.min()
        assert abs(rows["share"][best] - evenly["share"][nearest]) < 1.0 / 16


def test_what_is_not_stable_or_not_there_is_refused() -> None:
    with pytest.raises(gr.ModelError, match="must be a free inertia: body"):
        quiet().tipping("bodi")
    saddle = next(orbit for orbit in gr.periodic(quiet().model, every=True) if not orbit.stable)
    with pytest.raises(gr.ModelError, match="for a stable motion"):
        saddle.tipping("body")


def test_instants_need_not_divide_a_power_of_two() -> None:
    """At thirds of the period pulses are as large as elsewhere: the state is that of the motion there."""
    pulses = quiet().tipping("body", instants=3)
    assert np.all(pulses["forward"] > 0.01)
    assert np.all(pulses["backward"] < -0.01)


def test_what_dies_out_too_slowly_is_refused() -> None:
    slow = quiet().model.with_({"coupling.gap.damping": 1e-5})
    with pytest.raises(gr.ModelError, match="dies out too slowly"):
        gr.periodic(slow, start="linear").tipping("body")


def test_a_pulse_that_reverses_a_slip_lets_the_slider_stick() -> None:
    """Then its spring follows the deflection from its bound; a pulse along the slip leaves it at the bound."""
    orbit = gr.periodic(with_friction(0.77), start={"angle": [2.5], "velocity": [0.0]})
    period_map, rows = orbit.period_map, 400
    march = period_map.marched(orbit.motion.start, samples_per_cycle=rows)
    states = [period_map.sampled(march, row * orbit.cycles) for row in range(rows)]
    row = next(row for row, state in enumerate(states) if state.auxiliary_pieces[0] == FORWARD)
    inputs = period_map.system.inputs.later(row * orbit.cycles / rows)
    ahead = PeriodMap(replace(period_map.system, inputs=inputs), orbit.cycles)
    speed = states[row].y[1]
    assert speed > 0.0
    for factor, piece in ((-3.0, STICK), (2.0, FORWARD)):
        struck = ahead.struck(states[row], np.array([0.0, factor * speed, 0.0]))
        assert struck.auxiliary_pieces.tolist() == [piece]
        path = ahead.marched(struck, samples_per_cycle=8 * rows)
        first, second = (ahead.sampled(path, k).y for k in (0, 1))
        moved = second[0] - first[0] if piece == STICK else 0.0
        assert second[2] - first[2] == pytest.approx(moved, abs=1e-12)
        assert abs(second[0] - first[0]) > 1e-5
