"""Stable motions by sweeps with exact runs: against branches, and what happens when the time is over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import Cancelled
from gearrattle.orbits.exact_runs import ExactRun, exact_run, map_of_one_period
from gearrattle.orbits.stability_ranges import losses_of
from gearrattle.orbits.start_states import state_of
from gearrattle.orbits.sweeps import Sweeper, Way
from gearrattle.orbits.swept_motions import Sweeps
from gearrattle.time_limits import OutOfTime, TimeLimit, limited

SPEED = "excitation.speed"
RANGE = (0.55, 0.95)


@pytest.fixture(scope="module")
def model() -> gr.Model:
    return gr.example("backlash_oscillator")


@pytest.fixture(scope="module")
def sweeps(model: gr.Model) -> Sweeps:
    return Sweeper(model, SPEED, RANGE, limit=TimeLimit()).sweep()


def test_sweeps_find_the_jumps_of_the_branch(model: gr.Model, sweeps: Sweeps) -> None:
    branch = gr.continuation(model, SPEED, RANGE)
    of_branch = sorted((loss.upward, loss.value) for loss in losses_of(branch) if loss.jumps)
    assert sweeps.is_complete
    assert not sweeps.failures
    known = sorted((jump.upward, jump.value, jump.error) for jump in sweeps.jumps)
    assert [upward for upward, _, _ in known] == [upward for upward, _ in of_branch]
    for (_, value, error), (_, exact) in zip(known, of_branch, strict=True):
        assert value == pytest.approx(exact, abs=error + 2e-3 * (RANGE[1] - RANGE[0]))


def test_two_motions_lie_between_the_jump_down_and_the_jump_up(sweeps: Sweeps) -> None:
    ((low, high),) = sweeps.coexistence
    down, up = sorted(jump.value for jump in sweeps.jumps)
    assert down < low < high < up
    assert all(jump.has_return for jump in sweeps.jumps)


def test_every_value_is_known_in_both_directions_of_the_grid(sweeps: Sweeps) -> None:
    assert len(sweeps.of_both) >= 97
    assert [run.value for run in sweeps.up] == sorted(run.value for run in sweeps.up)
    assert all(run.cycles == 1 for run in sweeps.up)


def test_a_motion_has_the_rms_of_a_simulation(model: gr.Model) -> None:
    period_map = map_of_one_period(model)
    run = exact_run(model, period_map, state_of(model, period_map, None), 0.0)
    settled = gr.simulate(model, cycles=200, discard=199, samples_per_cycle=32)
    deflection = settled.data["deflection"].values[199 * 32 : -1, 0]
    assert run.cycles == 1
    assert run.rms[0] == pytest.approx(deflection.std(), rel=1e-3)
    assert run.headline == gr.criteria(settled).headline


def test_a_run_goes_on_where_the_last_one_ended_sliders_included() -> None:
    """Twice 32 periods are the same as 64: with friction the stretches of sliders are a part of the state."""
    staged = {
        "schema": 1,
        "inertia": [{"name": "body", "J": 1.0, "drag": 0.02}],
        "coupling": [
            {
                "name": "clutch",
                "between": ["body", "ground"],
                "stages": [
                    {"stiffness": "1 N*m/rad", "until": "1 rad", "hysteresis": "0.2 N*m"},
                    {"stiffness": "4 N*m/rad", "hysteresis": "0.2 N*m"},
                ],
            }
        ],
        "excitation": {"speed": 1.3},
        "torque": [{"on": "body", "harmonics": [{"order": 1, "amplitude": "1 N*m"}]}],
    }
    model = gr.Model.from_tables(staged)
    period_map = map_of_one_period(model)
    start = state_of(model, period_map, None)
    whole = period_map.later(period_map.later(start, 32), 32)
    run = exact_run(model, period_map, start, 0.0, blocks=1)
    again = exact_run(model, period_map, run.end, 0.0, blocks=1)
    assert np.any(again.end.y[-len(period_map.system.memories) :] != 0.0)
    steps = again.periods + run.periods
    expected = whole if steps == 64 else period_map.later(start, steps)
    assert again.end.y == pytest.approx(expected.y, abs=1e-9)


def test_what_is_known_when_the_time_is_over_is_the_result(model: gr.Model) -> None:
    limit = TimeLimit()
    shares: list[float] = []

    def stop(share: float) -> None:
        shares.append(share)
        if share > 0.1:
            raise Cancelled

    sweeper = Sweeper(model, SPEED, RANGE, limit=limit, progress=stop)
    sweeps = sweeper.sweep()
    assert sweeper.is_stopped
    assert not sweeps.is_complete
    assert 0 < len(sweeps.values) < 97
    nothing = Sweeper(model, SPEED, RANGE, limit=TimeLimit(0.0)).sweep()
    assert nothing.values == []
    assert not nothing.is_complete


def test_a_limit_ends_a_march(model: gr.Model) -> None:
    period_map = map_of_one_period(model)
    state = state_of(model, period_map, None)
    with limited(TimeLimit(0.0)), pytest.raises(OutOfTime):
        period_map.later(state, 32)
    period_map.later(state, 32)


def test_what_is_known_can_be_asked_for_while_threads_add_to_it(model: gr.Model) -> None:
    class Watch:
        def __init__(self) -> None:
            self.words: list[str] = []

        def __call__(self, share: float) -> None:
            assert 0.0 <= share <= 1.0
            assert not sweeper.so_far.is_complete  # between two steps of other threads

        def because(self, words: str) -> None:
            self.words.append(words)

    watch = Watch()
    sweeper = Sweeper(
        model, SPEED, RANGE, limit=TimeLimit(), progress=watch, words=lambda known: f"{len(known.values)}"
    )
    assert sweeper.sweep().is_complete
    assert [int(word) for word in watch.words] == sorted(int(word) for word in watch.words)


def irregular(like: ExactRun, value: float, rms: float, scatter: float) -> ExactRun:
    """A motion that does not repeat, with this rms of its clearance."""
    return replace(like, value=value, cycles=0, rms=np.array([rms]), scatter=np.array([scatter]))


@pytest.mark.parametrize(
    ("rms", "scatter", "steps"),
    [
        ((1.0, 1.02, 1.8, 1.82), (0.01, 0.01, 0.01, 0.01), [(0, 1), (1, 2), (2, 3)]),
        ((1.0, 1.4, 1.8, 1.82), (0.01, 0.2, 0.01, 0.01), [(0, 2), (2, 3)]),
        ((1.0, 1.3, 1.5, 1.82), (0.01, 0.2, 0.2, 0.01), [(0, 3)]),
        ((1.0, 1.1, 1.2, 1.3), (0.01, 0.01, 0.01, 0.01), [(0, 1), (1, 2), (2, 3)]),
        ((1.0, 1.3, 1.6, 2.0), (0.01, 0.01, 0.01, 0.01), [(0, 1), (1, 2), (2, 3)]),
    ],
)
def test_a_motion_on_its_way_to_another_does_not_hide_a_jump(
    sweeps: Sweeps, rms: tuple[float, ...], scatter: tuple[float, ...], steps: list[tuple[int, int]]
) -> None:
    way = Way(upward=True)
    for i, (size, error) in enumerate(zip(rms, scatter, strict=True)):
        way.runs[float(i)] = irregular(sweeps.up[0], float(i), size, error)
    assert [(int(first.value), int(last.value)) for first, last in way.decided_steps] == steps


def test_a_motion_that_was_followed_for_long_is_no_longer_passed_over(sweeps: Sweeps) -> None:
    way = Way(upward=True)
    for i, (size, error) in enumerate(((1.0, 0.01), (1.4, 0.2), (1.8, 0.01))):
        way.runs[float(i)] = irregular(sweeps.up[0], float(i), size, error)
    way.longer[1.0] = 4
    assert [(first.value, last.value) for first, last in way.decided_steps] == [(0.0, 1.0), (1.0, 2.0)]
