"""The benchmarks' RK2 and RK4, written out for one driveline, are the methods of the shelf."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmarks.midpoint import march, march_4, transmission

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.solvers.one_step import StepMarch
from gearrattle.engine.solvers.solver import Task
from gearrattle.engine.solvers.tableaus import CLASSICAL, MIDPOINT

CASES = Path(__file__).resolve().parents[3] / "examples" / "paper"
STEP, STEPS = 0.001 / 150.0, 5000


@pytest.mark.parametrize("case", ["case1", "case1_loaded", "case2_loaded", "case3_loaded"])
@pytest.mark.parametrize(("written_out", "tableau"), [(march, MIDPOINT), (march_4, CLASSICAL)])
def test_the_yardstick_takes_the_same_steps(case: str, written_out, tableau) -> None:
    """To rounding, 5000 steps on: transmission errors, both sides of every clearance and all five orders included."""
    model = gr.load(CASES / f"{case}.toml")
    rest = gr.equilibrium(model).angle
    state = np.concatenate([rest, np.zeros(4)])
    written_out(state, STEP, STEPS, transmission(model))
    task = Task(assemble(model).system, rest, np.zeros(4), 2, 1, None, STEP, audit=False)
    own = StepMarch(task, tableau, fixed=True, held=False)
    own.advance(STEPS)
    basis = own.problem.flow.coordinates.basis
    deflection, velocity = own.stepper.y[: len(basis)], own.stepper.y[len(basis) : len(basis) + 4]
    np.testing.assert_allclose(basis @ state[:4], deflection, rtol=0, atol=1e-12 * np.abs(state[:4]).max())
    np.testing.assert_allclose(state[4:], velocity, rtol=0, atol=1e-11 * np.abs(velocity).max())
