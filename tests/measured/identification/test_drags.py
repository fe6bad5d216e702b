"""Drag parts fitted to measured torques: known factors come back, open combinations are named, bad data are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr

RPM = np.pi / 30.0
PARTS = "inertia.fifth_gear.drag_parts"
FACTORS = [f"{PARTS}.0.factor", f"{PARTS}.1.factor"]


@pytest.fixture(scope="module")
def model() -> gr.Model:
    return gr.example("idle_rattle_oil")


def measured(truth: gr.Model, noise: float = 0.0, parts: tuple[int, ...] = (0, 1)) -> dict[str, Any]:
    """Torques of the fifth gear's parts, summed here, at twenty points."""
    speed, temperature = (a.ravel() for a in np.meshgrid(RPM * np.array([200, 400, 900, 1500]), [0, 20, 40, 60, 90.0]))
    assert truth.oil is not None
    torque = []
    for n, degrees in zip(speed.tolist(), temperature.tolist(), strict=True):
        oil = truth.oil.model_copy(update={"temperature": degrees})
        torque.append(sum(truth[f"{PARTS}.{i}"].at(n, oil).torque for i in parts))
    scatter = 1.0 + noise * np.random.default_rng(5).standard_normal(speed.size)
    return {"of": "fifth_gear", "speed": speed, "temperature": temperature, "torque": torque * scatter}


def test_the_factors_that_made_the_torques_come_back(model: gr.Model) -> None:
    truth = dict(zip(FACTORS, (0.45, 1.7), strict=True))
    rows = {"drag": [measured(model.with_(truth))]}
    fit = gr.identification.fit(model, rows, [f"{PARTS}.*.factor"], starts=3)
    assert [p.path for p in fit.parameters] == FACTORS
    assert [p.value for p in fit.parameters] == pytest.approx([0.45, 1.7], rel=1e-9)
    assert fit.model[FACTORS[1]] == pytest.approx(1.7, rel=1e-9)
    assert len(fit.minima) == 1
    assert "1 times what it says with the fitted values" in fit.notes[-1]


def test_standard_errors_hold_the_truth(model: gr.Model) -> None:
    """Of noisy torques; at stated errors chi-square is as large as its degrees of freedom, roughly."""
    truth = dict(zip(FACTORS, (0.45, 1.7), strict=True))
    rows = {"drag": [measured(model.with_(truth), noise=0.03) | {"relative_error": 0.03}]}
    fit = gr.identification.fit(model, rows, FACTORS, starts=2)
    for parameter in fit.parameters:
        assert abs(parameter.value - truth[parameter.path]) < 3.0 * parameter.standard_error
        assert parameter.standard_error < 0.1 * parameter.value
    assert 6.0 < fit.chi_square < 35.0
    assert fit.degrees_of_freedom == 18
    assert fit.explains


def test_a_value_inside_a_law_may_be_free(model: gr.Model) -> None:
    rows = {"drag": [measured(model.with_({f"{PARTS}.1.gap": "0.06 mm"}))]}
    fit = gr.identification.fit(model, rows, [f"{PARTS}.1.gap", FACTORS[0]], starts=3)
    assert [p.value for p in fit.parameters] == pytest.approx([6e-5, 1.0], rel=1e-6)


def test_what_torques_cannot_tell_apart_is_named(model: gr.Model) -> None:
    """The factor of a sheared film, and its gap: only their ratio counts."""
    fit = gr.identification.fit(
        model, {"drag": [measured(model, noise=0.03)]}, [f"{PARTS}.1.gap", FACTORS[1]], starts=2
    )
    (combination,) = fit.undetermined
    assert combination.structural
    assert [p.standard_error for p in fit.parameters] == [np.inf, np.inf]


def test_parts_that_were_measured_alone(model: gr.Model) -> None:
    truth = model.with_({FACTORS[0]: 0.7})
    rows = {"drag": [measured(truth, parts=(0,)) | {"parts": [0]}]}
    fit = gr.identification.fit(model, rows, [FACTORS[0]], starts=1)
    assert fit.parameters[0].value == pytest.approx(0.7, rel=1e-9)


def test_a_file_says_the_same_as_arrays(model: gr.Model, tmp_path: Path) -> None:
    row = measured(model.with_(dict(zip(FACTORS, (0.45, 1.7), strict=True))), noise=0.03)
    columns = zip(row["speed"] / RPM, row["temperature"] + 273.15, row["torque"] * 1e3, strict=True)
    lines = ["# rig 3", "speed [rpm], temperature [K], torque [N*mm]", *(f"{n!r}, {t!r}, {m!r}" for n, t, m in columns)]
    (tmp_path / "gear5.csv").write_text("\n".join(lines).replace("np.float64(", "").replace(")", ""), encoding="utf-8")
    (tmp_path / "drags.toml").write_text('[[drag]]\nof = "fifth_gear"\nfile = "gear5.csv"\n', encoding="utf-8")
    one = gr.identification.fit(model, {"drag": [row]}, FACTORS, starts=1)
    other = gr.identification.fit(model, tmp_path / "drags.toml", FACTORS, starts=1)
    assert [p.value for p in other.parameters] == pytest.approx([p.value for p in one.parameters], rel=1e-9)
    assert other.residuals[0].label == "drag of fifth_gear at 200 rpm, 0 °C"


@pytest.mark.parametrize(
    ("changes", "free", "location", "rule"),
    [
        ({"of": "sixth_gear"}, FACTORS, "drag.0.of", "no inertia has this name"),
        ({"of": "hub"}, FACTORS, "drag.0.of", "has no drag_parts"),
        ({"parts": [2]}, FACTORS, "drag.0.parts", "has the parts 0 to 1"),
        ({"parts": [0]}, FACTORS, f"free: {FACTORS[1]}", "no measured drag torque depends on it"),
        ({}, ["inertia.hub.J"], "free: inertia.hub.J", "no measured drag torque depends on it"),
        ({"file": "gear5.csv"}, FACTORS, "drag.0", "either file, or speed and torque"),
        ({"torque": np.ones(3)}, FACTORS, "drag.0.torque", "as many entries as speed"),
        ({"torque": -np.ones(20)}, FACTORS, "drag.0.torque", "greater than zero"),
    ],
)
def test_what_is_no_measured_drag_is_refused(
    model: gr.Model, changes: dict[str, Any], free: list[str], location: str, rule: str
) -> None:
    with pytest.raises(gr.ModelError) as refused:
        gr.identification.fit(model, {"drag": [measured(model) | changes]}, free)
    assert any(location in problem.place and rule in problem.rule for problem in refused.value.problems), refused.value


@pytest.mark.parametrize(
    ("written", "rule"),
    [
        ("speed [rpm], torque [N]\n1, 2", "torque"),
        ("speed [rpm], drag [N*m]\n1, 2", "the columns must be speed and torque"),
        ("speed, torque [N*m]\n1, 2", "must name its unit"),
        ("speed [rpm], torque [N*m]\n1, 0", "greater than zero"),
        ("speed [rpm], torque [N*m]\n1, nan", "finite number"),
        ("speed [rpm], torque [N*m]\n", "has a header but no samples"),
    ],
)
def test_what_is_no_drag_file_is_refused(model: gr.Model, tmp_path: Path, written: str, rule: str) -> None:
    (tmp_path / "gear5.csv").write_text(written, encoding="utf-8")
    (tmp_path / "drags.toml").write_text('[[drag]]\nof = "fifth_gear"\nfile = "gear5.csv"\n', encoding="utf-8")
    with pytest.raises(gr.ModelError, match=rule):
        gr.identification.fit(model, tmp_path / "drags.toml", FACTORS)


def test_drags_stand_alone(model: gr.Model) -> None:
    rows = {"drag": [measured(model)]}
    with pytest.raises(gr.ModelError, match="fit drags by themselves"):
        gr.identification.fit(model, rows | {"mode": [{"number": 2, "frequency": "55 Hz"}]}, FACTORS)
    with pytest.raises(gr.ModelError, match="a drag torque has none"):
        gr.identification.fit(model, rows, FACTORS, region={"damper": 0})


def test_points_beyond_a_measured_table_are_refused(model: gr.Model) -> None:
    table = {"kind": "measured", "speed": ["300 rpm", "800 rpm"], "torque": [["0.1 N*m", "0.2 N*m"]]}
    with pytest.raises(gr.ModelError, match="covers"):
        gr.identification.fit(model.with_({PARTS: [table]}), {"drag": [measured(model)]}, [FACTORS[0]])
