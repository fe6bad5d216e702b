"""Intervals hold what they promise: seeded repetition against the binomial law, moments against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.measured.validation import band_densities, order_agreement
from gearrattle.measured.validation.block_bootstrap import draws
from gearrattle.measured.validation.cycles import Cycles
from gearrattle.measured.validation.impact_agreement import passings
from gearrattle.measured.validation.level_agreement import compare_levels, mean_squares
from gearrattle.signals import psd

REPEATS = 300
LOW, HIGH = (0.95 + s * 3.0 * np.sqrt(0.95 * 0.05 / REPEATS) for s in (-1.0, 1.0))


def cycles(values: np.ndarray, period: float = 1.0) -> Cycles:
    return Cycles(values[:, :, None], values[:, :, None], 0.0, period)


def both(one: Cycles, other: Cycles, generator: np.random.Generator) -> tuple:
    return tuple(draws(mean_squares(entry), generator, 200) for entry in (one, other))


@pytest.mark.parametrize("ratio", [1.0, 1.3])
def test_sigmas_interval_holds_the_truth(ratio: float) -> None:
    """White cycles of known rms: sigma = 100 (1 - 1 / ratio)."""
    generator, held = np.random.default_rng(7), 0
    for _ in range(REPEATS):
        one = cycles(ratio * generator.standard_normal((60, 16)))
        other = cycles(generator.standard_normal((45, 16)))
        (rows,) = compare_levels(one, other, both(one, other, generator))
        level = rows[1]
        held += level.low <= 100.0 * (1.0 - 1.0 / ratio) <= level.high
    assert LOW <= held / REPEATS <= HIGH


def test_sigmas_interval_where_cycles_resemble_their_neighbours() -> None:
    """Levels with a correlation of 0.6 from cycle to cycle: independent scatter would hold the truth far too seldom."""
    generator, held = np.random.default_rng(8), 0
    shape = generator.standard_normal(16)
    for _ in range(REPEATS):
        pair = []
        for count in (120, 120):
            size = np.zeros(count)
            size[0] = generator.standard_normal()
            for n in range(1, count):
                size[n] = 0.6 * size[n - 1] + 0.8 * generator.standard_normal()
            pair.append(cycles((1.0 + 0.1 * size)[:, None] * shape))
        (rows,) = compare_levels(*pair, both(*pair, generator))
        held += rows[1].low <= 0.0 <= rows[1].high
    assert held / REPEATS >= 0.90  # blocks shorten the tail; honest lower bound, stated in the manual


def test_an_orders_interval_holds_its_amplitude_and_phase() -> None:
    generator = np.random.default_rng(9)
    amplitude = 0
    phase = 0
    at = np.arange(32) / 32.0
    for _ in range(REPEATS):
        one = cycles(1.1 * np.cos(2 * np.pi * at + 0.3) + generator.standard_normal((50, 32)))
        other = cycles(np.cos(2 * np.pi * at) + 0.5 * generator.standard_normal((40, 32)))
        drawn = both(one, other, generator)
        (rows,) = order_agreement.compare_orders(
            order_agreement.lines_of(one, drawn[0]), order_agreement.lines_of(other, drawn[1]), 1.0, 1.0
        )
        first = rows[0]
        truth = 100.0 * 0.1 / first.measured
        amplitude += first.low <= truth <= first.high
        phase += first.phase_low <= np.degrees(0.3) <= first.phase_high
    assert LOW <= amplitude / REPEATS <= HIGH
    assert LOW <= phase / REPEATS <= HIGH


@pytest.mark.long
def test_f_limits_hold_the_ratio_of_white_spectra() -> None:
    generator = np.random.default_rng(10)
    held = 0
    bands = 0
    for _ in range(REPEATS):
        one = cycles(1.5 * generator.standard_normal((64, 32)))
        other = cycles(generator.standard_normal((40, 32)))
        (rows,) = band_densities.compare_bands(band_densities.densities(one, other), (0.0, 12.8))
        held += sum(band.least <= 20.0 * np.log10(1.5) <= band.most for band in rows)
        bands += len(rows)
    few = 3.0 * np.sqrt(0.95 * 0.05 / REPEATS)  # bands of one repetition are nearly, not quite, independent
    assert abs(held / bands - 0.95) < few


def test_f_limits_hold_where_bursts_raise_a_band_for_cycles() -> None:
    """Noise whose size wanders with a correlation of 0.7 a cycle: Gaussian limits would be far too narrow."""
    generator = np.random.default_rng(12)
    held = 0
    gaussian = 0
    bands = 0
    for _ in range(REPEATS // 2):
        pair = []
        for count in (96, 96):
            size = np.zeros(count)
            for n in range(1, count):
                size[n] = 0.7 * size[n - 1] + 0.7 * generator.standard_normal()
            pair.append(cycles(np.exp(0.4 * size)[:, None] * generator.standard_normal((count, 32))))
        spectra = band_densities.densities(*pair)
        (rows,) = band_densities.compare_bands(spectra, (4.0, 12.8))
        for band in rows:
            held += band.least <= 0.0 <= band.most
            inside = (spectra[0].frequency >= band.low) & (spectra[0].frequency < band.high)
            n = [
                band_densities.gaussian_averages(entry.density[inside, 0], entry.periodograms.shape[2])
                for entry in spectra
            ]
            low, high = band_densities.limits(10.0 ** (band.decibels / 10.0), *n)
            gaussian += low <= 1.0 <= high
        bands += len(rows)
    assert gaussian / bands < 0.75
    assert held / bands > 0.88  # honest lower bound, stated in the manual


def test_equivalent_averages_are_the_variance_of_a_bands_power() -> None:
    """For white noise the power of a band has the relative variance 1 / n."""
    generator = np.random.default_rng(11)
    powers = []
    reports = []
    seen = []
    for _ in range(1500):
        record = cycles(generator.standard_normal((64, 16)))
        spectrum, _ = band_densities.densities(record, record)
        inside = spectrum.periodograms[10:20, 0]
        powers.append(inside.sum(axis=0).mean())
        reports.append(band_densities.gaussian_averages(inside.mean(axis=1), inside.shape[1]))
        seen.append(1.0 / band_densities.observed_averages(inside.sum(axis=0)))
    truth = np.mean(powers) ** 2 / np.var(powers)
    assert np.mean(reports) == pytest.approx(truth, rel=0.12)
    assert 1.0 / np.mean(seen) == pytest.approx(truth, rel=0.2)


def test_the_mean_of_the_segments_is_welchs_density() -> None:
    record = cycles(np.random.default_rng(13).standard_normal((40, 16)), period=0.02)
    spectrum, _ = band_densities.densities(record, record)
    welch = psd(record.values.reshape(-1, 1), 0.02, 16, 4)
    np.testing.assert_allclose(spectrum.density, welch.density, rtol=1e-12)
    np.testing.assert_allclose(spectrum.frequency, welch.frequency, rtol=1e-12)


def test_passings_of_a_sine_are_two_a_period() -> None:
    at = np.arange(20 * 64) / 64.0
    values = (3.0 * np.sin(2.0 * np.pi * at + 0.2)).reshape(20, 64)
    assert passings(values, 2.0).tolist() == [2.0] * 20
    assert passings(values, 3.1).sum() == 0.0
    rippled = values + 0.05 * np.sin(2.0 * np.pi * 20.0 * at).reshape(20, 64)
    assert passings(rippled, 2.0).sum() == 40.0  # ripples within the fall do not count
