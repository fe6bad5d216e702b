"""A six-speed gearbox with friction in its staged clutch: an answer against a sweep of 200 speeds by brute force.

No branch can be followed there within minutes: nine bodies, three sliders, up to 300 crossings a period, mostly chaos.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.orbits.balanced import balanced
from gearrattle.orbits.exact_runs import ExactRun, carried, exact_run, map_of_one_period
from gearrattle.orbits.start_states import state_of

SPEED = "excitation.speed"
RPM = np.pi / 30.0
RANGE = (600.0 * RPM, 3000.0 * RPM)
SPEEDS = np.linspace(*RANGE, 200)
STEP = float(SPEEDS[1] - SPEEDS[0])
ABRUPT = np.log(1.5)
LASTING = 3
FILE = Path(__file__).with_name("six_speed.toml")


def swept(model: gr.Model, values: np.ndarray) -> list[ExactRun]:
    """One run of 128 periods at every value, each from the end of the one before."""
    runs = list[ExactRun]()
    before = None
    for value in values.tolist():
        driveline = model.with_({SPEED: value})
        period_map = map_of_one_period(driveline)
        if before is None:
            state = period_map.later(state_of(driveline, period_map, None), 128)
        else:
            state = carried(runs[-1].end, before, period_map)
        runs.append(exact_run(driveline, period_map, state, value))
        before = period_map
    return runs


def jumps_in(runs: list[ExactRun]) -> list[tuple[float, float]]:
    """Steps over which the rms of a clearance changes for good, by half or more.

    All of the three motions before differ by so much from all of the three after: single irregular motions scatter.
    """
    steps = []
    for i in range(len(runs) - 1):
        before = runs[max(0, i + 1 - LASTING) : i + 1]
        after = runs[i + 1 : i + 1 + LASTING]
        changes = np.array([last.ratios(first) for first in before for last in after])
        grows = changes.min(axis=0)
        falls = -changes.max(axis=0)
        if np.any(np.maximum(grows, falls) > ABRUPT):
            steps.append((runs[i].value, runs[i + 1].value))
    return steps


@pytest.mark.long
def test_every_jump_of_a_brute_force_sweep_is_named() -> None:
    model = gr.load(FILE)
    brute = {upward: jumps_in(swept(balanced(model), SPEEDS if upward else SPEEDS[::-1])) for upward in (True, False)}
    assert all(len(steps) >= 2 for steps in brute.values())
    branch = gr.continuation(model, SPEED, RANGE, within="20 min")
    sweeps = branch.sweeps
    assert sweeps is not None
    assert len(sweeps.values) >= 40
    for upward, steps in brute.items():
        named = [jump for jump in sweeps.jumps if jump.upward == upward]
        for step in steps:
            nearest = min(named, key=lambda jump: abs(jump.value - np.mean(step)))
            assert abs(nearest.value - np.mean(step)) < nearest.error + 3.0 * STEP


def test_a_short_time_gives_what_is_known_and_says_what_is_not() -> None:
    """Over a narrow range at high speed, where a period has few impacts."""
    branch = gr.continuation(gr.load(FILE), SPEED, (2400.0 * RPM, 3000.0 * RPM), within=8.0)
    assert branch.sweeps is not None
    assert len(branch.sweeps.values) >= 5
    assert any(note.startswith("No branch was followed") for note in branch.notes)
    assert branch.sentence.startswith("Over speed from 2400 to 3000 rpm")
    assert ": one stable motion everywhere." in branch.sentence
