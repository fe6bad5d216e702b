"""rk4 with a fine step knows nothing of regions in closed form, and must agree with exact."""

from __future__ import annotations

import numpy as np
import pytest

from tests.laws.motion import crossings, scale_of, simulate
from tests.oracles.random_drivelines import FAMILIES, random_problem

CYCLES = 1


def rk4(model, cycles: int, steps: int, period: float):
    return simulate(model, cycles, algorithm="rk4", step=period / steps)


def difference(a, b, name: str = "deflection") -> float:
    theirs = b.data[name].values
    return float(np.max(np.abs(a.data[name].values - theirs) / scale_of(theirs)))


QUICK = ("chain", "loop", "staged", "mesh", "undamped")


@pytest.mark.parametrize(
    "family",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in FAMILIES if name != "stiff"],
)
def test_rk4_approaches_exact(family):
    """At corners a fixed step is of first order where the damping jumps, so the difference falls with the step."""
    model = random_problem(family, 1).model
    exact = simulate(model, CYCLES)
    period = exact.data.attrs["period"]
    coarse, fine = rk4(model, CYCLES, 5_000, period), rk4(model, CYCLES, 320_000, period)
    assert difference(fine, exact) < min(1e-3, difference(coarse, exact) / 4)
    for clearance in exact.data.clearance.values:
        assert crossings(fine, clearance) == crossings(exact, clearance)


def test_rk4_converges_in_fourth_order_where_no_corner_is_met():
    problem = random_problem("undamped", 105)
    exact = simulate(problem.model, problem.cycles)
    assert len(exact.events) == 0
    period = exact.data.attrs["period"]
    errors = [difference(rk4(problem.model, problem.cycles, n, period), exact, "angle") for n in (200, 400)]
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.2)
    assert errors[1] > 1e-12
