"""A motion with many crossings is no chatter: only crossings in a row at one instant count."""

from __future__ import annotations

import pytest

import gearrattle as gr
from gearrattle.engine.kernels import march, step_loop, window_march
from gearrattle.engine.kernels._jit import is_compiling

pytestmark = pytest.mark.skipif(is_compiling(), reason="changes a limit of plain kernels: make plain")

START = {"angle": [-0.3], "velocity": [-3.9]}


@pytest.mark.parametrize("algorithm", ["exact", "rk4", "rkf"])
def test_crossings_apart_in_time_are_not_counted_together(algorithm: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for module, name in ((march, "MOST_STALLED"), (window_march, "MOST_STALLED"), (step_loop, "_MOST_STALLED")):
        monkeypatch.setattr(module, name, 2)
    model = gr.example("rattle_oscillator")
    run = gr.simulate(model, algorithm=algorithm, cycles=4, discard=0, samples_per_cycle=16, initial=START, audit=False)
    assert len(run.events) > 8
