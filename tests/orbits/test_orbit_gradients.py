"""Gradients of a periodic motion: closed forms in contact, laws of its multipliers, motions of changed models."""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

import gearrattle as gr
from gearrattle.orbits import Orbit
from gearrattle.orbits.gradients import FORCE, MULTIPLIER, SWING, responses_of
from tests.orbits.test_branch import oscillator
from tests.orbits.test_families import train

PATHS = ("torque.0.mean", "coupling.gap.kinematic_error.0.amplitude", "coupling.gap.damping", "excitation.speed")


@cache
def rattling() -> Orbit:
    """The large motion between the folds."""
    model = oscillator().with_({"excitation.speed": 0.75})
    return gr.periodic(model, every=True)[-1]


@cache
def gradients_of_rattling() -> pd.DataFrame:
    return rattling().gradients(PATHS).set_index(["response", "of", "path"])


def contact(w: float, e: float, c: float, k: float, J: float) -> tuple[float, float]:
    """Peak-to-peak deflection and largest force in contact: J x'' + c x' + k (x - 1) = 0.1 + J e W^2 cos(W t)."""
    amplitude = J * e * w**2 / abs(k - J * w**2 + 1j * c * w)
    return 2.0 * amplitude, 0.1 + amplitude * abs(k + 1j * c * w)


def test_in_contact_they_are_those_of_the_closed_form() -> None:
    numbers = {
        "excitation.speed": 0.5,
        "coupling.gap.kinematic_error.0.amplitude": 0.05,
        "coupling.gap.damping": 0.1,
        "coupling.gap.stiffness": 1.0,
        "inertia.body.J": 1.0,
    }
    orbit = gr.periodic(oscillator().with_({"excitation.speed": 0.5}), start="linear")
    table = orbit.gradients(list(numbers)).set_index(["response", "of", "path"])["gradient"]
    values = list(numbers.values())
    for i, path in enumerate(numbers):
        h = 1e-4 * values[i]
        low, high = (
            np.array(contact(*[value + (side if j == i else 0.0) for j, value in enumerate(values)]))
            for side in (-h, h)
        )
        swing, force = (high - low) / (2.0 * h)
        assert table[SWING, "gap", path] == pytest.approx(swing, rel=1e-6, abs=1e-8)
        assert table[FORCE, "gap", path] == pytest.approx(force, rel=1e-6, abs=1e-8)


def test_in_contact_multipliers_decay_with_the_damping() -> None:
    """|mu| = exp(-c T / 2 J): its gradients by c, J and W are known."""
    orbit = gr.periodic(oscillator().with_({"excitation.speed": 0.5}), start="linear")
    paths = ["coupling.gap.damping", "inertia.body.J", "excitation.speed"]
    table = orbit.gradients(paths).set_index(["response", "of", "path"])["gradient"]
    period = 2.0 * np.pi / 0.5
    modulus = np.exp(-0.05 * period)
    wanted = [-0.5 * period * modulus, 0.05 * period * modulus, 0.05 * period / 0.5 * modulus]
    for number in ("1", "2"):
        for path, slope in zip(paths, wanted, strict=True):
            assert table[MULTIPLIER, number, path] == pytest.approx(slope, rel=1e-6)


def test_with_impacts_they_are_differences_of_motions_found_anew() -> None:
    orbit, table = rattling(), gradients_of_rattling()
    assert len(orbit.pattern) > 0
    for path in PATHS:
        value = float(table["value"].xs(path, level="path").iloc[0])
        slopes = []
        for h in (2e-3 * value, 1e-3 * value):
            swings = []
            for side in (-h, h):
                moved = gr.periodic(orbit.model.with_({path: value + side}), start=orbit)
                swings.append(np.append(responses_of(moved.period_map, moved.motion), np.abs(moved.multipliers)))
            slopes.append((swings[1] - swings[0]) / (2.0 * h))
        wanted = (4.0 * slopes[1] - slopes[0]) / 3.0
        own = [table.loc[subject, "gradient"] for subject in subjects(path)]
        np.testing.assert_allclose(own, wanted, rtol=2e-5, atol=1e-7)


def subjects(path: str) -> list[tuple[str, str, str]]:
    return [(SWING, "gap", path), (FORCE, "gap", path), (MULTIPLIER, "1", path), (MULTIPLIER, "2", path)]


def test_the_product_of_multipliers_is_left_alone_by_what_does_not_damp() -> None:
    """|mu_1 mu_2| = exp(-c T / J), through all impacts: the load moves both moduli against each other, if at all."""
    table, orbit = gradients_of_rattling()["gradient"], rattling()
    moduli = np.abs(orbit.multipliers)
    period = orbit.period
    for path, wanted in (
        ("torque.0.mean", 0.0),
        ("coupling.gap.damping", -period),
        ("excitation.speed", 0.1 * period / 0.75),
    ):
        of_log = sum(table[MULTIPLIER, str(i + 1), path] / moduli[i] for i in range(2))
        assert of_log == pytest.approx(wanted, rel=1e-6, abs=1e-6)


def test_scaled_torques_error_and_clearance_scale_the_motion() -> None:
    """The motion is proportional to mean, error and half gap together (Euler's theorem on homogeneous functions)."""
    orbit = rattling()
    paths = ["torque.0.mean", "coupling.gap.kinematic_error.0.amplitude", "coupling.gap.clearance"]
    table = orbit.gradients(paths)
    swing, force = responses_of(orbit.period_map, orbit.motion)
    for response, value in ((SWING, swing), (FORCE, force)):
        rows = table[table["response"] == response]
        assert float((rows["value"] * rows["gradient"]).sum()) == pytest.approx(value, rel=1e-6)


def test_the_force_is_that_of_the_samples_where_they_are_dense() -> None:
    orbit = rattling()
    largest = responses_of(orbit.period_map, orbit.motion)[1]
    sampled = float(np.abs(orbit.run.data["force"].values).max())
    assert sampled <= largest * (1.0 + 1e-12)
    assert sampled == pytest.approx(largest, rel=1e-3)


def test_the_force_of_a_slider_is_in_it() -> None:
    orbit = gr.periodic(train(means=2.0, hysteresis=0.02))
    largest = responses_of(orbit.period_map, orbit.motion)[1]
    sampled = float(np.abs(orbit.run.data["force"].values).max())
    assert sampled <= largest * (1.0 + 1e-12)
    assert sampled == pytest.approx(largest, rel=1e-4)


def clutch(second: float) -> gr.Model:
    """A clutch whose second stage adds so much friction; with 0.24 both stages begin to slip at one deflection."""
    stages = [
        {"stiffness": 0.4, "damping": 0.05, "until": 0.6, "hysteresis": 0.12, "stick_stiffness": 6.0},
        {"stiffness": 3.0, "damping": 0.1, "hysteresis": 0.12 + second, "stick_stiffness": 12.0},
    ]
    tables = {
        "inertia": [{"name": "a", "J": 1.0, "drag": 0.05}],
        "coupling": [{"name": "disc", "between": ["a", "ground"], "stages": stages}],
        "excitation": {"speed": 1.3},
        "torque": [{"on": "a", "mean": 0.2, "harmonics": [{"order": 1, "amplitude": 1.5}]}],
    }
    return gr.Model.from_tables({"schema": 1, "name": "clutch", "units": "dimensionless", **tables})


def test_stages_that_begin_to_slip_together_have_a_gradient() -> None:
    """A change of one of them exchanges their slips; a clutch whose stages slip one after the other has nearly it."""
    paths = [f"coupling.disc.stages.{i}.{name}" for i in (0, 1) for name in ("hysteresis", "stick_stiffness")]
    together, apart = (gr.periodic(clutch(second)).gradients(paths=paths) for second in (0.24, 0.24001))
    assert together["gradient"].notna().all()
    both = together.merge(apart, on=["response", "of", "path"], suffixes=("", "_apart"))
    change = both["per_10_percent"] - both["per_10_percent_apart"]
    assert (change.abs() <= 1e-4 * both["size"]).all()


def test_all_numbers_are_listed_and_what_moves_most_comes_first() -> None:
    table = rattling().gradients()
    assert {"inertia.body.J", *PATHS} <= set(table["path"])
    for _, rows in table.groupby(["response", "of"]):
        assert np.all(np.diff(np.abs(rows["per_10_percent"].dropna().to_numpy())) <= 0.0)


def test_a_search_with_these_gradients_ends_where_the_response_is_smallest() -> None:
    """In contact the swing over the speed has its maximum at W^2 = k / (J - c^2 / 2 k J ...): minimise its negative."""
    linear = oscillator().with_({"coupling.gap.kinematic_error.0.amplitude": 1e-4, "coupling.gap.damping": 0.4})
    path = "excitation.speed"

    def response(x: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        orbit = gr.periodic(linear.with_({path: float(x[0])}), start="linear")
        row = orbit.gradients([path]).set_index("response").loc[SWING]
        return -row["size"] / 1e-4, -np.array([row["gradient"]]) / 1e-4

    best = minimize(response, [0.8], jac=True, method="L-BFGS-B", bounds=[(0.6, 1.6)], options={"gtol": 1e-7})
    w = np.linspace(1.0, 1.2, 200_001)
    swing = w**2 / np.abs(1.0 - w**2 + 0.4j * w)
    assert best.x[0] == pytest.approx(w[np.argmax(swing)], abs=1e-5)


def test_one_of_a_family_is_refused() -> None:
    with pytest.raises(gr.ModelError, match="isolated"):
        gr.periodic(train(), start="zero").gradients()


@pytest.mark.parametrize(("path", "words"), [("torque.0.on", "to a number"), ("mesh.gear.backlash", "mesh")])
def test_paths_that_lead_to_no_number_are_refused(path: str, words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        rattling().gradients([path])
