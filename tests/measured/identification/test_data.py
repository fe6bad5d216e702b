"""Data files and response files: units, places of mistakes, and the same content in every form."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.measured.identification.data_file import read_data
from gearrattle.measured.identification.measured_modes import State
from gearrattle.measured.identification.response_file import read_samples
from tests.measured.identification import made

FREE = ["coupling.clutch.stiffness"]
OMEGA = np.linspace(100.0, 9000.0, 7)


def csv(header: str, columns: list[Any]) -> str:
    return header + "\n" + "\n".join(",".join(repr(float(v)) for v in row) for row in np.column_stack(columns)) + "\n"


@pytest.mark.parametrize("derivatives", [0, 1, 2])
def test_forms_of_a_response_file_are_the_same(derivatives: int) -> None:
    value = made.response(made.train(), "gear", "hub", OMEGA, derivatives)
    unit = ("rad", "rad/s", "rad/s^2")[derivatives]
    milli = ("mrad", "mrad/ms", "mrad/ms^2")[derivatives]
    texts = [
        csv(f"frequency [Hz], real [{unit}/(N*m)], imag [{unit}/(N*m)]", [OMEGA / math.tau, value.real, value.imag]),
        "# note\n" + csv(f"imag [{unit}/N/m],frequency [rad/s],real [{unit}/N/m]", [value.imag, OMEGA, value.real]),
        csv(
            f"frequency [rpm], magnitude [{milli}/(kN*mm)], phase [deg], error [{milli}/(kN*mm)]",
            [OMEGA * 30 / np.pi, np.abs(value) * 1e3 / 1e3**derivatives, np.degrees(np.angle(value)), np.ones(7)],
        ),
    ]
    for text in texts:
        actual = read_samples(text, "f.csv", False)
        assert actual.derivatives == derivatives
        assert actual.omega == pytest.approx(OMEGA, rel=1e-12)
        assert actual.value == pytest.approx(value, rel=1e-9)
    assert actual.error == pytest.approx(np.full(7, 1e-3 * 1e3**derivatives), rel=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "holds no header"),
        ("frequency [Hz], real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)]\n", "no samples"),
        (
            "frequency, real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)]\n1,1,1\n",
            "f.csv:1: found frequency; must name its unit",
        ),
        ("frequency [s], real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)]\n1,1,1\n", "frequency [s]; must be"),
        ("frequency [Hz], real [m/s^2], imag [m/s^2]\n1,1,1\n", "must have a unit of angle per torque"),
        ("frequency [Hz], real [rad/(N*m)], imag [rad/s/(N*m)]\n1,1,1\n", "same quantity per torque"),
        ("frequency [Hz], real [rad/(N*m)], phase [deg]\n1,1,1\n", "the columns must be"),
        ("frequency [Hz], frequency [Hz]\n1,1\n", "must be a column name, once"),
        ("frequency [Hz], real [rad/(N*m)], imag [rad/(N*m)]\n1,1\n", "f.csv:2: found 2 entries; must have 3"),
        (
            "frequency [Hz], real [rad/(N*m)], imag [rad/(N*m)]\n1,2,3\n2,nan,3\n",
            'f.csv:3: real: found "nan"; must be a f',
        ),
        (
            "frequency [Hz], real [rad/(N*m)], imag [rad/(N*m)]\n1,2,3\n2,x,3\n",
            'f.csv:3: real: found "x"; must be a fin',
        ),
        ("frequency [Hz], real [rad/(N*m)], imag [rad/(N*m)]\n1,2,3\n-2,1,3\n", "f.csv:3: frequency: found"),
        ("frequency [Hz], magnitude [rad/(N*m)], phase [deg]\n1,-2,3\n", "must not be negative"),
        ("frequency [Hz], real [rad/(N*m)], imag [rad/(N*m)], error [rad/(N*m)]\n1,2,3,0\n", "error: found 0"),
    ],
)
def test_wrong_response_files(text: str, said: str) -> None:
    with pytest.raises(gr.ModelError) as caught:
        read_samples(text, "f.csv", False)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("", "an empty file; a data file has tables and keys"),
        ("schema = 1\n", "data need at least one [[mode]]"),
        ("schema = 2\n[[mode]]\nnumber = 2\nomega = 3\n", "data.toml:1: schema"),
        ("[[mode]]\nnumber = 2\nfrequency = 55\n", "data.toml:3: mode.0.frequency: found 55; must name its unit"),
        ('[[mode]]\nnumber = 2\nfrequency = "55"\n', "must name a unit"),
        ('[[mode]]\nnumber = 2\nfrequency = "55 mm"\n', "data.toml:3"),
        ('[[mode]]\nnumber = 2\nfrequency = "-5 Hz"\n', "must be greater than zero"),
        ("[[mode]]\nnumber = 2\nomega = nan\n", "must be a finite number"),
        ("[[mode]]\nnumber = 0\nomega = 3.0\n", "must be a whole number from 1"),
        ("[[mode]]\nnumber = 5\nomega = 3.0\n", "data.toml:2: mode.0.number: found 5; the model has 4 modes"),
        ("[[mode]]\nnumber = 1\nomega = 3.0\n", "is rigid motion"),
        ('[[mode]]\nnumber = 4\nomega = 3.0\nrigid = ["mesh"]\n', "the model has 3 modes in this state"),
        ("[[mode]]\nomega = 3.0\n", "needs its number, or a shape"),
        ("[[mode]]\nnumber = 2\n", "needs a frequency, a shape, or both"),
        ('[[mode]]\nnumber = 2\nfrequency = "3 Hz"\nomega = 3.0\n', "say the same"),
        ("[[mode]]\nnumber = 2\nomga = 3.0\n", "unknown key"),
        ("[[mode]]\nnumber = 2\nshape = { hubb = 1, gear = 1 }\n", "no inertia has this name; there are flywheel"),
        ("[[mode]]\nnumber = 2\nshape = { hub = 1 }\n", "two inertias or more"),
        ("[[mode]]\nnumber = 2\nshape = { hub = inf, gear = 1 }\n", "hub: must be a finite number"),
        ("[[mode]]\nnumber = 2\nomega = 3.0\nrigid = ['clutsch']\n", 'did you mean "clutch"?'),
        ("[[mode]]\nnumber = 2\nomega = 3.0\ncontact_ratio = { clutch = 2 }\n", "must lie between 0 and 1"),
        ("[[mode]]\nnumber = 2\nomega = 3.0\nregion = { clutch = 7 }\n", "region: clutch"),
        ("[[mode]]\nnumber = 2\nomega = 3.0\n[[mode]]\nnumber = 3\nomega = 2.0\n", "the data are inconsistent"),
        ('[[response]]\nat = "hub"\ntorque_on = "hub"\n', "either file, or omega and value"),
        ('[[response]]\nat = "hub"\ntorque_on = "hup"\nfile = "x.csv"\n', 'did you mean "hub"?'),
        ('[[response]]\nat = "hub"\ntorque_on = "hub"\nfile = "x.csv"\n', "x.csv: no such file"),
    ],
)
def test_wrong_data_files(data: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("data.toml").write_text(data, encoding="utf-8")
    with pytest.raises(gr.ModelError) as caught:
        gr.identification.fit(made.train(), "data.toml", FREE)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"value": OMEGA * np.nan}, "must be finite numbers; sample 0 is none"),
        ({"value": OMEGA[1:]}, "must have as many samples"),
        ({"omega": -OMEGA}, "greater than zero"),
        ({"quantity": None}, "needs quantity"),
        ({"quantity": "force"}, 'must be "angle" or "velocity" or "acceleration"'),
        ({"value": 0 * OMEGA}, "must not vanish"),
        ({"value": OMEGA - OMEGA[0]}, "a sample of zero needs a standard error"),
        ({"error": np.zeros(7)}, "greater than zero"),
        ({"error": np.ones(3)}, "one entry for each sample"),
    ],
)
def test_wrong_arrays(keys: dict[str, Any], said: str) -> None:
    row = {"at": "hub", "torque_on": "hub", "quantity": "angle", "omega": OMEGA, "value": OMEGA + 1j, **keys}
    with pytest.raises(gr.ModelError) as caught:
        gr.identification.fit(made.train(), {"response": [row]}, FREE)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("free", "keys", "said"),
    [
        ([], {}, "no parameter is free"),
        (["coupling.clatch.stiffness"], {}, "no coupling is named clatch"),
        (["coupling.clutch.stifness"], {}, "has no value in the model"),
        (["inertia.*.K"], {}, "matches no value"),
        (["coupling.spline.between"], {}, "must be a number"),
        (["inertia.hub.drag"], {}, "a start is needed"),
        (["coupling.clutch.clearance"], {}, "enters neither inertias nor slopes"),
        (["mesh.mesh.radii.0"], {}, "must be a factor of inertias"),
        (["excitation.speed"], {}, "enters neither"),
        (FREE, {"bounds": {FREE[0]: (2000, 3000)}}, "must hold the start, 1500"),
        (FREE, {"bounds": {FREE[0]: ("1 N*m", "3 kN*m/rad")}}, "angle unit"),
        (FREE, {"bounds": {"inertia.hub.J": (1, 2)}}, "is not free"),
        (FREE, {"factor": 1.0}, "greater than 1"),
        (FREE, {"starts": 0}, "whole number from 1"),
        (FREE, {"seed": -1}, "whole number from 0"),
        (FREE, {"prior": 0.0}, "greater than zero"),
        (FREE, {"contact_ratio": {"nothing": 0.5}}, "no such element"),
    ],
)
def test_wrong_parameters(free: list[str], keys: dict[str, Any], said: str) -> None:
    with pytest.raises(gr.ModelError) as caught:
        gr.identification.fit(made.train(), {"mode": [{"number": 2, "omega": 290.0}]}, free, **keys)
    assert said in str(caught.value)


def test_bounds_take_units() -> None:
    data = {"mode": [{"number": 2, "frequency": "46.2 Hz"}]}
    actual = gr.identification.fit(made.train(), data, FREE, bounds={FREE[0]: ("1 kN*m/rad", "2 kN*m/rad")})
    assert (actual.parameters[0].lower, actual.parameters[0].upper) == (1000.0, 2000.0)
    assert actual.residuals[0].measured == pytest.approx(46.2 * 2 * np.pi)


def test_frequencies_in_every_unit_are_the_same() -> None:
    texts = ["60 Hz", "0.06 kHz", "3600 rpm", f"{120 * np.pi!r} rad/s", "21600 deg/s"]
    rows = [{"number": 2, "frequency": text, "standard_error": "1 Hz"} for text in texts]
    for mode in read_data({"mode": rows}, made.train(), State()).modes:
        assert mode.omega == pytest.approx(120 * np.pi, rel=1e-12)
        assert mode.omega_error == pytest.approx(2 * np.pi, rel=1e-12)


def test_a_dimensionless_model_takes_plain_numbers_only() -> None:
    text = made.TRAIN.replace("schema = 1", 'schema = 1\nunits = "dimensionless"')
    model = gr.loads(text)
    actual = gr.identification.fit(
        model, {"mode": [{"number": 2, "frequency": 280.0, "relative_error": 0.01}]}, FREE, starts=1
    )
    assert gr.modes(actual.model).frequencies[1] == pytest.approx(280.0)
    with pytest.raises(gr.ModelError, match="plain number"):
        gr.identification.fit(model, {"mode": [{"number": 2, "frequency": "280 Hz"}]}, FREE)
    with pytest.raises(gr.ModelError, match="must have no unit"):
        read_samples("frequency [Hz], real, imag\n1,2,3\n", "f.csv", True)
    assert read_samples("frequency, real, imag\n1,2,3\n", "f.csv", True).value == pytest.approx([2 + 3j])


def test_a_file_beside_the_data_file_is_read(tmp_path: Path) -> None:
    truth = made.train()
    value = made.response(truth, "gear", "gear", OMEGA)
    header = "frequency [rad/s], real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)]"
    (tmp_path / "gear.csv").write_text(csv(header, [OMEGA, value.real, value.imag]), encoding="utf-8")
    text = '[[response]]\nfile = "gear.csv"\nat = "gear"\ntorque_on = "gear"\nrelative_error = 0.01\n'
    (tmp_path / "data.toml").write_text(text, encoding="utf-8")
    actual = gr.identification.fit(made.off(truth, FREE, 1), tmp_path / "data.toml", FREE, starts=3)
    assert actual.parameters[0].value == pytest.approx(1500.0, rel=1e-8)
