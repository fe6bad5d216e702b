"""With ``NUMBA_DISABLE_JIT=1`` every kernel runs as plain Python, callbacks of C libraries too."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.model import ALGORITHMS

_SHORT: dict[str, Any] = {"discard": 0, "samples_per_cycle": 32}
_PROGRAM = f"""
import json, sys
import gearrattle as gr

def angle(example, **how):
    return gr.simulate(gr.example(example), **how, **{_SHORT!r}).data.angle.values.tolist()

motions = {{name: angle("backlash_oscillator", algorithm=name, cycles=3) for name in sys.argv[1:]}}
print(json.dumps(motions | {{"train": angle("case3", cycles=1)}}))
"""


@pytest.fixture(scope="module")
def plain() -> dict[str, np.ndarray]:
    command = [sys.executable, "-c", _PROGRAM, *ALGORITHMS]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return {name: np.array(angle) for name, angle in json.loads(done.stdout).items()}


@pytest.mark.slow
@pytest.mark.compiled
def test_plain_kernels_give_the_motion_of_a_train(plain: dict[str, np.ndarray]) -> None:
    angle = gr.simulate(gr.example("case3"), cycles=1, **_SHORT).data.angle.values
    assert plain["train"] == pytest.approx(angle, abs=1e-10 * np.ptp(angle))


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_plain_kernels_give_the_motion_of_compiled_ones(algorithm: str, plain: dict[str, np.ndarray]) -> None:
    run = gr.simulate(gr.example("backlash_oscillator"), algorithm=algorithm, cycles=3, **_SHORT)
    travel = np.ptp(run.data.angle.values)
    allowed = 1e-10 if algorithm == "exact" else 1e-2  # the others choose other steps where rounding differs
    assert plain[algorithm] == pytest.approx(run.data.angle.values, abs=allowed * travel)
