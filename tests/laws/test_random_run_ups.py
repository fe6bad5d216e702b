"""Random run-ups come back, in few steps, and cross corners when an integration of their formulas does."""

from __future__ import annotations

import time

import numpy as np
import pytest

import gearrattle as gr
from tests.laws.run_ups import CLEARANCE, NUDGE, draw, integrated, model_of

APART = 1e-11
"""Of the run: how far the crossings of two exact integrations may be apart before errors grow."""
COMPARABLE = 1e-6
"""Of the run: crossings that the nudge has moved farther are not compared."""
MOST_STEPS = 40
"""Per period, crossing and corner of the inputs; those measured: 2, at most 12."""
SLICE = 0.5
"""[s] of processor time, in which Ctrl-C must be heard."""


def crossings_compared(seed: int) -> int:
    """Compare one run-up with its integration; how many crossings could be compared."""
    run_up = draw(seed)
    slices = [time.process_time()]
    run = gr.simulate(
        model_of(run_up),
        samples_per_cycle=16,
        discard=0,
        audit=False,
        progress=lambda _: slices.append(time.process_time()),
    )
    assert np.diff(slices[1:]).max(initial=0.0) < SLICE
    events, end = run.trajectory.events, run.trajectory.end
    work = len(run_up.breaks) + len(events.time) + run_up.cycles
    assert run.cost.steps < MOST_STEPS * work
    times, pieces, state = integrated(run_up, end)
    nudged_times, nudged_pieces, nudged_state = integrated(run_up, end, NUDGE)
    allowed, count = APART * end, min(len(times), len(nudged_times))
    for i in range(count):
        allowed = max(allowed, 2.0 * abs(nudged_times[i] - times[i]))
        if nudged_pieces[i] != pieces[i] or allowed > COMPARABLE * end:
            return i
        assert i < len(events.time), f"crossing {i} at {times[i]} s is missing"
        assert abs(events.time[i] - times[i]) <= allowed, f"crossing {i} of {count} at {times[i]} s"
        assert events.to_region[i] == pieces[i]
    if len(times) == len(nudged_times):
        assert len(events.time) == count
        size = np.array([CLEARANCE, CLEARANCE, 1.0, 1.0])
        reached = np.concatenate([run.trajectory.angle[-1], run.trajectory.velocity[-1]])
        off = np.abs(nudged_state - state) / size
        assert np.all(np.abs(reached - state) / size <= np.maximum(2.0 * off.max(), 1e-9))
    return count


@pytest.mark.parametrize("seed", [0, 1, 3, 5, *(pytest.param(seed, marks=pytest.mark.long) for seed in (2, 4))])
def test_a_run_up_crosses_corners_when_its_formulas_do(seed: int) -> None:
    crossings_compared(seed)


@pytest.mark.long
@pytest.mark.parametrize("first", range(100, 300, 20))
def test_run_ups_cross_corners_when_their_formulas_do(first: int) -> None:
    compared = [crossings_compared(seed) for seed in range(first, first + 20)]
    assert sum(compared) > 100
