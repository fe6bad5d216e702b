"""The first exit of a gap against the roots numpy finds, and the cases numpy's roots cannot decide."""

import numpy as np
import pytest

from gearrattle.engine.kernels import first_exit as kernels
from gearrattle.engine.kernels.first_exit import NEVER, UNDECIDED, first_exit, stays_inside


def first_sign_change(c: np.ndarray) -> float:
    """Return where the polynomial first turns negative in (0, 1], from its roots and a dense scan."""
    roots = np.roots(c[::-1])
    real = np.sort(roots[np.abs(roots.imag) < 1e-9].real)
    for root in real[(real > 0) & (real <= 1)]:
        if np.polynomial.polynomial.polyval(root + 1e-6, c) < 0:
            return float(root)
    return NEVER


@pytest.mark.parametrize("seed", range(300))
def test_first_exit_is_the_first_root_through_which_the_gap_turns_negative(seed: int) -> None:
    rng = np.random.default_rng(seed)
    c = rng.normal(size=int(rng.integers(2, 12))) / (1.0 + np.arange(1)) * np.exp(rng.normal())
    c = np.pad(c, (0, 17 - len(c)))
    c[0] = abs(c[0])
    want, actual = first_sign_change(c), first_exit(c)
    assert actual == pytest.approx(want, abs=1e-9)


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("at", [0.1, 0.5, 0.937])
def test_just_touch_and_just_miss_are_told_apart(depth: float, at: float) -> None:
    def gap(clear: float) -> np.ndarray:
        c = np.zeros(17)
        c[:3] = at * at + clear, -2.0 * at, 1.0  # (s - at)^2 + clear
        return c

    assert first_exit(gap(depth)) == NEVER
    assert first_exit(gap(-depth)) == pytest.approx(at - np.sqrt(depth), rel=1e-9 / np.sqrt(depth))


def test_a_gap_of_zero_that_opens_is_no_exit_and_its_return_is_found() -> None:
    c = np.zeros(17)
    c[:3] = 0.0, 1.0, -2.0  # zero at 0 and at 1/2
    assert first_exit(c) == pytest.approx(0.5, abs=1e-15)
    c[2] = 3.0
    assert first_exit(c) == NEVER


def test_a_gap_of_zero_that_closes_is_an_exit_at_once() -> None:
    c = np.zeros(17)
    c[:2] = 0.0, -1.0
    assert first_exit(c) == 0.0
    c[:3] = 0.0, 0.0, -1.0
    assert first_exit(c) == 0.0


@pytest.mark.parametrize("seed", range(200))
def test_the_minorant_check_agrees_with_a_dense_scan(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gap = abs(rng.normal())
    rate = rng.normal()
    curvature = rng.normal() * 3
    third, h = abs(rng.normal()) * 5, rng.random() * 2
    x = np.linspace(0, h, 20001)
    lowest = np.min(gap + rate * x + curvature * x**2 / 2 - third * x**3 / 6)
    if abs(lowest) > 1e-6:
        assert stays_inside(gap, rate, curvature, third, h) == (lowest > 0)


def test_a_gap_that_stays_closed_to_rounding_is_searched_in_few_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    for c in (np.zeros(20), np.array([0.0] * 19 + [1e-300]), np.array([1e-30, -1e-17, *[1e-17] * 18])):
        assert trials(c, monkeypatch) < 2000


def test_a_gap_of_rounding_alone_does_not_hide_a_dip_behind_it() -> None:
    roots = np.polynomial.polynomial.polyfromroots([0.5, 0.5 + 1e-5])
    flat = np.polynomial.polynomial.polypow([0.0, 1.0], 9)  # below 1e-18 up to 0.01
    c = np.polynomial.polynomial.polymul(flat, roots)
    assert first_exit(np.append(c, np.zeros(20 - c.size))) == pytest.approx(0.5, abs=1e-6)


def test_powers_that_grow_late_cost_no_trials_early(monkeypatch: pytest.MonkeyPatch) -> None:
    c = np.array([1e-6, -1e-3, 0.0, *[0.0] * 12, 1e30])
    assert first_exit(c) == pytest.approx(1e-3, rel=1e-12)
    assert trials(c, monkeypatch) < 500


def trials(c: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> int:
    """Count the widths that one search tries; the search runs as plain Python."""
    count = 0
    plain = getattr(kernels.stays_inside, "py_func", kernels.stays_inside)

    def counted(*arguments: float) -> bool:
        nonlocal count
        count += 1
        return bool(plain(*arguments))

    monkeypatch.setattr(kernels, "stays_inside", counted)
    search = getattr(kernels.exit_from, "py_func", kernels.exit_from)
    search(c, 0.0, c[0], c[1], 2.0 * c[2])
    return count


@pytest.mark.parametrize(
    "which", [slice(0, 20), *(pytest.param(slice(i, i + 1), marks=pytest.mark.compiled) for i in (0, 7))]
)
def test_a_search_that_can_decide_nothing_is_given_up(which: slice) -> None:
    c = np.zeros(20)
    c[:3] = 1.0, -3.0, 5.0
    c[which] = np.nan
    assert first_exit(c) == UNDECIDED
