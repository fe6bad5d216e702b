"""Planetary sets: rows, modes, motions against an independent integrator and against plain meshes."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble, rows_of
from gearrattle.signals.driveline_constants import speed_ratios
from tests.oracles.planetary import integrate, random_set


def agrees(seed: int, samples: int = 16) -> int:
    """Compare sixteenths of a turn from a random start, and return how often corners were crossed."""
    case = random_set(seed)
    random, size = np.random.default_rng([1994, seed]), case.planets + 3
    angle, velocity = random.normal(size=size) * 1e-5, random.normal(size=size) * 1e-2
    start = {"angle": angle.tolist(), "velocity": velocity.tolist()}
    run = gr.simulate(gr.Model.from_tables(case.tables()), cycles=1, samples_per_cycle=16, initial=start, audit=False)
    last = run.data.isel(time=samples)
    state, crossings = integrate(case, np.concatenate([angle, velocity]), float(last.time))
    assert np.count_nonzero(run.events["time"] <= float(last.time)) == crossings
    for ours, theirs in ((last.angle.values, state[:size]), (last.velocity.values, state[size:])):
        assert np.max(np.abs(ours - theirs)) < 1e-9 * np.max(np.abs(theirs))
    return crossings


def test_a_random_set_moves_as_an_independent_integrator_says() -> None:
    assert agrees(0, samples=4) > 10


@pytest.mark.long
@pytest.mark.parametrize("seed", range(100))
def test_a_hundred_random_sets_move_as_an_independent_integrator_says(seed: int) -> None:
    agrees(seed)


def tables(**changes: object) -> dict[str, object]:
    """Return a set of three equal planets on a carrier that turns freely."""
    bodies = {"sun": 0.002, "ring": 0.03, "carrier": 0.01, "p1": 4e-4, "p2": 4e-4, "p3": 4e-4}
    planetary = {
        "name": "set", "sun": "sun", "ring": "ring", "carrier": "carrier", "planets": ["p1", "p2", "p3"],
        "radii": {"sun": 0.03, "planet": 0.02, "ring": 0.07},
        "stiffness": {"sun": 1e8, "ring": 1.5e8},
        "backlash": {"sun": 5e-5, "ring": 4e-5}, "damping": {"sun": 300.0, "ring": 300.0},
        "transmission_error": {"sun": [{"order": 30, "amplitude": 2e-6}], "ring": [{"order": 30, "amplitude": 1e-6}]},
        "mesh_phase": {"sun": [0.0, 2.0, 4.0]},
    }  # fmt: skip
    return {
        "schema": 1,
        "inertia": [{"name": name, "J": J} for name, J in bodies.items()],
        "planetary": [planetary | changes],
        "excitation": {"speed": 150.0},
        "torque": [{"on": "sun", "harmonics": [{"order": 2, "amplitude": 15.0}]}],
    }


def test_rigid_rotation_with_the_carrier_deflects_no_mesh() -> None:
    rows = rows_of(gr.Model.from_tables(tables()))
    assert np.count_nonzero(rows, axis=1).tolist() == [3] * 6
    assert np.max(np.abs(rows.sum(axis=1))) < 1e-16


def test_three_equal_planets_have_the_modes_of_kahraman() -> None:
    """Two planet modes of equal frequency, in which sun, ring and carrier rest; the others with planets in step."""
    model = gr.Model.from_tables(tables())
    sun = 0.03
    planet = 0.02
    ring = 0.07
    k_s = 1e8
    k_r = 1.5e8
    J_p = 4e-4
    modes = gr.modes(model)
    planets = planet * np.sqrt((k_s + k_r) / J_p)
    alike = np.isclose(modes.frequencies, planets, rtol=1e-10)
    assert alike.sum() == 2
    assert np.max(np.abs(modes.shapes[:3, alike])) < 1e-9 * np.max(np.abs(modes.shapes[:, alike]))
    # sun, carrier, ring and the common angle of the planets: K from 3 [k_s (R_s s + R_p p - R_c c)^2 + ...] / 2
    on_sun, on_ring = np.array([sun, -(sun + planet), 0.0, planet]), np.array([0.0, -(ring - planet), ring, -planet])
    stiffness = 3.0 * (k_s * np.outer(on_sun, on_sun) + k_r * np.outer(on_ring, on_ring))
    root = np.sqrt([0.002, 0.01, 0.03, 3.0 * J_p])
    in_step = np.sqrt(np.maximum(np.linalg.eigvalsh(stiffness / np.outer(root, root)), 0.0))
    assert modes.frequencies[~alike][2:] == pytest.approx(in_step[2:], rel=1e-9)
    assert np.max(modes.frequencies[:2]) < 1e-6 * in_step[2]


def test_a_set_on_a_fixed_carrier_moves_as_plain_meshes_do() -> None:
    """Plain meshes count the angles of planets and ring the other way round."""
    fixed = tables(carrier="ground")
    fixed["inertia"] = [row for row in fixed["inertia"] if row["name"] != "carrier"]  # type: ignore[index, union-attr]
    plain = {key: value for key, value in fixed.items() if key != "planetary"}
    rows = []
    for i in range(3):
        error = [{"order": 30, "amplitude": 2e-6, "phase": 2.0 * i}]
        rows.append(
            {
                "name": f"sun{i}",
                "between": ["sun", f"p{i + 1}"],
                "radii": [0.03, 0.02],
                "stiffness": 1e8,
                "damping": 300.0,
                "backlash": 5e-5,
                "transmission_error": error,
            }
        )
        rows.append(
            {
                "name": f"ring{i}",
                "between": [f"p{i + 1}", "ring"],
                "radii": [0.02, 0.07],
                "stiffness": 1.5e8,
                "damping": 300.0,
                "backlash": 4e-5,
                "transmission_error": [{"order": 30, "amplitude": 1e-6}],
            }
        )
    ours = gr.simulate(gr.Model.from_tables(fixed), cycles=1, discard=0, audit=False)
    theirs = gr.simulate(gr.Model.from_tables({**plain, "mesh": rows}), cycles=1, discard=0, audit=False)
    assert len(ours.events) == len(theirs.events) > 20
    sign = {"sun": 1.0, "ring": -1.0, "p1": -1.0, "p2": -1.0, "p3": -1.0}
    for name, way in sign.items():
        one, other = ours.data.velocity.sel(inertia=name).values, way * theirs.data.velocity.sel(inertia=name).values
        assert np.max(np.abs(one - other)) < 1e-8 * np.max(np.abs(one)), name


def test_mean_speeds_follow_willis() -> None:
    """With the ring held, the carrier turns R_s / (R_s + R_r) as fast as the sun, a planet backward."""
    held = tables()
    held["coupling"] = [{"name": "brake", "between": ["ring", "ground"], "stiffness": 1e6}]
    model = gr.Model.from_tables(held)
    ratios = speed_ratios(assemble(model).layout)
    assert ratios == pytest.approx([1.0, 0.0, 0.3, 0.75, 0.75, 0.75], rel=1e-12)


def test_masses_of_planets_are_added_to_the_carrier_and_noted() -> None:
    model = gr.Model.from_tables(tables(planet_mass=0.4, centre_distance=0.05))
    assert assemble(model).system.inertia[2] == pytest.approx(0.01 + 3 * 0.4 * 0.05**2, rel=1e-15)
    run = gr.simulate(model, cycles=1, audit=False)
    assert any("the planets' masses add 0.003 kg m^2 to the J of carrier" in note for note in run.notes)


def test_a_ring_that_does_not_fit_is_noted() -> None:
    model = gr.Model.from_tables(tables(radii={"sun": 0.03, "planet": 0.02, "ring": 0.068}))
    assert any("sun and two planets give 0.07 m" in note for note in gr.simulate(model, cycles=1, audit=False).notes)


def test_sun_ring_and_planets_may_be_loaded_from_ground() -> None:
    for fixed in ("sun", "ring"):
        grounded = tables(**{fixed: "ground"})
        grounded["inertia"] = [row for row in grounded["inertia"] if row["name"] != fixed]  # type: ignore[index, union-attr]
        grounded["torque"] = [{"on": "p1", "harmonics": [{"order": 2, "amplitude": 2.0}]}]
        run = gr.simulate(gr.Model.from_tables(grounded), cycles=2)
        assert run.cost.energy_residual < 1e-11
        assert list(run.data.element.values)[:2] == ["set-sun-p1", "set-ring-p1"]


def test_written_without_dimensions_a_set_moves_alike() -> None:
    model = gr.Model.from_tables(tables(planet_mass=0.4, centre_distance=0.05)).with_(
        {"torque.0.mean": 60.0, "inertia.carrier.drag_torque": 200.0, "inertia.ring.drag_torque": 0.0}
    )
    scaled = gr.nondimensionalize(model)
    ours = gr.simulate(model, cycles=2, audit=False)
    theirs = scaled.restore(gr.simulate(scaled.model, cycles=2, audit=False))
    assert np.max(np.abs(ours.data.velocity - theirs.data.velocity)) < 1e-9 * np.max(np.abs(ours.data.velocity))


def test_reduction_leaves_the_set_and_merges_what_hangs_on_it() -> None:
    longer = tables(planet_mass=0.4, centre_distance=0.05)
    longer["inertia"] = [*longer["inertia"], {"name": "output", "J": 0.05}]  # type: ignore[misc]
    longer["coupling"] = [{"name": "shaft", "between": ["carrier", "output"], "stiffness": 1e8}]
    reduced = gr.reduce(gr.Model.from_tables(longer), "75 Hz")
    assert [inertia.name for inertia in reduced.model.inertias] == ["sun", "ring", "carrier", "p1", "p2", "p3"]
    assert pytest.approx(0.01 + 0.003 + 0.05, rel=1e-12) == reduced.model.inertias[2].J
    assert reduced.model.planetaries[0].planet_mass is None
