"""Laws every solver on the shelf obeys; a new one is tested by being in the table."""

from fractions import Fraction

import numpy as np
import pytest

from gearrattle.outcome import Outcome
from gearrattle.solvers import SOLVERS, Extensible
from gearrattle.solvers.tableaus import CLASSICAL, MIDPOINT, Tableau
from gearrattle.system.piecewise import PiecewiseSystem
from tests.solvers.tasks import GAP, oscillator, run, task
from tests.system.drivelines import clearance, inputs

NAMES = sorted(SOLVERS)
FIXED = {"rk2": MIDPOINT, "rk4": CLASSICAL}


@pytest.mark.parametrize("name", NAMES)
def test_agrees_with_the_closed_form_of_a_driven_damped_oscillator(name: str) -> None:
    system = oscillator(drag=0.3, force=2.0)
    motion = run(task(system, [0.2], [-0.1], step=1e-3), name)
    t = np.arange(5 * 16 + 1) / 16
    w, o = 4.0, 2 * np.pi
    forced = 2.0 / (w - o**2 + 0.3j * o)  # particular solution of x'' + 0.3 x' + 4 x = 2 e^{iot}
    root = -0.15 + 1j * np.sqrt(w - 0.15**2)
    x0, v0 = 0.2 - forced.imag, -0.1 - (1j * o * forced).imag
    c = np.linalg.solve([[1, 0], [root.real, root.imag]], [x0, v0])
    want = np.exp(root.real * t) * (c[0] * np.cos(root.imag * t) + c[1] * np.sin(root.imag * t))
    want += (forced * np.exp(1j * o * t)).imag
    tolerance = {"exact": 1e-13, "rk2": 3e-6, "rk4": 1e-11}[name]
    assert np.abs(motion.angle[:, 0] - want).max() <= tolerance


@pytest.mark.parametrize("name", NAMES)
def test_a_gap_crosses_at_the_closed_form_times(name: str) -> None:
    motion = run(task(oscillator(GAP), [1.25], [0.0], cycles=20, step=1e-3), name)
    flight = 2 * 0.5 / (2 * 0.75)
    half = np.pi / 2 + flight
    want = np.array([np.pi / 4 + i // 2 * half + i % 2 * flight for i in range(100)])
    want = want[want <= 20]
    assert len(motion.crossings.time) == len(want)
    assert np.abs(motion.crossings.time - want).max() <= {"exact": 1e-13, "rk2": 2e-5, "rk4": 5e-6}[name]


@pytest.mark.parametrize("name", NAMES)
def test_the_force_integral_is_the_change_of_momentum(name: str) -> None:
    motion = run(task(oscillator(GAP), [1.25], [0.0], cycles=3, step=1e-3), name)
    tolerance = {"exact": 1e-13, "rk2": 1e-5, "rk4": 1e-5}[name]
    assert motion.final_force_integral[0] == pytest.approx(-motion.velocity[-1, 0], abs=tolerance)


@pytest.mark.parametrize("name", NAMES)
def test_sampling_never_changes_the_motion(name: str) -> None:
    system = oscillator(clearance(4.0, 0.2, 0.5, 0.1), force=3.0)
    coarse = run(task(system, [0.9], [0.0], cycles=8, samples=1, step=1e-3), name)
    fine = run(task(system, [0.9], [0.0], cycles=8, samples=97, step=1e-3), name)
    assert np.array_equal(coarse.crossings.time, fine.crossings.time)
    assert np.abs(coarse.angle - fine.angle[::97]).max() <= 1e-14


@pytest.mark.parametrize("name", sorted(FIXED))
def test_measured_order_of_convergence(name: str) -> None:
    errors = []
    for step in (1 / 64, 1 / 128):
        motion = run(task(oscillator(force=2.0), [0.2], [0.0], cycles=4, samples=1, step=step), name)
        reference = run(task(oscillator(force=2.0), [0.2], [0.0], cycles=4, samples=1))
        errors.append(np.abs(motion.angle - reference.angle).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(FIXED[name].order, abs=0.25)


@pytest.mark.parametrize("name", sorted(FIXED))
def test_function_calls_are_stages_times_steps(name: str) -> None:
    motion = run(task(oscillator(GAP), [1.25], [0.0], step=0.01), name)
    assert motion.function_calls == len(FIXED[name].b) * motion.steps
    assert motion.steps == 500


@pytest.mark.parametrize("tableau", [MIDPOINT, CLASSICAL], ids=lambda t: t.name)
def test_order_conditions_hold_in_rational_arithmetic(tableau: Tableau) -> None:
    a = [[*row, *[Fraction(0)] * (len(tableau.b) - len(row))] for row in tableau.a]
    b, c = tableau.b, tableau.c
    conditions = {1: [(sum(b), Fraction(1))], 2: [(sum(x * y for x, y in zip(b, c, strict=True)), Fraction(1, 2))]}
    if tableau.order >= 4:
        s = range(len(b))
        conditions[3] = [
            (sum(b[i] * c[i] ** 2 for i in s), Fraction(1, 3)),
            (sum(b[i] * a[i][j] * c[j] for i in s for j in s), Fraction(1, 6)),
        ]
        conditions[4] = [
            (sum(b[i] * c[i] ** 3 for i in s), Fraction(1, 4)),
            (sum(b[i] * c[i] * a[i][j] * c[j] for i in s for j in s), Fraction(1, 8)),
            (sum(b[i] * a[i][j] * c[j] ** 2 for i in s for j in s), Fraction(1, 12)),
            (sum(b[i] * a[i][j] * a[j][k] * c[k] for i in s for j in s for k in s), Fraction(1, 24)),
        ]
    assert all(got == want for pairs in conditions.values() for got, want in pairs)


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


ABLE = [name for name in NAMES if isinstance(SOLVERS[name](task(oscillator(GAP), [1.25], [0.0])), Extensible)]


def test_exact_can_go_on() -> None:
    assert "exact" in ABLE


@pytest.mark.parametrize("restored", [False, True], ids=["extended", "restored"])
@pytest.mark.parametrize("name", ABLE)
def test_going_on_is_as_if_it_had_been_longer(name: str, restored: bool) -> None:
    system = oscillator(clearance(4.0, 0.2, 0.5, 0.1), force=3.0)
    whole = run(task(system, [0.9], [0.0], cycles=12), name)
    part = task(system, [0.9], [0.0], cycles=5)
    march = SOLVERS[name](part)
    motions = []
    for cycles in (5, 1, 6):
        if motions and restored:
            snapshot = march.snapshot()
            march = SOLVERS[name](part)
            march.restore(snapshot, cycles)
        elif motions:
            march.extend(cycles)
        assert march.fraction() < 0.5
        while march.advance() is not Outcome.DONE:
            pass
        motions.append(march.motion())
    for quantity in ("angle", "velocity", "acceleration", "deflection", "force", "piece"):
        pieces = [getattr(m, quantity)[bool(i) :] for i, m in enumerate(motions)]
        assert np.concatenate(pieces).tobytes() == getattr(whole, quantity).tobytes()
    for quantity in ("time", "clearance", "from_piece", "to_piece", "velocity", "force_integral"):
        logged = np.concatenate([getattr(m.crossings, quantity) for m in motions])
        assert logged.tobytes() == getattr(whole.crossings, quantity).tobytes()
    assert sum(m.steps for m in motions) == whole.steps
    assert sum(m.steps * m.average_step for m in motions) == pytest.approx(whole.steps * whole.average_step)
    assert motions[-1].final_force_integral.tobytes() == whole.final_force_integral.tobytes()


@pytest.mark.parametrize("speeds", [(0.5, 0.5), (0.5, -0.5), (0.5 * (1 - 1.2e-16), 0.5 * (1 + 3e-16))])
@pytest.mark.parametrize("name", ABLE)
def test_crossings_at_the_border_of_two_chunks_are_in_one_of_them(name: str, speeds: tuple[float, float]) -> None:
    twins = PiecewiseSystem(np.ones(2), np.zeros(2), np.eye(2), (GAP, GAP), inputs(2, 2))  # both cross at t = 1
    both = task(twins, [0.0, 0.0], list(speeds), cycles=1)
    march = SOLVERS[name](both)
    motions = []
    for _ in range(4):
        while march.advance() is not Outcome.DONE:
            pass
        motions.append(march.motion())
        march.extend(1)
    whole = run(task(twins, [0.0, 0.0], list(speeds), cycles=4), name).crossings
    parts = [m.crossings for m in motions]
    for k in (0, 1):
        mine = np.concatenate([p.time[p.clearance == k] for p in parts])
        assert len(mine) == 2
        assert mine == pytest.approx(whole.time[whole.clearance == k], rel=1e-15)
        chain = [motions[0].initial_piece[k], *np.concatenate([p.to_piece[p.clearance == k] for p in parts])]
        assert list(np.concatenate([p.from_piece[p.clearance == k] for p in parts])) == chain[:-1]
