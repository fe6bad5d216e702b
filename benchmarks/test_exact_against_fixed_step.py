"""127 cycles of the paper's six cases, one sample a cycle: ``exact`` against the fastest plain RK2, h = 0.001/150 s.

Both run warm in one process; each round starts afresh from the static equilibrium. The closing table (``conftest``)
prints the ratio.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from benchmarks.midpoint import march, transmission

CASES = ("case1", "case2", "case3", "case1_loaded", "case2_loaded", "case3_loaded")
CYCLES = 127
STEP = 0.001 / 150.0


def _model(case: str) -> gr.Model:
    return gr.load(Path(__file__).resolve().parents[1] / "examples" / "paper" / f"{case}.toml")


@pytest.mark.parametrize("case", CASES)
def test_exact(benchmark: Any, case: str) -> None:
    model = _model(case)
    benchmark.group = case
    run = benchmark.pedantic(
        lambda: gr.simulate(model, cycles=CYCLES, discard=0, samples_per_cycle=1, audit=False),
        rounds=5,
        warmup_rounds=1,
    )
    benchmark.extra_info["events"] = len(run.events)
    assert run.data.sizes["time"] == CYCLES + 1


@pytest.mark.parametrize("case", CASES)
def test_midpoint(benchmark: Any, case: str) -> None:
    model = _model(case)
    benchmark.group = case
    start = np.concatenate([gr.equilibrium(model).angle, np.zeros(4)])
    plant = transmission(model)
    steps = round(CYCLES * 2 * np.pi / model.excitation.omega / STEP)

    def run() -> Any:
        state = start.copy()
        march(state, STEP, steps, plant)
        return state

    state = benchmark.pedantic(run, rounds=5, warmup_rounds=1)
    assert np.isfinite(state).all()
