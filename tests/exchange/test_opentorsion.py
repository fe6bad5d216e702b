"""Shaft lines of openTorsion: round trips, natural frequencies of both, everything lost is listed."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from tests.exchange.drivelines import linear, tree


def same_frequencies(ours: gr.Model, theirs: Any) -> bool:
    a, b = np.asarray(gr.modes(ours).frequencies), np.asarray(theirs)
    return bool(np.allclose(a, b, rtol=1e-9, atol=1e-6 * a.max()))


@pytest.mark.parametrize("name", ["case1", "case3", "eight_dof", "manual_transmission", "six_speed"])
def test_frequencies_and_damping_survive_the_way_there_and_back(name: str, tmp_path: Path) -> None:
    model = gr.example(name)
    written = gr.export_model(model, tmp_path / "a.json", partial=True)
    back = gr.import_model(written.path)
    assert same_frequencies(back.model, gr.modes(model).frequencies)
    ratios = [sorted(np.asarray(gr.modes(m).damping_ratios)[1:]) for m in (model, back.model)]
    np.testing.assert_allclose(ratios[0], ratios[1], rtol=1e-6)


def test_a_tree_of_128_bodies_comes_back(tmp_path: Path) -> None:
    model = linear(tree())
    written = gr.export_model(model, tmp_path / "a.json")
    assert not written.left_out
    back = gr.import_model(written.path, speed="60 rad/s").model
    assert len(back.inertias) == len(model.inertias) == 128
    assert sorted(i.J for i in back.inertias) == pytest.approx(sorted(i.J for i in model.inertias), rel=1e-12)
    assert same_frequencies(back, gr.modes(model).frequencies)


def test_a_clearance_is_never_lost_in_silence(tmp_path: Path) -> None:
    with pytest.raises(gr.ModelError, match=r"(?s)mesh.gear: found a clearance.*cannot hold") as caught:
        gr.export_model(gr.example("case3"), tmp_path / "a.json")
    assert "partial" in caught.value.problems[-1].remedy
    assert list(tmp_path.iterdir()) == []


def test_a_loop_and_a_stiffness_to_ground_are_refused(tmp_path: Path) -> None:
    tables: dict[str, Any] = linear(tree(4)).to_tables()
    loop = {"name": "more", "between": ["body_0", "body_3"], "stiffness": 5.0}
    for extra, words in (
        ([loop, {**loop, "name": "again", "between": ["body_1", "body_3"]}], "loop"),
        ([{**loop, "between": ["body_1", "ground"]}], "ground"),
    ):
        model = gr.Model.from_tables({**tables, "coupling": [*tables["coupling"], *extra]})
        with pytest.raises(gr.ModelError, match=words):
            gr.export_model(model, tmp_path / "a.json", partial=True)


def assembly() -> Any:
    """An assembly as openTorsion has it: a shaft with inertia, a rigid pair, an elastic pair."""
    first = SimpleNamespace(node=2, I=0.02, R=50, parent=None)
    second = SimpleNamespace(node=3, I=0.05, R=150, parent=first)
    third = SimpleNamespace(node=4, I=0.03, R=40, k=None, c=None, parent=None)
    fourth = SimpleNamespace(node=5, I=0.04, R=80, k=3e5, c=0.1, parent=third)
    shafts = [(0, 1, 2e4, 3.0, 0.0), (1, 2, 4e4, 0.0, 0.01), (3, 4, 5e4, 0.0, 0.0), (5, 6, 6e4, 0.0, 0.0)]
    disks = [(0, 1.0, 0.0), (1, 0.3, 0.4), (6, 2.0, 0.0)]
    return SimpleNamespace(
        shaft_elements=[SimpleNamespace(nl=a, nr=b, k=k, c=c, mass=m) for a, b, k, c, m in shafts],
        disk_elements=[SimpleNamespace(node=n, I=J, c=c, k=0.0) for n, J, c in disks],
        gear_elements=[first, second],
        elastic_gear_elements=[third, fourth],
        dofs=7,
    )


def test_an_assembly_has_the_frequencies_of_its_matrices() -> None:
    # by hand: M and K of the nodes, then theta_3 = -theta_2 / 3
    M = np.diag([1.0, 0.3, 0.02, 0.05, 0.03, 0.04, 2.0])
    M[np.ix_([1, 2], [1, 2])] += 0.01 * np.array([[2, 1], [1, 2]])
    K = np.zeros((7, 7))
    for a, b, k in ((0, 1, 2e4), (1, 2, 4e4), (3, 4, 5e4), (5, 6, 6e4)):
        K[np.ix_([a, b], [a, b])] += k * np.array([[1, -1], [-1, 1]])
    w = np.zeros(7)
    w[[4, 5]] = (1.0, 2.0)
    K += 3e5 * np.outer(w, w)
    T = np.delete(np.eye(7), 3, axis=1)
    T[3, 2] = -50 / 150
    omega = np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(T.T @ M @ T, T.T @ K @ T))))
    # the note states by how much ours differ, in one part and in sixteen
    coarse, fine = gr.import_model(assembly()), gr.import_model(assembly(), split=16)
    for imported, words in ((coarse, "a larger split"), (fine, "in 16 parts each")):
        ours = np.asarray(gr.modes(imported.model).frequencies)[1:6]
        error = np.abs(ours / np.sort(omega)[1:6] - 1.0)
        assert error[0] < 1e-4
        (note,) = [note for note in imported.notes if "lumped" in note]
        assert words in note
        assert f"by {error[0]:.2g} (relative)" in note
        assert f"at most {error.max():.2g} at" in note
    names = [body.name for body in coarse.model.inertias]
    assert names == ["disk_0", "disk_1", "gear_2", "gear_4", "gear_5", "disk_6"]
    mesh = coarse.model["mesh.mesh_node_4_node_5"]
    assert (*mesh.radii, mesh.stiffness, mesh.damping) == pytest.approx((0.08, 0.04, 3e5 / 0.04**2, 0.1 / 0.04**2))


def test_lumping_is_measured_against_the_consistent_matrix() -> None:
    shaft = SimpleNamespace(nl=0, nr=1, k=1e5, c=0.0, mass=0.5)
    source = SimpleNamespace(
        shaft_elements=[shaft],
        disk_elements=[SimpleNamespace(node=0, I=1.0, c=0.0, k=0.0), SimpleNamespace(node=1, I=2.0, c=0.0, k=0.0)],
        gear_elements=None,
        elastic_gear_elements=None,
        dofs=2,
    )
    M = np.diag([1.0, 2.0]) + 0.5 * np.array([[2, 1], [1, 2]])
    K = 1e5 * np.array([[1, -1], [-1, 1]])
    true = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.max())
    lumped = np.sqrt(1e5 * (1 / 2.5 + 1 / 3.5))
    (note,) = [note for note in gr.import_model(source).notes if "lumped" in note]
    assert f"at most {abs(lumped / true - 1):.2g} at {true / (2 * np.pi):.6g} Hz" in note


def tors(**changes: Any) -> dict[str, Any]:
    """A system in TORS, of two components."""
    motor = [
        {"name": "rotor", "type": "Disk", "inertia": 1.0, "damping": 0.1},
        {"name": "shaft", "type": "ShaftContinuous", "length": 500, "innerDiameter": 0, "outerDiameter": 60},
        {"name": "pinion", "type": "GearElement", "inertia": 0.01, "teeth": 20},
        {"name": "wheel", "type": "GearElement", "inertia": 0.05, "teeth": 60, "parent": "pinion"},
    ]
    load = [
        {"name": "spline", "type": "ShaftDiscrete", "stiffness": 1e5, "damping": 2.0},
        {
            "name": "fan",
            "type": "Disk",
            "inertia": 3.0,
            "damping": 0.0,
            "excitation": {"type": "x", "values": [[1, 2]]},
        },
    ]
    components = [{"name": "motor", "elements": motor}, {"name": "load", "elements": load}]
    return {"name": "line", "components": components, "structure": [["motor.wheel", "load.spline"]], **changes}


def test_a_system_of_two_components(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(json.dumps(tors()))
    imported = gr.import_model(path)
    model = imported.model
    assert [body.name for body in model.inertias] == ["motor_rotor", "motor_pinion", "load_fan"]
    area = np.pi * 0.06**4 / 32
    assert model["coupling.motor_shaft"].stiffness == pytest.approx(80e9 * area / 0.5, rel=1e-14)
    own = 8000.0 * area * 0.5
    assert pytest.approx(1.0 + own / 2, rel=1e-14) == model["inertia.motor_rotor"].J
    assert pytest.approx(0.01 + own / 2 + 0.05 / 9, rel=1e-14) == model["inertia.motor_pinion"].J
    assert [problem.value for problem in imported.left_out] == ["excitation"]
    # a shaft beyond a rigid pair: between bodies of the speeds 1/3 and 1, which turn in opposite senses
    assert model.meshes[0].radii == pytest.approx((1 / 3, 1.0)) or model.meshes[0].radii == pytest.approx((1.0, 1 / 3))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"structure": []}, "begin a line"),
        ({"structure": [["motor.wheel", "nothing.spline"]]}, "must be a pair"),
        ({"structure": [["motor.wheel", "load.spline"], ["load.fan", "motor.rotor"]]}, "begin a line"),
        (
            {"components": [{"name": "motor", "elements": [{"name": "x", "type": "Clutch"}]}], "structure": []},
            "no element",
        ),
        ({"components": [{"name": "motor", "elements": [{"name": "x", "type": "Disk"}]}], "structure": []}, "number"),
        ({"components": 3}, "needed"),
    ],
)
def test_what_is_no_system_is_refused(changes: dict[str, Any], words: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(json.dumps(tors(**changes)))
    with pytest.raises(gr.ModelError, match=words) as caught:
        gr.import_model(path)
    assert all("a.json" in problem.place for problem in caught.value.problems)


def test_openTorsion_itself_finds_our_frequencies(tmp_path: Path) -> None:
    ot = pytest.importorskip("opentorsion")
    for model in (gr.example("case3"), gr.example("six_speed"), linear(tree(40))):
        written = gr.export_model(model, tmp_path / "a.json", partial=True)
        theirs = ot.Assembly.from_tors(json.loads(written.path.read_text()))
        omega = np.sort(np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(theirs.M, theirs.K)))))
        assert same_frequencies(model, omega)
        assert same_frequencies(gr.import_model(theirs).model, gr.modes(model).frequencies)
