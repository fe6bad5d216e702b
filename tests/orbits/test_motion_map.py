"""The map over two values: its cells against a search for all motions, its borders against the events' curves."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.errors import Cancelled
from gearrattle.orbits import MotionMap
from gearrattle.orbits.motion_map import BESIDE, MISSING, MUST, NOT_COUNTED, NOTHING_STABLE, QUIET, Cell, cells_of
from gearrattle.orbits.progress import silent
from gearrattle.orbits.two_parameters.branches_at_second_value import Plane, Row
from gearrattle.orbits.two_parameters.event_boundary import borders_of
from gearrattle.orbits.two_parameters.special_points import special_points_of
from gearrattle.report.result_kinds import presentation_of
from tests.orbits.test_branch import over_frequency

pytestmark = pytest.mark.slow

MEAN = "torque.0.mean"


@cache
def over_load() -> MotionMap:
    """The backlash oscillator over frequency and load, its cusp at the load 0.4 inside."""
    return over_frequency().map(MEAN, (0.06, 0.46), across=26, up=4)


def test_cells_hold_what_a_search_for_all_motions_finds() -> None:
    """A random cell, and the one of most motions."""
    motions = over_load()
    counts = motions.data["quiet"] + motions.data["rattling"] + motions.data["unstable"]
    most = np.unravel_index(int(np.argmax(counts.values)), counts.shape)
    drawn = np.random.default_rng(5).integers((0, 0), counts.shape, (1, 2))
    for j, i in [*drawn.tolist(), [int(k) for k in most]]:
        values = {motions.path: float(motions.value[i]), MEAN: float(motions.seconds[j])}
        orbits = gr.periodic(motions.model.with_(values), every=True)
        stable = [orbit.verdict.verdict == "quiet" for orbit in orbits if orbit.stable]
        assert motions.cells[j][i][:3] == (sum(stable), len(stable) - sum(stable), len(orbits) - len(stable)), values
    assert int(counts.values[most]) == 3


def test_motions_beyond_a_fold_that_leads_out_of_the_range_are_known() -> None:
    """The branch from the first end folds at 591 rad/s and goes back; the motions beyond come from the other end."""
    model = gr.example("alternating_mesh")
    speed = model.excitation.omega
    branch = gr.continuation(model, "excitation.speed", (0.8 * speed, 1.1 * speed))
    assert max(curve.points[-1].parameter for curve in branch.curves) < 0.9 * speed
    cells = branch.map("mesh.gear.backlash", (0.5e-4, 2e-4), across=3, up=1).cells[0]
    assert [cell[:3] for cell in cells] == [(0, 1, 0)] * 3
    assert [cell.code for cell in cells] == [MUST] * 3


def test_a_quiet_motion_that_comes_in_at_the_first_end_is_known() -> None:
    """At the model's own load none is quiet at the first end; at a larger one a fold below the range makes one.

    Quiet is what swings less than the static deflection beyond the corner, in closed form.
    """
    mesh = {"name": "mesh", "between": ["gear", "ground"], "stiffness": 100.0, "damping": 0.02, "clearance": 0.02}
    gear = {"name": "gear", "J": 0.01, "drag": 0.05}
    load = {"on": "gear", "mean": 0.4, "harmonics": [{"order": 1, "amplitude": 0.3}]}
    tables = {"schema": 1, "inertia": [gear], "coupling": [mesh], "torque": [load], "excitation": {"speed": 60.0}}
    branch = gr.continuation(gr.Model.from_tables(tables), "excitation.speed", ("560 rpm", "1000 rpm"))
    motions = branch.map(MEAN, (0.3, 0.6), across=8, up=3)
    w, load_of_row = motions.value[None], motions.seconds[:, None]
    is_quiet = 0.3 / np.abs(100.0 - 0.01 * w**2 + 0.07j * w) < load_of_row / 100.0
    assert is_quiet.any()
    np.testing.assert_array_equal(motions.data["quiet"].values > 0, is_quiet)


def test_motions_of_one_row_are_known_in_the_rows_on_both_sides_of_it() -> None:
    """Rattle begins below the amplitude 3 in all rows, but a simulation settles in it in some only."""
    model = gr.example("rattle_oscillator")
    branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", (3.0, 6.6), start="linear")
    motions = branch.map(MEAN, (7.0, 8.0), across=4, up=6)
    assert np.all(motions.data["signs"].values == 1)
    assert np.all(motions.data["rattling"].values > 0)
    row, column = 5, 0
    values = {motions.path: float(motions.value[column]), MEAN: float(motions.seconds[row])}
    orbits = gr.periodic(model.with_(values), every=True)
    rattles = [orbit.verdict.verdict != "quiet" for orbit in orbits if orbit.stable]
    cell = motions.cells[row][column]
    assert (cell.quiet, cell.rattling) == (len(rattles) - sum(rattles), sum(rattles)) == (1, 2)


def test_what_settles_after_two_periods_is_known_where_no_doubling_leads_to_it() -> None:
    """The motion of one period is unstable over the whole range: its doublings lie outside."""
    mesh = {"name": "mesh", "between": ["gear", "ground"], "stiffness": 777.0, "damping": 1.878, "clearance": 0.01467}
    gear = {"name": "gear", "J": 1.0, "drag": 2.182}
    load = {"on": "gear", "mean": 6.99, "harmonics": [{"order": 1, "amplitude": 11.06}]}
    tables = {"schema": 1, "inertia": [gear], "coupling": [mesh], "torque": [load], "excitation": {"speed": 25.0}}
    branch = gr.continuation(gr.Model.from_tables(tables), "excitation.speed", (27.3, 31.8))
    assert not branch.data["stable"].any()
    motions = branch.map("coupling.mesh.damping", (1.878, 3.355), across=2, up=2)
    row, column = 1, 0
    values = {motions.path: float(motions.value[column]), motions.second: float(motions.seconds[row])}
    orbits = [orbit for orbit in gr.periodic(branch.model.with_(values), 2, every=True) if orbit.stable]
    assert [orbit.cycles for orbit in orbits] == [2]
    assert [cell.rattling for cells in motions.cells for cell in cells] == [1] * 4


def test_a_branch_that_leaves_and_is_not_followed_is_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gearrattle.orbits.branch_switching._leaving", lambda *_: [])
    path = "torque.0.harmonics.0.amplitude"
    branch = gr.continuation(gr.example("rattle_oscillator"), path, (3.0, 6.5), start="linear")
    assert "Not everything that leaves at 1 period doubling" in branch.notes[0]
    notes = branch.map(MEAN, (6.9, 7.6), across=2, up=1).notes
    assert "In 1 row not everything that leaves at doublings and breakings of symmetry is followed." in notes


def test_what_cannot_be_followed_to_the_next_row_is_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gearrattle.orbits.two_parameters.branches_at_second_value._MOST_POINTS", 2)
    motions = over_frequency().map(MEAN, (0.06, 0.46), across=2, up=1)
    assert any("could not be followed from one row to the next" in note for note in motions.notes)


def test_codes_change_where_the_borders_run() -> None:
    """Between both folds, which bound where three motions are, each row has unstable motions and elsewhere none."""
    motions = over_load()
    folds = [border for border in motions.borders if border.kind == "fold"]
    assert len(folds) == 2
    for j, second in enumerate(motions.seconds):
        between = np.zeros(len(motions.value), dtype=bool)
        if second < motions.special_points[0].second:
            low, high = sorted(float(np.interp(second, fold.second, fold.value)) for fold in folds)
            between = (motions.value > low) & (motions.value < high)
        unstable = np.array([cell.unstable for cell in motions.cells[j]])
        np.testing.assert_array_equal(unstable > 0, between)


def test_rattle_must_be_between_the_grazings_of_the_closed_form() -> None:
    """In contact the swing is 0.05 W^2 / |1 - W^2 + 0.1 i W|: a quiet motion is one that swings less than the load."""
    motions = over_load()
    w = motions.value
    swing = 0.05 * w**2 / np.abs(1.0 - w**2 + 0.1j * w)
    for j, second in enumerate(motions.seconds):
        is_quiet = np.array([cell.quiet > 0 for cell in motions.cells[j]])
        np.testing.assert_array_equal(is_quiet, swing < second)
    assert set(np.unique(motions.data["code"].values)) == {QUIET, BESIDE, MUST}
    assert np.all(motions.data["signs"].values == 1)


def test_special_points_are_those_at_which_the_curves_end() -> None:
    """Both folds end in one cusp; no other curve ends between the loads 0.06 and 0.46."""
    motions = over_load()
    (cusp,) = motions.special_points
    assert cusp.kind == "cusp"
    folds = [border for border in motions.borders if border.kind == "fold"]
    assert [(fold.ends_below, fold.ends_above) for fold in folds] == [("", "cusp"), ("", "cusp")]
    for fold in folds:
        assert (fold.value[-1], fold.second[-1]) == pytest.approx((cusp.value, cusp.second), abs=1e-7)
    grazings = [(border.ends_below, border.ends_above) for border in motions.borders if border.kind == "grazing"]
    assert grazings[0] == ("", "")


def test_a_special_point_of_two_curves_is_one() -> None:
    def curve(kind: str, value: float) -> xr.Dataset:
        words = np.array(["", kind])
        return xr.Dataset(
            {"special": ("point", words), "value": ("point", [0.0, value]), "second": ("point", [0.0, 1.0])}
        )

    curves = [curve("cusp", 0.5), curve("cusp", 0.5 + 1e-9), curve("cusp", 0.6), curve("fold meets grazing", 0.5)]
    points = special_points_of(curves, (1.0, 1.0))
    assert [(point.kind, point.value) for point in points] == [
        ("cusp", 0.5),
        ("cusp", 0.6),
        ("fold meets grazing", 0.5),
    ]


@pytest.mark.parametrize(
    ("cell", "code"),
    [
        (Cell(1, 0, 0, 1, ""), QUIET),
        (Cell(1, 1, 1, 1, ""), BESIDE),
        (Cell(1, 1, 0, 2, ""), BESIDE),
        (Cell(0, 1, 0, 1, ""), MUST),
        (Cell(0, 0, 1, 1, ""), NOTHING_STABLE),
        (Cell(0, 0, 0, 0, ""), MISSING),
        (Cell(0, 1, 0, 2, ""), MISSING),
        (Cell(1, 0, 0, 2, ""), MISSING),
        (Cell(1, 0, 0, 1, "a motion is one of a family"), NOT_COUNTED),
        (Cell(0, 0, 1, 1, "a motion is one of a family"), NOT_COUNTED),
        (Cell(0, 1, 0, 0, "a motion is one of a family"), MUST),
    ],
)
def test_what_a_cell_says(cell: Cell, code: int) -> None:
    assert cell.code == code


def test_a_saddle_without_its_neighbours_shows_that_motions_are_missing() -> None:
    """Between the folds the branch of the saddle alone has the sum of signs -1, with the motion in contact 0."""
    model = over_frequency().model.with_({"excitation.frequency": 0.75})
    (saddle,) = (orbit for orbit in gr.periodic(model, every=True) if not orbit.stable)
    alone = gr.continuation(model, "excitation.frequency", (0.75, 0.78), start=saddle)
    plane = Plane(alone.model, alone.path, MEAN, (0.75, 0.78), (0.099, 0.101), 1)
    (cells,) = cells_of([Row(plane, 0.1, alone.curves)], np.array([0.76, 0.77]), silent)
    assert [(cell.unstable, cell.signs, cell.code) for cell in cells] == 2 * [(1, 0, MISSING)]
    cells = alone.map(MEAN, (0.099, 0.101), across=2, up=1).cells[0]
    assert {cell.signs for cell in cells} == {1}  # with the motions that settle at the ends
    assert {cell.code for cell in cells} == {BESIDE}


@pytest.mark.long
def test_isolated_branches_are_sought_on_request() -> None:
    """The branch of the large motion alone does not reach an end of the range: it is found when it is sought."""
    model = over_frequency().model.with_({"excitation.frequency": 0.75})
    quiet = gr.continuation(model, "excitation.frequency", (0.75, 0.78), start="linear")
    known, sought = (quiet.map(MEAN, (0.099, 0.101), across=2, up=1, isolated=flag) for flag in (False, True))
    assert {cell.code for cell in known.cells[0]} == {QUIET}
    assert {cell.code for cell in sought.cells[0]} == {BESIDE}
    assert any("isolated branches were not sought" in note for note in known.notes)
    assert not any("isolated branches were not sought" in note for note in sought.notes)


def test_progress_grows_to_one_and_can_end_the_work() -> None:
    branch = gr.continuation(over_frequency().model, "excitation.frequency", (0.3, 0.5), start="linear")
    shares: list[float] = []
    branch.map(MEAN, (0.099, 0.101), across=2, up=2, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert shares.count(0.0) > 1, "a row reports before it ends"

    def stop(share: float) -> None:
        raise Cancelled(f"at {share}")

    with pytest.raises(Cancelled):
        branch.map(MEAN, (0.099, 0.101), across=2, up=2, progress=stop)


@pytest.mark.parametrize(
    ("second", "ends", "cells", "rule"),
    [
        ("torque.3.mean", (0.1, 0.2), {}, "torque.3"),
        ("excitation.speed", (0.1, 0.2), {}, "is what the branch is followed over"),
        (MEAN, (0.2, 0.3), {}, "must contain the model's own torque.0.mean"),
        (MEAN, (0.1, 0.1), {}, "two different values"),
        (MEAN, (0.05, 0.3), {"across": 0}, "across"),
    ],
)
def test_bad_arguments_are_refused(second: str, ends: tuple[float, float], cells: dict[str, int], rule: str) -> None:
    with pytest.raises(gr.ModelError, match=rule):
        over_frequency().map(second, ends, **cells)


def test_it_is_a_result_with_a_page_a_table_and_numbers(tmp_path: Path) -> None:
    motions = over_load()
    page = motions.save(tmp_path / "out").read_text(encoding="utf-8")
    for words in (
        "only rattling motions are stable",
        "no rattle was found, and the sum of signs agrees",
        "Special points",
    ):
        assert words in page
    motions.save(tmp_path / "map.csv")
    table = pd.read_csv(tmp_path / "map.csv")
    assert len(table) == motions.data["code"].size
    (chart,) = presentation_of(motions).charts()
    (panel,) = chart.panels
    area = sum(float(np.sum((c.right - c.left) * (c.high - c.low))) for c in panel.cells)
    assert area == pytest.approx((motions.range[1] - motions.range[0]) * 0.4)
    content = presentation_of(motions).content()
    assert sum(content["counts"].values()) == motions.data["code"].size


def test_why_a_curve_ends_inside_the_plane() -> None:
    rows = [("fold", 0.5, "cusp", 0.6), ("fold", 0.5, "", 0.6), ("grazing", 0.5, "", 30.0), ("grazing", 1.0, "", 30.0)]
    kinds = [kind for kind, *_ in rows]
    events = pd.DataFrame({"kind": kinds, "clearance": "gap", "collision": False, "value": 0.4, "grazing": ""})

    def boundary(event: int) -> xr.Dataset:
        _, end, special, value = rows[event]
        columns = {"second": [0.0, end], "value": [0.4, value], "special": ["", special]}
        return xr.Dataset({name: ("point", np.array(column)) for name, column in columns.items()})

    borders, _, _ = borders_of(events, boundary, ((0.3, 1.6), (0.0, 1.0)), silent, str)
    assert [border.ends_below for border in borders] == [""] * 4
    assert [border.ends_above for border in borders] == [
        "cusp",
        "not found further",
        "beyond the range of the first value",
        "",
    ]


@pytest.mark.parametrize("grazing", ["jump", "release"])
def test_a_grazing_at_which_the_gradient_jumps_has_no_border(grazing: str) -> None:
    """Its curve cannot be followed: that is said, and the map is made."""
    events = pd.DataFrame({"kind": ["grazing"], "clearance": "gap", "collision": False, "value": 0.4})

    def boundary(event: int) -> xr.Dataset:
        raise AssertionError(event)

    borders, points, notes = borders_of(events.assign(grazing=grazing), boundary, ((0.3, 1.6), (0.0, 1.0)), silent, str)
    assert (borders, points) == ([], [])
    assert notes == ["The grazing at 0.4 is not followed: the motion or its gradient jumps there."]


def test_a_map_is_drawn_though_no_rest_is_to_begin_from() -> None:
    """The last stage has no stiffness: a mean torque beyond the one before it has no static equilibrium."""
    stages = [{"stiffness": 1.0, "damping": 0.1, "until": 0.5}, {"stiffness": 0.0, "damping": 0.1}]
    joint = {"name": "joint", "between": ["gear", "ground"], "stages": stages}
    load = {"on": "gear", "mean": 0.4, "harmonics": [{"order": 1, "amplitude": 0.3}]}
    gear = {"name": "gear", "J": 1.0, "drag": 0.1}
    tables = {"schema": 1, "inertia": [gear], "coupling": [joint], "torque": [load], "excitation": {"speed": 2.0}}
    branch = gr.continuation(gr.Model.from_tables(tables), "excitation.speed", (2.0, 2.2))
    motions = branch.map(MEAN, (0.39, 0.7), across=1, up=2)
    assert motions.data["code"].shape == (2, 1)


def test_an_end_that_no_branch_reaches_is_refused() -> None:
    branch = gr.continuation(joint_with_friction(), "coupling.joint.hysteresis", (0.1, 0.0))
    with pytest.raises(gr.ModelError, match="slider of joint comes or goes"):
        branch.map(MEAN, (0.3, 0.5), across=1, up=1)


def joint_with_friction() -> gr.Model:
    """A gear on a joint with friction."""
    joint = {"name": "joint", "between": ["gear", "ground"], "stiffness": 1.0, "damping": 0.1, "hysteresis": 0.1}
    load = {"on": "gear", "mean": 0.4, "harmonics": [{"order": 1, "amplitude": 0.5}]}
    gear = {"name": "gear", "J": 1.0, "drag": 0.1}
    tables = {"schema": 1, "inertia": [gear], "coupling": [joint], "torque": [load], "excitation": {"speed": 2.0}}
    return gr.Model.from_tables(tables)
