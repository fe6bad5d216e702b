"""The example files: they load, their loads balance, and the paper's come out as its Table 1 prints them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import own_mean
from gearrattle.assembly.drag_torques import drag_torques
from gearrattle.model import Model, load, loads

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(path for path in EXAMPLES.rglob("*.toml") if path.parent.name not in ("measured", "studies", "remedies"))
CASES = [f"case{n}{kind}" for n in (1, 2, 3) for kind in ("", "_loaded")]


def _paper(name: str) -> Model:
    return load(EXAMPLES / "paper" / f"{name}.toml")


def _rigid_motion(model: Model) -> np.ndarray:
    """Return the angle of every inertia when the first turns by one and nothing deflects."""
    names = [inertia.name for inertia in model.inertias]
    rows = [(c.between, (1.0, 1.0)) for c in model.couplings] + [(m.between, m.radii) for m in model.meshes]
    angle = {names[0]: 1.0}
    for _ in names:
        for (a, b), (radius_a, radius_b) in rows:
            if a in angle:
                angle[b] = angle[a] * radius_a / radius_b
    return np.array([angle[name] for name in names])


def test_all_examples_are_here() -> None:
    names = {path.relative_to(EXAMPLES).as_posix() for path in FILES}
    assert names >= {f"paper/{case}.toml" for case in CASES}
    assert names >= {"paper/eight_dof.toml", "manual_transmission.toml", "driveline_lash.toml"}


@pytest.mark.parametrize("path", FILES, ids=[path.stem for path in FILES])
def test_examples_load_round_trip_and_balance(path: Path) -> None:
    model = load(path)
    assert loads(model.to_toml()) == model
    means = {body.name: -drag for body, drag in zip(model.inertias, drag_torques(model), strict=True)}
    for index, torque in enumerate(model.torques):
        means[torque.on] += own_mean(model, index)
    total = sum(abs(mean) for mean in means.values())
    held = any("ground" in c.between for c in model.couplings) or model.motions  # then something takes what is left
    assert held or abs(_rigid_motion(model) @ np.array(list(means.values()))) < 1e-13 * total
    assert (*model.motions, *model.torques)[0].on == model.inertias[0].name


def test_example_returns_every_model_by_the_name_of_its_file() -> None:
    assert {path.stem: gr.example(path.stem) for path in FILES} == {path.stem: load(path) for path in FILES}
    assert len({path.stem for path in FILES}) == len(FILES)


def test_a_wrong_name_of_an_example_is_answered_with_all_names_and_the_closest() -> None:
    with pytest.raises(gr.ModelError, match=r'case1, .*, run_up.*did you mean "case3_loaded"') as refused:
        gr.example("case3_load")
    assert all(path.stem in str(refused.value) for path in FILES)
    for wrong in ("studies/tolerances", "../paper/case3", "", None, 3):
        with pytest.raises(gr.ModelError, match="there is no such example"):
            gr.example(wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("case", CASES)
def test_table_1(case: str) -> None:
    model = _paper(case)
    J = [inertia.J for inertia in model.inertias]
    clutch, spline = model.couplings
    gear = model.meshes[0]
    omega, radius = 150.0, gear.radii[0]
    xi = [inertia.drag / (inertia.J * omega) for inertia in model.inertias]
    assert xi == pytest.approx([3.333e-6, 0.002, 9.524e-5, 1.667e-4], rel=3e-4)  # four digits are printed
    eta = [clutch.damping / J[0], clutch.damping / J[1], spline.damping / J[1], spline.damping / J[2]]
    eta += [radius**2 * gear.damping / J[2], radius**2 * gear.damping / J[3]]
    computed = np.array(eta) / omega
    assert computed == pytest.approx([0.005, 3.333333, 0.1111111, 0.00476190, 7.142857, 50.0], rel=1e-5)
    stiffness = [clutch.stiffness, clutch.stiffness, spline.stiffness, spline.stiffness]
    squares = [k / j for k, j in zip(stiffness, [J[0], J[1], J[1], J[2]], strict=True) if k is not None]
    squares += [radius**2 * gear.stiffness / J[2], radius**2 * gear.stiffness / J[3]]
    exact = [2 / 9, 148.148148, 1481.48148, 63.4920635, 7619.04762, 53333.3333]
    assert np.array(squares) / omega**2 == pytest.approx(exact, rel=1e-8)
    printed = np.array([0.222, 148.148, 1482.0, 63.49, 7619.0, 5.333e4])
    assert np.array(squares) / omega**2 == pytest.approx(printed, rel=1.1e-3)


@pytest.mark.parametrize("case", CASES)
def test_table_2(case: str) -> None:
    model = _paper(case)
    ratios = {"1": (0.1, 0.25), "2": (0.01, 0.025), "3": (0.001, 0.01)}
    clutch, spline = model.couplings
    gear = model.meshes[0]
    psi = gear.backlash / 2.0 / gear.radii[0]
    assert psi == pytest.approx(1e-3, rel=1e-15)
    assert (clutch.stiffness_ratio, clutch.damping_ratio) == ratios[case[4]]
    assert clutch.clearance / psi == pytest.approx(160.0, rel=1e-14)
    assert [element.name for element in (clutch, spline, gear)] == ["clutch", "spline", "gear"]
    if case[4] == "1":
        assert len(spline.drive_pieces) == 1
        assert gear.transmission_error == ()
    else:
        assert spline.clearance / psi == pytest.approx(58.67, rel=1e-14)
        error = gear.transmission_error[0]
        assert (error.order, error.amplitude) == (20.0, pytest.approx(0.1 * gear.backlash / 2.0))


@pytest.mark.parametrize("case", CASES)
def test_loads_of_the_cases(case: str) -> None:
    model = _paper(case)
    assert model.excitation.omega == 150.0
    assert [harmonic.amplitude for harmonic in model.torques[0].harmonics] == [202.5, 81.0, 50.625, 24.3, 12.15]
    assert model.torques[0].mean == 0.05 * 202.5
    drags = [inertia.drag_torque for inertia in model.inertias]
    taker = (model.torques[1].on, model.torques[1].mean)
    if case.endswith("loaded"):
        assert drags == [0.0, 0.2025, 0.2025, 0.0]
        assert taker == ("output_gear", -9.72)
    else:
        assert drags == [0.0, 0.2025, 0.0, 0.5]
        assert taker == ("input_gear", -9.4225)


def _frequencies(model: Model) -> np.ndarray:
    """Return the undamped natural frequencies with every element in contact [rad/s]."""
    index = {inertia.name: k for k, inertia in enumerate(model.inertias)}
    mass = np.array([inertia.J for inertia in model.inertias])
    stiffness = np.zeros((mass.size, mass.size))
    rows = [(c, (1.0, 1.0)) for c in model.couplings] + [(m, m.radii) for m in model.meshes]
    for element, (radius_a, radius_b) in rows:
        row = np.zeros(mass.size)
        row[index[element.between[0]]], row[index[element.between[1]]] = radius_a, -radius_b
        stiffness += element.drive_pieces[-1].stiffness * np.outer(row, row)
    values = np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(mass, mass)))
    return np.sqrt(np.abs(values))


def test_eight_dof_has_the_printed_frequencies() -> None:
    actual = _frequencies(_paper("eight_dof"))
    assert actual[0] < 1e-2
    assert actual[1:] == pytest.approx([346, 7412, 10134, 18526, 48442, 50869, 68632], rel=3e-4)


def test_driveline_lash_surges_at_the_published_frequency() -> None:
    actual = _frequencies(load(EXAMPLES / "driveline_lash.toml"))
    assert actual[1] / (2.0 * math.pi) == pytest.approx(2.77, abs=0.005)


def test_manual_transmission_is_a_four_cylinder_in_neutral() -> None:
    model = load(EXAMPLES / "manual_transmission.toml")
    assert [harmonic.order for harmonic in model.torques[0].harmonics] == [2.0, 4.0, 6.0]
    assert len(model.couplings[0].drive_pieces) == len(model.couplings[0].coast_pieces) == 3
    assert model.couplings[0].coast_pieces != model.couplings[0].drive_pieces
    loose = [mesh.between[1] for mesh in model.meshes]
    assert all(inertia.drag_torque > 0.0 for inertia in model.inertias if inertia.name in loose)
    assert model.torques[0].mean == "balance"
    assert own_mean(model, 0) == 0.53
    teeth = [(21, 42), (40, 35)]
    for mesh, (driver, driven) in zip(model.meshes, teeth, strict=True):
        assert mesh.radii[0] / mesh.radii[1] == pytest.approx(driver / driven, rel=1e-14)
        assert mesh.transmission_error[0].order == driver
