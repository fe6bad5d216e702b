"""Starts that are none are refused by the argument's own name."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.orbit import contact_state, linear_state
from gearrattle.orbits.start_states import state_of


@pytest.mark.parametrize("start", ["foo", 5, [1, 2], np.zeros(2)])
def test_a_start_that_is_none_is_refused_with_all_that_are(start: Any) -> None:
    with pytest.raises(gr.ModelError) as refused:
        gr.periodic(gr.example("rattle_oscillator"), start=start)
    message = str(refused.value)
    assert message.startswith("start: ")
    for word in ("static", "zero", "linear", "run", "orbit", "angle"):
        assert word in message


def test_a_start_in_a_table_of_another_size_names_the_table() -> None:
    with pytest.raises(gr.ModelError, match="angle"):
        gr.periodic(gr.example("rattle_oscillator"), start={"angle": [0.0, 0.0], "velocity": [0.0, 0.0]})


def test_an_orbit_of_other_inertias_is_refused() -> None:
    other = gr.periodic(gr.example("backlash_oscillator").with_({"excitation.speed": 1.2}))
    with pytest.raises(gr.ModelError, match=r"start: .*same inertias, flywheel"):
        gr.periodic(gr.example("case1"), start=other)


def test_a_start_beside_every_motion_is_refused() -> None:
    with pytest.raises(gr.ModelError, match=r'start: found "static"; is not used by every=True'):
        gr.periodic(gr.example("rattle_oscillator"), every=True, start="static")


def test_inputs_that_do_not_repeat_are_refused_by_their_paths() -> None:
    with pytest.raises(gr.ModelError, match=r"excitation.sweep: found a sweep of the speed; a periodic motion needs"):
        gr.periodic(gr.example("run_up"))
    with pytest.raises(gr.ModelError, match=r"motion.0.signal: found a record on flywheel; a periodic motion needs"):
        gr.periodic(gr.example("measured_flywheel"))


def test_where_the_linear_start_is_lost_the_share_of_the_harmonics_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    follow = Continuation.follow

    def lost(self: Continuation, *arguments: Any) -> Iterator[Point]:
        yield from islice(follow(self, *arguments), 3)
        raise ConvergenceError("the branch cannot be followed beyond 0.05")

    monkeypatch.setattr(Continuation, "follow", lost)
    with pytest.raises(gr.ConvergenceError, match=r"followed to \d.* % of all harmonics, .*another start"):
        gr.periodic(gr.example("rattle_oscillator"), start="linear")


@pytest.mark.parametrize("name", ["driveline_lash", "dual_mass_flywheel", "rattle_oscillator"])
def test_a_note_says_where_a_simulation_does_not_come_to_the_motion(name: str) -> None:
    model = gr.example(name).with_({"simulation.initial": "static"})
    motion = gr.periodic(model)
    run = gr.simulate(model.with_({"simulation.cycles": 300}), "exact")
    samples = 20 * motion.run.data["time"].size  # an irregular run does not swing alike in so many periods
    swings = [np.ptp(r.data["deflection"][-samples:].to_numpy(), axis=0) for r in (run, motion.run)]
    comes_to_it = np.allclose(*swings, rtol=0.02)
    assert motion.stable
    assert any("may show another" in note for note in motion.notes) == (not comes_to_it)


@pytest.mark.long
def test_a_motion_with_friction_that_settles_after_two_periods_says_so() -> None:
    with pytest.raises(gr.ConvergenceError, match=r"settles in one that repeats after 2 periods; try: cycles=2"):
        gr.periodic(gr.example("clutch_friction"))


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("alternating_mesh", {"excitation.speed": "3000 rpm"}),
        ("backlash_oscillator", {"excitation.speed": 0.3}),
        ("driveline_lash", {"torque.0.harmonics.0.amplitude": 10.0}),
    ],
)
def test_the_motion_in_contact_is_that_which_grows_out_of_the_rest(name: str, changes: dict[str, Any]) -> None:
    model = gr.example(name).with_(changes)
    period_map = PeriodMap(assemble(model).system, 1)
    rest = state_of(model, period_map, "static")
    state = contact_state(period_map, rest)
    assert state is not None
    scale = period_map.scale
    np.testing.assert_allclose(state.y * scale, linear_state(period_map, rest).y * scale, atol=1e-10)


def test_no_motion_in_contact_swings_over_a_corner() -> None:
    model = gr.example("backlash_oscillator")
    for speed in (0.3, 1.0):  # below resonance, and at it
        one = model.with_({"excitation.speed": speed})
        swing = 0.05 * speed**2 / abs(1.0 - speed**2 + 0.1j * speed)
        period_map = PeriodMap(assemble(one).system, 1)
        assert (contact_state(period_map, state_of(one, period_map, "static")) is None) == (swing > 0.1)
