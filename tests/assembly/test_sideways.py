"""Sideways motion in results: displacements are never angles, forces of bearings are what the laws say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.assembly.variant_assembly import coefficients
from gearrattle.engine.system.plain_arrays import coefficients_of
from gearrattle.signals import loose_gears, reduced_inertia
from tests.laws.test_sideways import ANGLE, driven


@pytest.fixture(scope="module")
def run() -> gr.Run:
    model = driven(clearance=1e-5, faces=4)
    return gr.simulate(model, cycles=4, discard=2, samples_per_cycle=64)


def test_displacements_are_variables_of_their_own_in_metres(run: gr.Run) -> None:
    data = run.data
    assert data["angle"].dims == ("time", "inertia")
    assert list(data["inertia"].values) == ["motor", "pinion", "wheel", "load"]
    assert data["displacement"].dims == ("time", "body_direction")
    assert list(data["body_direction"].values) == ["pinion.x", "pinion.y", "wheel.x", "wheel.y"]
    units = {name: data[name].attrs["units"] for name in data if "displacement" in name or "force" in name}
    assert units == {
        "force": "N m, or N for a mesh",
        "displacement": "m",
        "displacement_velocity": "m/s",
        "displacement_acceleration": "m/s^2",
        "bearing_force": "N",
        "casing_force": "N",
    }
    assert not any("rad" in str(v.attrs.get("units")) for v in data.values() if "body_direction" in v.dims)


def test_files_bring_them_back(run: gr.Run, tmp_path: Path) -> None:
    run.save(tmp_path / "run.nc")
    back = gr.open_run(tmp_path / "run.nc").trajectory.sideways
    own = run.trajectory.sideways
    assert back is not None
    assert own is not None
    for name in vars(own):
        np.testing.assert_array_equal(getattr(back, name), getattr(own, name))
    run.save(tmp_path / "run.csv")
    head = (tmp_path / "run.csv").read_text(encoding="utf-8").partition("\n")[0].split(",")
    assert {"displacement.wheel.y", "bearing_force.at_wheel.x", "casing_force.y"} <= set(head)
    assert "angle.wheel.y" not in head
    elements = run.to_dataframe("elements")
    assert elements["bearing_force.at_pinion.x"].to_numpy() == pytest.approx(own.bearing_force[:, 0])


def test_the_force_of_a_bearing_is_that_of_its_law(run: gr.Run) -> None:
    sideways = run.trajectory.sideways
    assert sideways is not None
    u, v = sideways.displacement, sideways.velocity
    deep = np.sign(u) * np.maximum(np.abs(u) - 1e-5, 0.0)
    expected = -(1e8 * deep + 2000.0 * np.where(np.abs(u) > 1e-5, v, 0.0))
    assert sideways.bearing_force == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_exact_statistics_know_the_forces_of_bearings(run: gr.Run) -> None:
    """Extremes lie at or beyond those of many samples, and the means add up to none at the two bearings."""
    t = run.trajectory
    assert t.exact is not None
    signals = [("force", name) for name in t.layout.bearing_names]
    exact = t.exact.statistics(t, signals)
    fine = gr.simulate(run.model, samples_per_cycle=2048).trajectory
    assert exact is not None
    assert fine.sideways is not None
    force = fine.sideways.bearing_force[2 * 2048 :]
    size = np.abs(force).max(axis=0)
    assert np.all(exact.high >= force.max(axis=0) - 1e-9 * size)
    assert np.all(exact.low <= force.min(axis=0) + 1e-9 * size)
    assert exact.high == pytest.approx(force.max(axis=0), abs=0.02 * size.max())
    by_name = gr.metrics(run)
    shown = by_name[by_name["quantity"] == "force standard deviation"]["subject"].tolist()
    assert set(t.layout.bearing_names) < set(shown)


def test_spectra_take_bearings_and_the_casing(run: gr.Run) -> None:
    for channel, unit in (("bearing_force.at_wheel.x", "N"), ("casing_force.y", "N"), ("displacement.wheel.x", "m")):
        assert gr.spectra(run, channel).attrs["units"] == unit


def test_orders_take_the_casing(run: gr.Run) -> None:
    cuts = gr.spectral.order_cuts(gr.simulate(run.model, cycles=20, discard=4), "casing_force.x", [2.0], turns=2)
    assert cuts.attrs["units"] == "N"
    assert (cuts["amplitude"].values > 0.0).all()


def test_the_force_on_the_casing_has_rms_and_peak_whatever_the_axes(run: gr.Run) -> None:
    """Against many samples, and the same for a driveline turned by 40 degrees; between samples both are exact."""

    def of(one: gr.Run) -> dict[str, float]:
        table = gr.metrics(one, names=["force_statistics"])
        casing = table[table["subject"] == "casing"]
        assert (casing["error"] == 0.0).all()
        return dict(zip(casing["quantity"], casing["value"], strict=True))

    own = of(run)
    fine = gr.simulate(run.model, samples_per_cycle=4096).trajectory
    assert fine.sideways is not None
    force = fine.sideways.casing_force[2 * 4096 : -1]
    length = np.hypot(*(force - force.mean(axis=0)).T)
    assert own["rms casing force"] == pytest.approx(np.sqrt(np.mean(length**2)), rel=1e-3)
    assert own["peak casing force"] >= length.max() * (1.0 - 3e-4)
    assert own["peak casing force"] == pytest.approx(length.max(), rel=0.01)
    plain, turned = (of(gr.simulate(driven(turn), cycles=4, discard=2)) for turn in (0.0, np.radians(40.0)))
    assert turned["rms casing force"] == pytest.approx(plain["rms casing force"], rel=1e-6)
    assert turned["peak casing force"] == pytest.approx(plain["peak casing force"], rel=4e-4)


def test_chunks_know_the_rms_on_the_casing_and_not_its_peak() -> None:
    model = driven()
    whole = gr.metrics(gr.simulate(model, cycles=8, discard=2), names=["force_statistics"])
    parts = gr.metrics(gr.stream(model, cycles=8, discard=2, chunk=2), names=["force_statistics"])
    (one, peak), (other, missing) = (table[table["subject"] == "casing"]["value"].tolist() for table in (whole, parts))
    assert other == pytest.approx(one, rel=1e-6)
    assert np.isfinite(peak)
    assert np.isnan(missing)


def test_a_target_is_a_force_on_the_casing_in_newtons() -> None:
    """The threshold of the torque at which the rms passes its limit, by runs on both of its sides."""
    model = driven(clearance=0.0).with_({"simulation.cycles": 20, "simulation.discard": 10})
    path = "torque.0.harmonics.0.amplitude"
    answer = gr.threshold(model, path, (2.0, 12.0), until="rms casing force < 20 N", count=3, width=0.1, workers=1)
    assert answer.bracket is not None
    sides = []
    for value in answer.bracket:
        table = gr.metrics(gr.simulate(model.with_({path: value})), names=["force_statistics"])
        sides.append(float(table[table["quantity"] == "rms casing force"]["value"].iloc[0]))
    assert sides[0] < 20.0 < sides[1]


def test_an_impact_moves_the_mass_too() -> None:
    """1/m_e = R1^2/J1 + R2^2/J2 + 1/m1 + 1/m2; without masses the last two are missing."""
    held, fixed = (assemble(driven(masses=masses)).layout for masses in (True, False))
    r1, r2 = 0.02819 * np.cos(ANGLE), 0.05638 * np.cos(ANGLE)
    turning = r1**2 / 0.00027 + r2**2 / 0.0027
    assert reduced_inertia(held, held.element_names.index("gear-drive")) == pytest.approx(
        1.0 / (turning + 1.0 / 0.6 + 1.0 / 1.5)
    )
    assert reduced_inertia(held, 2) == pytest.approx(0.16745, abs=5e-6)
    assert reduced_inertia(fixed, 2) == pytest.approx(0.27484, abs=5e-6)


def test_a_loose_gear_is_loose_with_two_flanks() -> None:
    model = gr.example("bearing_clearance")
    gears = loose_gears(assemble(model).layout)
    names = assemble(model).layout.element_names
    assert [(names[gear.mesh], gear.reduction) for gear in gears] == [("gear-drive", pytest.approx(0.5))]


def test_columns_of_variants_are_those_of_every_variant() -> None:
    model = gr.Model.from_tables(driven().to_tables() | {"gravity": {"direction": -1.2}})
    for path, values in {
        "mesh.gear.backlash": [6e-5, 5e-5],
        "inertia.motor.J": [0.0043, 0.004],
        "inertia.pinion.mass": [0.6, 0.7],
        "bearing.at_wheel.stiffness": [1e8, 2e8],
        "gravity.direction": [-1.2, -1.3],
    }.items():
        columns, good = coefficients(model, {path: np.array(values)}, 2)
        for v in np.flatnonzero(good).tolist():
            alone = coefficients_of(assemble(model.with_({path: values[v]})).system)
            np.testing.assert_array_equal(columns.inertia[v], alone.inertia)
            np.testing.assert_array_equal(columns.mean[v], alone.mean)
            np.testing.assert_array_equal(columns.laws.stiffness[v], alone.laws.stiffness)
            np.testing.assert_array_equal(columns.laws.upper[v], alone.laws.upper)
        assert good.all() == path.startswith(("mesh", "inertia.motor"))


@pytest.mark.parametrize("path", ["inertia.pinion.mass", "mesh.gear.stiffness"])
def test_a_study_gives_what_single_runs_give(path: str, tmp_path: Path) -> None:
    model = driven().with_({"simulation.cycles": 6, "simulation.discard": 3, "simulation.samples_per_cycle": 64})
    values = [1.0 * float(model[path]), 1.3 * float(model[path])]
    study = gr.study(model, {path: values}, workers=1, output=tmp_path / "study")
    for index, value in enumerate(values):
        alone = gr.criteria(gr.simulate(model.with_({path: value})))
        share = float(study["impacts per cycle"].sel(part="gear-drive").values[index])
        assert share == pytest.approx(alone["gear-drive"].impacts_per_cycle)


def test_a_study_has_statistics_of_bearing_forces(tmp_path: Path) -> None:
    model = driven().with_({"simulation.cycles": 4, "simulation.discard": 2, "simulation.samples_per_cycle": 64})
    name = "force standard deviation"
    study = gr.study(model, {"mesh.gear.stiffness": [1e8, 2e8]}, outputs=[name], workers=1, output=tmp_path / "study")
    alone = gr.metrics(gr.simulate(model.with_({"mesh.gear.stiffness": 1e8})))
    row = alone[(alone["quantity"] == name) & (alone["subject"] == "at_wheel.y")]
    value = float(study[name].sel(part="at_wheel.y").values[0])
    assert value == pytest.approx(float(row["value"].iloc[0]), rel=1e-9)


def extended(**of_bearings: object) -> gr.Model:
    """The driven pair with a stiff shaft of three massless bodies before its motor."""
    tables = driven(**of_bearings).to_tables()
    tables["inertia"] += [{"name": "flywheel", "J": 0.001}, {"name": "disc", "J": 0.0005}]
    stiff = {"stiffness": 1e8, "damping": 1.0}
    tables["coupling"] += [
        {"name": "one", "between": ["flywheel", "disc"], **stiff},
        {"name": "two", "between": ["disc", "motor"], **stiff},
    ]
    tables["simulation"] = {"cycles": 8, "discard": 4, "samples_per_cycle": 64}
    return gr.Model.from_tables(tables)


@pytest.mark.parametrize("of_bearings", [{}, {"clearance": 1e-5, "faces": 4}])
def test_bodies_without_a_mass_are_lumped_and_those_with_one_stay(of_bearings: dict[str, object]) -> None:
    model = extended(**of_bearings)
    reduction = gr.reduce(model, "2 kHz")
    smaller = reduction.model
    assert [body.name for body in smaller.inertias] == ["motor", "pinion", "wheel", "load"]
    assert sum(body.J for body in smaller.inertias) == pytest.approx(sum(body.J for body in model.inertias))
    assert [body.mass for body in smaller.inertias] == [None, 0.6, 1.5, None]
    assert smaller.bearings == model.bearings
    assert reduction.elements["input"].reason == "is at a body that moves sideways, which stays a body of its own"
    assert {reduction.elements[name].merged for name in ("one", "two")} == {True}
    # frequencies in the band, and the motion
    full = gr.modes(model).frequencies
    small = gr.modes(smaller).frequencies
    inside = full[full < 2.0 * np.pi * 2000.0]
    assert small[: inside.size] == pytest.approx(inside, rel=1e-3)
    one, two = (gr.criteria(gr.simulate(variant)) for variant in (model, smaller))
    assert two["gear-drive"].max_impact_energy == pytest.approx(one["gear-drive"].max_impact_energy, rel=0.02)


def test_lumping_a_body_with_a_mass_says_why_not() -> None:
    with pytest.raises(gr.ModelError, match=r"input.*is at a body that moves sideways, which stays a body of its own"):
        gr.reduce(extended(), "2 kHz", merge=["input"])


def test_lumping_keeps_displacements_of_the_start() -> None:
    start = {"angle": [0.0] * 6, "velocity": [0.0] * 6, "displacement": [1e-6, 2e-6, 3e-6, 4e-6]}
    model = extended().with_({"simulation.initial": start})
    initial = gr.reduce(model, "2 kHz").model.simulation.to_plain()["initial"]
    assert initial["displacement"] == start["displacement"]
    assert len(initial["angle"]) == 4


@pytest.mark.parametrize("method", ["craig-bampton", "modal", "lumping"])
def test_condensing_takes_displacements_as_coordinates(method: str) -> None:
    model = extended(clearance=1e-5, faces=4)
    small = gr.condense(model, "1 kHz", method=method)
    full = gr.modes(model).frequencies
    inside = full[full < 2.0 * np.pi * 1000.0]
    assert small.frequencies()[: inside.size] == pytest.approx(inside, rel=0.05)
    assert {"pinion.x", "wheel.y"} <= set(small.inertia_names)


def falling(**changes: object) -> gr.Model:
    """A body in a housing with clearance, pulled down, that a torque does not touch."""
    tables = {
        "schema": 1,
        "inertia": [{"name": "gear", "J": 0.002, "mass": 1.0, "drag": 0.1}],
        "bearing": [
            {"name": "needles", "on": "gear", "stiffness": 1e7, "damping": 200.0, "clearance": 5e-4, "faces": 8}
        ],
        "gravity": {},
        "excitation": {"speed": 30.0},
        "simulation": {"cycles": 8, "discard": 0, "initial": "zero"},
    }
    return gr.Model.from_tables({**tables, **changes})


def test_the_verdict_has_one_row_a_bearing() -> None:
    """A body that falls on the bottom bounces there: one side, impacts of one face, and sqrt(2 g C) the hardest."""
    run = gr.simulate(falling())
    verdict = gr.criteria(run)
    assert [(part.name, part.kind, part.gap) for part in verdict.parts] == [("needles", "bearing", True)]
    part = verdict["needles"]
    assert (part.regime, part.severity) == ("single-sided", "rattles")
    assert part.max_approach_speed == pytest.approx(np.sqrt(2.0 * 9.81 * 5e-4), rel=1e-9)
    assert part.max_impact_energy == pytest.approx(9.81 * 5e-4, rel=1e-9)
    assert part.impacts_per_cycle * 8 == (run.events["to_region"].abs() > run.events["from_region"].abs()).sum()
    assert part.mean_contact_impulse is None
    assert "needles hits one side only" in verdict.sentence
    subjects = set(gr.metrics(run)["subject"]) | {entry.subject for entry in verdict.entries}
    assert "needles" in subjects
    assert not any(subject.startswith("needles-") for subject in subjects)


def test_a_body_that_rolls_round_without_letting_go_is_quiet() -> None:
    """It leaves face after face, and at least one stays in contact: pressed outward, it runs round the ring."""
    gap = 1e-4
    deep = 3.0 * gap
    rate = 1e7 * (deep - gap) / deep  # of a spring that turns
    whirl = np.sqrt(rate)
    state = {"displacement": [deep, 0.0], "displacement_velocity": [0.0, deep * whirl]}
    bearing = {"name": "needles", "on": "gear", "stiffness": 1e7, "clearance": gap, "faces": 16}
    start = {"initial": {"angle": [0.0], "velocity": [0.0], **state}}
    settings = {"cycles": 1, "discard": 0, **start}
    model = falling(gravity={"acceleration": 1e-9}, bearing=[bearing], simulation=settings)
    run = gr.simulate(model)
    assert run.trajectory.sideways is not None
    angle = np.unwrap(np.arctan2(*run.trajectory.sideways.displacement.T[::-1]))
    assert angle[-1] > 6.0 * np.pi
    assert len(run.events) > 100
    part = gr.criteria(run)["needles"]
    assert (part.regime, part.impacts_per_cycle, part.contact_share) == ("quiet", 0.0, 1.0)


def test_a_body_thrown_across_its_clearance_is_double_sided() -> None:
    start = {"angle": [0.0], "velocity": [0.0], "displacement": [0.0, 0.0], "displacement_velocity": [0.02, 0.3]}
    bearing = {"name": "needles", "on": "gear", "stiffness": 1e7, "clearance": 1e-4, "faces": 16}
    settings = {"cycles": 1, "discard": 0, "initial": start}
    verdict = gr.criteria(gr.simulate(falling(gravity={"acceleration": 1e-9}, bearing=[bearing], simulation=settings)))
    assert verdict["needles"].regime == "double-sided"
    assert "needles hits opposite sides" in verdict.sentence


def test_chunks_and_studies_judge_the_bearing_as_a_run_does(tmp_path: Path) -> None:
    model = driven(clearance=1e-5, faces=8).with_({"simulation.cycles": 6, "simulation.discard": 2})
    part = gr.criteria(gr.simulate(model))["at_wheel"]
    chunked = gr.criteria(gr.stream(model, chunk=2))["at_wheel"]
    numbers = {"impacts_per_cycle", "max_impact_energy", "mean_exchanged_momentum", "contact_share"}
    for name in numbers:
        assert getattr(chunked, name) == pytest.approx(getattr(part, name), rel=1e-9), name
    assert chunked.regime == part.regime
    outputs = ["impacts per cycle", "regime", "contact share", "mean restitution"]
    study = gr.study(model, {"mesh.gear.stiffness": [2e8, 1e8]}, outputs=outputs, workers=1, output=tmp_path / "study")
    of_wheel = study.sel(part="at_wheel").isel({"mesh.gear.stiffness": 0})
    assert float(of_wheel["impacts per cycle"]) == pytest.approx(part.impacts_per_cycle)
    assert float(of_wheel["contact share"]) == pytest.approx(part.contact_share)
    assert not any(str(name).startswith("at_wheel-") for name in study["part"].values)
