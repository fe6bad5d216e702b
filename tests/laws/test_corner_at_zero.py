"""A corner at zero has no size of its own: motion through it is the same at every size of the motion.

x'' + c x' + k x = 0 with (k, c) = (w^2, 0.04 w) for x > 0 and (9 w^2, 0.3 w) for x < 0 passes zero at equal intervals,
pi over the damped frequencies w sqrt(1 - 0.02^2) and 3 w sqrt(1 - 0.05^2) in turn, while it decays by a fifth a cycle.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from tests.laws.motion import simulate
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Stage, Torque


def bilinear(rate: int, velocity: str) -> Driveline:
    """The oscillator above, starting at zero; the period of the output grid is 2 pi / rate."""
    drive = (Stage(str(rate**2), str(0.04 * rate)),)
    coast = (Stage(str(9 * rate**2), str(0.3 * rate)),)
    spring = Coupling("spring", ("x", "ground"), stages=drive, coast_stages=coast)
    return Driveline("bilinear", (Body("x", "1"),), (spring,), speed=str(rate)).start(("0",), (velocity,))


def expected(rate: int, cycles: int) -> np.ndarray:
    """Times of the passages in so many periods 2 pi / rate."""
    half = pi / sqrt(1 - 0.02**2), pi / (3 * sqrt(1 - 0.05**2))
    passages = np.cumsum(np.tile(half, 2 * cycles))
    return passages[passages < 2 * pi * cycles] / rate


def passages(rate: int, velocity: str, cycles: int) -> np.ndarray:
    return simulate(bilinear(rate, velocity), cycles, 4).events["time"].to_numpy()


@pytest.mark.parametrize("rate", [1, 100, 10_000, 1_000_000])
def test_a_stiff_spring_is_as_exact_as_a_soft_one(rate):
    """Ten cycles, in which the motion falls to a tenth of its first size, 1 / rate."""
    assert passages(rate, "1.0", 10) == pytest.approx(expected(rate, 10), rel=1e-12)


@pytest.mark.parametrize("velocity", ["1e3", "1.0", "1e-6", "1e-12", "1e-18"])
def test_a_small_motion_is_as_exact_as_a_large_one(velocity):
    assert passages(1, velocity, 10) == pytest.approx(expected(1, 10), rel=1e-12)


def test_a_decaying_motion_passes_zero_for_ever():
    assert passages(1, "1.0", 200) == pytest.approx(expected(1, 200), rel=1e-12)


@pytest.mark.parametrize("size", ["1e-9", "1e-15"])
def test_a_small_torque_drives_the_same_motion_as_a_large_one(size):
    def driven(size: str) -> np.ndarray:
        pull = Torque("x", harmonics=(Harmonic("1", size), Harmonic("2", size)))
        return simulate(replace(bilinear(1, size), torques=(pull,)), 20, 4).events["time"].to_numpy()

    assert len(driven(size)) > 40
    assert driven(size) == pytest.approx(driven("1"), rel=1e-12)
