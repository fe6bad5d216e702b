"""Parts of the march of one-step methods: the interpolant, the search for exits, the order of crossings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearrattle.engine.kernels import step_loop
from gearrattle.engine.kernels.step_loop import Stepper, hermite


@pytest.mark.parametrize("x", [0.0, 0.2, 0.5, 0.9, 1.0])
def test_the_interpolant_of_a_cubic_is_the_cubic(x: float) -> None:
    cubic = np.polynomial.Polynomial([0.7, -1.3, 2.1, 0.4])
    rate, h = cubic.deriv(), 0.8
    assert hermite(x, h, cubic(0.0), rate(0.0), cubic(h), rate(h)) == pytest.approx(cubic(x * h), rel=1e-14)


@pytest.mark.parametrize("seed", range(20))
def test_an_exit_lies_in_its_bracket(seed: int) -> None:
    """A cubic gap, positive at the start: the first eighth at whose end it is negative."""
    rng = np.random.default_rng(seed)
    gap = np.polynomial.Polynomial([rng.uniform(0.1, 1.0), *rng.normal(size=3)])
    rate, h, bracket = gap.deriv(), 1.0, np.empty(2)
    eighths = np.arange(1, 9) / 8.0
    outside = eighths[gap(eighths) < 0.0]
    assert step_loop._exit(h, gap(0.0), rate(0.0), gap(h), rate(h), bracket) == bool(outside.size)
    if outside.size:
        assert bracket.tolist() == [outside[0] - 0.125, outside[0]]


@pytest.mark.parametrize("seed", range(5))
def test_crossings_are_logged_in_order_of_time(seed: int) -> None:
    """Among those of one step; none is earlier than those of the step before."""
    rng = np.random.default_rng(seed)
    times, last = rng.uniform(0.0, 1.0, 6), 0.3
    room, nothing = len(times) + 1, np.zeros(0)
    stepper: Any = Stepper(
        nothing,
        np.zeros(4),
        np.zeros(8, np.int64),
        nothing,
        np.zeros((0, 0)),
        np.zeros(room),
        np.zeros(room, np.int64),
        np.zeros((room, 2), np.int64),
        np.zeros(room),
        np.zeros(room),
    )
    step_loop._log(stepper, 0, last, 9, 1, -1, 0.5, 0.25)
    for k, time in enumerate(times):
        step_loop._log(stepper, 1, time, k, k, 1, 10.0 * k, 100.0 * k)
    order = np.argsort(np.maximum(times, last), kind="stable")
    assert stepper.event_element.tolist() == [9, *order]
    assert stepper.event_time.tolist() == [last, *np.maximum(times, last)[order]]
    assert stepper.event_pieces[1:].tolist() == [[k, k + 1] for k in order]
    assert stepper.event_rate.tolist() == [0.5, *(10.0 * order)]
    assert stepper.event_integral.tolist() == [0.25, *(100.0 * order)]
