"""Standard errors cover the truth as often as they say, over seeded draws of noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

import gearrattle as gr
from tests.measured.identification import made

DRAWS = 40
OMEGA = np.concatenate([np.linspace(200.0, 400.0, 30), np.linspace(1000.0, 12000.0, 60)])
MODAL = ["inertia.hub.J", "inertia.wheel.J", "coupling.clutch.stiffness", "coupling.spline.stiffness"]
FULL = np.concatenate([np.linspace(150.0, 3000.0, 40), np.linspace(3200.0, 30000.0, 60)])
DAMPED = ["coupling.clutch.stiffness", "coupling.clutch.damping", "mesh.mesh.stiffness", "mesh.mesh.damping"]


def noisy_modes(truth: gr.Model, random: np.random.Generator) -> dict:
    rows = made.mode_rows(truth, [2, 3, 4])
    for row in rows:
        error = 0.005 * row["omega"]
        row.pop("relative_error")
        row |= {"omega": row["omega"] + error * random.standard_normal(), "standard_error": f"{error!r} rad/s"}
    for number in (2, 3, 4):
        shape = made.shape_row(truth, number, error=0.01)
        size = max(abs(v) for v in shape["shape"].values())
        noisy = {k: v + 0.01 * size * random.standard_normal() for k, v in shape["shape"].items()}
        rows.append({**shape, "shape": noisy, "shape_error": 0.01 * size / max(abs(v) for v in noisy.values())})
    return {"mode": rows}


def noisy_response(truth: gr.Model, random: np.random.Generator) -> dict:
    row = made.response_row(truth, "gear", "gear", OMEGA)
    error = 0.03 * np.abs(row["value"])
    noise = random.standard_normal((2, OMEGA.size)) * error
    row.pop("relative_error")
    return {"response": [{**row, "value": row["value"] + noise[0] + 1j * noise[1], "error": error}]}


def covered(free: list[str], noisy) -> tuple[np.ndarray, np.ndarray]:
    """(DRAWS, P) deviations in standard errors, and chi-square over its degrees of freedom."""
    truth = made.train()
    deviations, spread = [], []
    for seed in range(DRAWS):
        data = noisy(truth, np.random.default_rng(seed))
        actual = gr.identification.fit(truth, data, free, starts=1)
        assert not any(p.at_bound for p in actual.parameters)
        deviations.append([np.log(p.value / made.value(truth, p.path)) / p.relative_error for p in actual.parameters])
        spread.append(actual.chi_square / actual.degrees_of_freedom)
    return np.array(deviations), np.array(spread)


@pytest.mark.long
@pytest.mark.parametrize(("free", "noisy"), [(MODAL, noisy_modes), (DAMPED, noisy_response)], ids=["modes", "response"])
def test_standard_errors_cover_the_truth(free: list[str], noisy) -> None:
    deviations, spread = covered(free, noisy)
    for inside, rate in ((1.0, 0.6827), (1.96, 0.95)):
        hits = np.count_nonzero(np.abs(deviations) < inside, axis=0)
        low, high = binom.ppf([0.0005, 0.9995], DRAWS, rate)
        assert np.all((hits >= low) & (hits <= high)), (inside, hits / DRAWS)
    assert np.abs(deviations.mean(axis=0)).max() < 3.3 / np.sqrt(DRAWS)
    assert 0.8 < spread.mean() < 1.2


def test_a_response_recovers_stiffness_and_damping_from_a_rough_start() -> None:
    truth = made.train()
    actual = gr.identification.fit(
        made.off(truth, DAMPED, 3), noisy_response(truth, np.random.default_rng(99)), DAMPED, starts=6
    )
    for p in actual.parameters:
        away = p.value - made.value(truth, p.path)
        assert abs(away) < 4 * p.standard_error
        assert p.relative_error < 0.1


def test_errors_that_were_not_given_are_taken_from_the_residuals() -> None:
    """Same data, errors assumed: the standard errors come out as with the true ones, to what 11 residuals can say."""
    truth = made.train()
    values = noisy_modes(truth, np.random.default_rng(5))
    silent = {"mode": [{k: v for k, v in row.items() if not k.endswith("_error")} for row in values["mode"]]}
    assumed = gr.identification.fit(truth, silent, MODAL, starts=1)
    assert any("standard errors assumed" in note for note in assumed.notes)
    doubled = {"mode": [{**row, "omega": row["omega"]} if "omega" in row else row for row in silent["mode"]]}
    scale = np.sqrt(assumed.chi_square / assumed.degrees_of_freedom)
    plain = {
        "mode": [
            {**row, **({"relative_error": 0.01} if "omega" in row else {"shape_error": 0.02})}
            for row in doubled["mode"]
        ]
    }
    trusted = gr.identification.fit(truth, plain, MODAL, starts=1)
    for p, q in zip(assumed.parameters, trusted.parameters, strict=True):
        assert p.value == pytest.approx(q.value, rel=1e-9)
        assert p.standard_error == pytest.approx(scale * q.standard_error, rel=1e-6)


def test_profile_agrees_with_the_standard_error_where_the_data_are_sharp() -> None:
    truth = made.train()
    actual = gr.identification.fit(truth, noisy_modes(truth, np.random.default_rng(3)), MODAL, starts=1, profile=True)
    for p in actual.parameters:
        low, high = p.interval
        assert np.log(high / low) / 2 == pytest.approx(1.96 * p.relative_error, rel=0.02)
        assert low < p.value < high


def test_profile_of_what_is_open_has_no_end() -> None:
    truth = made.train()
    free = ["inertia.gear.J", "mesh.mesh.stiffness", "mesh.mesh.damping"]
    actual = gr.identification.fit(truth, {"mode": made.mode_rows(truth, [4])}, free, starts=1, profile=True)
    assert [p.interval for p in actual.parameters] == [(0.0, np.inf)] * 3


def test_the_ends_of_a_profile_have_the_chi_square_they_should() -> None:
    """At an end, the best fit with the parameter held there is worse by 3.841."""
    truth = made.train()
    data = noisy_modes(truth, np.random.default_rng(8))
    free = MODAL[2:]
    actual = gr.identification.fit(truth, data, free, starts=1, profile=True)
    for end in actual.parameters[0].interval:
        held = gr.identification.fit(actual.model.with_({free[0]: end}), data, free[1:], starts=1)
        assert held.chi_square - actual.chi_square == pytest.approx(3.8415, abs=0.01)


def test_the_profile_of_a_value_on_its_bound_begins_there_and_is_as_wide_as_that_of_a_free_one() -> None:
    """The first step of its search goes far, and the others must come back to their minimum from there."""
    truth = made.train()
    rows = [made.response_row(truth, at, "gear", FULL) for at in ("flywheel", "wheel", "gear")]
    random = np.random.default_rng(3)
    for row in rows:
        row["value"] = row["value"] * (1.0 + 0.02 * (random.standard_normal((2, FULL.size)) * [[1.0], [1.0j]]).sum(0))
    free, bounds = gr.identification.fit(truth, {"response": rows}, MODAL, starts=1), {MODAL[0]: (0.002, 0.01)}
    held = gr.identification.fit(truth, {"response": rows}, MODAL, starts=1, bounds=bounds, profile=True).parameters[0]
    assert (held.at_bound, held.interval[0]) == ("lower", 0.0)
    assert free.parameters[0].value < held.value
    # the best of the others' fits rises from the bound on as the parabola of the free one does
    away = np.log(held.value / free.parameters[0].value) / free.parameters[0].relative_error
    end = np.log(held.interval[1] / free.parameters[0].value) / free.parameters[0].relative_error
    assert end**2 - away**2 == pytest.approx(3.8415, rel=0.02)
