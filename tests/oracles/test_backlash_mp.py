"""The oracle of the oscillator with backlash: against itself, and against another way to count its motions."""

from __future__ import annotations

import pytest
from mpmath import mp, mpf

from tests.oracles import backlash_mp as oracle
from tests.oracles.winding import fixed_points


@pytest.fixture(autouse=True)
def _digits():
    with mp.workdps(oracle.DIGITS):
        yield


@pytest.mark.parametrize(("frequency", "near", "cycles"), [("0.75", (1.2287, 0.1647), 1), ("1.5", (0.772, -0.123), 2)])
def test_the_map_takes_the_solution_of_the_equations_to_itself(
    frequency: str, near: tuple[float, float], cycles: int
) -> None:
    w = mpf(frequency)
    pattern, crossings = oracle.orbit(w, near, cycles)
    state = oracle.state_at_zero(pattern, w, crossings, cycles)
    end = oracle.mapped(w, state, cycles)[0]
    assert max(abs(a - b) for a, b in zip(end, state, strict=True)) < mpf("1e-36")
    product = mp.fprod(oracle.multipliers(w, state, cycles))
    assert abs(product - mp.exp(-mpf(oracle.DAMPING) * cycles * oracle.period(w))) < 1e-15


def test_folds_and_grazings() -> None:
    """Thirty digits, as they came out; the grazings are roots of a quadratic in W^2."""
    assert mp.nstr(oracle.fold(mpf("0.7085"), (0.98, 0.24)), 20) == "0.7080316187218310301"
    assert mp.nstr(oracle.fold(mpf("0.828"), (1.2165, 0.0319)), 20) == "0.82846398438821593141"
    assert mp.nstr(oracle.fold(mpf("1.3575"), (1.2187, 0.2325), 2), 20) == "1.3562469117722894641"
    for guess in ("0.82", "1.41"):  # (e^2 / m^2 - 1) W^4 + (2 - c^2) W^2 - 1 = 0
        square = oracle.grazing_from_contact(guess) ** 2
        assert abs(mpf("-0.75") * square**2 + mpf("1.99") * square - 1) < mpf("1e-36")


def test_round_every_cell() -> None:
    """Three motions between the folds, whose signs add up to one."""
    points = fixed_points(0.75)
    assert sorted(sign for _, _, sign in points) == [-1, 1, 1]
    saddle = next((x, v) for x, v, sign in points if sign < 0)
    pattern, crossings = oracle.orbit(mpf("0.75"), saddle)
    state = oracle.state_at_zero(pattern, mpf("0.75"), crossings)
    assert max(abs(a - b) for a, b in zip(state, saddle, strict=True)) < 1e-3
