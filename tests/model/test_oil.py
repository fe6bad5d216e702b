"""The oil: Walther's law through two points of a data sheet, density, and what is no oil."""

from __future__ import annotations

import math

import pytest

import gearrattle as gr
from gearrattle.model.oil import OILS, Oil

POINTS = [
    {"temperature": "40 degC", "kinematic": "30.8 mm^2/s"},
    {"temperature": "100 degC", "kinematic": "5.9 mm^2/s"},
]


def oil(**keys: object) -> Oil:
    return Oil.model_validate({"viscosity": POINTS, "temperature": 40.0, **keys})


@pytest.mark.parametrize(
    ("temperature", "viscosity"),
    [(-20, 1304.2), (0, 249.4), (20, 75.23), (40, 30.8), (80, 9.087), (90, 7.241), (100, 5.9)],
)
def test_the_law_gives_the_worked_values(temperature: float, viscosity: float) -> None:
    """Worked by hand from A = 8.76554, B = 3.44182 with c = 0.7."""
    assert 1e6 * oil().kinematic_viscosity(temperature) == pytest.approx(viscosity, rel=2e-4)


@pytest.mark.parametrize(("temperature", "viscosity"), [(80, 9.12), (90, 7.25)])
def test_other_points_of_the_data_sheet_are_met_to_1_percent(temperature: float, viscosity: float) -> None:
    assert 1e6 * oil().kinematic_viscosity(temperature) == pytest.approx(viscosity, rel=0.01)


def test_density_falls_in_a_straight_line() -> None:
    thin = oil(density="845 kg/m^3", density_slope=-5.5e-4)
    assert thin.mass_density(15.0) == 845.0
    assert 1e3 * thin.dynamic_viscosity(-20.0) == pytest.approx(1123.3, rel=1e-4)
    assert 1e3 * thin.dynamic_viscosity(20.0) == pytest.approx(63.39, rel=1e-4)
    assert 1e3 * thin.dynamic_viscosity(80.0) == pytest.approx(7.404, rel=1e-4)


def test_kelvin_and_degrees_are_one_temperature() -> None:
    assert oil(temperature="313.15 K").temperature == 40.0
    assert oil(temperature="40 °C").temperature == oil(temperature="40 degC").temperature == 40.0


@pytest.mark.parametrize("name", list(OILS))
def test_a_known_oil_is_that_of_its_data_sheet(name: str) -> None:
    known = Oil.model_validate({"type": name, "temperature": 40.0})
    sheet = OILS[name]
    assert 1e6 * known.kinematic_viscosity(40.0) == pytest.approx(sheet.at_40, rel=1e-12)
    assert 1e6 * known.kinematic_viscosity(100.0) == pytest.approx(sheet.at_100, rel=1e-12)
    assert any("density" in note for note in known.notes()) == (sheet.density is None)


def test_what_lies_beyond_the_data_is_said() -> None:
    assert oil(density=870).notes() == ()
    (note,) = oil(density=870, temperature=-20).notes()
    assert "extrapolated from 40 and 100 degC" in note
    assert any("thinner than 2" in note for note in oil(density=870, temperature=200).notes())


def text(table: str) -> str:
    return f"""schema = 1
{table}
[[inertia]]
name = "gear"
J = 0.01
[excitation]
speed = 80
"""


@pytest.mark.parametrize(
    ("table", "path", "rule"),
    [
        ("[oil]\ntemperature = 40", "oil", "either viscosity or type"),
        ('[oil]\ntype = "atf-mb-236.14"', "oil.temperature", "required"),
        ('[oil]\ntype = "atf-mb-236.14"\ntemperature = 313.15', "oil.temperature", "between -60 and 250 degC"),
        ('[oil]\ntype = "atf-mb-236.14"\ntemperature = "40 deg"', "oil.temperature", "temperature in K or degC or °C"),
        ('[oil]\ntype = "atf-mb"\ntemperature = 40', "oil.type", "must be"),
        (
            '[oil]\nviscosity = [{temperature = 40, kinematic = "6 mm^2/s"}, '
            '{temperature = 100, kinematic = "30 mm^2/s"}]\ntemperature = 40',
            "oil.viscosity",
            "must fall",
        ),
        (
            '[oil]\nviscosity = [{temperature = 40, kinematic = "6 mm^2/s"}]\ntemperature = 40',
            "oil.viscosity",
            "two points",
        ),
    ],
)
def test_what_is_no_oil_is_refused(table: str, path: str, rule: str) -> None:
    with pytest.raises(gr.ModelError) as refused:
        gr.loads(text(table))
    assert any(problem.place.endswith(path) and rule in problem.rule for problem in refused.value.problems), (
        refused.value
    )


def test_a_model_keeps_its_oil() -> None:
    model = gr.loads(text('[oil]\ntype = "atf-mb-236.14"\ntemperature = "40 degC"'))
    assert gr.loads(model.to_toml()) == model
    warm = model.with_({"oil.temperature": "80 degC"})
    assert warm["oil.temperature"] == 80.0
    assert math.isclose(1e6 * warm["oil"].kinematic_viscosity(), 9.85, rel_tol=0.05)
