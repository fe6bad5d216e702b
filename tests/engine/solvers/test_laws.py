"""Laws every solver on the shelf obeys; a new one is tested by being in the table."""

import time

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.solvers import SOLVERS, Extensible
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.model.simulation import ALGORITHMS
from gearrattle.outcome import Outcome
from tests.engine.solvers.tasks import GAP, oscillator, run, task
from tests.engine.system.drivelines import clearance, inputs

NAMES = sorted(SOLVERS)
FIXED = ("rk2", "rk4")
ALL = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.compiled) if name == "radau" else name for name in NAMES]
)
"""SciPy's Radau is slow with plain kernels, and runs no line of them that others do not."""
CHOSEN = [name for name in NAMES if name != "exact" and name not in FIXED]
TOLERANCE = 1e-10
"""What solvers that choose their steps are asked for; the others go by 1e-3."""
SMOOTH, BLIND = 1e-8, 1e-6
"""Largest error of the former: in a smooth motion of size one; stepping blindly over eighteen corners (an embedded
estimate has zeros: of the steps tried across a corner, one that happens to lie there is taken)."""
RESTARTED = {"rkv-events": 1e-8, "gear-events": 1e-6}
"""The same restarting at them; CVODE begins with order one each time."""
ALLOWED = {"exact": 1e-13, "rk2": 3e-6, "rk4": 1e-11}
"""The same in a smooth motion, of the others."""


def test_the_file_format_knows_every_algorithm_and_no_other() -> None:
    assert set(ALGORITHMS) == set(SOLVERS)


@ALL
def test_agrees_with_the_closed_form_of_a_driven_damped_oscillator(name: str) -> None:
    system = oscillator(drag=0.3, force=2.0)
    motion = run(task(system, [0.2], [-0.1], step=1e-3, tolerance=TOLERANCE), name)
    t = np.arange(5 * 16 + 1) / 16
    w, o = 4.0, 2 * np.pi
    forced = 2.0 / (w - o**2 + 0.3j * o)  # particular solution of x'' + 0.3 x' + 4 x = 2 e^{iot}
    root = -0.15 + 1j * np.sqrt(w - 0.15**2)
    x0, v0 = 0.2 - forced.imag, -0.1 - (1j * o * forced).imag
    c = np.linalg.solve([[1, 0], [root.real, root.imag]], [x0, v0])
    want = np.exp(root.real * t) * (c[0] * np.cos(root.imag * t) + c[1] * np.sin(root.imag * t))
    want += (forced * np.exp(1j * o * t)).imag
    assert np.abs(motion.angle[:, 0] - want).max() <= ALLOWED.get(name, SMOOTH)


@ALL
def test_inertias_without_any_element_turn_by_themselves(name: str) -> None:
    """J v' = sin(w t) - d v, from rest: v = [(d/J) sin w t - w cos w t + w exp(-d t/J)] / (J ((d/J)^2 + w^2))."""
    text = """
    schema = 1
    units = "SI"
    inertia = [{ name = "a", J = 2.0, drag = 0.5 }, { name = "b", J = 1.0 }]
    excitation = { speed = 8.0 }
    torque = [{ on = "a", harmonics = [{ order = 1, amplitude = 1.0 }] }]
    simulation = { initial = "static" }
    """
    step = 1e-3 if name in FIXED else None
    tolerance = None if name in FIXED else TOLERANCE
    run = gr.simulate(gr.loads(text), name, cycles=5, samples_per_cycle=16, step=step, tolerance=tolerance)
    t = run.trajectory.time
    v = run.trajectory.velocity
    rate = 0.25
    want = (rate * np.sin(8.0 * t) - 8.0 * np.cos(8.0 * t) + 8.0 * np.exp(-rate * t)) / (2.0 * (rate**2 + 64.0))
    assert np.abs(v[:, 0] - want).max() <= ALLOWED.get(name, SMOOTH)
    assert not np.any(v[:, 1])


def test_the_time_of_a_run_is_not_that_of_its_notes(monkeypatch: pytest.MonkeyPatch) -> None:
    model = gr.loads(
        """
        schema = 1
        units = "SI"
        inertia = [{ name = "a", J = 1.0 }]
        coupling = [{ name = "s", between = ["a", "ground"], stiffness = 100.0, damping = 0.1, clearance = 0.1 }]
        excitation = { speed = 8.0 }
        """
    )
    gr.simulate(model, "rk4", cycles=1)

    def slow(*_: object) -> tuple[str, ...]:
        time.sleep(1.0)
        return ("slow",)

    monkeypatch.setattr("gearrattle.engine.solvers.one_step.stability_notes", slow)
    run = gr.simulate(model, "rk4", cycles=1)
    assert "slow" in run.notes
    assert 0.0 < run.cost.wall_time < 0.9


@ALL
def test_a_gap_crosses_at_the_closed_form_times(name: str) -> None:
    motion = run(task(oscillator(GAP), [1.25], [0.0], cycles=20, step=1e-3, tolerance=TOLERANCE), name)
    flight = 2 * 0.5 / (2 * 0.75)
    half = np.pi / 2 + flight
    want = np.array([np.pi / 4 + i // 2 * half + i % 2 * flight for i in range(100)])
    want = want[want <= 20]
    assert len(motion.crossings.time) == len(want)
    allowed = {"exact": 1e-13, "rk2": 2e-5, "rk4": 5e-6}.get(name, RESTARTED.get(name, BLIND))
    assert np.abs(motion.crossings.time - want).max() <= allowed


@ALL
def test_the_force_integral_is_the_change_of_momentum(name: str) -> None:
    motion = run(task(oscillator(GAP), [1.25], [0.0], cycles=3, step=1e-3, tolerance=TOLERANCE), name)
    tolerance = {"exact": 1e-13, "rk2": 1e-5, "rk4": 1e-5}.get(name, SMOOTH)
    assert motion.final_force_integral[0] == pytest.approx(-motion.velocity[-1, 0], abs=tolerance)


@ALL
def test_sampling_never_changes_the_motion(name: str) -> None:
    system = oscillator(clearance(4.0, 0.2, 0.5, 0.1), force=3.0)
    coarse = run(task(system, [0.9], [0.0], cycles=8, samples=1, step=1e-3), name)
    fine = run(task(system, [0.9], [0.0], cycles=8, samples=97, step=1e-3), name)
    assert np.array_equal(coarse.crossings.time, fine.crossings.time)
    assert np.abs(coarse.angle - fine.angle[::97]).max() <= 1e-14


@pytest.mark.parametrize("factor", [-1.0, 4.0], ids=["mirrored", "four times as large"])
@ALL
def test_mirrored_or_enlarged_with_its_loads_a_motion_is_the_same(name: str, factor: float) -> None:
    size, settings = abs(factor), {"cycles": 8, "step": 1e-3, "tolerance": 1e-8}
    plain = run(task(oscillator(clearance(4.0, 0.2, 0.5), force=3.0), [0.9], [0.1], **settings), name)
    system = oscillator(clearance(4.0, 0.2, 0.5 * size), force=3.0 * factor)
    other = run(task(system, [0.9 * factor], [0.1 * factor], **settings), name)
    assert len(plain.crossings.time) >= 4
    assert np.abs(other.angle - factor * plain.angle).max() <= 1e-11 * size
    assert np.abs(other.crossings.time - plain.crossings.time).max() <= 1e-11
    assert other.steps == plain.steps


@pytest.mark.parametrize("name", CHOSEN)
def test_a_smaller_tolerance_gives_a_smaller_error(name: str) -> None:
    system = oscillator(drag=0.1, force=2.0)
    want = run(task(system, [0.2], [0.0], cycles=6)).angle
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8):
        motion = run(task(system, [0.2], [0.0], cycles=6, tolerance=tolerance), name)
        errors.append(np.abs(motion.angle - want).max())
        assert errors[-1] <= 1e3 * tolerance
    assert errors[1] < 0.3 * errors[0]
    assert errors[2] < 0.3 * errors[1]


@ALL
def test_agrees_with_exact_up_to_the_first_corner_and_finds_it(name: str) -> None:
    law = clearance(400.0, 0.1, 0.5)
    problem = task(oscillator(law, force=30.0), [0.1], [3.0], cycles=1, samples=512, step=1e-4, tolerance=TOLERANCE)
    motion, want = run(problem, name), run(problem)
    first = int(512 * want.crossings.time[0])
    assert first > 8
    assert np.abs(motion.angle[:first] - want.angle[:first]).max() <= 10 * ALLOWED.get(name, SMOOTH)
    assert abs(motion.crossings.time[0] - want.crossings.time[0]) <= 10 * ALLOWED.get(name, SMOOTH)


@ALL
def test_without_damping_energy_is_kept(name: str) -> None:
    problem = task(oscillator(GAP), [1.25], [0.0], cycles=10, step=1e-3, tolerance=TOLERANCE)
    motion = run(problem, name)
    stretch = np.maximum(np.abs(motion.angle[:, 0]) - 0.5, 0.0)
    energy = 0.5 * motion.velocity[:, 0] ** 2 + 0.5 * 4.0 * stretch**2
    assert np.ptp(energy) <= {"exact": 1e-12, "rk2": 2e-4, "rk4": 1e-5}.get(name, BLIND) * energy[0]


@pytest.mark.parametrize("name", CHOSEN)
def test_a_tolerance_that_cannot_be_met_is_a_result_not_a_loop(name: str) -> None:
    march = SOLVERS[name](task(oscillator(GAP), [1.25], [0.0], cycles=1, tolerance=1e-200))
    while (outcome := march.advance()) is Outcome.SLICE_SPENT:
        pass
    if outcome is Outcome.DONE:  # two columns of an extrapolation may agree to the last bit
        assert name == "bulirsch-stoer"
        assert march.motion().crossings.time[0] == pytest.approx(np.pi / 4, abs=1e-9)
        return
    assert outcome is Outcome.NO_CONVERGENCE
    assert 0.0 <= march.position().time < 1.0
    assert "tolerance" in outcome.advice


@ALL
def test_steps_calls_and_lengths_are_told(name: str) -> None:
    motion = run(task(oscillator(GAP), [1.25], [0.0], cycles=5, step=1e-2), name)
    assert 0 < motion.steps < motion.function_calls
    assert motion.average_step == pytest.approx(5.0 / motion.steps)
    assert motion.average_trial_step > 0.0
    if name != "exact":
        assert motion.smallest_step is not None
        assert 0.0 < motion.smallest_step <= motion.average_step * (1 + 1e-9)
    if name in FIXED:
        assert motion.rejected_steps == 0


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
