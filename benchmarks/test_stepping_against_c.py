"""``rkf`` and ``rkv`` beside the same pairs hand-written in C: cost of a step, tried or taken, on case 3.

*Smooth*: under the moderate load no corner is met, so both do the same. *Rattling*: ours also locates and logs a
crossing in one of fourteen steps tried, which the C version does not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from benchmarks.native.library import build, compiler, march
from gearrattle.assembly import assemble
from gearrattle.engine.solvers import SOLVERS, Task
from gearrattle.engine.solvers.step_stability import default_step
from gearrattle.engine.solvers.tableaus import FEHLBERG, VERNER, Tableau
from gearrattle.engine.solvers.vector_field import FieldProblem
from gearrattle.outcome import Outcome
from gearrattle.reproduction.paper_cases import load_case

CYCLES, TOLERANCE = 20, 1e-6
PAIRS = [FEHLBERG, VERNER]


@pytest.fixture(scope="module", params=["smooth", "rattling"])
def problem(request: pytest.FixtureRequest) -> FieldProblem:
    smooth = request.param == "smooth"
    model = load_case(3, 0.5 if smooth else 0.05, loaded=smooth)
    start = gr.equilibrium(model).angle
    return FieldProblem.of(Task(assemble(model).system, start, np.zeros(4), CYCLES, 1, TOLERANCE, None, audit=False))


def _group(problem: FieldProblem, tableau: Tableau) -> str:
    carried = abs(float(problem.task.system.inputs.mean[-1])) > 1.0
    return f"{tableau.name}, {'smooth' if carried else 'rattling'}"


@pytest.mark.parametrize("tableau", PAIRS, ids=lambda t: t.name)
def test_kernel(benchmark: Any, problem: FieldProblem, tableau: Tableau) -> None:
    benchmark.group = _group(problem, tableau)

    def run() -> Any:
        solver = SOLVERS[tableau.name](problem.task)
        while solver.advance() is not Outcome.DONE:
            pass
        return solver.motion()

    motion = benchmark.pedantic(run, rounds=5, warmup_rounds=1)
    benchmark.extra_info["tried"] = motion.steps + motion.rejected_steps


@pytest.mark.skipif(compiler() is None, reason="no C compiler on this machine")
@pytest.mark.parametrize("tableau", PAIRS, ids=lambda t: t.name)
def test_c(benchmark: Any, problem: FieldProblem, tableau: Tableau, tmp_path: Path) -> None:
    benchmark.group = _group(problem, tableau)
    function, step = build(tmp_path), default_step(problem.flow, problem.start)
    end = float(problem.sample_times[-1])
    _, counts = benchmark.pedantic(
        lambda: march(function, problem, tableau, tolerance=TOLERANCE, step=step, end=end), rounds=5, warmup_rounds=1
    )
    benchmark.extra_info["tried"] = int(counts.sum())


def test_both_give_the_same_motion_to_the_tolerance(problem: FieldProblem, tmp_path: Path) -> None:
    if compiler() is None:
        pytest.skip("no C compiler on this machine")
    step, end = default_step(problem.flow, problem.start), float(problem.sample_times[-1]) / CYCLES / 8
    y, counts = march(build(tmp_path), problem, VERNER, tolerance=TOLERANCE, step=step, end=end)
    task = Task(problem.task.system, problem.task.angle, problem.task.velocity, 1, 8, TOLERANCE, None, audit=False)
    solver = SOLVERS["rkv"](task)
    while solver.advance() is not Outcome.DONE:
        pass
    motion = solver.motion()
    assert counts.sum() > 20
    assert np.allclose(motion.velocity[1], y[problem.field.basis.shape[0] :][:4], rtol=1e-4, atol=1e-6)
