"""Super- and sub-harmonics in signals made of known lines."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals import Line, strongest, sub_harmonics, super_harmonics
from gearrattle.trajectory import Array

PER_CYCLE = 32


def signal(*parts: tuple[float, float], cycles: int = 48, noise: float = 0.0) -> Array:
    phase = 2 * np.pi * np.arange(cycles * PER_CYCLE) / PER_CYCLE
    clean = sum((a * np.sin(o * phase + 0.7 * o) for o, a in parts), np.zeros(phase.size))
    return clean + noise * np.random.default_rng(11).normal(size=phase.size)


def found(lines: tuple[Line, ...]) -> dict[float, float]:
    return {line.order: line.amplitude for line in lines}


def test_super_harmonics_are_unexcited_multiples() -> None:
    lines = super_harmonics(signal((1, 1.0), (2, 0.5), (3, 0.2), (7, 0.02), (9, 0.005)), PER_CYCLE, 1.0, [1.0, 2.0])
    assert found(lines) == pytest.approx({3.0: 0.2, 7.0: 0.02}, rel=1e-11)


@pytest.mark.parametrize("divisor", range(2, 9))
def test_sub_harmonics_of_every_divisor_are_told_apart(divisor: int) -> None:
    lines = sub_harmonics(signal((1, 1.0), (1 / divisor, 0.3), cycles=16 * divisor), PER_CYCLE, 1.0, [1.0])
    assert found(lines) == pytest.approx({1 / divisor: 0.3}, rel=1e-10)


def test_fractional_lines_above_the_fundamental_are_sub_harmonics_too() -> None:
    lines = sub_harmonics(signal((1, 1.0), (1.5, 0.2), (7 / 3, 0.1)), PER_CYCLE, 1.0, [1.0])
    assert found(lines) == pytest.approx({1.5: 0.2, 7 / 3: 0.1}, rel=1e-10)


def test_common_period_longer_than_the_fundamental() -> None:
    # orders 2 and 3 are excited, T is that of order 1: a line at order 1 lies below both, one at 4 above
    both = signal((2, 1.0), (3, 0.5), (1, 0.1), (4, 0.2))
    assert found(sub_harmonics(both, PER_CYCLE, 1.0, [2.0, 3.0])) == pytest.approx({1.0: 0.1}, rel=1e-10)
    assert found(super_harmonics(both, PER_CYCLE, 1.0, [2.0, 3.0])) == pytest.approx({4.0: 0.2}, rel=1e-10)


def test_orders_are_multiples_of_omega_not_of_the_common_period() -> None:
    # only orders 2 and 4 excited: T is half a turn, its fundamental is order 2
    lines = super_harmonics(signal((1, 1.0), (2, 0.4), (3, 0.1)), PER_CYCLE, 2.0, [2.0, 4.0])
    assert found(lines) == pytest.approx({6.0: 0.1}, rel=1e-10)


def test_noise_is_no_line() -> None:
    noisy = signal((1, 1.0), noise=0.5)
    assert super_harmonics(noisy, PER_CYCLE, 1.0, [1.0]) == ()
    assert sub_harmonics(noisy, PER_CYCLE, 1.0, [1.0]) == ()


def test_line_above_noise_is_found() -> None:
    noisy = signal((1, 1.0), (0.5, 0.3), (3, 0.3), noise=0.2)
    assert list(found(sub_harmonics(noisy, PER_CYCLE, 1.0, [1.0]))) == [0.5]
    assert list(found(super_harmonics(noisy, PER_CYCLE, 1.0, [1.0]))) == [3.0]


def test_an_odd_number_of_cycles_hides_no_line_beside_a_period_doubling() -> None:
    lines = super_harmonics(signal((1, 1.0), (0.5, 0.9), (3, 0.02), cycles=41), PER_CYCLE, 1.0, [1.0])
    assert found(lines) == pytest.approx({3.0: 0.02}, rel=1e-10)


def test_too_short_or_unexcited_or_silent_signals_have_none() -> None:
    rich = signal((1, 1.0), (0.5, 0.3), (3, 0.3))
    assert super_harmonics(rich[: 7 * PER_CYCLE], PER_CYCLE, 1.0, [1.0]) == ()
    assert sub_harmonics(rich[: 15 * PER_CYCLE], PER_CYCLE, 1.0, [1.0]) == ()
    assert super_harmonics(rich, PER_CYCLE, 1.0, []) == ()
    assert sub_harmonics(rich, PER_CYCLE, 1.0, []) == ()
    assert super_harmonics(np.zeros(rich.size), PER_CYCLE, 1.0, [1.0]) == ()


def test_one_sample_a_cycle_shows_nothing_and_does_not_fail() -> None:
    assert super_harmonics(np.arange(40.0) % 3, 1, 1.0, [1.0]) == ()


def test_strongest() -> None:
    assert strongest([Line(1.5, 0.2), Line(2.5, 0.4)]) == Line(2.5, 0.4)
    assert strongest([]) is None
