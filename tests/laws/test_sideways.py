"""Sideways motion: natural frequencies by hand, invariance, the limit of stiff bearings, balances, one direction."""

from __future__ import annotations

from math import cos, pi, radians, sin
from typing import Any

import numpy as np
import pytest

import gearrattle as gr

ANGLE = radians(20.0)
PAIR = {"mass": 6.57, "bearing": 1e8, "mesh": 517925405.24, "J": 0.0365284, "radius": 0.1 * cos(ANGLE)}


def pair(**of_bearings: Any) -> gr.Model:
    """Two equal gears; the pair of the multi-rotor test of ROSS (github.com/petrobras/ross, tests/test_multi_rotor.py):
    mass, bearings, 20 teeth of module 10 mm and the mesh, with J that of its ring.
    """
    held = {"stiffness": PAIR["bearing"], **of_bearings}
    mesh = {"name": "gear", "between": ["a", "b"], "radii": [PAIR["radius"]] * 2, "stiffness": PAIR["mesh"]}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": name, "J": PAIR["J"], "mass": PAIR["mass"]} for name in "ab"],
            "mesh": [{**mesh, "pressure_angle": ANGLE}],
            "bearing": [{"name": f"at_{name}", "on": name, **held} for name in "ab"],
            "excitation": {"speed": 100.0},
        }
    )


def train(turn: float = 0.0, **changes: Any) -> dict[str, Any]:
    """A motor, a pinion and a gear on bearings, and a load; data of Chaari et al. 2012, the mesh stiffness chosen."""
    mesh = {
        "name": "gear",
        "between": ["pinion", "wheel"],
        "radii": [0.02819 * cos(ANGLE), 0.05638 * cos(ANGLE)],
        "stiffness": 2e8,
        "pressure_angle": ANGLE,
        "centre_line": turn,
    }
    tables = {
        "schema": 1,
        "inertia": [
            {"name": "motor", "J": 0.0043},
            {"name": "pinion", "J": 0.00027, "mass": 0.6},
            {"name": "wheel", "J": 0.0027, "mass": 1.5},
            {"name": "load", "J": 0.0045},
        ],
        "coupling": [
            {"name": "input", "between": ["motor", "pinion"], "stiffness": 1e5},
            {"name": "output", "between": ["wheel", "load"], "stiffness": 1e5},
        ],
        "mesh": [mesh],
        "bearing": [{"name": f"at_{name}", "on": name, "stiffness": 1e8} for name in ("pinion", "wheel")],
        "excitation": {"speed": 100.0},
    }
    return {**tables, **changes}


def driven(turn: float = 0.0, *, stiffness: float = 1e8, masses: bool = True, **of_bearings: Any) -> gr.Model:
    """The same with damping, backlash and a torque that parts the teeth."""
    tables = train(turn)
    tables["inertia"][0]["drag"] = 0.05
    tables["inertia"][3] |= {"drag": 0.05, "drag_torque": 2.0}
    tables["mesh"][0] |= {"damping": 1500.0, "backlash": 6e-5}
    for coupling in tables["coupling"]:
        coupling["damping"] = 5.0
    for bearing in tables["bearing"]:
        bearing |= {"stiffness": stiffness, "damping": 2000.0, **of_bearings}
    tables["torque"] = [{"on": "motor", "mean": "balance", "harmonics": [{"order": 2, "amplitude": 60.0}]}]
    if not masses:
        for body in tables["inertia"]:
            body.pop("mass", None)
        del tables["bearing"], tables["mesh"][0]["pressure_angle"], tables["mesh"][0]["centre_line"]
    return gr.Model.from_tables(tables)


def hertz(model: gr.Model) -> np.ndarray:
    return gr.modes(model).frequencies / (2.0 * pi)


def by_hand() -> list[float]:
    """Natural frequencies of the pair [Hz]: (kb + 2 km - m w^2)(2 km - J/r^2 w^2) = 4 km^2, and kb/m three times."""
    m, kb, km = PAIR["mass"], PAIR["bearing"], PAIR["mesh"]
    turning = PAIR["J"] / PAIR["radius"] ** 2
    squares = np.roots([m * turning, -(2 * km * m + turning * (kb + 2 * km)), (kb + 2 * km) * 2 * km - 4 * km**2])
    return sorted(np.sqrt([*squares, kb / m, kb / m, kb / m]) / (2.0 * pi))


def test_a_pair_of_equal_gears_has_the_frequencies_of_the_closed_form() -> None:
    frequencies = hertz(pair())
    assert frequencies[0] == 0.0
    assert frequencies[1:] == pytest.approx(by_hand(), rel=1e-10)
    assert frequencies == pytest.approx([0.0, 482.851, 620.923, 620.923, 620.923, 3238.646], abs=1e-3)


def test_a_pair_on_one_direction_moves_along_it_alone() -> None:
    along = hertz(pair(direction=pi / 2 - ANGLE))
    expected = by_hand()
    assert along[1:] == pytest.approx([expected[0], expected[1], expected[4]], rel=1e-10)
    across = hertz(pair(direction=-ANGLE))
    stiff = np.sqrt(2.0 * PAIR["mesh"] * PAIR["radius"] ** 2 / PAIR["J"]) / (2.0 * pi)
    assert across[1:] == pytest.approx([expected[1], expected[1], stiff], rel=1e-10)


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.1])
def test_a_train_of_four_bodies_has_the_published_data_s_frequencies(turn: float) -> None:
    expected = [0.0, 536.85, 1260.35, 1299.49, 1608.76, 2054.68, 2611.39, 6029.24]
    assert hertz(gr.Model.from_tables(train(turn))) == pytest.approx(expected, abs=0.005)


def test_stiff_bearings_leave_the_driveline_of_fixed_centres() -> None:
    """Frequencies come nearer with the inverse of the stiffness."""
    fixed = hertz(driven(masses=False))
    off = []
    for stiffness in (1e12, 1e13):
        frequencies = hertz(driven(stiffness=stiffness))[: fixed.size]
        off.append(float(np.max(np.abs(frequencies[1:] / fixed[1:] - 1.0))))
    assert off[1] < 1e-4
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.02)
    alone = np.sqrt(2.0 * PAIR["mesh"] * PAIR["radius"] ** 2 / PAIR["J"]) / (2.0 * pi)
    assert alone == pytest.approx(2518.48, abs=0.005)


def test_a_motion_on_stiff_bearings_is_that_of_fixed_centres() -> None:
    settings = {"cycles": 6, "discard": 2, "samples_per_cycle": 64}
    fixed = gr.simulate(driven(masses=False), **settings).trajectory
    held = gr.simulate(driven(stiffness=1e13), **settings).trajectory
    size = np.abs(fixed.velocity).max(axis=0)
    assert np.max(np.abs(held.velocity - fixed.velocity) / size) < 1e-3
    assert len(held.events) == len(fixed.events) > 0


@pytest.mark.parametrize(("turn", "of_bearings"), [(1.234, {}), (pi / 4, {"clearance": 1e-5, "faces": 8})])
def test_turning_all_of_it_changes_nothing(turn: float, of_bearings: dict[str, Any]) -> None:
    """By any angle without clearance, by that from face to face with it."""
    settings = {"cycles": 3, "discard": 1, "samples_per_cycle": 64}
    here, there = (gr.simulate(driven(angle, **of_bearings), **settings) for angle in (0.0, turn))
    one, two = here.trajectory, there.trajectory
    assert np.max(np.abs(one.events.time - two.events.time)) < 1e-9 * one.end
    turned = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
    for name in ("displacement", "bearing_force"):
        mine, theirs = (getattr(t.sideways, name) for t in (one, two))
        expected = np.hstack([mine[:, i : i + 2] @ turned.T for i in (0, 2)])
        assert theirs == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())
    first, second = gr.criteria(here), gr.criteria(there)
    meshes = [[part.regime for part in v.parts if part.kind == "mesh"] for v in (first, second)]
    assert first.headline == second.headline
    assert meshes[0] == meshes[1]


@pytest.mark.parametrize("of_bearings", [{}, {"clearance": 1e-5, "faces": 12}, {"clearance": 2e-5, "faces": 4}])
def test_energy_and_momentum_balance(of_bearings: dict[str, Any]) -> None:
    """The casing takes what the bodies' momentum does not: sum m u'' = - casing force."""
    run = gr.simulate(driven(**of_bearings), cycles=4, discard=1, samples_per_cycle=64)
    t = run.trajectory
    assert run.cost.energy_residual is not None
    assert run.cost.energy_residual < 1e-9
    assert t.sideways is not None
    momentum = t.sideways.acceleration * t.layout.direction_mass
    gained = np.stack([momentum[:, axis::2].sum(axis=1) for axis in (0, 1)], axis=1)
    force = t.sideways.casing_force
    assert gained == pytest.approx(-force, abs=1e-9 * np.abs(force).max())


def test_closing_the_centres_eats_backlash() -> None:
    """delta_d - delta_c = 2 sin a (u_ax - u_bx), with which both flanks may touch."""
    run = gr.simulate(driven(clearance=1e-5, faces=4), cycles=3, discard=1, samples_per_cycle=64)
    t = run.trajectory
    assert t.sideways is not None
    names = t.layout.clearance_names
    drive, coast = (t.deflection[:, names.index(f"gear-{flank}")] for flank in ("drive", "coast"))
    closer = t.sideways.displacement[:, 0] - t.sideways.displacement[:, 2]
    assert drive - coast == pytest.approx(2.0 * sin(ANGLE) * closer, abs=1e-17)


def test_an_even_load_rests_on_the_bearings() -> None:
    """At rest the force on the casing is that of a couple: none in all, T / r_b at each bearing."""
    tables = train()
    tables["torque"] = [{"on": "motor", "mean": 10.0}, {"on": "load", "mean": -20.0}]
    rest = gr.equilibrium(gr.Model.from_tables(tables))
    force = 10.0 / (0.02819 * cos(ANGLE))
    expected = [force * sin(ANGLE), force * cos(ANGLE), -force * sin(ANGLE), -force * cos(ANGLE)]
    assert list(rest.bearing_force.values()) == pytest.approx(expected, rel=1e-9)
    assert [-1e8 * u for u in rest.displacement.values()] == pytest.approx(expected, rel=1e-9)


def test_dimensionless_it_is_the_same() -> None:
    model = driven(clearance=1e-5, faces=8).with_({"simulation.cycles": 3, "simulation.samples_per_cycle": 32})
    scaled = gr.nondimensionalize(model)
    there = scaled.restore(gr.simulate(scaled.model)).trajectory.sideways
    here = gr.simulate(model).trajectory.sideways
    assert here is not None
    assert there is not None
    for name in ("displacement", "velocity", "acceleration", "bearing_force"):
        mine, theirs = getattr(here, name), getattr(there, name)
        assert theirs == pytest.approx(mine, abs=1e-7 * np.abs(mine).max())


NEEDLE = {"shaft": 3.0, "gear": 1.0, "main": 1e8, "needle": 2e8}


def on_its_shaft(
    needle: float = NEEDLE["needle"], *, gravity: dict[str, Any] | None = None, **of_needle: Any
) -> gr.Model:
    """A loose gear on a needle bearing around its shaft, which has a bearing in the housing; they turn freely."""
    tables = {
        "schema": 1,
        "inertia": [
            {"name": "shaft", "J": 0.01, "mass": NEEDLE["shaft"], "drag": 0.1},
            {"name": "gear", "J": 0.002, "mass": NEEDLE["gear"], "drag": 0.1},
        ],
        "bearing": [
            {"name": "main", "on": "shaft", "stiffness": NEEDLE["main"], "damping": 2000.0},
            {"name": "needle", "on": "gear", "around": "shaft", "stiffness": needle, "damping": 500.0, **of_needle},
        ],
        "excitation": {"speed": 100.0},
    }
    return gr.Model.from_tables({**tables, "gravity": gravity} if gravity else tables)


def test_a_gear_on_its_shaft_has_the_frequencies_of_two_masses() -> None:
    """m1 m2 w^4 - (m1 k2 + m2 (k1 + k2)) w^2 + k1 k2 = 0, in either direction."""
    m1, m2, k1, k2 = NEEDLE.values()
    squares = np.roots([m1 * m2, -(m1 * k2 + m2 * (k1 + k2)), k1 * k2])
    expected = np.repeat(np.sort(np.sqrt(squares)), 2)
    assert gr.modes(on_its_shaft()).frequencies[2:] == pytest.approx(expected, rel=1e-10)


def test_a_gear_held_stiffly_on_its_shaft_is_one_body_with_it() -> None:
    m1, m2, k1, _ = NEEDLE.values()
    off = []
    for needle in (1e12, 1e13):
        lowest = gr.modes(on_its_shaft(needle)).frequencies[2:4]
        off.append(float(np.max(np.abs(lowest / np.sqrt(k1 / (m1 + m2)) - 1.0))))
    assert off[1] < 1e-5
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.02)


def with_a_loose_gear(**of_needle: Any) -> gr.Model:
    """The driven pair with the wheel on a needle bearing around a shaft of its own."""
    tables = driven().to_tables()
    tables["inertia"].append({"name": "shaft", "J": 0.002, "mass": 2.0, "drag": 0.05})
    tables["bearing"][1] |= {"around": "shaft", **of_needle}
    tables["bearing"].append({"name": "at_shaft", "on": "shaft", "stiffness": 1e8, "damping": 2000.0})
    return gr.Model.from_tables(tables)


@pytest.mark.parametrize("of_needle", [{}, {"clearance": 1e-5, "faces": 12}])
def test_energy_and_momentum_balance_around_a_shaft_too(of_needle: dict[str, Any]) -> None:
    """The casing takes the forces of bearings in the housing alone, which is what the bodies' momentum lacks."""
    run = gr.simulate(with_a_loose_gear(**of_needle), cycles=4, discard=1, samples_per_cycle=64)
    t = run.trajectory
    assert run.cost.energy_residual is not None
    assert run.cost.energy_residual < 1e-9
    assert t.sideways is not None
    momentum = t.sideways.acceleration * t.layout.direction_mass
    gained = np.stack([momentum[:, axis::2].sum(axis=1) for axis in (0, 1)], axis=1)
    force = t.sideways.casing_force
    assert gained == pytest.approx(-force, abs=1e-9 * np.abs(force).max())
    by_name = dict(zip(t.layout.bearing_names, t.sideways.bearing_force.T, strict=True))
    assert force[:, 0] == pytest.approx(-by_name["at_pinion.x"] - by_name["at_shaft.x"], abs=1e-9 * np.abs(force).max())


def test_a_shaft_held_stiffly_leaves_the_gear_on_the_housing() -> None:
    """Around a shaft that hardly moves the gear moves as in the housing, with the same crossings."""
    settings = {"cycles": 4, "discard": 1, "samples_per_cycle": 64}
    here = gr.simulate(driven(clearance=1e-5, faces=8), **settings).trajectory
    tables = with_a_loose_gear(clearance=1e-5, faces=8).to_tables()
    tables["bearing"][0] |= {"clearance": 1e-5, "faces": 8}
    tables["bearing"][2]["stiffness"] = 1e14
    there = gr.simulate(gr.Model.from_tables(tables), **settings).trajectory
    assert here.sideways is not None
    assert there.sideways is not None
    size = np.abs(here.sideways.displacement).max()
    assert there.sideways.displacement[:, :4] == pytest.approx(here.sideways.displacement, abs=1e-3 * size)
    assert len(there.events) == len(here.events) > 0


@pytest.mark.parametrize("angle", [-0.5 * pi, 0.3])
def test_weight_bends_bearings_by_m_g_over_k(angle: float) -> None:
    m1, m2, k1, k2 = NEEDLE.values()
    rest = gr.equilibrium(on_its_shaft(gravity={"direction": angle}))
    shaft = 9.81 * (m1 + m2) / k1
    gear = shaft + 9.81 * m2 / k2
    expected = [shaft * cos(angle), shaft * sin(angle), gear * cos(angle), gear * sin(angle)]
    assert list(rest.displacement.values()) == pytest.approx(expected, rel=1e-9)
    pull = [9.81 * (m1 + m2) * cos(angle), 9.81 * (m1 + m2) * sin(angle)]
    assert list(rest.bearing_force.values())[:2] == pytest.approx([-force for force in pull], rel=1e-9)


@pytest.mark.parametrize("faces", [4, 8, 16])
def test_a_body_with_weight_rests_on_the_bottom_of_its_clearance(faces: int) -> None:
    """There a face lies: C + m g / k below the shaft."""
    m1, m2, k1, k2 = NEEDLE.values()
    rest = gr.equilibrium(on_its_shaft(clearance=2e-5, faces=faces, gravity={"acceleration": "9.81 m/s^2"}))
    below = rest.displacement["gear.y"] - rest.displacement["shaft.y"]
    assert below == pytest.approx(-(2e-5 + 9.81 * m2 / k2), rel=1e-9)
    assert rest.displacement["shaft.y"] == pytest.approx(-9.81 * (m1 + m2) / k1, rel=1e-9)
    assert rest.displacement["gear.x"] == pytest.approx(0.0, abs=1e-12)


def test_a_body_falls_through_its_clearance() -> None:
    """From the centre, around a shaft held stiffly: at t = sqrt(2 C / g) it meets the bottom with sqrt(2 g C)."""
    gap = 5e-4
    model = on_its_shaft(clearance=gap, faces=4, gravity={"direction": "-90 deg"})
    model = model.with_({"bearing.main.stiffness": 1e16, "simulation.initial": "zero"})
    events = gr.simulate(model, cycles=1, discard=0, samples_per_cycle=64).events
    first = events.iloc[0]
    assert first["time"] == pytest.approx(np.sqrt(2.0 * gap / 9.81), rel=1e-6)
    assert abs(first["velocity"]) == pytest.approx(np.sqrt(2.0 * 9.81 * gap), rel=1e-6)


STAR = {"mass": 0.9, "sun": 0.03, "planet": 0.02, "J": 4e-4, "Jp": 5e-5, "k": 8e7, "ring": 6e7}


def star(planets: int = 3, *, turn: float = 0.0, mass: bool = True, **of_set: Any) -> dict[str, Any]:
    """A sun between planets on a carrier that stands still, and a ring that does too."""
    names = [f"p{i}" for i in range(planets)]
    row = {
        "name": "set",
        "sun": "sun",
        "ring": "ground",
        "carrier": "ground",
        "planets": names,
        "radii": {"sun": STAR["sun"], "planet": STAR["planet"], "ring": STAR["sun"] + 2.0 * STAR["planet"]},
        "stiffness": {"sun": STAR["k"], "ring": STAR["ring"]},
        **({"pressure_angle": ANGLE} if mass else {}),
        **({"planet_positions": [turn + 2.0 * pi * i / planets for i in range(planets)]} if turn else {}),
        **of_set,
    }
    bodies = [{"name": "sun", "J": STAR["J"], **({"mass": STAR["mass"]} if mass else {})}]
    bodies += [{"name": name, "J": STAR["Jp"]} for name in names]
    return {"schema": 1, "inertia": bodies, "planetary": [row], "excitation": {"speed": 200.0}}


@pytest.mark.parametrize("turn", [0.0, 0.4])
@pytest.mark.parametrize("planets", [3, 4, 7])
def test_a_floating_sun_has_the_frequencies_of_the_closed_form(planets: int, turn: float) -> None:
    """With N planets evenly around, u and the planets' rotation a n_i.u: twice the roots of a pair of equations,

    m u'' = -N k/2 (u + R_p a), J_p a'' = -R_p k (u + R_p a) - k_r R_p^2 a; all planets alike and the sun: another pair;
    the planets alone N - 3 times sqrt((k + k_r) R_p^2 / J_p).
    """
    k, ring, radius, own = STAR["k"], STAR["ring"], STAR["planet"], STAR["sun"]
    across = np.linalg.eigvals(
        [
            [planets * k / 2.0 / STAR["mass"], planets * k / 2.0 * radius / STAR["mass"]],
            [radius * k / STAR["Jp"], radius**2 * (k + ring) / STAR["Jp"]],
        ]
    )
    turning = np.linalg.eigvals(
        [
            [planets * k * own**2 / STAR["J"], planets * k * own * radius / STAR["J"]],
            [k * own * radius / STAR["Jp"], radius**2 * (k + ring) / STAR["Jp"]],
        ]
    )
    alone = [radius**2 * (k + ring) / STAR["Jp"]] * (planets - 3)
    expected = np.sort(np.sqrt([*across, *across, *turning, *alone]))
    model = gr.Model.from_tables(star(planets, turn=turn))
    assert gr.modes(model).frequencies == pytest.approx(expected, rel=1e-9)


def spinning(*, plain: bool, backlash: float) -> gr.Model:
    """The star driven at its sun, as a set, or as plain gear pairs whose planets count the other way round.

    Its planets stand unevenly, and the sun has a weight.
    """
    positions = [0.1, 2.0, 4.4]
    gaps = {"sun": backlash, "ring": 0.0}
    tables = star(backlash=gaps, damping={"sun": 800.0, "ring": 500.0}, planet_positions=positions)
    tables["gravity"] = {"direction": -1.2}
    tables["inertia"] += [{"name": "motor", "J": 0.002, "drag": 0.05}]
    tables["coupling"] = [{"name": "shaft", "between": ["motor", "sun"], "stiffness": 2e4, "damping": 2.0}]
    tables["bearing"] = [{"name": "soft", "on": "sun", "stiffness": 1e5, "damping": 20.0}]
    tables["torque"] = [{"on": "motor", "mean": 3.0, "harmonics": [{"order": 2, "amplitude": 30.0}]}]
    tables["simulation"] = {"cycles": 4, "discard": 1, "samples_per_cycle": 64}
    if plain:
        (row,) = tables.pop("planetary")
        pair = {"radii": [STAR["sun"], STAR["planet"]], "stiffness": STAR["k"], "damping": 800.0}
        spring = {"stiffness": STAR["ring"] * STAR["planet"] ** 2, "damping": 500.0 * STAR["planet"] ** 2}
        tables["mesh"] = [
            {
                "name": f"m{i}",
                "between": ["sun", planet],
                **pair,
                "backlash": backlash,
                "pressure_angle": ANGLE,
                "centre_line": positions[i],
            }
            for i, planet in enumerate(row["planets"])
        ]
        tables["coupling"] += [{"name": f"r{i}", "between": [f"p{i}", "ground"], **spring} for i in range(3)]
    return gr.Model.from_tables(tables)


@pytest.mark.parametrize("backlash", [0.0, 5e-5])
def test_a_set_with_a_moving_sun_moves_as_its_gear_pairs(backlash: float) -> None:
    one, two = (gr.simulate(spinning(plain=plain, backlash=backlash)) for plain in (False, True))
    assert one.cost.energy_residual is not None
    assert one.cost.energy_residual < 1e-9
    until = min(run.variation.horizon(1e3) for run in (one, two))
    count = int(np.sum(one.trajectory.time < until))
    for mine, theirs in (
        (one.trajectory.sideways.displacement, two.trajectory.sideways.displacement),
        (one.trajectory.velocity[:, [0, 4]], two.trajectory.velocity[:, [0, 4]]),
        (one.trajectory.velocity[:, 1:4], -two.trajectory.velocity[:, 1:4]),
    ):
        assert mine[:count] == pytest.approx(theirs[:count], abs=1e-7 * np.abs(theirs).max())
    assert (len(one.events) > 20) == (backlash > 0.0)


def test_a_floating_sun_shares_its_load_between_planets_that_stand_wrong() -> None:
    """An error of one planet of three: a fixed sun loads them unevenly, one that floats evenly."""
    share = {}
    for mass in (False, True):
        tables = star(mass=mass)
        tables["planetary"][0]["backlash"] = {"sun": 0.0, "ring": 0.0}
        tables["coupling"] = [{"name": "off", "between": ["p0", "ground"], "stiffness": 1e5, "preload": 40.0}]
        tables["torque"] = [{"on": "sun", "mean": 300.0}]
        rest = gr.equilibrium(gr.Model.from_tables(tables))
        force = np.array([rest.deflection[f"set-sun-p{i}"] for i in range(3)]) * STAR["k"]
        assert force.sum() * STAR["sun"] == pytest.approx(300.0, rel=1e-9)
        share[mass] = np.ptp(force) / force.mean()
    assert share[False] > 0.1
    assert share[True] < 1e-9


def test_a_sun_without_a_bearing_floats_and_has_a_verdict() -> None:
    tables = spinning(plain=False, backlash=5e-5).to_tables()
    del tables["bearing"]
    findings = gr.run(gr.Model.from_tables(tables))
    assert {part.kind for part in findings.verdict.parts} == {"mesh"}
    sideways = findings.motion.trajectory.sideways
    assert sideways is not None
    assert 1e-6 < np.abs(sideways.displacement).max() < 1e-3
    assert sideways.bearing_force.shape[1] == 0
