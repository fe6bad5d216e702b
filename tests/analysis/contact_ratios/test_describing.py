"""Closed forms of describing functions against quadrature, textbook formulas and each other."""

from __future__ import annotations

from itertools import pairwise
from math import asin, erf, pi, sqrt

import numpy as np
import pytest

from gearrattle.analysis.contact_ratios.describing import under_gaussian, under_sine
from gearrattle.engine.system.law import PiecewiseLaw, Stage, staged


def two_stage(alpha: float, beta: float = 1.0, half_gap: float = 1.0, preload: float = 0.0) -> PiecewiseLaw:
    stages = [Stage(alpha, beta, half_gap), Stage(1.0, 1.0, None)]
    return staged(stages, stages, preload)


def random_law(seed: int) -> PiecewiseLaw:
    """A staged law of one to four stages a side, sides unlike, with a preload."""
    rng = np.random.default_rng(seed)

    def side() -> list[Stage]:
        count = int(rng.integers(1, 5))
        ends = np.cumsum(rng.uniform(0.1, 1.0, count)).tolist()
        ends[-1] = None
        return [Stage(float(rng.uniform(0, 3)), float(rng.uniform(0, 2)), end) for end in ends]

    return staged(side(), side(), float(rng.normal()))


def averages(law: PiecewiseLaw, amplitude: float, mean: float) -> tuple[float, float, float, float]:
    """Mean force, gain, damping of equal loss and mean slope by Gauss-Legendre quadrature between corners."""
    inside = [float(np.arcsin((c - mean) / amplitude)) for c in law.corners if abs(c - mean) < amplitude]
    nodes, weights = np.polynomial.legendre.leggauss(40)
    total = np.zeros(4)
    for low, high in pairwise([-pi / 2, *inside, pi / 2]):
        phi, weight = 0.5 * (low + high) + 0.5 * (high - low) * nodes, 0.5 * (high - low) * weights / pi
        piece = law.piece_at(mean + amplitude * np.sin(0.5 * (low + high)))
        delta = mean + amplitude * np.sin(phi)
        force = law.stiffness[piece] * delta + law.offset[piece]
        total += [
            weight @ force,
            2.0 * weight @ (force * np.sin(phi)) / amplitude,
            2.0 * law.damping[piece] * (weight @ np.cos(phi) ** 2),
            law.stiffness[piece] * weight.sum(),
        ]
    return tuple(total.tolist())


@pytest.mark.parametrize("seed", range(60))
def test_sine_with_mean_against_quadrature(seed: int) -> None:
    law, rng = random_law(seed), np.random.default_rng(1000 + seed)
    amplitude, mean = float(rng.uniform(0.05, 4.0)), float(rng.normal())
    actual = under_sine(law, amplitude, mean)
    force, gain, damping, slope = averages(law, amplitude, mean)
    size = np.abs(law.stiffness).max() * (amplitude + abs(mean)) + np.abs(law.offset).max()
    assert actual.mean_force == pytest.approx(force, abs=1e-12 * size)
    assert actual.gain == pytest.approx(gain, abs=1e-12 * size / amplitude)
    assert actual.damping == pytest.approx(damping, abs=1e-12 * law.damping.max())
    assert actual.mean_slope == pytest.approx(slope, abs=1e-12 * law.stiffness.max())
    assert actual.mean_gain == pytest.approx((force - law.elastic(0.0)) / mean, abs=1e-12 * size / abs(mean))


@pytest.mark.parametrize("alpha", [0.0, 0.1, 0.25, 2.0])
@pytest.mark.parametrize("over", [0.2, 0.5, 0.99])
def test_two_stage_law_under_a_sine_is_the_textbook_formula(alpha: float, over: float) -> None:
    """N = 1 - (1 - alpha) (2/pi) (asin h + h sqrt(1 - h^2)), h = b/A (Gelb and Vander Velde 1968)."""
    actual = under_sine(two_stage(alpha, beta=alpha), 1.0 / over)
    inside = 2 / pi * (asin(over) + over * sqrt(1 - over**2))
    assert actual.gain == pytest.approx(1 - (1 - alpha) * inside, rel=1e-14)
    assert actual.damping == pytest.approx(actual.gain, rel=1e-14)
    assert actual.mean_slope == pytest.approx(1 - (1 - alpha) * 2 / pi * asin(over), rel=1e-14)
    assert actual.mean_force == pytest.approx(0.0, abs=1e-15)
    assert actual.mean_gain == actual.mean_slope


def test_a_sine_of_twice_the_gap_tells_the_two_quantities_apart() -> None:
    actual = under_sine(two_stage(0.0), 2.0)
    assert (round(actual.mean_slope, 3), round(actual.gain, 3)) == (0.667, 0.391)


def test_a_sine_inside_one_piece_meets_that_piece_alone() -> None:
    law = two_stage(0.25, beta=0.5, preload=0.3)
    assert under_sine(law, 0.5, 0.4).gain == 0.25
    outside = under_sine(law, 0.5, 3.0)
    assert (outside.gain, outside.mean_slope, outside.damping) == (1.0, 1.0, 1.0)
    assert outside.mean_force == pytest.approx(law.elastic(3.0), rel=1e-15)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("motion", [under_sine, under_gaussian])
def test_the_mean_slope_is_the_slope_of_the_mean_force(seed: int, motion) -> None:
    law, step = random_law(seed), 1e-5
    ahead, behind = motion(law, 0.8, 0.1 + step).mean_force, motion(law, 0.8, 0.1 - step).mean_force
    assert motion(law, 0.8, 0.1).mean_slope == pytest.approx((ahead - behind) / (2 * step), abs=2e-3)


@pytest.mark.parametrize("alpha", [0.0, 0.1])
@pytest.mark.parametrize(("deviation", "mean"), [(0.5, 0.0), (1.0, 0.7), (3.0, -1.5)])
def test_gaussian_motion_has_one_ratio_the_error_function(alpha: float, deviation: float, mean: float) -> None:
    actual = under_gaussian(two_stage(alpha), deviation, mean)
    inside = 0.5 * (erf((1 - mean) / deviation / sqrt(2)) + erf((1 + mean) / deviation / sqrt(2)))
    assert actual.gain == pytest.approx(alpha + (1 - alpha) * (1 - inside), rel=1e-13)
    assert actual.mean_slope == actual.gain


@pytest.mark.parametrize("seed", range(10))
def test_gaussian_against_quadrature(seed: int) -> None:
    law = random_law(seed)
    mean = 0.2
    deviation = 0.9
    nodes, weights = np.polynomial.legendre.leggauss(60)
    total = np.zeros(2)
    for low, high in pairwise([mean - 12.0, *law.corners, mean + 12.0]):
        delta, weight = 0.5 * (low + high) + 0.5 * (high - low) * nodes, 0.5 * (high - low) * weights
        weight = weight * np.exp(-0.5 * ((delta - mean) / deviation) ** 2) / (deviation * sqrt(2 * pi))
        piece = law.piece_at(0.5 * (low + high))
        force = law.stiffness[piece] * delta + law.offset[piece]
        total += [weight @ force, weight @ (force * (delta - mean)) / deviation**2]
    actual = under_gaussian(law, deviation, mean)
    assert [actual.mean_force, actual.gain] == pytest.approx(total.tolist(), abs=1e-10)
