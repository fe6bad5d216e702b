"""Sound of the force on the casing: levels in closed form, nothing folds back, axes do not matter, no switch-on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gearrattle as gr
from gearrattle.signals.casing_sound import casing_force, casing_pressure, source_of
from gearrattle.signals.impact_sound import REFERENCE, SoundPath, modal_path, pressure_level
from gearrattle.trajectory import Trajectory
from tests.laws.test_sideways import driven, train

Array = NDArray[np.float64]
RATE = 48_000.0
MODE = (850.0, 0.03, 1.4)
PATH = modal_path([MODE], RATE, "one mode")


def response_at(frequency: float) -> float:
    """|H| of the single mode in closed form [Pa/N]."""
    f0, damping, gain = MODE
    own, w = 2.0 * np.pi * f0, 2.0 * np.pi * frequency
    return float(gain * own * np.sqrt(1.0 - damping**2) / abs(own**2 - w**2 + 2j * damping * own * w))


class Known:
    """A force on the casing that is known at any time, in place of that of the motion."""

    def __init__(self, force: Callable[[Array], Sequence[Array]]) -> None:
        self.force = force

    def values(self, _motion: Trajectory, _signals: Sequence[Any], time: Array) -> Array:
        return np.stack(self.force(time), axis=1)


@pytest.fixture(scope="module")
def motion() -> Trajectory:
    """A motion of 30 periods of 31.4 ms, the last 10 of them judged."""
    run = gr.simulate(driven(), cycles=30, discard=20, samples_per_cycle=64)
    return run.trajectory


def with_force(motion: Trajectory, force: Callable[[Array], Sequence[Array]]) -> Trajectory:
    return replace(motion, exact=Known(force))


def level(motion: Trajectory, path: SoundPath = PATH) -> float:
    return pressure_level(casing_pressure(motion, path)[0])


def test_a_sinusoidal_bearing_force_has_the_level_of_the_closed_form() -> None:
    """A linear driveline at an order: F |H| / sqrt(2), of the size of the force on the casing."""
    tables = train()
    for body, drag in zip(tables["inertia"], (0.05, 0.0, 0.0, 0.05), strict=True):
        body["drag"] = drag
    tables["mesh"][0]["damping"] = 1500.0
    for bearing in tables["bearing"]:
        bearing["damping"] = 2000.0
    for coupling in tables["coupling"]:
        coupling["damping"] = 20.0
    tables["bearing"][0] |= {"stiffness": 4e7}
    order = 40.0
    tables["torque"] = [{"on": "motor", "harmonics": [{"order": order, "amplitude": 60.0}]}]
    run = gr.simulate(gr.Model.from_tables(tables), cycles=4000, discard=3800, samples_per_cycle=32)
    t = run.trajectory
    force = t.sideways.casing_force[3800 * 32 : -1]
    amplitude = 2.0 * np.abs((force * np.exp(-2j * np.pi * np.arange(len(force)) / 32)[:, None]).mean(axis=0))
    frequency = order * 100.0 / (2.0 * np.pi)
    assert 1.0 / t.layout.period == pytest.approx(frequency)
    exact = 20.0 * np.log10(np.hypot(*amplitude) * response_at(frequency) / np.sqrt(2.0) / REFERENCE)
    assert level(t) == pytest.approx(exact, abs=0.002)


def test_a_force_that_turns_adds_the_energies_of_its_directions(motion: Trajectory) -> None:
    """(cos, sin): twice the energy of one direction, and along x = -y no silence."""
    w = 2.0 * np.pi * 40.0 / motion.layout.period
    one = 20.0 * np.log10(response_at(w / (2.0 * np.pi)) / np.sqrt(2.0) / REFERENCE)
    turning = with_force(motion, lambda t: (np.cos(w * t), np.sin(w * t)))
    assert level(turning) == pytest.approx(one + 10.0 * np.log10(2.0), abs=1e-3)
    against = with_force(motion, lambda t: (np.cos(w * t), -np.cos(w * t)))
    assert level(against) == pytest.approx(one + 10.0 * np.log10(2.0), abs=1e-3)


def test_paths_by_direction_add_their_pressures(motion: Trajectory) -> None:
    """The same path for x and y: (cos, cos) is heard at twice the pressure, (cos, -cos) not at all."""
    w = 2.0 * np.pi * 40.0 / motion.layout.period
    both = replace(PATH, response=np.stack([PATH.response, PATH.response]), forces=("x", "y"))
    one = 20.0 * np.log10(response_at(w / (2.0 * np.pi)) / np.sqrt(2.0) / REFERENCE)
    assert level(with_force(motion, lambda t: (np.cos(w * t), np.cos(w * t))), both) == pytest.approx(
        one + 6.0206, abs=1e-3
    )
    assert level(with_force(motion, lambda t: (np.cos(w * t), -np.cos(w * t))), both) < one - 200.0


def test_axes_do_not_matter(motion: Trajectory) -> None:
    """A driveline turned by 40 degrees has the same level, though its forces have other components."""
    turned = gr.simulate(driven(np.radians(40.0)), cycles=30, discard=20, samples_per_cycle=64).trajectory
    assert level(turned) == pytest.approx(level(motion), abs=1e-6)


def test_what_a_step_has_beyond_hearing_does_not_fold_back(motion: Trajectory) -> None:
    """A square wave against its harmonics 4 / (pi k): below 16 kHz ten times nearer than samples at 48 kHz are."""
    turns = 2.0 * np.pi * 3.0 / motion.layout.period
    wave = with_force(motion, lambda t: (np.sign(np.sin(turns * t + 0.1)), 0.0 * t))
    force = casing_force(wave, RATE).values[:, 0]
    time = motion.layout.period * 20 + np.arange(force.size) / RATE
    harmonics = [k for k in range(1, 1000, 2) if k * turns < 2.0 * np.pi * 18_000.0]
    exact = np.sum([4.0 / (np.pi * k) * np.sin(k * (turns * time + 0.1)) for k in harmonics], axis=0)
    heard = np.fft.rfftfreq(force.size, 1.0 / RATE) < 16_000.0

    def error(values: Array) -> float:
        return float(np.abs(np.fft.rfft((values - exact) * np.hanning(exact.size)))[heard].max())

    assert error(force) < 0.1 * error(np.sign(np.sin(turns * time + 0.1)))
    assert error(force) < 5e-4 * np.abs(np.fft.rfft(exact * np.hanning(exact.size))).max()


def test_the_sound_is_as_long_as_the_steady_part_and_has_no_switch_on(motion: Trajectory) -> None:
    """The same sinusoid with and without discarded cycles: the first has its final size from the first sample on."""
    w = 2.0 * np.pi * 40.0 / motion.layout.period
    sine = with_force(motion, lambda t: (np.sin(w * t), 0.0 * t))
    pressure, is_exact = casing_pressure(sine, PATH)
    assert is_exact
    assert pressure.size == round(10 * motion.layout.period * RATE)
    size = response_at(w / (2.0 * np.pi))
    assert np.abs(pressure[:2000]).max() == pytest.approx(size, rel=2e-3)
    begun, _ = casing_pressure(replace(sine, discard=0), PATH)
    assert abs(np.abs(begun[:200]).max() - size) > 0.2 * size


def test_a_constant_force_is_silent(motion: Trajectory) -> None:
    still = with_force(motion, lambda t: (5.0 + 0.0 * t, -3.0 + 0.0 * t))
    assert level(still) < -150.0


def test_samples_of_another_algorithm_give_nearly_the_same(motion: Trajectory) -> None:
    exact = gr.simulate(driven(), cycles=30, discard=20, samples_per_cycle=2048).trajectory
    pressure, is_exact = casing_pressure(replace(exact, exact=None), PATH)
    assert not is_exact
    assert pressure_level(pressure) == pytest.approx(level(motion), abs=0.05)


def test_what_is_heard_follows_from_the_bearings() -> None:
    assert source_of(gr.simulate(driven(), cycles=1, discard=0).trajectory.layout) == "casing"
    assert source_of(gr.simulate(driven(masses=False), cycles=1, discard=0).trajectory.layout) == "impacts"
