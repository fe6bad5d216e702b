"""Energies and participations of modes: laws, against formulas and finite differences of frequencies alone."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Torque

SEEDS = range(12)


def train(seed: int) -> gr.Model:
    """A random tree of 2 to 7 inertias, geared or not, grounded or not, with a second path or not."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 8))
    bodies = tuple(Body(f"b{i}", f"{10 ** rng.uniform(-3, 0):.6g}") for i in range(size))
    shafts, meshes = [], []
    for i in range(1, size):
        ends, k = (f"b{rng.integers(0, i)}", f"b{i}"), 10 ** rng.uniform(2, 5)
        if rng.random() < 0.4:
            radii = (f"{rng.uniform(0.02, 0.1):.4g}", f"{rng.uniform(0.02, 0.1):.4g}")
            meshes.append(Mesh(f"m{i}", ends, radii, f"{k / 0.0025:.6g}", error=(Harmonic("20", "1e-5"),)))
        else:
            shafts.append(Coupling(f"s{i}", ends, f"{k:.6g}"))
    if rng.random() < 0.4:
        shafts.append(Coupling("held", ("b0", "ground"), f"{10 ** rng.uniform(1, 4):.6g}"))
    if size > 3 and rng.random() < 0.5:
        shafts.append(Coupling("loop", ("b1", f"b{size - 1}"), "1234.5"))
    drive = Torque("b0", "0", (Harmonic("1", "10"),))
    return gr.loads(Driveline("train", bodies, tuple(shafts), tuple(meshes), torques=(drive,), speed="100").toml())


def rigid_modes(actual: gr.typing.Modes) -> int:
    return int(np.sum(actual.frequencies == 0.0))


def separate(frequencies: np.ndarray, mode: int) -> bool:
    """Whether no other frequency is within a tenth: then a small change moves this one alone."""
    others = np.delete(frequencies, mode)
    return bool(np.all(np.abs(others / frequencies[mode] - 1.0) > 0.1))


@pytest.mark.parametrize("seed", SEEDS)
def test_shares_follow_from_the_shapes(seed: int) -> None:
    model = train(seed)
    actual, system = gr.modes(model), assemble(model).system
    stiffness = np.array([element.drive[-1].stiffness for element in model.elements])
    inertia = np.array([body.J for body in model.inertias])
    stored = stiffness[:, None] * (system.rows @ actual.shapes) ** 2
    moving = inertia[:, None] * actual.shapes**2
    first = rigid_modes(actual)
    assert actual.strain_energy[:, first:] == pytest.approx((stored / stored.sum(axis=0))[:, first:], abs=1e-9)
    assert np.all(np.isnan(actual.strain_energy[:, :first]))
    assert actual.kinetic_energy == pytest.approx(moving / moving.sum(axis=0), abs=1e-9)
    assert actual.modal_inertia == pytest.approx(moving.sum(axis=0), rel=1e-9)
    assert actual.participation == pytest.approx(actual.shapes**2 / moving.sum(axis=0), rel=1e-7, abs=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_shares_add_up(seed: int) -> None:
    model = train(seed)
    actual = gr.modes(model)
    first, inertia = rigid_modes(actual), np.array([body.J for body in model.inertias])
    assert actual.strain_energy[:, first:].sum(axis=0) == pytest.approx(1.0, rel=1e-12)
    assert actual.kinetic_energy.sum(axis=0) == pytest.approx(1.0, rel=1e-12)
    assert actual.participation.sum(axis=1) == pytest.approx(1.0 / inertia, rel=1e-12)
    if len(model.elements) == len(inertia) - first:  # without loops no step of transmission error is locked in
        assert actual.strain_energy[:, first:].sum(axis=1) == pytest.approx(1.0, rel=1e-12)
    else:
        assert np.any(actual.strain_energy[:, first:].sum(axis=1) < 1.0 - 1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_strain_energy_is_the_sensitivity_of_the_frequency_to_the_stiffness(seed: int) -> None:
    model, step = train(seed), 1e-4
    actual = gr.modes(model)
    for k, element in enumerate(model.elements):
        path, stiffness = f"{element.path}.stiffness", element.drive[-1].stiffness
        ends = [gr.modes(model.with_({path: stiffness * np.exp(sign * step)})).frequencies for sign in (1.0, -1.0)]
        for mode in range(rigid_modes(actual), len(actual.frequencies)):
            if separate(actual.frequencies, mode):
                slope = 2.0 * np.log(ends[0][mode] / ends[1][mode]) / (2.0 * step)
                assert actual.strain_energy[k, mode] == pytest.approx(slope, abs=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_kinetic_energy_is_the_sensitivity_of_the_frequency_to_the_inertia(seed: int) -> None:
    model, step = train(seed), 1e-4
    actual = gr.modes(model)
    for i, body in enumerate(model.inertias):
        path = f"inertia.{body.name}.J"
        ends = [gr.modes(model.with_({path: body.J * np.exp(sign * step)})).frequencies for sign in (1.0, -1.0)]
        for mode in range(rigid_modes(actual), len(actual.frequencies)):
            if separate(actual.frequencies, mode):
                slope = 2.0 * np.log(ends[0][mode] / ends[1][mode]) / (2.0 * step)
                assert actual.kinetic_energy[i, mode] == pytest.approx(-slope, abs=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_participation_gives_the_acceleration_by_a_unit_torque(seed: int) -> None:
    """The sum over modes is the accelerance that solving with the dynamic stiffness gives."""
    model = train(seed)
    actual, system = gr.modes(model), assemble(model).system
    inertia = np.diag([body.J for body in model.inertias])
    stiffness = system.rows.T @ np.diag([element.drive[-1].stiffness for element in model.elements]) @ system.rows
    omega = 0.37 * actual.frequencies[-1]
    solved = np.diag(-(omega**2) * np.linalg.inv(stiffness - omega**2 * inertia))
    summed = actual.participation @ (-(omega**2) / (actual.frequencies**2 - omega**2))
    assert summed == pytest.approx(solved, rel=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_excitation_is_how_the_energy_of_a_blow_or_a_step_spreads(seed: int) -> None:
    model = train(seed)
    actual, system = gr.modes(model), assemble(model).system
    names = [element.name for element in model.elements]
    inertia = np.array([body.J for body in model.inertias])
    unit = actual.shapes / np.sqrt(actual.modal_inertia)  # of unit modal inertia
    assert actual.sources[0] == "torque on b0"
    assert actual.sources[1:] == tuple(f"transmission error of {mesh.name}" for mesh in model.meshes)
    blow = np.eye(len(inertia))[0] / inertia  # velocities after a unit impulse
    energy = 0.5 * (unit.T @ (inertia * blow)) ** 2
    assert actual.excitation[0] == pytest.approx(energy / (0.5 / inertia[0]), abs=1e-9)
    for row, mesh in zip(actual.excitation[1:], model.meshes, strict=True):
        force = system.rows[names.index(mesh.name)] * mesh.stiffness  # by a unit step of transmission error
        elastic = actual.frequencies > 0.0
        values = np.where(elastic, 0.5 * (unit.T @ force) ** 2 / np.where(elastic, actual.frequencies, 1.0) ** 2, 0.0)
        assert row == pytest.approx(values / (0.5 * mesh.stiffness), abs=1e-9)


def test_one_inertia_alone_and_on_a_spring() -> None:
    body = (Body("disc", "2"),)
    free = gr.modes(gr.loads(Driveline("free", body, speed="1").toml()))
    assert free.frequencies.tolist() == [0.0]
    assert free.strain_energy.shape == (0, 1)
    assert free.kinetic_energy.tolist() == [[1.0]]
    assert free.participation.tolist() == [[0.5]]
    assert (free.works_in(0), free.excited_by(0), free.moves(0)) == ({}, {}, {"disc": 1.0})
    held = gr.modes(gr.loads(Driveline("held", body, (Coupling("s", ("ground", "disc"), "50"),), speed="1").toml()))
    assert held.frequencies == pytest.approx([5.0], rel=1e-15)
    assert held.strain_energy == pytest.approx(np.ones((1, 1)), rel=1e-15)
    assert held.modal_inertia == pytest.approx([2.0], rel=1e-15)


def test_an_open_clearance_holds_no_energy() -> None:
    bodies = tuple(Body(f"b{i}", "1") for i in range(3))
    shafts = (Coupling("a", ("b0", "b1"), "10"), Coupling("b", ("b1", "b2"), "10", clearance="0.1"))
    actual = gr.modes(gr.loads(Driveline("gap", bodies, shafts, speed="1").toml()), contact_ratio={"b": 0.0})
    assert actual.frequencies == pytest.approx([0, 0, np.sqrt(20)], rel=1e-14)
    assert actual.strain_energy[:, 2] == pytest.approx([1.0, 0.0], abs=1e-15)
    assert actual.works_in(2) == {"a": pytest.approx(1.0)}


def test_modes_of_equal_trains_do_not_mix() -> None:
    bodies = tuple(Body(f"b{i}", J) for i, J in enumerate(["1", "2", "1", "2"]))
    shafts = (Coupling("a", ("b0", "b1"), "10"), Coupling("b", ("b2", "b3"), "10"))
    actual = gr.modes(gr.loads(Driveline("twins", bodies, shafts, speed="1").toml()))
    assert actual.frequencies == pytest.approx([0, 0, np.sqrt(15), np.sqrt(15)], rel=1e-14)
    assert actual.repeated() == ((2, 3),)
    assert actual.strain_energy[:, 2:].tolist() == [[1.0, 0.0], [0.0, 1.0]]
    assert actual.kinetic_energy[:, 2] == pytest.approx([2 / 3, 1 / 3, 0, 0], rel=1e-14)


def test_shares_of_a_repeated_frequency_mean_something_as_a_sum() -> None:
    """Three equal gears on one shaft: two modes of one frequency, whose energies are shared in any way."""
    bodies = (Body("shaft", "1"), *(Body(f"g{i}", "0.1") for i in range(3)))
    shafts = tuple(Coupling(f"s{i}", ("shaft", f"g{i}"), "1000") for i in range(3))
    actual = gr.modes(gr.loads(Driveline("fork", bodies, shafts, speed="1").toml()))
    assert actual.frequencies[1:] == pytest.approx([100, 100, 100 * np.sqrt(1.3)], rel=1e-14)
    assert actual.repeated() == ((1, 2),)
    assert actual.strain_energy[:, 1:3].sum(axis=1) == pytest.approx(2 / 3, rel=1e-12)
    assert actual.kinetic_energy[:, 1:3].sum(axis=1) == pytest.approx([0, 2 / 3, 2 / 3, 2 / 3], abs=1e-12)
    assert actual.strain_energy[:, 3] == pytest.approx(1 / 3, rel=1e-12)


def test_a_soft_element_beside_a_stiff_one() -> None:
    """Chain 1 -k- 1 -K- 1 with K = 1e18 k: closed form of the shares of both modes."""
    bodies = tuple(Body(f"b{i}", "1") for i in range(3))
    shafts = (Coupling("soft", ("b0", "b1"), "1e-6"), Coupling("stiff", ("b1", "b2"), "1e12"))
    actual = gr.modes(gr.loads(Driveline("soft", bodies, shafts, speed="1").toml()))
    assert actual.strain_energy[0] == pytest.approx([np.nan, 1.0, 0.0], abs=1e-14, nan_ok=True)
    assert actual.kinetic_energy[:, 1] == pytest.approx([2 / 3, 1 / 6, 1 / 6], rel=1e-6)
