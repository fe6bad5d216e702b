"""Sections 5 to 7 of the 1995 paper: Table 1, R_lambda and conditioning of the model inferred from it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.analysis.stiffness import r_lambda_over, regions
from gearrattle.simulation.fixed_steps import step_limits

PAPER = Path(__file__).parents[2] / "examples" / "paper"
EXACT = {
    "xi_11": 1 / 3e5, "xi_22": 2e-3, "xi_33": 1 / 10500, "xi_44": 1 / 6000,
    "eta_11": 5e-3, "eta_12": 10 / 3, "eta_22": 1 / 9, "eta_23": 1 / 210, "eta_33": 50 / 7, "eta_34": 50.0,
    "Omega2_11": 2 / 9, "Omega2_12": 4000 / 27, "Omega2_22": 40000 / 27, "Omega2_23": 4000 / 63,
    "Omega2_33": 160000 / 21, "Omega2_34": 160000 / 3,
}  # fmt: skip
PRINTED = {
    "xi_11": "3.333e-06",
    "xi_22": "0.002",
    "xi_33": "9.524e-05",
    "xi_44": "1.667e-04",
    "eta_11": "0.005",
    "eta_12": "3.333",
    "eta_22": "0.111",
    "eta_23": "0.005",
    "eta_33": "7.143",
    "eta_34": "50.000",
    "Omega2_11": "0.222",
    "Omega2_12": "148.148",
    "Omega2_23": "63.49",
    "Omega2_33": "7619.0",
    "Omega2_34": "5.333e04",
}
"""Table 1 but for Omega_22^2, printed 1482.0: the inferred model has 1481.5."""


@pytest.fixture
def case3() -> gr.Model:
    return gr.load(PAPER / "case3.toml")


def test_table_1_comes_out_of_the_inferred_model(case3: gr.Model) -> None:
    actual = gr.nondimensionalize(case3).coefficients
    assert {name: actual[name] for name in EXACT} == pytest.approx(EXACT, rel=1e-14)
    assert (actual["b_1"], actual["b_2"], actual["b_3"]) == pytest.approx((160.0, 58.67, 1.0))
    assert (actual["alpha_1"], actual["beta_1"], actual["epsilon_3_20"]) == pytest.approx((0.001, 0.01, 0.1))
    assert actual["Omega_e"] == 1.0
    assert [actual[f"T_a1_{j}"] for j in range(1, 6)] == pytest.approx([30.0, 12.0, 7.5, 3.6, 1.8])


@pytest.mark.parametrize("name", PRINTED)
def test_table_1_to_the_digits_printed(case3: gr.Model, name: str) -> None:
    digits = PRINTED[name]
    mantissa, _, exponent = digits.partition("e")
    unit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    assert abs(gr.nondimensionalize(case3).coefficients[name] - float(digits)) <= 0.5 * unit * (1 + 1e-9)


def test_r_lambda_and_conditioning(case3: gr.Model) -> None:
    actual = gr.stiffness(case3, contact_ratio={"clutch": 0.1})
    assert round(actual.r_lambda, 1) == 332.1
    assert round(gr.stiffness(case3).r_lambda, 1) == 109.3
    assert actual.stiffness_class == "mild"
    assert actual.rigid_eigenvalues.real == pytest.approx([0.0, -1.512e-3], rel=1e-3)
    size = {name: float(f"{value:.1e}") for name, value in actual.condition.items()}
    assert (size["dimensional"], size["torsional"]) == (1.7e9, 1.1e5)
    assert actual.condition["mixed"] == actual.condition["translational"] == actual.condition["torsional"]
    assert actual.condition["balanced"] < 6e3


def test_r_lambda_is_the_same_without_dimensions(case3: gr.Model) -> None:
    scaled = gr.stiffness(gr.nondimensionalize(case3).model, contact_ratio={"clutch": 0.1})
    plain = gr.stiffness(case3, contact_ratio={"clutch": 0.1})
    assert scaled.r_lambda == pytest.approx(plain.r_lambda, rel=1e-11)
    assert scaled.condition["dimensional"] == pytest.approx(plain.condition["torsional"], rel=1e-8)


def test_fig_6_falls_with_the_contact_ratio_of_the_gears(case3: gr.Model) -> None:
    actual = r_lambda_over(case3, "gear", [0.1, 0.5, 1.0], {"clutch": 0.1})
    assert (np.diff(actual) > 0).all()
    assert actual[-1] == pytest.approx(332.107, abs=1e-3)


def test_the_paper_s_rk4_step_is_unstable(case3: gr.Model) -> None:
    limits = {limit.algorithm: limit for limit in step_limits(case3, regions(case3)[0], 0.0128 / 150)}
    assert round(limits["rk4"].growth, 2) == 1.69
    assert limits["rk4"].largest_step * 150 == pytest.approx(0.0119757, abs=5e-8)
    assert limits["rk4"].labels["gear"] == 1
    assert step_limits(case3, regions(case3)[0], 0.001 / 150)[0].growth <= 1.0 + 1e-9
