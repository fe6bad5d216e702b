"""Motions under piecewise polynomials: against closed forms, an integrator restarted at knots and corners, and laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PPoly

from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.piecewise_signals import Signals
from tests.engine.solvers.tasks import GAP, finished, oscillator, run, same_bits, task
from tests.engine.system.drivelines import clearance, inputs, linear, random_chain

END = 4.0


def splines(times: np.ndarray, torque: np.ndarray, error: np.ndarray) -> tuple[Signals, CubicSpline, CubicSpline]:
    """Return a torque on the first inertia and an error of the first element."""
    made = CubicSpline(times, torque), CubicSpline(times, error)
    coefficients = np.stack([entry.c[::-1].T for entry in made], axis=1)
    return Signals(times, coefficients, np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]])), *made


def random_splines(seed: int) -> tuple[Signals, CubicSpline, CubicSpline]:
    """Return splines through points at random times, a few of them much nearer to each other than others."""
    rng = np.random.default_rng(seed)
    times = np.sort(np.concatenate([[0.0, END + 0.3], rng.uniform(0.0, END, 40), 2.0 + rng.uniform(0.0, 0.02, 5)]))
    times = times[np.concatenate([[True], np.diff(times) > 1e-3])]
    return splines(times, 3.0 * rng.normal(size=times.size), 0.1 * rng.normal(size=times.size))


def jumping(seed: int, degree: int) -> tuple[Signals, PPoly, CubicSpline]:
    """Return a torque of polynomials that do not meet, and an error that is smooth."""
    smooth, _, error = random_splines(seed)
    rng, intervals = np.random.default_rng(seed), len(smooth.knots) - 1
    length = np.diff(smooth.knots)[:, None]
    torque = 3.0 * rng.normal(size=(intervals, degree + 1)) / length ** np.arange(degree + 1)
    coefficients = smooth.coefficients.copy()
    coefficients[:, 0] = 0.0
    coefficients[:, 0, : degree + 1] = torque
    return replace(smooth, coefficients=coefficients), PPoly(torque[:, ::-1].T, smooth.knots), error


def restarted(system: PiecewiseSystem, torque: PPoly, error: CubicSpline) -> tuple[np.ndarray, int]:
    """Return the last state and the number of crossings of one inertia in a gap, restarted at knots and corners."""
    law, drag = system.laws[0], float(system.drag[0])
    (corner,), stiffness, damping = np.unique(np.abs(law.corners)), law.stiffness[-1], law.damping[-1]
    knots = torque.x[torque.x < END]
    y, crossings = np.zeros(2), 0
    for i, (begin, end) in enumerate(zip(knots, [*knots[1:], END], strict=True)):
        now, push = begin, PPoly(torque.c[:, i : i + 1], torque.x[i : i + 2])  # goes on where the interval ends
        while True:
            ahead = y[0] - error(now) + 1e-7 * (y[1] - error(now, 1))
            side = 0.0 if abs(ahead) < corner else float(np.sign(ahead))

            def rate(t: float, y: np.ndarray, side: float = side, push: PPoly = push) -> list[float]:
                force = stiffness * (y[0] - error(t) - side * corner) + damping * (y[1] - error(t, 1)) if side else 0.0
                return [y[1], push(t) - drag * y[1] - force]

            def gap(t: float, y: np.ndarray, side: float = side) -> float:
                return corner - abs(y[0] - error(t)) if side == 0.0 else side * (y[0] - error(t)) - corner

            gap.terminal, gap.direction = True, -1.0  # type: ignore[attr-defined]
            actual = solve_ivp(rate, (now, end), y, method="DOP853", rtol=1e-13, atol=1e-14, events=gap, max_step=2e-3)
            y, now = actual.y[:, -1], float(actual.t[-1])
            if actual.status == 0:
                break
            crossings += 1
    return y, crossings


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(2, 6))])
def test_rattle_under_splines(seed: int) -> None:
    signals, torque, error = random_splines(seed)
    system = replace(oscillator(clearance(400.0, 2.0, 0.3), drag=0.05), signals=signals)
    motion = finished(ExactMarch(replace(task(system, [0.0], [0.0], cycles=4), audit=True)))
    y, crossings = restarted(system, torque, error)
    assert len(motion.crossings.time) == crossings
    assert crossings > 10
    assert motion.angle[-1, 0] == pytest.approx(y[0], abs=1e-9)
    assert motion.velocity[-1, 0] == pytest.approx(y[1], abs=1e-8)
    assert motion.energy is not None
    assert motion.energy.relative_residual <= 1e-12


@pytest.mark.parametrize(
    ("seed", "degree"),
    [(0, 0), (1, 1), *(pytest.param(seed, seed % 4, marks=pytest.mark.long) for seed in range(2, 6))],
)
def test_rattle_under_jumps(seed: int, degree: int) -> None:
    signals, torque, error = jumping(seed, degree)
    system = replace(oscillator(clearance(400.0, 2.0, 0.3), drag=0.05), signals=signals)
    motion = finished(ExactMarch(replace(task(system, [0.0], [0.0], cycles=4), audit=True)))
    y, crossings = restarted(system, torque, error)
    assert len(motion.crossings.time) == crossings
    assert crossings > 10
    assert motion.angle[-1, 0] == pytest.approx(y[0], abs=1e-9)
    assert motion.velocity[-1, 0] == pytest.approx(y[1], abs=1e-8)
    assert motion.energy is not None
    assert motion.energy.relative_residual <= 1e-12


@pytest.mark.parametrize("degree", [0, 1, 3, 7, 12])
def test_a_linear_oscillator_under_a_polynomial(degree: int) -> None:
    """x'' + 4 x = sum a_j t^j: the particular polynomial by comparing coefficients, and a free motion beside it."""
    rng = np.random.default_rng(degree)
    a = rng.normal(size=degree + 1)
    p = np.zeros(degree + 3)
    for j in range(degree, -1, -1):
        p[j] = (a[j] - (j + 2) * (j + 1) * p[j + 2]) / 4.0
    signals = Signals(np.array([0.0, 1.5]), a[None, None, :], np.ones((1, 1)), np.zeros((1, 1)))
    motion = run(task(replace(oscillator(linear(4.0)), signals=signals), [0.3], [-0.2], cycles=1, samples=8))
    t = np.linspace(0.0, 1.0, 9)
    made = np.polynomial.polynomial.polyval(t, p)
    want = made + (0.3 - p[0]) * np.cos(2.0 * t) + 0.5 * (-0.2 - p[1]) * np.sin(2.0 * t)
    np.testing.assert_allclose(motion.angle[:, 0], want, rtol=0, atol=1e-13 * max(1.0, np.abs(p).max()))


@pytest.mark.parametrize("short", [1e-1, 1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("degree", [3, 7, 11])
def test_a_push_in_an_interval_much_shorter_than_others(degree: int, short: float) -> None:
    """x'' + 4 x = p(t) in between, by Duhamel's integral; the higher derivatives of p are of any size."""
    knots = np.array([0.0, 0.3, 0.3 + short, 1.2])
    length = knots[2] - knots[1]
    a = np.random.default_rng(degree).normal(size=degree + 1) / short
    coefficients = np.zeros((3, 1, degree + 1))
    coefficients[1, 0] = a / length ** np.arange(degree + 1)
    signals = Signals(knots, coefficients, np.ones((1, 1)), np.zeros((1, 1)))
    motion = run(task(replace(oscillator(linear(4.0)), signals=signals), [0.0], [0.0], cycles=1, samples=8))
    node, weight = np.polynomial.legendre.leggauss(16)
    part = 0.5 * (1.0 + node)
    push = 0.5 * length * weight * np.polynomial.polynomial.polyval(part, a)
    since = np.linspace(0.0, 1.0, 9)[4:, None] - (knots[1] + length * part)
    np.testing.assert_allclose(motion.angle[4:, 0], 0.5 * np.sin(2.0 * since) @ push, rtol=0, atol=1e-13)
    np.testing.assert_allclose(motion.velocity[4:, 0], np.cos(2.0 * since) @ push, rtol=0, atol=1e-13)


def test_more_knots_change_nothing() -> None:
    signals, *_ = random_splines(3)
    at = np.sort(np.concatenate([signals.knots, np.linspace(0.01, END, 57)]))
    begins = at[:-1]
    order = np.arange(signals.degree + 1)
    factorials = np.array([1.0, 1.0, 2.0, 6.0])
    cut = np.stack([signals.at(begins, int(j)) for j in order], axis=2) / factorials
    finer = Signals(at, cut, signals.torque, signals.error)
    system = oscillator(GAP, drag=0.2)
    one, other = (run(task(replace(system, signals=entry), [0.0], [0.0], cycles=4)) for entry in (signals, finer))
    np.testing.assert_allclose(one.angle, other.angle, rtol=0, atol=1e-10)
    assert len(one.crossings.time) == len(other.crossings.time) > 5


@pytest.mark.parametrize("seed", range(8))
def test_a_constant_signal_is_a_mean(seed: int) -> None:
    system = random_chain(seed)
    n = system.size
    m = len(system.laws)
    period = system.inputs.period
    constant = Signals(np.array([0.0, 3.3 * period]), np.ones((1, 1, 1)), system.inputs.mean[:, None], np.zeros((m, 1)))
    moved = replace(system, inputs=replace(system.inputs, mean=np.zeros(n)), signals=constant)
    start = np.random.default_rng(seed).normal(size=n) * 1e-3
    one, other = (run(task(entry, list(start), [0.0] * n, cycles=1)) for entry in (system, moved))
    np.testing.assert_allclose(one.velocity, other.velocity, rtol=0, atol=1e-9 * np.abs(one.velocity).max())


def test_slices_and_chunks_change_no_bit() -> None:
    signals, *_ = random_splines(1)
    problem = task(replace(oscillator(GAP, force=1.0), signals=signals), [0.1], [0.0], cycles=4)
    whole, parts = run(problem), ExactMarch(replace(problem, cycles=2))
    finished(parts)
    parts.extend(2)
    second = finished(parts)
    assert np.array_equal(second.angle, whole.angle[2 * 16 :])
    again = ExactMarch(replace(problem, cycles=2))
    finished(again)
    fresh = ExactMarch(replace(problem, cycles=2))
    fresh.restore(again.snapshot(), 2)
    same_bits(finished(fresh), second)


def test_without_signals_nothing_is_added() -> None:
    march = ExactMarch(task(oscillator(GAP), [0.6], [0.0]))
    assert march.flow.chain.size == 0
    assert march.flow.width == march.flow.states + 1
    assert inputs(1, 1).count == 0
