"""CVODE's methods: counts that are CVODE's own, crossings that converge, failures as outcomes, nothing left behind."""

from __future__ import annotations

import ctypes
import gc
import sys
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from gearrattle.cli import main
from gearrattle.engine.kernels import callbacks
from gearrattle.engine.solvers import SOLVERS, Task, sundials
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ModelError
from gearrattle.outcome import Outcome
from tests.engine.solvers.tasks import GAP, finished, oscillator, run, task
from tests.engine.system.drivelines import clearance, inputs, linear, random_chain

BLIND = ["adams", "gear"]
NAMES = [*BLIND, "gear-events"]
RATTLE = oscillator(clearance(4.0, 0.2, 0.5, 0.1), force=3.0)


def rattling(tolerance: float | None = None, cycles: int = 8) -> Task:
    """Return an oscillator that crosses its corners again and again."""
    return replace(task(RATTLE, [0.9], [0.0], cycles=cycles), tolerance=tolerance)


@pytest.mark.parametrize("name", NAMES)
def test_function_calls_are_all_that_were_made(name, monkeypatch):
    made = Counter()
    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 3)
    compiled = kind(callbacks.slopes.address)

    @kind
    def counted(*arguments):
        made["calls"] += 1
        return compiled(*arguments)

    address = ctypes.cast(counted, ctypes.c_void_p).value
    monkeypatch.setattr(callbacks, "slopes", SimpleNamespace(address=address))
    motion = run(rattling(), name)
    assert len(motion.crossings.time) > 4
    assert motion.function_calls == made["calls"]


@pytest.mark.parametrize("name", BLIND)
def test_counts_are_cvode_s(name):
    march = SOLVERS[name](rattling())
    motion, value = finished(march), ctypes.c_long()

    def told(what: str) -> int:
        sundials._call(
            "cvode",
            what,
            ctypes.c_int,
            (ctypes.c_void_p, march.memory.memory),
            (ctypes.c_void_p, ctypes.addressof(value)),
        )
        return value.value

    assert motion.function_calls == told("CVodeGetNumRhsEvals")
    assert motion.steps == told("CVodeGetNumSteps")
    assert motion.rejected_steps == told("CVodeGetNumErrTestFails") + told("CVodeGetNumStepSolveFails")
    if name == "gear":
        assert motion.jacobian_calls == told("CVodeGetNumJacEvals") > 0


@pytest.mark.parametrize("name", NAMES)
def test_steps_add_up_to_the_run(name):
    motion = run(rattling(), name)
    assert 0.0 < motion.smallest_step < min(motion.average_step, motion.average_trial_step)
    assert motion.steps * motion.average_step == pytest.approx(8.0)


def test_the_compiled_jacobian_is_the_slope_of_the_right_hand_side():
    for seed in range(4):
        system = random_chain(seed)
        start = [list(np.random.default_rng(seed).normal(size=system.size)) for _ in range(2)]
        block = SOLVERS["gear"](task(system, *start)).block
        kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 3)
        slopes, matrix = (kind(f.address) for f in (callbacks.plain_slopes, callbacks.plain_jacobian))
        z, count = block.initial.copy(), block.states

        def at(z, block=block, count=count, slopes=slopes):
            out = np.empty(count)
            slopes(0.01, z.ctypes.data, out.ctypes.data, block.words.ctypes.data)
            return out

        actual = np.empty((count, count))
        matrix(0.01, z.ctypes.data, actual.ctypes.data, block.words.ctypes.data)
        step = 1e-4 * np.eye(count)
        want = np.array([(at(z + h) - at(z - h)) / 2e-4 for h in step])
        assert np.abs(actual - want).max() <= 1e-6 * np.abs(actual).max()


@pytest.mark.parametrize("name", NAMES)
def test_agrees_with_exact_before_the_first_corner(name):
    motion, exact = run(rattling(1e-10), name), run(rattling())
    before = np.arange(8 * 16 + 1) / 16 < exact.crossings.time[0]
    assert before.sum() > 5
    assert np.abs(motion.angle - exact.angle)[before].max() <= 4e-9
    assert np.abs(motion.velocity - exact.velocity)[before].max() <= 1e-8


@pytest.mark.parametrize("name", NAMES)
def test_crossings_are_those_of_exact_and_converge_with_the_tolerance(name):
    exact, errors = run(rattling()).crossings, []
    for tolerance in (1e-5, 1e-7, 1e-9, 1e-11):
        actual = run(rattling(tolerance), name).crossings
        assert np.array_equal(actual.to_piece, exact.to_piece)
        assert np.array_equal(actual.from_piece, exact.from_piece)
        errors.append(np.abs(actual.time - exact.time).max())
        assert np.abs(actual.velocity - exact.velocity).max() <= 100 * errors[-1]
        assert np.abs(actual.force_integral - exact.force_integral).max() <= 100 * errors[-1]
    assert errors[-1] < errors[0] / 100  # the error test alone notices corners: blind steps converge by leaps
    if name == "gear-events":
        assert all(later < earlier / 3 for earlier, later in pairwise(errors))
        assert errors[-1] <= 1e-8


@pytest.mark.compiled
@pytest.mark.parametrize("seed", [3, 9, 31])
def test_restarts_at_every_corner_of_a_chain_that_rattles(seed):
    system, rng = random_chain(seed), np.random.default_rng(seed)
    start = [list(0.1 * rng.normal(size=system.size)), list(rng.normal(size=system.size))]
    problem = replace(task(system, *start, cycles=8), tolerance=1e-11)
    actual, exact = run(problem, "gear-events").crossings, run(problem).crossings
    assert len(exact.time) >= 50
    for quantity in ("clearance", "from_piece", "to_piece"):
        assert np.array_equal(getattr(actual, quantity), getattr(exact, quantity))
    assert np.abs(actual.time - exact.time).max() <= 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_what_does_not_feed_back_does_not_shorten_steps(name):
    pair = PiecewiseSystem(np.ones(2), np.zeros(2), np.array([[1.0, -1.0]]), (linear(4.0),), inputs(2, 1))
    near, far = (run(task(pair, [x + 0.25, x], [speed, speed]), name) for x, speed in ((0.0, 0.0), (1e6, 0.0)))
    assert near.steps == far.steps
    assert np.array_equal(near.force, far.force)


@pytest.mark.parametrize("name", NAMES)
def test_a_start_on_a_corner_at_rest_stays_there(name):
    motion = run(task(oscillator(GAP), [0.5], [0.0]), name)
    assert len(motion.crossings.time) == 0
    assert np.array_equal(motion.angle, np.full((81, 1), 0.5))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("tolerance", [1e-300, 5e-324])
def test_a_tolerance_out_of_reach_is_an_outcome(name, tolerance, capfd):
    assert SOLVERS[name](rattling(tolerance)).advance() is Outcome.NO_CONVERGENCE
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", NAMES)
def test_a_motion_without_bound_is_an_outcome(name, capfd):
    march = SOLVERS[name](task(oscillator(drag=-1e4), [1.0], [0.0]))
    while (outcome := march.advance()) is Outcome.SLICE_SPENT:
        pass
    assert outcome is Outcome.NON_FINITE
    assert 0.0 < march.position().time < 1.0
    assert SOLVERS[name](task(oscillator(GAP), [1.0], [np.nan])).advance() is Outcome.NON_FINITE
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", NAMES)
def test_works_in_slices(monkeypatch, name):
    monkeypatch.setattr("gearrattle.engine.solvers.cvode._SLICE", 0.0)
    monkeypatch.setattr("gearrattle.engine.solvers.cvode._FIRST_BUDGET", 16)
    march, fractions = SOLVERS[name](rattling(1e-10, cycles=10)), []
    while march.advance() is Outcome.SLICE_SPENT:
        fractions.append(march.fraction())
    assert len(fractions) > 2
    assert fractions == sorted(fractions)
    assert march.fraction() == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_all_that_is_made_is_freed(name, monkeypatch):
    counts: Counter[str] = Counter()
    call = sundials._call

    def counted(part, function, *rest):
        counts[function] += 1
        return call(part, function, *rest)

    monkeypatch.setattr(sundials, "_call", counted)
    march = SOLVERS[name](rattling())
    finished(march)
    del march
    gc.collect()
    assert counts["CVodeCreate"] == counts["CVodeFree"] == 1
    assert counts["SUNContext_Create"] == counts["SUNContext_Free"] == 1
    assert counts["N_VMake_Serial"] == counts["N_VDestroy"] == 3
    assert counts["SUNDenseMatrix"] == counts["SUNMatDestroy"] == counts["SUNLinSol_Dense"] == counts["SUNLinSolFree"]
    assert counts["SUNNonlinSol_FixedPoint"] == counts["SUNNonlinSolFree"]


@pytest.mark.parametrize("name", NAMES)
def test_without_the_extra_the_error_says_what_to_install(name, monkeypatch, capsys):
    sundials._libraries.cache_clear()
    monkeypatch.setitem(sys.modules, "sksundae", None)
    monkeypatch.setitem(sys.modules, "sksundae.cvode", None)
    with pytest.raises(ModelError, match=r'simulation.algorithm: .*pip install "gearrattle\[sundials\]"'):
        SOLVERS[name](rattling())
    arguments = ["simulate", "examples/paper/case1.toml", "--cycles", "1", "--discard", "0", "--algorithm", name]
    assert main(arguments) == 2
    assert 'pip install "gearrattle[sundials]"' in capsys.readouterr().err
    monkeypatch.undo()
    sundials._libraries.cache_clear()
    sundials.available(name)


@pytest.mark.parametrize("name", ["adams", "gear", "gear-events"])
def test_where_a_slice_ends_changes_no_bit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    system = oscillator(clearance(400.0, 0.3, 0.05), force=3.0)
    shaken = replace(system, inputs=replace(system.inputs, error_sine=np.array([[0.04]])))
    problem = task(shaken, [0.0], [0.4], cycles=6)
    whole = run(problem, name)
    monkeypatch.setattr("gearrattle.engine.solvers.cvode._FIRST_BUDGET", 3)
    monkeypatch.setattr("gearrattle.engine.solvers.cvode._LARGEST_BUDGET", 3)
    sliced = run(problem, name)
    assert len(whole.crossings.time) > 10
    assert sliced.angle.tobytes() == whole.angle.tobytes()
    assert sliced.crossings.time.tobytes() == whole.crossings.time.tobytes()
    assert sliced.function_calls == whole.function_calls
