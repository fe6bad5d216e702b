"""Units that a model file was written in: kept beside the model, and no part of it."""

from __future__ import annotations

import pickle

import pytest

import gearrattle as gr
from gearrattle.model.path_labels import in_written_unit
from gearrattle.model.written_units import written_units

TIP_IN = gr.example("tip_in")


def test_units_are_kept_by_path() -> None:
    units = written_units(TIP_IN)
    assert units["coupling.rotor_spline.stiffness"] == "kN*m/rad"
    assert units["mesh.first_stage.radii.0"] == "mm"
    assert units["torque.0.ramps.0.over"] == "ms"
    assert "torque.1.mean" not in units  # "balance"


@pytest.mark.parametrize(
    ("path", "factor", "unit"),
    [
        ("coupling.rotor_spline.stiffness", 1e-3, "kN*m/rad"),
        ("coupling.rotor_spline.clearance", 57.29577951308232, "deg"),
        ("excitation.speed", 9.549296585513721, "rpm"),
        ("inertia.pinion.J", 1.0, "kg*m^2"),
    ],
)
def test_numbers_are_shown_as_they_were_written(path: str, factor: float, unit: str) -> None:
    assert in_written_unit(path, TIP_IN) == (pytest.approx(factor), unit)


def test_plain_numbers_are_in_si() -> None:
    plain = gr.loads(TIP_IN.to_toml())
    assert written_units(plain) == {}
    assert in_written_unit("coupling.rotor_spline.stiffness", plain) == (1.0, "N m/rad")
    assert plain == TIP_IN
    assert hash(plain) == hash(TIP_IN)


def test_changed_models_and_copies_keep_them() -> None:
    changed = TIP_IN.with_({"mesh.first_stage.backlash": "90 um", "inertia.rotor.J": 0.04})
    units = written_units(changed)
    assert units["mesh.first_stage.backlash"] == "um"
    assert units["mesh.final_drive.backlash"] == "mm"
    assert units["inertia.rotor.J"] == "kg*m^2"
    assert written_units(pickle.loads(pickle.dumps(changed))) == units
