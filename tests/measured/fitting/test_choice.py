"""Which lines are compared: noise has no say in it, and what a model cannot explain is not left out."""

from __future__ import annotations

import numpy as np

from gearrattle.measured.fitting.line_choice import Chosen, of_both, of_fitted
from gearrattle.measured.fitting.recorded import Motion, Recorded
from gearrattle.measured.validation import level_agreement, order_agreement
from gearrattle.measured.validation.block_bootstrap import draws
from gearrattle.measured.validation.cycles import Cycles
from gearrattle.recording import Channel

CYCLES, SAMPLES, LINES = 22, 256, 102
NOISE = 0.3
ERROR = NOISE * np.sqrt(2.0 / (CYCLES * SAMPLES))
"""Of either part of a line of the mean cycle."""
ALL = np.ones(LINES, dtype=np.bool_)
NUMBER = np.arange(1, LINES + 1)
TRUE = (np.exp(1.7j * NUMBER**2) / NUMBER**1.4)[:, None]
"""(K, 1) lines of a motion with impacts: many of them are as small as the noise."""

WEAK = 8
"""Lines from here on are not much larger than the next."""


def cycles_of(seed: int, true: np.ndarray = TRUE) -> Cycles:
    """22 measured cycles with white noise."""
    random = np.random.default_rng([7, seed])
    spectrum = np.concatenate([np.zeros((1, 1)), true, np.zeros((SAMPLES // 2 - LINES, 1))])
    cycle = np.fft.irfft(0.5 * SAMPLES * spectrum, SAMPLES, axis=0)
    values = cycle + NOISE * random.standard_normal((CYCLES, SAMPLES, 1))
    return Cycles(values, values, 0.0, 1.0)


def lines_of(seed: int, true: np.ndarray = TRUE) -> order_agreement.Lines:
    """Lines of these cycles."""
    cycles = cycles_of(seed, true)
    how = draws(level_agreement.mean_squares(cycles), np.random.default_rng(seed), lines=order_agreement.strong(cycles))
    return order_agreement.lines_of(cycles, how)


def raised(chosen: np.ndarray, lines: order_agreement.Lines) -> np.ndarray:
    """By how much noise has raised the size of chosen lines, in standard errors."""
    true = TRUE[chosen, 0]
    return np.asarray((lines.mean[chosen, 0] * np.conj(true / np.abs(true))).real - np.abs(true)) / ERROR


def test_lines_of_a_fitted_motion_are_not_those_that_noise_has_raised() -> None:
    """By both sizes the weakest that count are, on average over 40 records by a third of a standard error."""
    by_both: list[float] = []
    by_fitted: list[float] = []
    for seed in range(40):
        lines = lines_of(seed)
        chosen, _ = of_both(lines, np.zeros_like(TRUE), ALL)
        by_both += raised(chosen[chosen >= WEAK], lines).tolist()
        chosen, _ = of_fitted(lines, TRUE, np.zeros((LINES, 1)), ALL, phases=True)
        by_fitted += raised(chosen[chosen >= WEAK], lines).tolist()
    assert np.mean(by_both) > 3.3 / np.sqrt(len(by_both))
    assert abs(np.mean(by_fitted)) < 3.3 / np.sqrt(len(by_fitted))


def test_a_true_model_leaves_the_choice_to_its_own_lines() -> None:
    """40 records of 102 lines at one in ten thousand: a line that is taken by chance is rare."""
    strong = np.arange(order_agreement.MOST)  # they fall with their number
    others = 0
    for seed in range(40):
        chosen, channel = of_fitted(lines_of(seed), TRUE, np.zeros((LINES, 1)), ALL, phases=True)
        assert not channel.any()
        others += len(set(chosen.tolist()) ^ set(strong.tolist()))
    assert others <= 4


def test_a_measured_line_that_the_model_cannot_explain_counts() -> None:
    measured = TRUE.copy()
    measured[40] = 0.2
    chosen, _ = of_fitted(lines_of(0, true=measured), TRUE, np.zeros((LINES, 1)), ALL, phases=True)
    assert 40 in chosen
    known = np.zeros((LINES, 1))
    known[40] = 0.2  # as uncertain as it is large
    chosen, _ = of_fitted(lines_of(0, true=measured), TRUE, known, ALL, phases=True)
    assert 40 not in chosen


def test_without_phases_only_lines_count_that_stand_out_of_the_noise() -> None:
    chosen, _ = of_fitted(lines_of(0), TRUE, np.zeros((LINES, 1)), ALL, phases=False)
    assert chosen.size
    assert np.abs(TRUE[chosen, 0]).min() > 2.0 * ERROR


def test_lines_outside_the_band_do_not_count() -> None:
    within = NUMBER > 3
    for chosen, _ in (
        of_both(lines_of(0), TRUE, within),
        of_fitted(lines_of(0), TRUE, np.zeros((LINES, 1)), within, phases=True),
    ):
        assert chosen.min() == 3


def test_amplitudes_are_compared_as_noise_raises_them() -> None:
    """Of lines above three standard errors, over 40 records: sizes that are not raised are off by a tenth of one."""
    off: list[float] = []
    plain: list[float] = []
    for seed in range(40):
        cycles = cycles_of(seed)
        how = draws(
            level_agreement.mean_squares(cycles), np.random.default_rng(seed), lines=order_agreement.strong(cycles)
        )
        strong = np.flatnonzero(np.abs(TRUE[:, 0]) > 3.0 * ERROR)[-4:]
        none = np.zeros(0, dtype=np.int64)
        chosen = Chosen(strong, np.zeros_like(strong), none, phases=False, delay=None)
        channel = Channel("n", "velocity", "n", "rad/s", np.zeros(1))
        recorded = Recorded((channel,), cycles, 0.0, 1.0, 1.0, chosen, how, np.zeros(0), np.zeros(1))
        off += ((recorded.values(Motion(TRUE, np.zeros(1)), 0.0) - recorded.own_values) / ERROR).tolist()
        plain += ((np.abs(TRUE[strong, 0]) - recorded.own_values) / ERROR).tolist()
    assert abs(np.mean(off)) < 3.3 / np.sqrt(len(off))
    assert np.mean(off) - np.mean(plain) > 0.05
