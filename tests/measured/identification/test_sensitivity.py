"""Residuals against hand-written matrices, and the Jacobian against differences, for every kind of datum."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

import gearrattle as gr
from gearrattle.measured.identification.data_file import read_data
from gearrattle.measured.identification.free_parameters import coefficients, free_parameters
from gearrattle.measured.identification.measured_modes import State
from gearrattle.measured.identification.modal_problem import FitProblem
from gearrattle.measured.identification.modal_sensitivity import Spectrum
from tests.measured.identification import made

EIGHT = gr.load(Path(__file__).parents[3] / "examples" / "paper" / "eight_dof.toml")
OMEGA = np.linspace(40.0, 9000.0, 17)
FREE = ["inertia.*.J", "inertia.*.drag", "*.stiffness", "*.damping"]


def problem(model: gr.Model, data: dict, free: list[str] = FREE) -> FitProblem:
    parameters = free_parameters(model, free, {}, 3.0)
    measured = read_data(data, model, State())
    states = {
        item.state: coefficients(model, parameters, item.state) for item in (*measured.modes, *measured.responses)
    }
    return FitProblem(measured, tuple(i.name for i in model.inertias), states, len(parameters.paths))


def near(at: str, derivatives: int) -> np.ndarray:
    """Return a response of about the train's size: differences of residuals then keep their digits."""
    return (1.3 + 0.4j) * made.response(made.train(), at, "hub", OMEGA, derivatives)


DATA = {
    "frequencies": {"mode": [{"number": n, "omega": w} for n, w in ((2, 900.0), (3, 2000.0), (4, 13000.0))]},
    "partly closed": {
        "mode": [{"number": n, "omega": 500.0 * n, "contact_ratio": {"clutch": 0.1, "mesh": 0.4}} for n in (2, 3, 4)]
    },
    "first stage": {"mode": [{"number": 2, "omega": 300.0, "region": {"clutch": 0}}]},
    "rigid mesh": {"mode": [{"number": n, "omega": 500.0 * n, "rigid": ["mesh"]} for n in (2, 3)]},
    "shapes": {
        "mode": [
            {"number": 2, "shape": {"flywheel": 0.1, "hub": 1, "wheel": 1.2, "gear": 0.7}, "shape_error": 0.02},
            {"number": 4, "shape": {"wheel": -0.4, "gear": 1.0}, "shape_error": 0.05, "rigid": []},
            {"number": 3, "shape": {"hub": -0.4, "gear": 1.0}, "rigid": ["spline"]},
        ]
    },
    "matched by shape": {"mode": [{"omega": 800.0, "shape": {"flywheel": -0.02, "hub": 0.8, "wheel": 1, "gear": 2}}]},
    **{
        word: {
            "response": [
                {"at": "gear", "torque_on": "hub", "quantity": word, "omega": OMEGA, "value": near("gear", power)},
                {
                    "at": "hub",
                    "torque_on": "hub",
                    "quantity": word,
                    "omega": OMEGA,
                    "value": near("hub", power),
                    "rigid": ["mesh"],
                },
            ]
        }
        for power, word in enumerate(("angle", "velocity", "acceleration"))
    },
}


@pytest.mark.parametrize("kind", DATA)
def test_jacobian_agrees_with_differences(kind: str) -> None:
    asked = problem(made.train(), DATA[kind], [*FREE, "coupling.clutch.stiffness_ratio"])
    x = np.random.default_rng(5).uniform(-0.5, 0.5, asked.count)
    jacobian = asked.residuals(x)[1]
    step = 1e-4
    differences = np.column_stack(
        [
            (
                8 * (asked.residuals(x + d)[0] - asked.residuals(x - d)[0])
                - (asked.residuals(x + 2 * d)[0] - asked.residuals(x - 2 * d)[0])
            )
            / (12 * step)
            for d in step * np.eye(asked.count)
        ]
    )
    size = np.linalg.norm(jacobian, axis=1, keepdims=True)
    assert size.min() > 0.0
    assert np.abs(jacobian - differences).max() < 1e-6 * size.max()
    assert np.all(np.abs(jacobian - differences) < 1e-6 * size)


@pytest.mark.parametrize("number", range(2, 9))
def test_derivatives_of_the_eight_inertias(number: int) -> None:
    parameters = free_parameters(EIGHT, ["inertia.*.J", "*.stiffness"], {}, 3.0)
    c = coefficients(EIGHT, parameters, State())
    x, count = np.zeros(15), 8
    spectrum = Spectrum(c, x)
    actual = spectrum.shape_gradient(number - 1)
    J, _, K = made.matrices(EIGHT)
    assert spectrum.omega[1:] == pytest.approx(np.sqrt(eigh(K, J)[0][1:]), rel=1e-9)
    step = 1e-4
    for p in range(15):
        sides = [Spectrum(c, sign * step * np.eye(15)[p]) for sign in (1, -1)]
        shapes = [
            s.shapes[:, number - 1] * np.sign(s.shapes[:, number - 1] @ J @ spectrum.shapes[:, number - 1])
            for s in sides
        ]
        slope = (shapes[0] - shapes[1]) / (2 * step)
        assert slope == pytest.approx(actual[:, p], abs=1e-6 * np.abs(actual).max())
        omega = (sides[0].omega[number - 1] - sides[1].omega[number - 1]) / (2 * step)
        assert omega == pytest.approx(spectrum.omega_gradient(number - 1)[p], abs=1e-6 * spectrum.omega[number - 1])
    assert actual.shape == (count, 15)


@pytest.mark.parametrize("derivatives", [0, 1, 2])
def test_response_agrees_with_dense_solves(derivatives: int) -> None:
    model = made.train()
    c = coefficients(model, free_parameters(model, FREE, {}, 3.0), State())
    actual = Spectrum(c, np.zeros(c.of_inertia.shape[1])).response(3, 0, derivatives, OMEGA)[0]
    assert actual == pytest.approx(made.response(model, "gear", "flywheel", OMEGA, derivatives), rel=1e-9)


def test_a_rigid_element_is_the_limit_of_a_stiff_one() -> None:
    model = made.train()
    stiff = gr.modes(model.with_({"mesh.mesh.stiffness": 7.2e17})).frequencies[:3]
    asked = problem(model, {"mode": [{"number": 2, "omega": 1.0, "rigid": ["mesh"]}]})
    (c,) = asked.states.values()
    assert Spectrum(c, np.zeros(asked.count)).omega == pytest.approx(stiff, rel=1e-8, abs=1e-6)


def test_residuals_vanish_on_exact_data_and_do_not_feel_a_shape_s_scale() -> None:
    model = made.train()
    data = {
        "mode": [*made.mode_rows(model, [2, 3, 4]), made.shape_row(model, 3), made.shape_row(model, 4, numbered=False)],
        "response": [made.response_row(model, "gear", "flywheel", OMEGA)],
    }
    asked = problem(model, data)
    rows = asked.residuals(np.zeros(asked.count))[0]
    assert np.abs(rows).max() < 1e-6
    assert rows.size == 3 + 2 * 4 + 2 * OMEGA.size
