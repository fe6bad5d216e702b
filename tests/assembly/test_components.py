"""What every component says of itself for other units and for groups of bodies, against its elements."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble, must_stay_level, rows_of
from gearrattle.assembly.scaled import dimensionless
from gearrattle.engine.system.characteristic import Scales
from gearrattle.model import Element
from gearrattle.model.components import COMPONENTS
from tests.model.test_components import BODIES, EXAMPLES

SINE = [{"order": 2, "amplitude": 1e-3, "phase": 0.3}]
STAGES: list[dict[str, Any]] = [
    {"stiffness": 30.0, "damping": 0.2, "until": 0.05, "hysteresis": 0.4},
    {"stiffness": 400.0, "damping": 0.6, "hysteresis": 0.7},
]
CASES: list[tuple[str, dict[str, Any]]] = [
    *((kind, {}) for kind in COMPONENTS),
    ("coupling", {"clearance": 0.02, "damping": 0.3, "stiffness_ratio": 0.1, "damping_ratio": 0.2, "preload": 3.0}),
    ("coupling", {"clearance": 0.02, "kinematic_error": SINE}),
    ("coupling", {"stiffness": None, "stages": STAGES, "coast_stages": STAGES[1:], "preload": -1.0}),
    ("coupling", {"hysteresis": 2.0, "stick_stiffness": 500.0}),
    ("coupling", {"hooke": {"angle": 0.3}}),
    ("bearing", {"damping": 40.0, "faces": 8}),
    ("bearing", {"direction": 0.3}),
    ("bearing", {"clearance": 0.0}),
    ("mesh", {"damping": 40.0, "transmission_error": SINE, "contact_damping": "clipped"}),
    ("planetary", {"damping": {"sun": 3.0, "ring": 4.0}, "backlash": {"sun": 1e-4, "ring": 2e-4}}),
    ("planetary", {"transmission_error": {"sun": SINE}, "planet_mass": 0.4, "centre_distance": 0.05}),
]
NAMED = pytest.mark.parametrize(("kind", "changes"), CASES, ids=[f"{kind} {', '.join(c)}" for kind, c in CASES])


def model_of(kind: str, changes: dict[str, Any]) -> gr.Model:
    """One component among five bodies."""
    component = {key: value for key, value in {**EXAMPLES[kind], **changes}.items() if value is not None}
    inertias: list[dict[str, Any]] = [{"name": name, "J": 0.01 * (i + 1)} for i, name in enumerate(BODIES)]
    if kind == "bearing":
        inertias[0]["mass"] = 0.7
    return gr.Model.from_tables({"schema": 1, "inertia": inertias, kind: [component], "excitation": {"speed": 100.0}})


def numbers_of(element: Element, unit: dict[str, float]) -> list[float]:
    """All numbers of an element with a dimension, divided by its units."""
    deflection, force = (unit["length"], unit["force"]) if element.along_line else (unit["angle"], unit["torque"])
    arm = unit["radius"] if element.along_line else 1.0
    numbers = [*(factor / arm for _, factor in element.arms), *(radius / arm for radius in element.radii)]
    for piece in (*element.drive, *element.coast):
        rate = deflection * unit["speed"]
        numbers += [piece.stiffness * deflection / force, piece.damping * rate / force, piece.hysteresis / force]
        numbers += [piece.stick_stiffness * deflection / force, (piece.until or 0.0) / deflection]
    return [*numbers, element.preload / force, *(sine.amplitude / deflection for sine in element.errors)]


@NAMED
def test_every_number_scales_by_its_kind(kind: str, changes: dict[str, Any]) -> None:
    model, scales = model_of(kind, changes), Scales(70.0, 0.02, 0.3, 2e-4)
    one = dict.fromkeys(scales.units(), 1.0)
    scaled = dimensionless(model, scales)
    for element, other in zip(model.elements, scaled.elements, strict=True):
        assert numbers_of(other, one) == pytest.approx(numbers_of(element, scales.units()), rel=1e-12)
    J = np.array([body.J for body in scaled.inertias])
    for i, body in enumerate(model.inertias):
        added = sum(component.added_inertia().get(body.name, 0.0) for component in model.components.values())
        assert J[i] == pytest.approx((body.J + added) / scales.units()["inertia"])
        if body.mass is not None:
            assert scaled.inertias[i].mass == pytest.approx(body.mass / scales.units()["mass"])


@NAMED
@pytest.mark.parametrize("ratios", [(1.0, 1.0), (2.5, 2.5), (2.5, 0.4)])
def test_between_groups_the_forces_are_the_same(
    kind: str, changes: dict[str, Any], ratios: tuple[float, float]
) -> None:
    """A body of the ratio rho turns by rho theta, and hands on rho times its torque: power is the same."""
    model = model_of(kind, changes)
    component = next(iter(model.components.values()))
    if ratios != (1.0, 1.0) and component.keeps_bodies:
        pytest.skip("its bodies stay")
    if ratios[0] != ratios[1] and must_stay_level(model):
        pytest.skip("no mesh can stand for it")
    size = rows_of(model).shape[1]  # displacements follow the angles
    rho = np.array([*ratios, *np.ones(size - 2)])
    to = {body: (body, float(r)) for body, r in zip(BODIES, rho, strict=False)}
    array, table = component.between_groups(to)
    tables = {key: value for key, value in model.to_tables().items() if key not in COMPONENTS}
    grouped = gr.Model.from_tables({**tables, array: [table]})
    for seed in range(20):
        theta, omega = np.random.default_rng(seed).normal(size=(2, size)) * np.array([[0.03], [5.0]])
        want = rho * torques(model, rho * theta, rho * omega)
        assert torques(grouped, theta, omega) == pytest.approx(want, rel=1e-9, abs=1e-9)
    assert len(assemble(grouped).system.auxiliaries) == len(assemble(model).system.auxiliaries)


def torques(model: gr.Model, theta: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Torque of all laws on every body, and force in every direction, at angles and displacements, and their rates."""
    rows, forces = rows_of(model), []
    for law, deflection, rate in zip(assemble(model).system.laws, rows @ theta, rows @ omega, strict=True):
        forces.append(law.elastic(float(deflection)) + law.damping[law.piece_at(float(deflection))] * rate)
    return -rows.T @ np.array(forces)
