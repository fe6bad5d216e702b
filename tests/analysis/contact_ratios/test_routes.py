"""The three routes where they must agree, and where they must not."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.analysis.contact_ratios import ROUTES
from gearrattle.analysis.contact_ratios.contact_ratio_record import elastic, law_of
from gearrattle.analysis.contact_ratios.describing import describing, under_gaussian, under_sine
from gearrattle.analysis.contact_ratios.mean_slope import mean_slope
from gearrattle.analysis.contact_ratios.spectral_gain import gain, spectral
from gearrattle.signals import contact_share, steady
from tests import synthetic
from tests.analysis.contact_ratios.motions import CLUTCH, GEAR, gaussian, with_deflection


def sine(over: float, mean: float = 0.0, cycles: int = 16, samples: int = 4096) -> np.ndarray:
    """Return a sine of amplitude half gap / over, in the gear's gap."""
    time = np.arange(cycles * samples + 1) / samples
    return 5e-5 * (mean + np.sin(2 * np.pi * time + 0.1) / over)


@pytest.mark.parametrize("kind", ["quiet", "single-sided", "double-sided"])
def test_mean_slope_is_alpha_and_the_contact_share(kind: str) -> None:
    motion = synthetic.trajectory(kind)
    actual, window = mean_slope(motion), steady(motion)
    for k, slope in enumerate(motion.layout.stiffness_of_piece):
        alpha = float(slope.min() / slope.max())
        assert actual.value[k] == pytest.approx(alpha + (1 - alpha) * contact_share(motion, k, window), rel=1e-12)
    assert (actual.low == actual.value).all()


@pytest.mark.parametrize("mean", [0.0, 0.7])
def test_a_sine_of_twice_the_gap(mean: float) -> None:
    motion = with_deflection(sine(0.5, mean), 4096)
    law = law_of(motion.layout, GEAR)
    want = under_sine(law, 1e-4, 5e-5 * mean)
    assert mean_slope(motion).value[GEAR] == pytest.approx(want.mean_slope / law.stiffness.max(), abs=1e-6)
    assert describing(motion).value[GEAR] == pytest.approx(want.gain / law.stiffness.max(), abs=1e-6)
    assert spectral(motion, "none").value[GEAR] == pytest.approx(want.gain / law.stiffness.max(), abs=1e-6)
    if mean == 0.0:
        assert [round(ROUTES[r](motion).value[GEAR], 3) for r in ("mean-slope", "describing")] == [0.667, 0.391]


def test_h1_without_taper_is_the_multi_harmonic_describing_function() -> None:
    motion = synthetic.trajectory(cycles=20)
    moving = np.ptp(motion.deflection, axis=0) > 0
    assert moving.any()
    assert spectral(motion, "none").value[moving] == pytest.approx(describing(motion).value[moving], rel=1e-10)


@pytest.mark.parametrize("clearance", [CLUTCH, GEAR])
def test_all_agree_under_gaussian_motion(clearance: int) -> None:
    corner = float(synthetic.layout().corners[clearance].max())
    motion = with_deflection(gaussian(8000, 64, 1.3 * corner, 1), 64, clearance)
    law = law_of(motion.layout, clearance)
    want = under_gaussian(law, 1.3 * corner).gain / law.stiffness.max()
    actual = {name: route(motion) for name, route in ROUTES.items()}
    assert actual["mean-slope"].value[clearance] == pytest.approx(want, abs=5e-3)
    assert actual["describing"].value[clearance] == pytest.approx(want, abs=5e-3)
    assert actual["spectral"].value[clearance] == pytest.approx(want, abs=5e-3)


def test_the_interval_covers_the_truth_as_often_as_it_says() -> None:
    """Gaussian deflection through a gap: H1's truth is the error function; 200 seeds."""
    hits, law = 0, law_of(synthetic.layout(), GEAR)
    truth = under_gaussian(law, 8e-5).gain
    for seed in range(200):
        deflection = gaussian(128, 32, 8e-5, seed)[:-1]
        actual = gain(deflection, 1.0 * elastic(law, deflection), 32.0, 16)
        hits += abs(actual.value - truth) <= 2.131 * actual.deviation  # Student, 15 degrees of freedom
    assert 0.90 <= hits / 200 <= 0.99


def test_h1_hv_h2_bracket_the_gain_of_a_noisy_spring() -> None:
    rng = np.random.default_rng(3)
    deflection = rng.normal(size=2**15)
    noisy = 2.0 * deflection + rng.normal(size=deflection.size)
    actual = gain(deflection, noisy, 1.0, 32)
    inner = slice(2, -2)
    assert actual.value == pytest.approx(2.0, abs=4 * actual.deviation)
    assert (np.abs(actual.h1[inner]) <= np.abs(actual.hv[inner]) * (1 + 1e-12)).all()
    assert (np.abs(actual.hv[inner]) <= np.abs(actual.h2[inner]) * (1 + 1e-12)).all()
    assert np.mean(actual.coherence[inner]) == pytest.approx(0.8, abs=0.02)
    spread = np.std(np.abs(actual.h1[inner]) / 2.0)
    assert spread == pytest.approx(np.median(actual.random_error[inner]), rel=0.1)


def test_a_motion_that_repeats_has_no_random_error() -> None:
    actual = spectral(with_deflection(sine(0.5, 0.2, samples=256), 256))
    assert actual.high[GEAR] - actual.low[GEAR] < 1e-6
    assert actual.notes == ()


def test_what_does_not_move_has_no_gain_but_a_slope() -> None:
    motion = with_deflection(np.full(257, 6e-5), 64)
    assert mean_slope(motion).value[GEAR] == 1.0
    assert np.isnan(describing(motion).value[GEAR])
    assert np.isnan(spectral(motion).value[GEAR])


def test_one_segment_tells_no_error() -> None:
    actual = spectral(with_deflection(sine(0.5, cycles=1), 4096))
    assert np.isnan(actual.low[GEAR])
    assert "one segment" in actual.notes[0]
