"""The torsion of rotors of ROSS: saved files and objects, against the torsional blocks of their matrices."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr

ROTOR = Path(__file__).with_name("ross_rotor.toml")
"""Four elements of a shaft, two disks and two bearings, saved by ROSS 2.3.0."""


def torsional_frequencies() -> np.ndarray:
    """Frequencies of the consistent matrices of that rotor, by hand [rad/s]."""
    area = np.pi * 0.05**4 / 32
    K = np.zeros((5, 5))
    M = np.diag([0.0, 0.32956362089137037, 0.0, 0.35, 0.0])
    for k in range(4):
        K[k : k + 2, k : k + 2] += 81.2e9 * area / 0.25 * np.array([[1, -1], [-1, 1]])
        M[k : k + 2, k : k + 2] += 7810 * area * 0.25 / 6 * np.array([[2, 1], [1, 2]])
    return np.sort(np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(M, K)))))


def test_a_saved_rotor_and_what_lumping_costs() -> None:
    source = torsional_frequencies()
    for split in (1, 8):
        imported = gr.import_model(ROTOR, split=split)
        ours = np.asarray(gr.modes(imported.model).frequencies)[1:5]
        error = np.abs(ours / source[1:] - 1)
        (note,) = [note for note in imported.notes if "lumped" in note]
        assert f"by {error[0]:.2g} (relative)" in note
        assert f"at most {error.max():.2g} at" in note
        assert len(imported.model.inertias) == 4 * split + 1
    assert "bending is not imported, nor 2 bearings" in " ".join(imported.notes)
    assert [body.name for body in gr.import_model(ROTOR).model.inertias][1] == "Disk_0"


def test_json_holds_the_same(tmp_path: Path) -> None:
    path = tmp_path / "rotor.json"
    path.write_text(json.dumps(tomllib.loads(ROTOR.read_text())))
    assert gr.import_model(path).model == gr.import_model(ROTOR).model


def test_proportional_damping_and_couplings(tmp_path: Path) -> None:
    content: dict[str, Any] = tomllib.loads(ROTOR.read_text())
    content["ShaftElement_Shaft Element 0"] |= {"alpha": 3.0, "beta": 1e-5}
    content["CouplingElement_hub"] = {"n": 4, "Ip_l": 0.01, "Ip_r": 0.02, "kr_z": 3e6, "cr_z": 7.0}
    path = tmp_path / "rotor.json"
    path.write_text(json.dumps(content))
    model = gr.import_model(path).model
    shaft = model["coupling.Shaft_Element_0"]
    own = 7810 * np.pi * 0.05**4 / 32 * 0.25
    assert shaft.damping == pytest.approx(1e-5 * shaft.stiffness)
    assert [body.drag for body in model.inertias[:3]] == pytest.approx([1.5 * own, 1.5 * own, 0.0])
    assert (model["coupling.hub"].stiffness, model["coupling.hub"].damping) == (3e6, 7.0)
    assert model.inertias[-1].J == 0.02


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"MagicElement_x": {"n": 0}}, "no element whose torsion is known"),
        ({"DiskElement_x": {"n": 0, "Ip": "much"}}, "must be a number"),
        ({"DiskElement_x": {"n": -1, "Ip": 1.0}}, "number of a node"),
        ({"ShaftElement_x": {"n": 0, "L": 1.0}}, "must be a table with rho"),
        ({"DiskElement_x": 3}, "no element of a rotor"),
    ],
)
def test_what_is_no_rotor_is_refused(changes: dict[str, Any], words: str, tmp_path: Path) -> None:
    path = tmp_path / "rotor.json"
    path.write_text(json.dumps({**tomllib.loads(ROTOR.read_text()), **changes}))
    with pytest.raises(gr.ModelError, match=words):
        gr.import_model(path)


def test_ross_itself_has_these_blocks() -> None:
    ross = pytest.importorskip("ross")
    rotor = ross.Rotor.load(ROTOR)
    twist = np.arange(5, rotor.ndof, 6)
    K, M = rotor.K(0)[np.ix_(twist, twist)], rotor.M(0)[np.ix_(twist, twist)]
    omega = np.sort(np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(M, K)))))
    np.testing.assert_allclose(omega[1:], torsional_frequencies()[1:], rtol=1e-9)
    ours = gr.import_model(rotor, split=4)
    from_file = gr.import_model(ROTOR, split=4)
    np.testing.assert_allclose(
        gr.modes(ours.model).frequencies[1:], gr.modes(from_file.model).frequencies[1:], rtol=1e-12
    )
    coupling = ross.CouplingElement(m_l=1.0, m_r=1.0, Ip_l=0.01, Ip_r=0.02, kr_z=3e6, cr_z=7.0)
    joined = ross.Rotor([*rotor.shaft_elements, coupling], rotor.disk_elements, rotor.bearing_elements)
    model = gr.import_model(joined).model
    assert (model.couplings[-1].stiffness, model.couplings[-1].damping) == pytest.approx((3e6, 7.0))
    assert pytest.approx(0.02) == model.inertias[-1].J
