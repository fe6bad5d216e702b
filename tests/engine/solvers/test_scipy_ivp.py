"""SciPy's steppers: counts derived from what SciPy tells, convergence with the tolerance, failures as outcomes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from gearrattle.engine.solvers import SOLVERS, Task
from gearrattle.engine.solvers.scipy_ivp import FINEST
from gearrattle.outcome import Outcome
from tests.engine.solvers.tasks import GAP, finished, oscillator, run, task
from tests.engine.system.drivelines import clearance

NAMES = ["dop853", "radau"]
RATTLE = oscillator(clearance(4.0, 0.2, 0.5, 0.1), force=3.0)


def rattling(tolerance: float | None = None) -> Task:
    """Return an oscillator that crosses its corners again and again."""
    return replace(task(RATTLE, [0.9], [0.0], cycles=8), tolerance=tolerance)


@pytest.mark.parametrize("name", NAMES)
def test_crossings_are_those_of_exact_and_converge_with_the_tolerance(name):
    exact, errors = run(rattling()).crossings, []
    for tolerance in (1e-5, 1e-7, 1e-9):
        actual = run(rattling(tolerance), name).crossings
        assert np.array_equal(actual.to_piece, exact.to_piece)
        errors.append(np.abs(actual.time - exact.time).max())
        assert np.abs(actual.velocity - exact.velocity).max() <= 100 * errors[-1]
        assert np.abs(actual.force_integral - exact.force_integral).max() <= 100 * errors[-1]
    assert all(later < earlier / 3 for earlier, later in pairwise(errors))


def test_dop853_takes_twelve_evaluations_a_try_and_two_to_begin():
    motion = run(rattling(), "dop853")
    assert motion.rejected_steps > 0
    assert motion.function_calls == 2 + 12 * (motion.steps + motion.rejected_steps)
    values = run(replace(rattling(), step=0.01), "dop853")
    assert values.function_calls == 1 + 12 * (values.steps + values.rejected_steps)


def test_samples_cost_no_function_calls():
    dense = replace(rattling(), samples_per_cycle=300)
    assert run(dense, "dop853").function_calls == run(rattling(), "dop853").function_calls


def test_radau_rejects_what_it_tries_in_vain(monkeypatch):
    from scipy.integrate._ivp import radau

    solves = []
    solve = radau.solve_collocation_system

    def counted(*arguments):
        answer = solve(*arguments)
        solves.append((arguments[1], arguments[3], answer[0]))
        return answer

    monkeypatch.setattr(radau, "solve_collocation_system", counted)
    motion = run(rattling(), "radau")
    tries = len({(begin, step) for begin, step, _ in solves})  # a second solve of a step has a new Jacobian
    assert motion.steps + motion.rejected_steps == tries
    assert motion.rejected_steps > 0


@pytest.mark.parametrize("name", NAMES)
def test_steps_add_up_to_the_run(name):
    motion = run(rattling(), name)
    assert 0.0 < motion.smallest_step < min(motion.average_step, motion.average_trial_step)
    assert motion.steps * motion.average_step == pytest.approx(8.0)


@pytest.mark.parametrize("name", NAMES)
def test_a_tolerance_finer_than_scipy_s_is_noted(name):
    march = SOLVERS[name](task(oscillator(), [1.0], [0.0], cycles=1))
    assert finished(march).notes == ()
    (note,) = SOLVERS[name](rattling(1e-16)).stepper.notes
    assert f"{FINEST:.2g}" in note


@pytest.mark.parametrize("name", NAMES)
def test_failures_are_outcomes(name):
    failed = (Outcome.NO_CONVERGENCE, Outcome.NON_FINITE)
    assert SOLVERS[name](rattling(1e-300)).advance() in failed
    assert SOLVERS[name](task(oscillator(GAP), [1.0], [np.nan])).advance() is Outcome.NON_FINITE


def test_a_motion_without_bound_is_an_outcome():
    march = SOLVERS["dop853"](task(oscillator(drag=-1e4), [1.0], [0.0]))
    while (outcome := march.advance()) is Outcome.SLICE_SPENT:
        pass
    assert outcome is Outcome.NON_FINITE
    assert 0.0 < march.position().time < 1.0
