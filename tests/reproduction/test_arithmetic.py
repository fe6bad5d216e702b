"""What follows from the paper's printed digits, and from Table 1's model without any motion."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.reproduction import printed_values, table5
from gearrattle.reproduction.efficiency_by_order import calls_for
from gearrattle.reproduction.measurements import Scope, Setup, measure
from gearrattle.reproduction.paper_cases import SPEED
from gearrattle.reproduction.paper_stiffness import conditioning, jacobian, natural, stiffness_ratio
from gearrattle.reproduction.table1 import agrees, parameters


@pytest.mark.parametrize(("clutch", "ratio"), [(0.1, 332.1), (1.0, 109.3)])
def test_r_lambda_is_the_same_in_every_formulation(clutch, ratio):
    for form in ({}, {"time_scale": SPEED}, {"mixed": True}, {"time_scale": SPEED, "mixed": True}):
        assert stiffness_ratio(jacobian(clutch, 1.0, **form)) == pytest.approx(ratio, abs=0.05)


def test_conditioning_is_what_scaling_changes():
    assert conditioning(jacobian(0.1, 1.0)) == pytest.approx(1.7e9, rel=0.02)
    assert conditioning(jacobian(0.1, 1.0, SPEED)) == pytest.approx(1.1e5, rel=0.02)


def test_damping_hardly_moves_the_fastest_mode():
    fastest = np.abs(np.linalg.eigvals(jacobian(1.0, 1.0))).max()
    assert natural(1.0, 1.0)[-1] == pytest.approx(fastest, rel=1e-3)


def test_fifteen_of_sixteen_parameters_follow_from_round_values():
    ours = parameters()
    assert list(ours) == list(printed_values.TABLE_1)
    assert [name for name, text in printed_values.TABLE_1.items() if not agrees(text, ours[name])] == ["Omega_22^2"]


def test_sigma_recomputes_but_once():
    (wrong,) = [row for row in table5.section().rows if row.status == "differs"]
    assert wrong.figures["sigma"] == pytest.approx(-1.99, abs=0.005)
    assert "-1.92 to -2.05" in wrong.why


def test_an_algorithm_that_is_not_there_is_a_result():
    setup = Setup(1, True, "none-such", 2)
    measurements = measure(Scope(True), [setup, setup])
    assert measurements.run(setup) is None
    assert measurements.result(setup).status == "not available here"


def test_calls_are_interpolated_between_runs():
    points = [(1e-1, 100), (1e-3, 1000)]
    assert calls_for(points, 1e-2) == pytest.approx(10**2.5)
    assert np.isnan(calls_for(points, 1e-4))
