"""Recordings by the exact engine from a known model: the truth comes back within its stated standard errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

import gearrattle as gr
from tests.measured.fitting import made


@pytest.mark.parametrize(
    ("path", "off"), [(path, off) for path, off in zip(made.TRUTH, (1.8, 0.4, 2.2, 0.45), strict=True)]
)
def test_a_wrong_start_within_the_bounds_finds_the_truth(path: str, off: float) -> None:
    fit = gr.identification.fit(made.model(**{path: off * made.TRUTH[path]}), made.recording(), [path])
    (p,) = fit.parameters
    assert abs(p.value - made.TRUTH[path]) < 4.0 * p.standard_error
    assert p.relative_error < 0.02
    assert fit.chi_square / fit.degrees_of_freedom < 3.0
    assert fit.undetermined == ()
    assert made.value(fit.model, path) == p.value


def test_several_values_are_told_apart() -> None:
    free = ["coupling.gap.stiffness", "coupling.gap.clearance", "inertia.gear.J"]
    start = made.model(**{path: off * made.TRUTH[path] for path, off in zip(free, (1.3, 0.7, 1.2), strict=True)})
    fit = gr.identification.fit(start, made.recording(), free, starts=8)
    away = np.log([p.value / made.TRUTH[p.path] for p in fit.parameters])
    assert away @ np.linalg.solve(fit.covariance, away) < 16.3  # 99.9 % of chi-square with three degrees


@pytest.mark.long
@pytest.mark.parametrize("draws", [10, 25])
def test_standard_errors_cover_the_truth(draws: int) -> None:
    """Over seeded noise: the shares within one and 1.96 standard errors, by the binomial law, and no bias."""
    path = "coupling.gap.clearance"
    deviations, spread = [], []
    for seed in range(draws):
        fit = gr.identification.fit(made.model(), made.recording(seed), [path], starts=1)
        deviations.append(np.log(fit.parameters[0].value / made.TRUTH[path]) / fit.parameters[0].relative_error)
        spread.append(fit.chi_square / fit.degrees_of_freedom)
    for inside, rate in ((1.0, 0.6827), (1.96, 0.95)):
        low, high = binom.ppf([0.0005, 0.9995], draws, rate)
        assert low <= np.count_nonzero(np.abs(deviations) < inside) <= high
    assert abs(np.mean(deviations)) < 3.3 / np.sqrt(draws)
    assert 0.8 < np.mean(spread) < 1.5  # the errors are those of a bootstrap over 50 cycles


LINEAR = gr.loads(made.MODEL.replace("clearance = 0.01\n", ""))


@pytest.mark.parametrize(
    ("free", "how"),
    [
        (["torque.0.harmonics.0.amplitude"], {}),
        (["torque.0.harmonics.0.amplitude"], {"calibration": 3.0}),
        pytest.param(["coupling.gap.stiffness", "inertia.gear.J"], {}, marks=pytest.mark.long),
    ],
)
def test_a_profile_is_the_standard_errors_interval_where_the_motion_is_linear(
    free: list[str], how: dict[str, float]
) -> None:
    """Without a gap the motion is linear in a torque, and over a standard error in all others."""
    data = {"recording": {"file": made.recording(source=LINEAR), **how}}
    fit = gr.identification.fit(LINEAR, data, free, starts=1, profile=True)
    for p in fit.parameters:
        low, high = (np.array(p.interval) - p.value) / (1.96 * p.standard_error)
        assert low == pytest.approx(-1.0, rel=0.005)
        assert high == pytest.approx(1.0, rel=0.005)


def test_a_record_without_noise_gives_the_truth() -> None:
    path = "inertia.gear.J"
    fit = gr.identification.fit(made.model(**{path: 0.06}), made.recording(noise=0.0), [path], starts=1)
    assert fit.parameters[0].value == pytest.approx(0.05, rel=1e-4)  # what resampling leaves open


def test_amplitudes_alone_know_less() -> None:
    path, record = "inertia.gear.drag", made.recording()
    start = made.model(**{path: 0.6})
    whole = gr.identification.fit(start, record, [path], starts=1)
    sizes = gr.identification.fit(start, {"recording": {"file": record, "phases": False}}, [path], starts=1)
    assert len(sizes.residuals) == len(whole.residuals) / 2
    assert sizes.parameters[0].standard_error > whole.parameters[0].standard_error
    assert abs(sizes.parameters[0].value - 0.5) < 4.0 * sizes.parameters[0].standard_error


def test_a_calibration_that_is_uncertain_widens_the_error_by_as_much() -> None:
    """The torque's amplitude is known as well as the gain of the sensors, 3 % in common to all lines of each."""
    path, off = "torque.0.harmonics.0.amplitude", 1.03
    record = made.recording(gain=off, names=("engine",))
    plain = gr.identification.fit(made.model(), record, [path], starts=1)
    known = {"recording": {"file": record, "calibration": 3.0}}
    fit = gr.identification.fit(made.model(), known, [path], starts=1)
    assert abs(plain.parameters[0].value - 40.0) > 4.0 * plain.parameters[0].standard_error
    assert abs(fit.parameters[0].value - 40.0) < 4.0 * fit.parameters[0].standard_error


def test_a_known_delay_of_the_clocks_is_one_value_less_to_fit() -> None:
    path = "coupling.gap.stiffness"
    record = made.recording()
    free = gr.identification.fit(made.model(), record, [path], starts=1)
    known = {"recording": {"file": record, "clock": "-37.7 ms"}}
    fit = gr.identification.fit(made.model(), known, [path], starts=1)
    assert fit.degrees_of_freedom == free.degrees_of_freedom + 1
    assert fit.parameters[0].value == pytest.approx(900.0, abs=4.0 * fit.parameters[0].standard_error)


@pytest.mark.long
def test_a_motion_that_never_repeats_is_fitted_on_a_surface_and_says_so() -> None:
    """Chaotic, by its scatter from cycle to cycle; the record is of another start, so nothing but averages agrees."""
    changes = {"excitation.frequency": 24.0, "torque.0.mean": 8.0, "inertia.engine.drag": 0.5, "inertia.gear.drag": 0.1}
    long = {"simulation.cycles": 260, "simulation.discard": 60}
    path, truth = "coupling.gap.stiffness", made.model(**changes, **long)
    record = made.recording(source=truth.with_({"simulation.initial": "zero"}), noise=0.02, cycles=320)
    fit = gr.identification.fit(truth.with_({path: 1.3 * 900.0}), record, [path], starts=6, factor=2.0, profile=True)
    (p,) = fit.parameters
    assert p.interval is None
    assert any(note.startswith("no profiles:") for note in fit.notes)
    assert any("does not repeat itself" in note for note in fit.notes)
    assert abs(np.log(p.value / 900.0)) < 4.0 * p.relative_error
    assert p.relative_error < 0.1


def test_the_rms_counts_where_the_noise_is_stated() -> None:
    path, noise = "coupling.gap.stiffness", 0.05
    record = made.recording(noise=noise)
    stated = {channel.name: noise * float(channel.values.std()) * 0.9**0.5 for channel in record.channels}
    known = {"recording": {"file": record, "noise": stated}}
    fit = gr.identification.fit(made.model(), known, [path], starts=1)
    rms = [r for r in fit.residuals if r.label.endswith("rms")]
    assert [r.label for r in rms] == ["n_engine: rms", "n_gear: rms"]
    assert all(r.fitted == pytest.approx(r.measured, rel=2e-3) for r in rms)
