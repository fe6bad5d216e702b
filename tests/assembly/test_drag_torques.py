"""Drag parts in a driveline: against the same driveline written with plain numbers, dampers and torques."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.assembly.drag_torques import drag_torques, viscous_drags
from gearrattle.assembly.scaled import dimensionless
from gearrattle.assembly.variant_assembly import coefficients
from gearrattle.engine.system.characteristic import characteristic
from gearrattle.engine.system.plain_arrays import coefficients_of
from gearrattle.model.drag_points import drag_points
from gearrattle.signals import loose_gears, torque_ratio

OIL = {"type": "70w-75w-gl4", "temperature": "40 degC"}
NEEDLE = {"kind": "needle-bearing", "on": "shaft", "mean_diameter": "45 mm"}
CONE = {"kind": "synchroniser", "on": "shaft", "mean_radius": "30 mm", "length": "8 mm", "gap": "0.1 mm"}
SEAL = {"kind": "shaft-seal", "shaft_diameter": "30 mm"}
CHURNING = {
    "kind": "churning",
    "depth": "30 mm",
    "oil_volume": "1500 cm^3",
    "pitch_diameter": "120 mm",
    "face_width": "20 mm",
    "teeth": 40,
    "tooth_height": "6.75 mm",
}


def tables(parts: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    """A loose gear on the output shaft, driven over a layshaft; it turns slower than its shaft."""
    return {
        "schema": 1,
        "oil": OIL,
        "inertia": [
            {"name": "flywheel", "J": 0.2, "drag": 0.1},
            {"name": "shaft", "J": 0.01},
            {"name": "lay", "J": 0.005, "drag": 0.01},
            {"name": "gear", "J": 0.002, "drag_parts": parts},
        ],
        "coupling": [{"name": "clutch", "between": ["flywheel", "shaft"], "stiffness": 1000.0, "damping": 0.5}],
        "mesh": [
            {"name": "in", "between": ["shaft", "lay"], "radii": [0.03, 0.045], "stiffness": 1e8, "damping": 500.0},
            {
                "name": "idle",
                "between": ["lay", "gear"],
                "radii": [0.05, 0.04],
                "stiffness": 1e8,
                "damping": 500.0,
                "backlash": 1e-4,
            },
        ],
        "excitation": {"speed": "800 rpm"},
        "torque": [{"on": "flywheel", "mean": "balance", "harmonics": [{"order": 2, "amplitude": 60.0}]}],
        "simulation": {"cycles": 12, "discard": 4},
        **more,
    }


def model(parts: list[dict[str, Any]], **more: Any) -> gr.Model:
    return gr.Model.from_tables(tables(parts, **more))


def test_parts_on_the_housing_are_drag_and_drag_torque() -> None:
    by_parts = model([CHURNING, SEAL])
    plain = tables([])
    points = drag_points(by_parts)
    assert [point.speed for point in points] == pytest.approx([800.0 * np.pi / 30.0 * 5.0 / 6.0] * 2)
    gear = plain["inertia"][3]
    del gear["drag_parts"], plain["oil"]
    gear["drag_torque"] = points[0].torque + points[1].torque
    gear["drag"] = points[0].slope + points[1].slope
    one = gr.simulate(by_parts)
    other = gr.simulate(gr.Model.from_tables(plain))
    assert np.array_equal(one.data.angle, other.data.angle)
    assert one.events.equals(other.events)


def test_parts_between_bodies_are_a_damper_and_a_pair_of_torques() -> None:
    """The shaft is faster than the gear: its bearing drives the gear, and brakes the shaft."""
    by_parts = model([NEEDLE, CONE, CHURNING])
    needle, cone, churning = drag_points(by_parts)
    assert needle.speed == cone.speed == pytest.approx(-800.0 * np.pi / 30.0 / 6.0)
    torque = needle.torque + cone.torque
    plain = tables([])
    del plain["inertia"][3]["drag_parts"], plain["oil"]
    plain["inertia"][3] |= {"drag": churning.slope, "drag_torque": churning.torque - torque}
    plain["inertia"][1]["drag_torque"] = torque
    damper = {"name": "bearing", "between": ["gear", "shaft"], "stiffness": 0.0, "damping": needle.slope + cone.slope}
    plain["coupling"].append(damper)
    one = assemble(by_parts).system
    other = assemble(gr.Model.from_tables(plain)).system
    assert one.inputs.mean == pytest.approx(other.inputs.mean, abs=1e-14)
    free = [tuple(len(law.stiffness) // 2 for law in system.laws) for system in (one, other)]
    assert one.damping_of(free[0]) == pytest.approx(other.damping_of(free[1]), abs=1e-14)
    runs = [gr.simulate(driveline) for driveline in (by_parts, gr.Model.from_tables(plain))]
    times = [run.events.time.to_numpy()[:30] for run in runs]
    assert times[0] == pytest.approx(times[1], rel=1e-9)
    assert runs[0].data.element.values.tolist()[-1] == "gear-on-shaft"


def test_a_gear_that_turns_with_its_shaft_has_no_drag_on_it() -> None:
    locked = tables([NEEDLE])
    locked["coupling"].append({"name": "dog", "between": ["gear", "shaft"], "stiffness": 1e4, "damping": 1.0})
    locked["mesh"][1]["radii"] = [0.045, 0.03]
    (point,) = drag_points(gr.Model.from_tables(locked))
    assert (point.torque, point.slope) == (0.0, 0.0)
    assert drag_torques(gr.Model.from_tables(locked)) == (0.0, 0.0, 0.0, 0.0)


def test_a_shaft_whose_speed_nothing_settles_is_refused_unless_it_is_given() -> None:
    apart = tables([{**NEEDLE, "on": "output"}])
    apart["inertia"].append({"name": "output", "J": 0.01})
    with pytest.raises(gr.ModelError, match="do not settle the mean speed of output"):
        assemble(gr.Model.from_tables(apart))
    apart["inertia"][3]["drag_parts"][0]["relative_speed"] = "400 rpm"
    (point,) = drag_points(gr.Model.from_tables(apart))
    assert point.speed == pytest.approx(400.0 * np.pi / 30.0)


def test_warm_oil_drags_less() -> None:
    cold, warm = (drag_torques(model([CHURNING], oil={**OIL, "temperature": t}))[3] for t in (-20.0, 40.0))
    assert cold > 1.5 * warm


def test_along_a_sweep_the_torques_are_tables() -> None:
    swept = model([NEEDLE, CHURNING], excitation={"sweep": {"from": "600 rpm", "to": "1200 rpm", "over": "0.5 s"}})
    torques = drag_torques(swept)
    for rpm in (600.0, 787.5, 1200.0):
        speed = rpm * np.pi / 30.0
        still = drag_torques(model([NEEDLE, CHURNING], excitation={"speed": speed}))
        at = [torque.at(speed) if hasattr(torque, "at") else torque for torque in torques]
        assert at == pytest.approx(still, rel=1e-12)
    between = drag_torques(model([NEEDLE, CHURNING], excitation={"speed": "795 rpm"}))
    assert torques[3].at(795 * np.pi / 30.0) == pytest.approx(between[3], rel=1e-3)  # type: ignore[attr-defined]
    assert len(gr.simulate(swept).events) > 10


def test_a_table_of_the_file_and_parts_add_up_along_a_sweep() -> None:
    both = tables([CHURNING], excitation={"sweep": {"from": "600 rpm", "to": "1200 rpm", "over": "0.5 s"}})
    both["inertia"][3]["drag_torque"] = {"speed": ["500 rpm", "900 rpm", "1300 rpm"], "value": [0.1, 0.2, 0.4]}
    total = drag_torques(gr.Model.from_tables(both))[3]
    parts = drag_torques(model([CHURNING], excitation={"speed": "1000 rpm"}))[3]
    assert total.at(1000 * np.pi / 30.0) == pytest.approx(parts + 0.25, rel=1e-3)  # type: ignore[attr-defined]


def test_without_dimensions_the_motion_is_the_same() -> None:
    by_parts = model([NEEDLE, CHURNING])
    driveline = assemble(by_parts)
    scales = characteristic(driveline.system, driveline.layout.is_mesh, driveline.layout.omega, 1e-4, 0.04)
    plain = dimensionless(by_parts, scales)
    assert plain["inertia.gear.drag_parts"][0].kind == "constant"
    times = [gr.simulate(one).events.time.to_numpy()[:30] for one in (by_parts, plain)]
    assert times[0] == pytest.approx(times[1] * scales.units()["time"], rel=1e-9)
    assert drag_torques(plain)[1] == pytest.approx(drag_torques(by_parts)[1] / scales.units()["torque"])


def test_variants_in_one_loop_have_the_bits_of_single_runs() -> None:
    by_parts = model([NEEDLE, CHURNING])
    axes = {"torque.0.harmonics.0.amplitude": [40.0, 50.0, 60.0], "oil.temperature": [20.0, 80.0]}
    outputs = ["impacts per cycle", "largest impact energy"]
    data = gr.study(by_parts, axes, outputs, scheduler="threads")
    for i, amplitude in enumerate(axes["torque.0.harmonics.0.amplitude"]):
        for j, temperature in enumerate(axes["oil.temperature"]):
            changes = {"torque.0.harmonics.0.amplitude": amplitude, "oil.temperature": temperature}
            verdict = gr.run(by_parts.with_(changes)).verdict
            assert data["largest impact energy"].values[i, j, 0] == verdict["idle"].max_impact_energy


@pytest.mark.parametrize("parts", [[NEEDLE, CHURNING], [CHURNING, SEAL], [NEEDLE, CONE]])
def test_a_smaller_model_needs_the_same_torque_to_balance(parts: list[dict[str, Any]]) -> None:
    by_parts = model(parts)
    smaller = gr.reduce(by_parts, "200 Hz", limit=0.5).model
    assert len(smaller.inertias) < len(by_parts.inertias)
    assert gr.equilibrium(smaller).balance == pytest.approx(gr.equilibrium(by_parts).balance, rel=1e-12)


@pytest.mark.parametrize("part", [{"slope": -0.2}, {"relative_speed": -80.0}, {"slope": -0.2, "relative_speed": -80.0}])
def test_drag_that_is_negative_in_all_survives_a_reduction(part: dict[str, Any]) -> None:
    """A torque that falls, or drives, more than everything else of its group drags."""
    tables = {
        "schema": 1,
        "inertia": [
            {"name": "engine", "J": 0.1, "drag": 0.05, "drag_torque": 0.5},
            {"name": "hub", "J": 0.01},
            {"name": "gear", "J": 0.002, "drag_parts": [{"kind": "constant", "torque": 3.0, **part}]},
        ],
        "coupling": [{"name": "shaft", "between": ["engine", "hub"], "stiffness": 1e3, "damping": 0.1}],
        "mesh": [{"name": "mesh", "between": ["hub", "gear"], "radii": [0.04, 0.05], "stiffness": 1e9, "damping": 1e2}],
        "excitation": {"speed": 100.0},
        "torque": [{"on": "engine", "mean": "balance", "harmonics": [{"order": 2, "amplitude": 5.0}]}],
    }
    whole = gr.Model.from_tables(tables)
    smaller = gr.reduce(whole, "25 Hz", limit=0.5).model
    assert [inertia.name for inertia in smaller.inertias] == ["engine", "hub"]
    assert gr.equilibrium(smaller).balance == pytest.approx(gr.equilibrium(whole).balance, rel=1e-12)
    assert viscous_drags(smaller)[1] == pytest.approx(0.64 * viscous_drags(whole)[2], rel=1e-12)
    one, other = (
        gr.simulate(m, cycles=6, discard=1, initial="static").data["velocity"].sel(inertia="hub").values
        for m in (whole, smaller)
    )
    assert np.max(np.abs(one - other)) < 1e-4 * np.max(np.abs(one))


def test_a_gear_that_its_shaft_drives_is_loose_all_the_same() -> None:
    """The bearing presses the gear onto its other flank, with as much torque."""
    driven = model([NEEDLE])
    layout = assemble(driven).layout
    assert layout.drag_torque[3] < 0.0
    (gear,) = loose_gears(layout)
    assert layout.inertia_names[gear.loose] == "gear"
    ratio = torque_ratio(layout, gear, 100.0)
    assert ratio == pytest.approx(0.002 * gear.reduction * 100.0 / -layout.drag_torque[3])
    assert torque_ratio(layout, gear, 100.0, float(layout.drag_torque[3])) == ratio
    assert layout.largest_drag_torque(3) == -layout.drag_torque[3]


def test_a_drag_that_falls_with_speed_has_its_form_without_dimensions() -> None:
    falling = {"kind": "measured", "speed": ["600 rpm", "720 rpm"], "torque": [["0.2 N*m", "0.1 N*m"]]}
    by_parts = model([falling])
    assert drag_points(by_parts)[0].slope < 0.0
    plain = gr.nondimensionalize(by_parts).model
    assert plain["inertia.gear.drag_parts"][0].slope < 0.0
    assert drag_points(plain)[0].slope == plain["inertia.gear.drag_parts"][0].slope


def test_a_fluctuation_beyond_a_measured_table_leaves_the_page() -> None:
    from gearrattle.report.drag_table import drag_table, straight_line_error

    narrow = model([{"kind": "measured", "speed": ["660 rpm", "670 rpm"], "torque": [["0.1 N*m", "0.2 N*m"]]}])
    trajectory = gr.simulate(narrow).trajectory
    assert np.isnan(straight_line_error(narrow, drag_points(narrow)[0], trajectory))
    table = drag_table(narrow, trajectory)
    assert table is not None
    assert "beyond the measured speeds" in table.rows[0]


def test_a_name_that_the_element_of_a_drag_part_has_is_refused() -> None:
    taken = tables([NEEDLE])
    taken["coupling"].append({"name": "gear-on-shaft", "between": ["lay", "ground"], "stiffness": 1.0})
    with pytest.raises(gr.ModelError, match=r"its drag is the element gear-on-shaft, and coupling\.1 has this name"):
        gr.Model.from_tables(taken)
    assert gr.Model.from_tables(tables([NEEDLE, CONE])).elements[-1].name == "gear-on-shaft"


def test_a_proof_over_the_speed_is_refused() -> None:
    with pytest.raises(gr.ModelError, match="drag parts or tables over the speed"):
        gr.prove_quiet(model([NEEDLE, CHURNING]), {"excitation.speed": ("700 rpm", "900 rpm")})


def test_the_page_of_a_run_has_the_drag_by_part() -> None:
    from gearrattle.report.drag_table import drag_table

    findings = gr.run(model([NEEDLE, CHURNING, SEAL]))
    table = drag_table(findings.model, findings.motion.trajectory)
    assert table is not None
    words = [row[:3] for row in table.rows]
    assert words == [
        ("gear", "needle bearing", "shaft"),
        ("", "churning", "housing"),
        ("", "shaft seal", "housing"),
        ("", "sum", ""),
    ]
    assert "30.8 mm²/s" in table.title
    notes = " ".join(findings.motion.notes)
    assert "shaft is faster, and drives it" in notes
    assert "coefficients unchecked" in notes


def test_the_error_of_the_straight_line_is_that_of_the_law_over_the_fluctuation() -> None:
    from gearrattle.report.drag_table import straight_line_error

    swinging = model([NEEDLE, CHURNING])
    trajectory = gr.simulate(swinging).trajectory
    needle, churning = drag_points(swinging)
    for point, on in ((needle, 1), (churning, None)):
        swing = trajectory.velocity[trajectory.discard * trajectory.samples_per_cycle :, 3]
        swing = (
            swing
            if on is None
            else swing - trajectory.velocity[trajectory.discard * trajectory.samples_per_cycle :, on]
        )
        laws = [point.part.at(abs(point.speed + delta), swinging.oil).torque for delta in swing.tolist()]
        lines = point.torque + point.slope * np.sign(point.speed) * swing
        error = np.max(np.abs(laws - lines)) / point.torque
        actual = straight_line_error(swinging, point, trajectory)
        assert actual == pytest.approx(error, rel=0.05, abs=1e-6)
    shaken = model(
        [NEEDLE], torque=[{"on": "flywheel", "mean": "balance", "harmonics": [{"order": 1, "amplitude": 3e3}]}]
    )
    assert straight_line_error(shaken, drag_points(shaken)[0], gr.simulate(shaken).trajectory) == float("inf")


@pytest.mark.parametrize(
    ("path", "values"),
    [
        ("oil.temperature", [-20.0, 10.0, 40.0, 70.0, 100.0]),
        ("excitation.speed", [60.0, 75.0, 83.7, 90.0, 130.0]),
        ("mesh.idle.backlash", [5e-5, 8e-5, 1e-4, 1.5e-4, 2e-4]),
        ("inertia.gear.drag_torque", [0.0, 0.1, 0.2, 0.3, 0.4]),
    ],
)
def test_columns_of_variants_have_the_bits_of_single_assembly(path: str, values: list[float]) -> None:
    by_parts = model([NEEDLE, CONE, CHURNING, SEAL])
    numbers, good = coefficients(by_parts, {path: np.array(values)}, len(values))
    assert good.all()
    for v, value in enumerate(values):
        single = coefficients_of(assemble(by_parts.with_({path: value})).system)
        for name in ("inertia", "drag", "mean"):
            assert np.array_equal(getattr(numbers, name)[v], getattr(single, name)), name
        assert np.array_equal(numbers.laws.damping[v], single.laws.damping)


def test_variants_of_an_oil_that_is_none_go_by_themselves() -> None:
    temperatures = np.array([20.0, 400.0, 40.0, -300.0])
    good = coefficients(model([NEEDLE]), {"oil.temperature": temperatures}, 4)[1]
    assert good.tolist() == [True, False, True, False]
    measured = {"kind": "measured", "speed": [1.0, 100.0], "temperature": [20.0, 60.0], "torque": [[0.1, 0.2]] * 2}
    good = coefficients(model([measured]), {"oil.temperature": np.array([10.0, 30.0, 60.0, 61.0])}, 4)[1]
    assert good.tolist() == [False, True, True, False]
