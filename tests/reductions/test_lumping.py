"""Lumping: the paper's case, closed forms, and what must be kept exactly."""

from __future__ import annotations

from functools import cache
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from tests.reductions.drivelines import random_driveline

EIGHT = Path(__file__).parents[2] / "examples" / "paper" / "eight_dof.toml"
PAPER = ("clutch", "spline", "mesh_34")
SEEDS = [*range(16), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(16, 40))]


@cache
def reduced(seed: int) -> tuple[gr.Model, gr.typing.Reduction]:
    """A random driveline, reduced to a band that holds one to three of its modes."""
    model = random_driveline(seed)
    omega = gr.modes(model).frequencies
    omega = omega[omega > 1e-6 * omega.max()]
    return model, gr.reduce(model, 1.2 * float(omega[min(seed % 3, omega.size - 1)]) / (2 * pi))


def test_the_papers_eight_bodies_become_its_four() -> None:
    small = gr.reduce(gr.load(EIGHT), "75 Hz", keep=PAPER)
    assert [body.name for body in small.model.inertias] == ["flywheel", "hub", "gear_3", "gear_4"]
    assert small.groups == {"gear_3": {"gear_5": 1.0, "gear_6": 1.0, "gear_7": 1.0, "gear_8": 1.0}}
    J = {body.name: body.J for body in gr.load(EIGHT).inertias}
    assert pytest.approx(sum(J[f"gear_{i}"] for i in (3, 5, 7, 6, 8)), rel=1e-15) == small.model.inertias[2].J
    assert gr.modes(small.model).frequencies == pytest.approx([0, 346, 7937, 48091], abs=0.5)
    assert small.error.frequencies == pytest.approx([346], abs=0.5)
    assert 0 < float(small.error) < 0.001
    assert small.error.mac.min() > 0.99999


def test_the_papers_lumping_with_unequal_gears() -> None:
    changes = {"mesh.mesh_56.radii": [0.04, 0.06], "mesh.mesh_78.radii": [0.05, 0.03]}
    model = gr.load(EIGHT).with_(changes)
    small = gr.reduce(model, "75 Hz", merge=["mesh_56", "mesh_78"])
    assert small.groups["gear_3"] == pytest.approx({"gear_5": 1, "gear_6": 4 / 6, "gear_7": 1, "gear_8": 5 / 3})
    J = {body.name: body.J for body in model.inertias}
    expected = J["gear_3"] + J["gear_5"] + J["gear_7"] + J["gear_6"] * (4 / 6) ** 2 + J["gear_8"] * (5 / 3) ** 2
    kept = small.model.inertias[2]
    assert pytest.approx(expected, rel=1e-14) == kept.J
    assert kept.drag_torque == pytest.approx(0.5 * (4 / 6 + 5 / 3), rel=1e-14)
    assert kept.drag == pytest.approx(1.5e-4 + 3.75e-5 * (2 + 16 / 36 + 25 / 9), rel=1e-14)


def test_clearances_stay_unless_the_user_gives_them_up() -> None:
    small = gr.reduce(gr.load(EIGHT), "75 Hz")
    assert [mesh.name for mesh in small.model.meshes] == ["mesh_34", "mesh_56", "mesh_78"]
    assert [c.name for c in small.model.couplings] == ["clutch", "spline"]
    assert not any("given up" in note for note in small.notes)
    assert any("mesh_56, mesh_78" in n for n in gr.reduce(gr.load(EIGHT), "75 Hz", keep=PAPER).notes)


def test_two_bodies_on_a_rigid_shaft_and_a_spring_to_the_ground() -> None:
    model = gr.loads("""
        schema = 1
        excitation.speed = 10
        inertia = [{ name = "a", J = 2.0 }, { name = "b", J = 3.0 }]
        coupling = [{ name = "rigid", between = ["a", "b"], stiffness = 1e12 },
                    { name = "spring", between = ["b", "ground"], stiffness = 500.0 }]
        """)
    small = gr.reduce(model, 5.0)
    assert gr.modes(small.model).frequencies == pytest.approx([sqrt(500 / 5)], rel=1e-14)
    # one shaft of stiffness k between J_a and the rest lowers the frequency by omega^2 J_a^2 / (2 k (J_a + J_b))
    assert float(small.error) == pytest.approx(100 * 4 / (2 * 1e12 * 5), rel=1e-3)


def test_a_spring_behind_a_gear_is_seen_through_its_ratio() -> None:
    model = gr.loads("""
        schema = 1
        excitation.speed = 10
        inertia = [{ name = "pinion", J = 0.1 }, { name = "wheel", J = 0.4 }, { name = "load", J = 9.0 }]
        coupling = [{ name = "shaft", between = ["wheel", "load"], stiffness = 300.0 }]
        mesh = [{ name = "gears", between = ["pinion", "wheel"], radii = [0.02, 0.06], stiffness = 1e14 }]
        torque = [{ on = "pinion", harmonics = [{ order = 1, amplitude = 3.0 }] }]
        """)
    small = gr.reduce(model, 10.0)
    assert [body.name for body in small.model.inertias] == ["wheel", "load"]  # the shaft stays a coupling
    J = 0.4 + 9 * 0.1
    assert pytest.approx(J, rel=1e-14) == small.model.inertias[0].J
    assert small.model.torques[0].harmonics[0].amplitude == pytest.approx(9.0, rel=1e-14)
    assert gr.modes(small.model).frequencies[1] == pytest.approx(sqrt(300 * (1 / J + 1 / 9)), rel=1e-13)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_model_written_is_the_system_in_its_subspace(seed: int) -> None:
    model, small = reduced(seed)
    full, less = assemble(model).system, assemble(small.model).system
    names = [body.name for body in model.inertias]
    kept = [body.name for body in small.model.inertias]
    basis = np.zeros((full.size, less.size))
    for j, owner in enumerate(kept):
        basis[names.index(owner), j] = 1.0
        for member, ratio in small.groups.get(owner, {}).items():
            basis[names.index(member), j] = ratio
    assert less.inertia == pytest.approx(basis.T**2 @ full.inertia, rel=1e-13)
    assert less.drag == pytest.approx(basis.T**2 @ full.drag, rel=1e-13)
    assert less.inputs.mean == pytest.approx(basis.T @ full.inputs.mean, rel=1e-12, abs=1e-13)
    assert less.inputs.torque_sine == pytest.approx(basis.T @ full.inputs.torque_sine, rel=1e-12, abs=1e-13)
    where = {e.name: k for k, e in enumerate(model.elements)}
    for k, element in enumerate(small.model.elements):
        row = less.rows[k]
        law = less.laws[k]
        old = full.laws[where[element.name]]
        full_row = full.rows[where[element.name]] @ basis
        unit = row[np.argmax(np.abs(row))] / full_row[np.argmax(np.abs(row))]  # delta' = unit x delta
        assert row == pytest.approx(unit * full_row, rel=1e-12, abs=1e-13)
        assert law.corners == pytest.approx(unit * old.corners, rel=1e-12)
        assert law.stiffness * unit**2 == pytest.approx(old.stiffness, rel=1e-12)
        assert law.damping * unit**2 == pytest.approx(old.damping, rel=1e-12)
        assert law.offset * unit == pytest.approx(old.offset, rel=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_rigid_body_energy_is_kept(seed: int) -> None:
    model, small = reduced(seed)
    reference = small.model.inertias[-1].name
    seen = []
    for entry in (model, small.model):
        actual = gr.modes(entry)
        if actual.frequencies[0] > 0.0:
            return  # held by the ground
        motion = actual.shapes[:, 0] / actual.shapes[actual.inertia_names.index(reference), 0]
        seen.append(float(np.array([body.J for body in entry.inertias]) @ motion**2))
    assert seen[1] == pytest.approx(seen[0], rel=1e-11)


@pytest.mark.parametrize("seed", SEEDS)
def test_static_deflection_across_kept_clearances_is_kept(seed: int) -> None:
    model, small = reduced(seed)
    full, less = gr.equilibrium(model), gr.equilibrium(small.model)
    assert less.region == full.region
    corner = {e.name: e.drive[0].until for e in model.elements}
    for e in small.model.elements:
        if len(e.drive) > 1:
            share = full.deflection[e.name] / corner[e.name]
            assert less.deflection[e.name] / e.drive[0].until == pytest.approx(share, rel=1e-8, abs=1e-9)
