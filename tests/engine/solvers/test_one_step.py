"""Runge-Kutta methods and extrapolation: the numbers of their tableaus, order, counts of calls, steps over corners."""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import combinations_with_replacement
from math import prod

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.solvers import SOLVERS, Marching, Motion
from gearrattle.engine.solvers.one_step import ChosenStep, FixedStep, StepMarch
from gearrattle.engine.solvers.tableaus import CLASSICAL, Tableau
from gearrattle.outcome import Outcome
from tests.engine.solvers.tasks import GAP, oscillator, run, task
from tests.engine.system.drivelines import clearance

TABLEAUS = [solver.tableau for solver in SOLVERS.values() if isinstance(solver, FixedStep | ChosenStep)]
NAMED = pytest.mark.parametrize("tableau", TABLEAUS, ids=lambda t: f"{t.name} {t.order}")
Tree = tuple["Tree", ...]
"""A rooted tree is the tuple of its branches."""


@cache
def trees(order: int) -> tuple[Tree, ...]:
    """Return the rooted trees with so many nodes."""
    return tuple(sorted({tuple(sorted(branches)) for branches in forests(order - 1)}))


def forests(nodes: int) -> Iterator[tuple[Tree, ...]]:
    """Yield the multisets of trees with so many nodes in all."""
    if nodes == 0:
        yield ()
    for largest in range(1, nodes + 1):
        for count in range(1, nodes // largest + 1):
            for rest in forests(nodes - largest * count):
                if all(size(tree) < largest for tree in rest):
                    for chosen in combinations_with_replacement(trees(largest), count):
                        yield (*rest, *chosen)


def size(tree: Tree) -> int:
    """Return the number of nodes."""
    return 1 + sum(size(branch) for branch in tree)


def density(tree: Tree) -> int:
    """Return gamma: the product of the sizes of all subtrees."""
    return size(tree) * prod(density(branch) for branch in tree)


def elementary(tree: Tree, a: list[list[Fraction]]) -> list[Fraction]:
    """Return the tree's elementary weight at every stage."""
    out = [Fraction(1)] * len(a)
    for branch in tree:
        inner = elementary(branch, a)
        out = [x * sum((row[j] * inner[j] for j in range(len(a))), Fraction(0)) for x, row in zip(out, a, strict=True)]
    return out


def order_of(tableau: Tableau, weights: tuple[Fraction, ...], most: int) -> int:
    """Return the largest order, up to ``most``, whose conditions b . Phi(tree) = 1 / gamma(tree) all hold exactly."""
    a = [[*row, *[Fraction(0)] * (len(weights) - len(row))] for row in tableau.a]
    for order in range(1, most + 1):
        for tree in trees(order):
            actual = sum((b * phi for b, phi in zip(weights, elementary(tree, a), strict=True)), Fraction(0))
            if actual != Fraction(1, density(tree)):
                return order - 1
    return most


def test_there_are_as_many_rooted_trees_as_known() -> None:
    assert [len(trees(n)) for n in range(1, 8)] == [1, 1, 2, 4, 9, 20, 48]


@NAMED
def test_order_conditions_hold_in_rational_arithmetic_and_no_further(tableau: Tableau) -> None:
    assert order_of(tableau, tableau.b, 7) == tableau.order
    if tableau.estimator:
        assert order_of(tableau, tableau.estimator, 7) == tableau.estimator_order
        assert abs(tableau.estimator_order - tableau.order) == 1
        assert tableau.extrapolated().extrapolated() == tableau


def fixed(tableau: Tableau, steps: int) -> Motion:
    """Return four cycles of a driven oscillator by so many equal steps."""
    problem = task(oscillator(force=2.0), [0.2], [0.0], cycles=4, samples=1, step=4 / steps)
    march: Marching = FixedStep(tableau)(problem)
    while march.advance() is not Outcome.DONE:
        pass
    return march.motion()


@NAMED
def test_measured_order_of_convergence(tableau: Tableau) -> None:
    want = run(task(oscillator(force=2.0), [0.2], [0.0], cycles=4, samples=1)).angle
    coarse, fine = (np.abs(fixed(tableau, steps).angle - want).max() for steps in (128, 256))
    assert np.log2(coarse / fine) == pytest.approx(tableau.order, abs=0.3)


@NAMED
def test_function_calls_are_stages_times_steps(tableau: Tableau) -> None:
    motion = fixed(tableau, 500)
    assert motion.function_calls == len(tableau.b) * motion.steps
    assert motion.steps == 500


@pytest.mark.parametrize(("name", "stages"), [("rkf", 6), ("rkv", 8)])
def test_a_rejected_step_keeps_its_first_stage(name: str, stages: int) -> None:
    motion = run(task(oscillator(GAP), [1.25], [0.0], tolerance=1e-8), name)
    assert motion.rejected_steps > 3
    assert motion.function_calls == stages * motion.steps + (stages - 1) * motion.rejected_steps


def test_extrapolation_gets_farther_with_more_columns() -> None:
    problem = task(oscillator(force=2.0), [0.2], [0.0], cycles=20, tolerance=1e-12)
    smooth = run(problem, "bulirsch-stoer")
    assert smooth.steps < 0.2 * run(problem, "rkv").steps
    assert smooth.function_calls < 0.7 * run(problem, "rkv").function_calls


def test_extrapolation_counts_every_call() -> None:
    problem = task(oscillator(force=2.0), [0.2], [0.0], cycles=1, samples=1, step=0.1, tolerance=1e30)
    march = StepMarch(problem, None, fixed=False, held=False)
    while march.advance() is not Outcome.DONE:
        pass
    motion = march.motion()
    assert motion.steps == 3
    assert motion.function_calls == 3 + (2 + 4 + 6 + 8) + 2 * (2 + 4)  # nothing fails such a test: fewer columns next


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_restarting_at_corners_finds_them_all_where_blind_steps_lose_digits(tolerance: float) -> None:
    law = clearance(900.0, 3.0, 0.05)
    problem = task(oscillator(law, force=12.0), [0.0], [0.2], cycles=4, tolerance=tolerance)
    want = run(problem)
    held = run(problem, "rkv-events")
    blind = run(problem, "rkv")
    assert len(want.crossings.time) > 20
    assert len(held.crossings.time) == len(want.crossings.time)
    assert np.array_equal(held.crossings.to_piece, want.crossings.to_piece)
    error = np.abs(held.crossings.time - want.crossings.time).max()
    assert error <= 10 * tolerance
    assert np.abs(held.angle - want.angle).max() < 0.3 * np.abs(blind.angle - want.angle).max()


@pytest.mark.parametrize("name", ["rk4", "rkf", "rkv-events", "bulirsch-stoer"])
def test_where_a_slice_ends_changes_no_bit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    law = clearance(400.0, 0.3, 0.05)
    system = oscillator(law, force=3.0)
    shaken = replace(system, inputs=replace(system.inputs, error_sine=np.array([[0.04]])))
    problem = task(shaken, [0.0], [0.4], cycles=6, step=1e-3)
    whole = run(problem, name)
    monkeypatch.setattr("gearrattle.engine.solvers.one_step._BUDGET", 3)
    sliced = run(problem, name)
    assert len(whole.crossings.time) > 10
    assert sliced.angle.tobytes() == whole.angle.tobytes()
    assert sliced.crossings.time.tobytes() == whole.crossings.time.tobytes()
    assert sliced.crossings.to_piece.tobytes() == whole.crossings.to_piece.tobytes()
    assert sliced.function_calls == whole.function_calls


@pytest.mark.parametrize("step", [0.15, 0.3, 0.45])
def test_a_shorter_last_step_sees_its_own_end(step: float) -> None:
    system = oscillator(clearance(4.0, 0.0, 0.05))
    moved = {"cycles": np.array([1.0]), "torque_sine": np.zeros((1, 1)), "torque_cosine": np.zeros((1, 1))}
    moved |= {"error_sine": np.array([[2.0]]), "error_cosine": np.zeros((1, 1))}  # the gap moves by many half-gaps
    shaken = replace(system, inputs=replace(system.inputs, **moved))
    motion = run(task(shaken, [0.0], [0.0], cycles=1, step=step), "rk4")
    assert motion.crossings.to_piece[-1] == motion.piece[-1, 0]
    assert motion.crossings.time[-1] <= 1.0


def test_a_start_on_a_corner_goes_on_in_the_region_it_moves_into() -> None:
    problem = task(oscillator(GAP), [0.5], [1.0], cycles=3, tolerance=1e-10)
    want, held = run(problem), run(problem, "rkv-events")
    assert len(held.crossings.time) == len(want.crossings.time)
    assert np.abs(held.crossings.time - want.crossings.time).max() <= 1e-8


def test_the_stability_limit_of_rk4_on_the_imaginary_axis_is_2_sqrt_2() -> None:
    inside, outside = CLASSICAL.growth(np.array([2.8284j, 2.8285j]))
    assert inside < 1 < outside


def test_an_unstable_step_is_a_note_with_the_growth_factor() -> None:
    stiff = oscillator(clearance(1e4, 0.0, 0.5))  # contact: omega = 100
    motion = run(task(stiff, [0.49], [1.0], cycles=1, step=0.05), "rk4")
    (note,) = motion.notes
    growth = float(CLASSICAL.growth(np.array([5j]))[0])
    assert f"grows by {growth:.4g}" in note
    assert run(task(stiff, [0.49], [1.0], cycles=1, step=0.01), "rk4").notes == ()


def test_the_default_step_is_a_quarter_over_the_fastest_eigenvalue_down_to_a_whole_fraction_of_the_period() -> None:
    motion = run(task(oscillator(GAP), [1.25], [0.0], cycles=1), "rk4")
    assert motion.steps == 8  # 0.25 / 2 = 1/8 of the period of 1


def moving_corner() -> gr.Model:
    """Two gears in a gap that a transmission error larger than half of it moves to and fro."""
    gear = {"J": 1.0, "drag": 0.1}
    mesh = {"name": "mesh", "between": ["pinion", "gear"], "radii": [1.0, 1.0], "stiffness": 1.0, "damping": 0.05}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "pinion", **gear}, {"name": "gear", **gear}],
            "mesh": [{**mesh, "backlash": 2.0, "transmission_error": [{"order": 1, "amplitude": 1.5, "phase": 0.3}]}],
            "excitation": {"frequency": 1.2},
            "torque": [{"on": "pinion", "mean": 0.1}, {"on": "gear", "mean": -0.1}],
        }
    )


@pytest.mark.parametrize(("algorithm", "error"), [("rk4", 1e-3), ("rkf", 1e-3), ("bulirsch-stoer", 1e-3)])
def test_crossings_are_located_at_the_instant_that_moves_the_corner(algorithm: str, error: float) -> None:
    model = moving_corner()
    how = {"step": 2.0 * np.pi / 1.2 / 400} if algorithm == "rk4" else {}
    want = gr.simulate(model, cycles=6, discard=0, audit=False).events
    events = gr.simulate(model, algorithm=algorithm, cycles=6, discard=0, audit=False, **how).events
    assert len(want) > 20
    assert len(events) == len(want)
    assert np.abs(events["time"] - want["time"]).max() < error
