"""Motions in communication steps: the bits of one long march, closed forms, and marches that share nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from gearrattle.engine.solvers import Motion
from gearrattle.engine.solvers.communication_steps import Begin, CommunicationSteps, Point, with_channels
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.samples_in_si import crossings_of
from gearrattle.engine.system.flow import in_periods
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.outcome import Outcome
from tests.engine.solvers.tasks import finished, oscillator, task
from tests.engine.system.drivelines import clearance, linear, random_chain

STEPS = 64
FIELDS = ("angle", "velocity", "force", "deflection")


def channelled(seed: int, knots: np.ndarray) -> tuple[PiecewiseSystem, np.ndarray]:
    """Return a random chain with a torque that jumps and a smooth error as channels, and their polynomials.

    The channels have the scales of signals with these knots, and are no larger than the harmonics: bits are equal then.
    """
    steps = np.diff(knots)
    rng = np.random.default_rng(seed)
    chain = random_chain(seed)
    torque = np.zeros((chain.size, 2))
    torque[0, 0] = 1.0
    error = np.zeros((len(chain.laws), 2))
    error[-1, 1] = 1.0
    coefficients = np.zeros((len(steps), 2, 3))
    coefficients[:, 0, :2] = 0.3 * rng.normal(size=(len(steps), 2))
    level, slope = 0.0, 0.0
    for row, length in zip(coefficients[:, 1], steps, strict=True):
        row[:] = level, slope, 1e-3 * rng.normal() / length
        level, slope = level + slope * length + row[2] * length**2, slope + 2.0 * row[2] * length
    return with_channels(chain, torque, error, float(steps.max()), 2), coefficients


def stepped(march: CommunicationSteps, ends: np.ndarray, coefficients: np.ndarray) -> tuple[list[Point], list[float]]:
    """Return the points after every step, and the times of all crossings."""
    points, crossings = [], list[float]()
    for end, row in zip(ends, coefficients, strict=True):
        assert march.step(float(end), row) is Outcome.DONE
        points.append(march.point())
        crossings += crossings_of(march.flow, march.logged()).time.tolist()
    return points, crossings


def rows(points: Sequence[Point], name: str) -> np.ndarray:
    return np.array([getattr(point, name) for point in points])


def begun(system: PiecewiseSystem, seed: int = 0) -> CommunicationSteps:
    rng = np.random.default_rng(seed)
    state = task(system, 0.1 * rng.normal(size=system.size), rng.normal(size=system.size))
    return CommunicationSteps(replace(state, audit=False))


def long_march(system: PiecewiseSystem, knots: np.ndarray, coefficients: np.ndarray, **grid: int) -> Motion:
    assert system.signals is not None
    signals = replace(system.signals, knots=knots, coefficients=coefficients)
    start = begun(system).task
    return finished(ExactMarch(replace(start, system=replace(system, signals=signals), **{"audit": False, **grid})))


@pytest.mark.parametrize("seed", range(6))
def test_the_bits_of_one_long_march_on_the_same_grid(seed: int) -> None:
    knots = np.arange(STEPS + 1) * (0.1 / 16)
    system, coefficients = channelled(seed, knots)
    points, crossings = stepped(begun(system), in_periods(knots, 0.1)[1:], coefficients)
    motion = long_march(system, knots, coefficients, cycles=STEPS // 16, samples_per_cycle=16)
    for name in ("angle", "velocity"):
        assert np.array_equal(rows(points, name), getattr(motion, name)[1:])
    assert np.array_equal(crossings, motion.crossings.time)
    assert np.array_equal(rows(points, "piece"), motion.piece[1:])


@pytest.mark.parametrize("seed", [1, 4])
def test_steps_of_any_length_have_the_crossings_of_one_long_march(seed: int) -> None:
    knots = np.append(0.0, np.cumsum(np.random.default_rng(seed).uniform(1e-4, 0.03, STEPS)))
    system, coefficients = channelled(seed, knots)
    _, crossings = stepped(begun(system), in_periods(knots, 0.1)[1:], coefficients)
    cycles = int(knots[-1] / 0.1)
    motion = long_march(system, knots, coefficients, cycles=cycles, samples_per_cycle=1)
    assert len(motion.crossings.time) > 5
    assert np.array_equal(crossings[: len(motion.crossings.time)], motion.crossings.time)


@pytest.mark.parametrize("cuts", [[1.7], [0.3, 0.3000001, 1.2, 1.7], np.linspace(0.0, 1.7, 40)[1:].tolist()])
def test_a_linear_oscillator_under_a_ramp(cuts: list[float]) -> None:
    """x'' + 4 x = 1 + 2 t: a particular straight line and a free motion, however it is cut."""
    system = with_channels(oscillator(linear(4.0)), np.ones((1, 1)), np.zeros((1, 1)), 0.5, 1)
    march = CommunicationSteps(task(system, [0.3], [-0.2]))
    now = 0.0
    for end in cuts:
        assert march.step(end, np.array([[1.0 + 2.0 * now, 2.0]])) is Outcome.DONE
        now = end
    want = 0.25 + 0.5 * now + (0.3 - 0.25) * np.cos(2.0 * now) + 0.5 * (-0.2 - 0.5) * np.sin(2.0 * now)
    point = march.point()
    assert point.angle[0] == pytest.approx(want, abs=2e-14)
    assert point.force[0] == pytest.approx(4.0 * want, abs=1e-13)
    assert point.acceleration[0] == pytest.approx(1.0 + 2.0 * now - 4.0 * want, abs=1e-13)


@pytest.mark.parametrize("usual", [0.01, 0.3, 3.0])
def test_steps_may_be_longer_than_usual(usual: float) -> None:
    """A body in a gap, driven through several impacts in one step: the motion of many short steps."""
    system = oscillator(clearance(400.0, 2.0, 0.3), drag=0.05)
    torque, error = np.ones((1, 1)), np.zeros((1, 1))
    push = np.array([[30.0, -12.0]])
    march = CommunicationSteps(task(with_channels(system, torque, error, usual, 1), [0.0], [0.0]))
    assert march.step(2.5, push) is Outcome.DONE
    crossings = crossings_of(march.flow, march.logged()).time
    assert len(crossings) > 5
    many = CommunicationSteps(task(with_channels(system, torque, error, 0.05, 1), [0.0], [0.0]))
    ends = np.linspace(0.0, 2.5, 51)
    rows_of = [np.array([[30.0 - 12.0 * begin, -12.0]]) for begin in ends[:-1]]
    points, want = stepped(many, ends[1:], np.array(rows_of))
    np.testing.assert_allclose(crossings, want, rtol=0, atol=1e-11)
    assert march.point().angle[0] == pytest.approx(points[-1].angle[0], abs=1e-11)


def test_a_point_is_a_left_limit() -> None:
    """A torque that jumps from 1 to 5 accelerates by 1 at the end of the first step, by 5 at once after it."""
    system = with_channels(oscillator(clearance(4.0, 0.1, 0.5)), np.ones((1, 1)), np.zeros((1, 1)), 0.1, 0)
    march = CommunicationSteps(task(system, [0.0], [0.0]))
    assert march.step(0.1, np.array([[1.0]])) is Outcome.DONE
    assert march.point().acceleration[0] == pytest.approx(1.0, abs=1e-15)
    assert march.point().velocity[0] == pytest.approx(0.1, abs=1e-15)
    assert march.step(0.1 + 1e-9, np.array([[5.0]])) is Outcome.DONE
    assert march.point().acceleration[0] == pytest.approx(5.0, abs=1e-15)


def test_a_prescribed_error_moves_the_other_end() -> None:
    """x'' = -4 (x - e) with e = t^2: x = t^2 - (1 - cos 2 t) / 2, and the force is that of x - e."""
    system = with_channels(oscillator(linear(4.0)), np.zeros((1, 1)), np.ones((1, 1)), 0.1, 2)
    march = CommunicationSteps(task(system, [0.0], [0.0]))
    for k in range(10):
        now = 0.1 * k
        assert march.step(0.1 * (k + 1), np.array([[now**2, 2.0 * now, 1.0]])) is Outcome.DONE
    lag = -0.5 * (1.0 - np.cos(2.0))
    point = march.point()
    assert point.angle[0] == pytest.approx(1.0 + lag, abs=1e-14)
    assert point.force[0] == pytest.approx(4.0 * lag, abs=1e-13)


def test_marches_of_one_driveline_share_nothing() -> None:
    knots = np.arange(STEPS + 1) * (0.1 / 16)
    system, coefficients = channelled(2, knots)
    ends = in_periods(knots, 0.1)[1:]
    alone, _ = stepped(begun(system), ends, coefficients)
    one, other = begun(system), begun(system, 1)
    for end, row, want in zip(ends, coefficients, alone, strict=True):
        assert one.step(float(end), row) is Outcome.DONE
        assert other.step(float(end), -3.0 * row) is Outcome.DONE
        for actual, expected in zip(one.point(), want, strict=True):
            assert np.array_equal(actual, expected)


def test_another_march_goes_on_from_a_snapshot() -> None:
    knots = np.arange(STEPS + 1) * (0.1 / 10)
    system, coefficients = channelled(3, knots)
    ends = in_periods(knots, 0.1)[1:]
    march = begun(system)
    stepped(march, ends[:20], coefficients[:20])
    snapshot = march.snapshot()
    point = march.point()
    want, crossings = stepped(march, ends[20:], coefficients[20:])
    other = begun(system, 7)
    other.restore(snapshot)
    for actual, expected in zip(other.point(), point, strict=True):
        assert np.array_equal(actual, expected)
    actual, again = stepped(other, ends[20:], coefficients[20:])
    assert crossings == again
    for name in Point._fields:
        assert np.array_equal(rows(actual, name), rows(want, name))


def test_a_march_begins_in_the_middle_of_a_period() -> None:
    """Harmonics have their phases, and the polynomials of the channels hold from there on."""
    knots = np.arange(41) * (0.1 / 8)
    system, coefficients = channelled(5, knots)
    ends = in_periods(knots, 0.1)[1:]
    march = begun(system)
    stepped(march, ends[:11], coefficients[:11])
    here = march.point()
    want, _ = stepped(march, ends[11:20], coefficients[11:20])
    middle = replace(begun(system).task, angle=here.angle, velocity=here.velocity)
    now = coefficients[11].copy()
    other = CommunicationSteps(middle, Begin(int(ends[10]), float(ends[10] % 1.0), now))
    actual, _ = stepped(other, ends[11:20], coefficients[11:20])
    for name in FIELDS:
        scale = np.abs(rows(want, name)).max()
        np.testing.assert_allclose(rows(actual, name), rows(want, name), rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["equal", "any"])
def test_the_energy_balance_of_all_steps(seed: int, kind: str) -> None:
    """The works of a long march are those of the steps, batches of equal ones together."""
    lengths = np.random.default_rng(seed).uniform(1e-4, 0.03, STEPS)
    knots = np.arange(301) * (0.1 / 16) if kind == "equal" else np.append(0.0, np.cumsum(lengths))
    system, coefficients = channelled(seed, knots)
    march = CommunicationSteps(replace(begun(system).task, audit=True))
    stepped(march, in_periods(knots, 0.1)[1:], coefficients)
    energy = march.energy()
    assert energy is not None
    assert energy.relative_residual < 1e-11
    assert march.energy() is energy
    if kind == "equal":
        long = long_march(system, knots, coefficients, audit=True, cycles=18, samples_per_cycle=16).energy
        assert long is not None
        part = CommunicationSteps(replace(begun(system).task, audit=True))
        stepped(part, in_periods(knots, 0.1)[1:289], coefficients[:288])
        actual = part.energy()
        assert actual is not None
        for name in ("torque_work", "error_work", "drag_loss", "element_loss", "stored"):
            want = np.array(getattr(long, name))
            np.testing.assert_allclose(getattr(actual, name), want, rtol=0, atol=1e-10 * long.turnover)


def test_a_wrong_torque_is_missed_by_the_balance() -> None:
    """A torque beside the one that the march had leaves a residual."""
    knots = np.arange(STEPS + 1) * (0.1 / 16)
    system, coefficients = channelled(1, knots)
    march = CommunicationSteps(replace(begun(system).task, audit=True))
    stepped(march, in_periods(knots, 0.1)[1:], coefficients)
    assert march._balance is not None
    march._balance._coefficients[7] = march._balance._coefficients[7] + np.array([[1e-3], [0.0]])
    energy = march.energy()
    assert energy is not None
    assert energy.relative_residual > 1e-7
