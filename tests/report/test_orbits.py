"""Pages of periodic motions: what they say is what the motions are."""

from __future__ import annotations

import re
from cmath import phase
from dataclasses import replace
from itertools import pairwise
from math import degrees, log
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.orbits import Branch, Orbit, PeriodicMotions
from gearrattle.orbits.stability_ranges import courses_of, losses_of, ranges_of
from gearrattle.report.moving_table import moving_table
from gearrattle.report.orbit_tables import impacts_of, lasting
from gearrattle.report.plots.branches_figure import EVENTS
from gearrattle.report.result_kinds import presentation_of
from tests.orbits.test_run_ups import oscillator as run_up_oscillator
from tests.report.examples import result

LIMIT = 6.053190
"""Amplitude at which the flanks of the oscillator first part (see its file)."""


@pytest.fixture(scope="module")
def orbit() -> Orbit:
    return result("periodic motion")


@pytest.fixture(scope="module")
def branch() -> Branch:
    return result("branches")


def chart(of: Any, key: str) -> Any:
    return next(chart for chart in presentation_of(of).charts() if chart.key == key)


def test_the_sentence_tells_period_stability_rattle_and_multiplier(orbit: Orbit) -> None:
    assert orbit.sentence == (
        "A stable motion that repeats after 1 T (1): double-sided rattle; "
        "the largest multiplier has the modulus 0.7408."
    )
    unstable = result("periodic motions").orbits[1]
    assert unstable.sentence.startswith("An unstable motion that repeats after 1 T (1): single-sided rattle")


def test_the_ends_of_a_narrow_range_are_told_apart() -> None:
    branch = gr.continuation(gr.example("backlash_oscillator"), "excitation.frequency", (0.6, 0.600004))
    ends = re.findall(r"from ([\d.]*\d) to ([\d.]*\d)", branch.sentence)
    assert ends == [("0.6", "0.600004")]
    (row,) = presentation_of(branch).tables()[0].rows
    assert row[2:4] == ("0.6", "0.600004")


def test_the_sentence_tells_where_no_branch_leads() -> None:
    """The branch turns back at its fold, and nothing is known of the rest of the range."""
    branch = gr.continuation(gr.example("driveline_lash"), "excitation.frequency", ("0.5 Hz", "0.65 Hz"))
    assert branch.sentence.endswith("No branch leads through the range from 0.5093 to 0.65 Hz.")


def test_doublings_whose_motions_are_not_followed_are_told() -> None:
    model = gr.example("driveline_lash").with_({"simulation.initial": "static"})
    branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", (600.0, 670.0))
    doublings = branch.events[branch.events["kind"] == "period doubling"]
    own = doublings[doublings["branch"] == 1]["value"]
    assert len(own) == 1
    (note,) = branch.notes
    value = f"{float(own.iloc[0]):.9g}"
    assert note == f"What leaves at 1 period doubling of branches of doubled period ({value} N m) is not followed."


@pytest.mark.parametrize(
    ("size", "cycles", "words"),
    [
        (0.5, 1, "halved after 1 T"),
        (0.25, 4, "halved after 2 T"),
        (2.0, 3, "doubled after 3 T"),
        (1.0, 1, "kept"),
        (1e-17, 1, "gone at once"),
    ],
)
def test_how_long_a_disturbance_lasts(size: float, cycles: int, words: str) -> None:
    assert lasting(size, cycles) == words


def test_tables_hold_multipliers_impacts_and_state(orbit: Orbit) -> None:
    tables = {table.title: table for table in presentation_of(orbit).tables()}
    half = log(2.0) / -log(abs(orbit.multipliers[0]))
    argument = degrees(phase(orbit.multipliers[0]))
    assert tables["Multipliers"].rows[0] == ("0.740818", f"{argument:.4g}°", f"halved after {half:.3g} T")
    assert [row[2] for row in tables["Impacts in their order"].rows] == [side for _, side in orbit.pattern]
    assert np.all(np.diff(impacts_of(orbit).time) > 0.0)
    assert float(tables["State at the start of a period"].rows[0][1].replace("−", "-")) == pytest.approx(
        orbit.state["angle"][0], rel=1e-7
    )


def test_the_phase_plane_is_a_closed_curve_with_a_dot_for_every_period(orbit: Orbit) -> None:
    curve, dots = chart(orbit, "phase_plane").panels[0].lines
    assert curve.x[0] == pytest.approx(curve.x[-1], abs=1e-9)
    assert curve.y[0] == pytest.approx(curve.y[-1], abs=1e-8)
    assert (dots.x.size, dots.shape) == (orbit.cycles, "circle")


def test_a_saved_model_begins_on_the_motion(orbit: Orbit, tmp_path: Path) -> None:
    orbit.save(tmp_path / "begin.toml")
    run = gr.simulate(gr.load(tmp_path / "begin.toml"), cycles=1, discard=0)
    assert run.trajectory.angle[-1] == pytest.approx(run.trajectory.angle[0], abs=1e-9)
    assert len(run.events) == len(orbit.run.events)


def test_files_of_a_motion_hold_its_period_and_its_multipliers(orbit: Orbit, tmp_path: Path) -> None:
    orbit.save(tmp_path / "orbit.nc")
    with xr.open_dataset(tmp_path / "orbit.nc", engine="h5netcdf") as data:
        values = data["multiplier_real"].values + 1j * data["multiplier_imaginary"].values
        assert np.array_equal(values, orbit.multipliers)
        assert data["deflection"].dims == ("time", "clearance")
        assert data["impact_side"].values.tolist() == [side for _, side in orbit.pattern]
    orbit.save(tmp_path / "orbit.csv")
    table = pd.read_csv(tmp_path / "orbit.csv", comment="#")
    assert len(table) == orbit.run.data.sizes["time"]


def test_several_motions_are_a_row_each() -> None:
    motions = result("periodic motions")
    assert motions.sentence == "3 motions repeat: 2 stable, 1 unstable."
    (table,) = presentation_of(motions).answer()
    assert [row[2] for row in table.rows] == ["stable", "unstable", "stable"]
    dashes = [line.dash for line in chart(motions, "phase_planes").panels[0].lines if line.mark == "line"]
    assert dashes == ["solid", "dashed", "solid"]


def test_no_motion_is_a_result_too(tmp_path: Path) -> None:
    nothing = PeriodicMotions(gr.example("rattle_oscillator"), ())
    assert nothing.sentence == "No motion that repeats was met."
    nothing.save(tmp_path / "out")
    assert nothing.charts() == []


def test_the_sentence_of_a_branch_tells_ranges_and_jumps(branch: Branch) -> None:
    assert branch.sentence == (
        "Over torque amplitude on gear, order 1 from 3.6 to 6.3: "
        "one stable motion from 3.6 to 3.693 and from 6.187 to 6.3; elsewhere two. "
        "Going up the motion jumps at 6.1866. Going down the motion jumps at 3.6932."
    )
    grazing = branch.events.iloc[0]
    assert (grazing["kind"], grazing["clearance"]) == ("grazing", "flanks")
    assert grazing["value"] == pytest.approx(LIMIT, abs=1e-6)


def test_ranges_end_at_the_located_event(branch: Branch) -> None:
    first, second = ranges_of(branch)[:2]
    fold = float(branch.events.loc[branch.events["kind"] == "fold", "value"].iloc[0])
    assert (first.stable, first.begin, first.end, first.cause) == (True, 3.6, fold, "fold")
    assert (second.stable, second.begin) == (False, fold)
    down, up = (loss for loss in losses_of(branch) if loss.jumps)
    assert (down.upward, up.value, up.upward) == (False, fold, True)


def test_a_soft_doubling_is_no_jump(branch: Branch) -> None:
    events = branch.events
    doubling = float(events.loc[events["kind"] == "period doubling", "value"].iloc[0])
    assert any(one.stable and doubling in (one.begin, one.end) for one in ranges_of(branch))
    assert {(loss.kind, loss.jumps) for loss in losses_of(branch)} == {("fold", True), ("period doubling", False)}


def test_of_what_leaves_a_neimark_sacker_bifurcation_nothing_is_said(branch: Branch) -> None:
    """The doubling under another name, and without the branch that leaves there."""
    curves = tuple(
        replace(
            curve,
            events=tuple(
                replace(one, kind="Neimark-Sacker") if one.kind == "period doubling" else one for one in curve.events
            ),
        )
        for curve in branch.curves
    )
    kinds = {loss.kind: loss.jumps for loss in losses_of(replace(branch, curves=curves))}
    assert kinds == {"fold": True, "Neimark-Sacker": None}


def test_a_range_ends_where_a_branch_turns_back_without_a_change_of_stability(branch: Branch) -> None:
    """The row would say "from 3.6 to 3.6" otherwise."""
    unstable = xr.full_like(branch.data["stable"], False)
    always = SimpleNamespace(
        data=branch.data.assign(stable=unstable), curves=branch.curves, events=branch.events, range=branch.range
    )
    folds = branch.events.loc[(branch.events["kind"] == "fold") & (branch.events["branch"] == 0), "value"].tolist()
    ranges = [one for one in ranges_of(cast("Branch", always)) if one.branch == 0]
    assert [one.end for one in ranges[:-1]] == folds
    assert [one.begin for one in ranges[1:]] == folds


def test_the_curve_changes_its_dash_where_the_stability_changes(branch: Branch) -> None:
    course, kinds = courses_of(branch)[0], branch.events["kind"].tolist()
    steps = course.stable
    at = [i for i, (a, b) in enumerate(pairwise(steps), 1) if a != b]
    assert [course.kinds[i] for i in at] == ["fold", "fold", "period doubling"]
    assert steps[0]
    assert not steps[-1]
    lines = chart(branch, "extremes").panels[0].lines
    solid, dashed = (next(line for line in lines if line.dash == dash) for dash in ("solid", "dashed"))
    first = int(np.flatnonzero(np.isnan(solid.x))[0])
    assert solid.x[first - 1] == dashed.x[0] == branch.events["value"].iloc[kinds.index("fold")]


def test_events_have_shapes_of_their_own(branch: Branch) -> None:
    shapes = [key.shape for key in EVENTS.values()]
    assert len(set(shapes)) == len(shapes)
    assert {key.colour for key in EVENTS.values()} == {EVENTS["fold"].colour}, "told apart without colour"
    figure = chart(branch, "extremes")
    marked = {line.name: line.shape for line in figure.panels[0].lines if line.mark == "points"}
    assert marked == {"grazing": "cross", "fold": "square", "period doubling": "diamond"}
    assert {"stable", "unstable", "grazing", "fold"} <= {key.name for key in figure.legend}


def test_a_grazing_is_marked_at_its_corner(branch: Branch) -> None:
    figure = chart(branch, "extremes")
    mark = next(line for line in figure.panels[0].lines if line.name == "grazing")
    assert mark.y[0] == pytest.approx(0.6, abs=1e-9)


def test_files_of_branches_hold_multipliers_and_events(branch: Branch, tmp_path: Path) -> None:
    assert np.iscomplexobj(branch.data["multiplier"].values)
    branch.save(tmp_path / "branch.nc")
    with xr.open_dataset(tmp_path / "branch.nc", engine="h5netcdf") as data:
        values = data["multiplier_real"].values + 1j * data["multiplier_imaginary"].values
        assert np.array_equal(values, branch.data["multiplier"].values)
        assert data["event_kind"].values.tolist() == branch.events["kind"].tolist()
    branch.save(tmp_path / "branch.csv")
    table = pd.read_csv(tmp_path / "branch.csv")
    assert len(table) == branch.data.sizes["point"]
    numbers = table["multiplier.1.real"] + 1j * table["multiplier.1.imaginary"]
    assert numbers.to_numpy() == pytest.approx(branch.data["multiplier"].values[:, 0], rel=1e-12)
    assert table["highest.flanks [1]"].to_numpy() == pytest.approx(branch.data["highest"].values[:, 0], rel=1e-12)


def test_what_one_clearance_touches_is_not_marked_at_another() -> None:
    case = gr.continuation(gr.example("case1"), "excitation.speed", ("1430 rpm", "1427 rpm"), step_limit=0.2)
    assert case.events["clearance"].tolist() == ["gear"]
    clutch, gear = ([line.name for line in panel.lines] for panel in chart(case, "extremes").panels)
    assert "grazing" not in clutch
    assert "grazing" in gear


def test_a_table_says_what_moves_the_jumps(branch: Branch) -> None:
    """The first row is what moves the first fold most; without folds there is no table."""
    table = moving_table(branch)
    events = branch.events
    folds = events.index[(events["kind"] == "fold") & (events["branch"] == 0)]
    gradients = branch.gradients(int(folds[0]))
    assert float(table.rows[0][0]) == pytest.approx(float(events["value"][folds[0]]), rel=1e-5)
    assert float(table.rows[0][3]) == pytest.approx(float(gradients["per_10_percent"][0]), rel=1e-2)
    quiet = gr.continuation(gr.example("rattle_oscillator"), branch.path, (3.0, 3.1), start="linear")
    assert moving_table(quiet).rows == ()


def test_a_fold_with_a_doubling_in_its_step_is_a_jump() -> None:
    """A gear in a gap: the step over the fold at 0.525033 ends behind a doubling at 0.525339, where it is unstable.

    A Runge-Kutta run, 4000 steps a period and 3000 periods from 0.5251 to 0.5245, leaves the swing of 2.684 for 3.861
    between 0.52504 and 0.52501.
    """
    gear = {"name": "gear", "J": 1.0}
    mesh = {"name": "mesh", "between": ["gear", "ground"], "stiffness": 1.0, "damping": 0.1, "clearance": 1.0}
    load = {"on": "gear", "mean": 0.11, "harmonics": [{"order": 1, "amplitude": 0.165}]}
    about = {"schema": 1, "name": "gear in a gap", "units": "dimensionless", "excitation": {"speed": 0.5}}
    model = gr.Model.from_tables(
        {**about, "inertia": [gear], "coupling": [{**mesh, "damping_ratio": 1.0}], "torque": [load]}
    )
    branch = gr.continuation(model, "excitation.speed", (0.5, 0.8))
    folds = branch.events[(branch.events["kind"] == "fold") & (branch.events["branch"] == 0)]
    assert folds["value"].to_numpy() == pytest.approx([0.695013, 0.525033], abs=1e-6)
    jumps = {(round(loss.value, 6), loss.upward) for loss in losses_of(branch) if loss.event in folds.index}
    assert jumps == {(0.695013, True), (0.525033, False)}
    assert {float(row[0]) for row in moving_table(branch).rows} == {0.695013, 0.525033, 0.525339}


def test_a_hard_doubling_is_among_what_is_moved() -> None:
    branch = gr.continuation(run_up_oscillator(0.098, 0.19, 0.144), "excitation.speed", (0.45, 0.9))
    rows = moving_table(branch).rows
    assert [row[1] for row in rows] == sorted((row[1] for row in rows), key=["fold", "period doubling"].index)
    assert {float(row[0]) for row in rows if row[1] == "period doubling"} == {0.569333}
