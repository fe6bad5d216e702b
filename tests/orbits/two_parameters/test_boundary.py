"""Events over a second value: against their closed form, and up to the cusp in which two folds meet."""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from mpmath import mp, mpf

import gearrattle as gr
from gearrattle.orbits import Branch
from gearrattle.orbits.two_parameters.special_points import KINDS
from gearrattle.report.plots.motion_map_figure import SPECIAL
from tests.oracles import backlash_mp as oracle
from tests.orbits.test_branch import oscillator, over_frequency


@pytest.mark.parametrize("low", [0.095, 0.0005])
def test_a_grazing_stays_on_its_closed_form(low: float) -> None:
    """Contact is lost where the amplitude of x = 1 + mean + amplitude cos is the mean; slow motions are flat there."""
    curve = over_frequency().boundary(0, "torque.0.mean", (low, 0.11))
    w = curve["value"].values
    amplitude = 0.05 * w**2 / np.abs(1.0 - w**2 + 0.1j * w)
    np.testing.assert_allclose(amplitude, curve["second"].values, rtol=0, atol=1e-10)
    assert curve["second"].values[[0, -1]].tolist() == [low, 0.11]
    assert curve.attrs["notes"] == []


@pytest.mark.parametrize("event", [0, 1])
def test_where_the_period_begins_does_not_matter(event: int) -> None:
    """The phase moves the touch over the begin of the period, either way."""
    branch = over_frequency()
    curve = branch.boundary(event, "coupling.gap.kinematic_error.0.phase", (-4.0, 7.0))
    assert curve["second"].values[[0, -1]].tolist() == [-4.0, 7.0]
    np.testing.assert_allclose(curve["value"], branch.events["value"][event], rtol=0, atol=1e-11)


CUSP = (1.57208, 0.399188)
MEETING = (1.03362644, 0.00149098)
"""Positions less the error, and velocities at t = 0, near those of the special points."""
TOUCHED = mpf("0.4700646")
"""When the corner is touched, in periods."""


@pytest.mark.parametrize("event", [1, pytest.param(3, marks=pytest.mark.long)])
def test_both_folds_end_in_one_cusp(event: int) -> None:
    """The cusp, against thirty digits."""
    curve = over_frequency().boundary(event, "torque.0.mean", (0.1, 0.45))
    assert curve.attrs["kind"] == "fold"
    assert curve.attrs["notes"] == ["The event is not found beyond torque.0.mean = 0.400569: cusp."]
    assert curve["special"].values.tolist() == [""] * (curve.sizes["point"] - 1) + ["cusp"]
    end = (float(curve["value"][-1]), float(curve["second"][-1]))
    with mp.workdps(30):
        cusp = oracle.cusp(mpf(end[0]), mpf(end[1]), CUSP)
    np.testing.assert_allclose(end, [float(x) for x in cusp], rtol=0, atol=1e-8)


@pytest.mark.long
@pytest.mark.parametrize("event", [0, 5])
def test_two_grazings_meet_where_the_swing_is_largest(event: int) -> None:
    """The amplitude 0.05 w^2 / |1 - w^2 + 0.1 i w| is largest at w^2 = 1 / (1 - 0.005)."""
    largest = 0.5 / np.sqrt(1.0 - 0.05**2)
    curve = over_frequency().boundary(event, "torque.0.mean", (0.1, 0.55))
    assert curve["special"].values[-1] == "turning point"
    assert float(curve["second"][-1]) == pytest.approx(largest, abs=1e-8)
    assert float(curve["value"][-1]) == pytest.approx(1.0 / np.sqrt(1.0 - 0.005), abs=1e-6)


@cache
def fold_to_small_loads() -> xr.Dataset:
    return over_frequency().boundary(1, "torque.0.mean", (0.005, 0.1))


def test_a_fold_passes_the_grazing_that_it_meets() -> None:
    """There the motion with two crossings touches the corner once more, and folds: against thirty digits."""
    curve = fold_to_small_loads()
    assert curve["second"].values[[0, -1]].tolist() == [0.005, 0.1]
    special = curve.isel(point=curve["special"] != "")
    assert special["special"].values.tolist() == ["fold meets grazing"]
    value, mean = float(special["value"][0]), float(special["second"][0])
    with mp.workdps(30):
        want = oracle.fold_at_grazing(mpf(value), mpf(mean), MEETING, TOUCHED * oracle.period(mpf(value)))
    np.testing.assert_allclose([value, mean], [float(x) for x in want], rtol=0, atol=1e-8)


@pytest.mark.long
@pytest.mark.parametrize("own", [0.0088, 0.0089])
def test_a_fold_passes_a_grazing_wherever_it_is_followed_from(own: float) -> None:
    model = oscillator().with_({"torque.0.mean": own})
    branch = gr.continuation(model, "excitation.frequency", (0.3, 0.55))
    fold = fold_to_small_loads()
    is_near = np.abs(branch.events["value"] - np.interp(own, fold["second"], fold["value"])) < 1e-3
    row = branch.events.index[(branch.events["kind"] == "fold") & is_near][0]
    curve = branch.boundary(int(row), "torque.0.mean", (0.005, 0.1))
    assert curve["second"].values[[0, -1]].tolist() == [0.005, 0.1]
    np.testing.assert_allclose(curve["value"].values[[0, -1]], fold["value"].values[[0, -1]], rtol=0, atol=1e-8)


@pytest.mark.slow
def test_a_grazing_passes_the_fold_that_it_meets_at_the_same_point() -> None:
    model = oscillator().with_({"torque.0.mean": 0.0095})
    branch = gr.continuation(model, "excitation.frequency", (0.44, 0.5), start="linear")
    chosen = branch.events.index[branch.events["kind"] == "grazing"][0]
    curve = branch.boundary(int(chosen), "torque.0.mean", (0.0087, 0.0097))
    special = curve.isel(point=curve["special"] != "")
    assert special["special"].values.tolist() == ["fold meets grazing"]
    fold = fold_to_small_loads()
    passed = fold.isel(point=fold["special"] != "")
    actual, want = ([float(curve[name][0]) for name in ("second", "value")] for curve in (special, passed))
    np.testing.assert_allclose(actual, want, rtol=0, atol=1e-8)


@pytest.mark.long
def test_a_grazing_of_two_periods_does_not_become_one_of_the_motion_of_one_period() -> None:
    """Where it ends, another grazing of the same corner lies near: that of the quiet motion."""
    branch = gr.continuation(oscillator().with_({"torque.0.mean": 0.02}), "excitation.frequency", (0.3, 1.6))
    events = branch.events.assign(cycles=[branch.curves[number].cycles for number in branch.events["branch"]])
    doubled = events.index[(events["kind"] == "grazing") & (events["cycles"] == 2)]
    ends = []
    for high in (0.05, 0.3):
        curve = branch.boundary(int(doubled[0]), "torque.0.mean", (0.015, high))
        w, mean = curve["value"].values, curve["second"].values
        amplitude = 0.05 * w**2 / np.abs(1.0 - w**2 + 0.1j * w)
        assert np.abs(amplitude / mean - 1.0).min() > 1e-3
        assert curve["special"].values[-1] == "turning point"
        ends.append(mean[-1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


@pytest.mark.long
def test_two_grazings_of_a_doubled_branch_end_in_one_turning_point() -> None:
    """Both lie 1e-5 apart at the end, beside other events: at 0.0106456 neither exists, at 0.0106458 both do."""
    branch = gr.continuation(oscillator().with_({"torque.0.mean": 0.0107}), "excitation.frequency", (0.3, 1.3))
    events = branch.events
    is_doubled = (events["kind"] == "grazing") & (events["branch"] == 1)
    chosen = events.index[is_doubled & (events["value"] > 0.495) & (events["value"] < 0.4957)]
    ends = []
    for row in chosen:
        curve = branch.boundary(int(row), "torque.0.mean", (0.0106, 0.0108))
        assert np.diff(curve["second"].values).min() > 0.0
        if curve["special"].values[0] == "turning point":
            ends.append((float(curve["second"][0]), float(curve["value"][0])))
    assert len(ends) == 2
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-8)
    assert 0.0106456 < ends[0][0] < 0.0106458


@pytest.mark.long
def test_a_fold_ends_in_its_own_cusp_though_another_fold_lies_beyond() -> None:
    """A swallowtail: of four folds within 1e-4 of frequency two vanish, and another one goes on as the first began."""
    branch = gr.continuation(oscillator().with_({"torque.0.mean": 0.005}), "excitation.frequency", (0.3, 1.6))
    events = branch.events
    chosen = events.index[(events["kind"] == "fold") & (events["branch"] == 1)]
    curves = [branch.boundary(int(row), "torque.0.mean", (0.001, 0.05)) for row in chosen]
    assert [curve["special"].values[-1] for curve in curves] == ["cusp", "cusp"]
    load, frequency = float(curves[0]["second"][-1]), float(curves[0]["value"][-1])
    assert load == pytest.approx(0.0053035, abs=2e-8)
    counts = []
    for near in (load - 1e-7, load + 1e-7):
        beside_it = gr.continuation(oscillator().with_({"torque.0.mean": near}), "excitation.frequency", (0.3, 0.4))
        folds = beside_it.events["value"][beside_it.events["kind"] == "fold"]
        counts.append(int((np.abs(folds - frequency) < 2e-5).sum()))
    assert counts == [3, 1]
    assert curves[0]["special"].values[0] == "cusp"
    assert float(curves[1]["second"][0]) == 0.001
    passed = curves[1].isel(point=slice(1, -1))
    assert set(passed["special"].values) == {"", "fold meets grazing"}


@pytest.mark.long
def test_an_isolated_branch_shrinks_to_a_turning_point_of_its_folds() -> None:
    """Followed from two loads, which take other steps."""
    ends = []
    for own in (0.04, 0.05):
        branch = gr.continuation(oscillator().with_({"torque.0.mean": own}), "excitation.frequency", (0.3, 1.6))
        is_fold = (branch.events["kind"] == "fold") & (branch.events["branch"] == 1)
        row = branch.events.index[is_fold & (branch.events["value"] < 1.1)][0]
        curve = branch.boundary(int(row), "torque.0.mean", (own, 0.3))
        assert curve["special"].values[-1] == "turning point"
        ends.append((float(curve["second"][-1]), float(curve["value"][-1])))
    np.testing.assert_allclose(ends[0][0], ends[1][0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(ends[0][1], ends[1][1], rtol=0, atol=1e-6)


UNTIL = "coupling.g.stages.0.until"


def two_steps(until: float, mean: float = 1.0, amplitude: float = 3.5) -> gr.Model:
    """One body on a spring that stiffens twice; its motions double their period near where they touch a corner."""
    stages = [
        {"stiffness": 0.78, "damping": 0.02, "until": until},
        {"stiffness": 15.6, "damping": 0.08, "until": 1.98},
        {"stiffness": 62.4, "damping": 0.08},
    ]
    tables = {
        "schema": 1,
        "name": "two steps",
        "units": "dimensionless",
        "inertia": [{"name": "a", "J": 1.02, "drag": 0.021}],
        "coupling": [{"name": "g", "between": ["a", "ground"], "stages": stages}],
        "excitation": {"speed": 1.9},
        "torque": [{"on": "a", "mean": mean, "harmonics": [{"order": 1, "amplitude": amplitude}]}],
    }
    return gr.Model.from_tables(tables)


@pytest.mark.long
@pytest.mark.parametrize(
    ("until", "speeds", "ends", "end"),
    [(0.96, (1.89, 1.92), (0.94, 0.97), 0), (0.945, (1.91, 1.925), (0.9, 0.96), -1)],
)
def test_a_grazing_ends_at_the_doubling_that_it_comes_from(
    until: float, speeds: tuple[float, float], ends: tuple[float, float], end: int
) -> None:
    """At that stage the motion of one period grazes where it doubles its period: the end is not named."""
    branch = gr.continuation(two_steps(until), "excitation.speed", speeds)
    row = branch.events.index[(branch.events["kind"] == "grazing") & (branch.events["branch"] == 1)][0]
    curve = branch.boundary(int(row), UNTIL, ends)
    assert set(curve["special"].values) == {""}
    assert len(curve.attrs["notes"]) == 1
    at = gr.continuation(two_steps(float(curve["second"][end])), "excitation.speed", (1.91, 1.92))
    own = at.events[at.events["branch"] == 0]
    assert sorted(own["kind"]) == ["grazing", "period doubling"]
    np.testing.assert_allclose(own["value"], float(curve["value"][end]), rtol=0, atol=5e-5)


@pytest.mark.long
def test_a_fold_that_stays_at_a_grazing_ends_where_that_meets_its_doubling() -> None:
    """What happens there is not named."""
    branch = gr.continuation(two_steps(0.99), "excitation.speed", (1.7, 1.75))
    row = branch.events.index[(branch.events["kind"] == "fold") & (branch.events["branch"] == 1)][0]
    curve = branch.boundary(int(row), "torque.0.mean", (0.95, 1.3))
    assert set(curve["special"].values) == {""}
    mean, speed = float(curve["second"][-1]), float(curve["value"][-1])
    counts = []
    for change in (-1e-5, 1e-5):
        own = gr.continuation(two_steps(0.99, mean + change), "excitation.speed", (1.705, 1.715)).events
        is_near = (own["branch"] == 0) & (np.abs(own["value"] - speed) < 2e-5)
        counts.append(own.loc[is_near, "kind"].tolist())
    assert counts == [["period doubling", "grazing", "period doubling"], ["grazing"]]


def two_bodies(damping: float) -> gr.Model:
    """A pair of gears held by a spring, whose doubled branch folds beside the doubling."""
    couplings = [
        {"name": "g", "between": ["a", "b"], "stiffness": 14.1, "damping": damping, "clearance": 0.89},
        {"name": "s", "between": ["a", "ground"], "stiffness": 1.32, "damping": 0.03},
    ]
    bodies = [{"name": "a", "J": 0.83, "drag": 0.006}, {"name": "b", "J": 0.92, "drag": 0.004}]
    torque = {"on": "a", "mean": 0.94, "harmonics": [{"order": 1, "amplitude": 4.71}]}
    tables = {"inertia": bodies, "coupling": couplings, "excitation": {"speed": 1.04}, "torque": [torque]}
    return gr.Model.from_tables({"schema": 1, "name": "two bodies", "units": "dimensionless", **tables})


@pytest.mark.long
def test_a_fold_of_a_doubled_branch_ends_at_the_doubling() -> None:
    """Its distance from the doubling falls with the square of the damping's way to there: from other branches.

    The end is no cusp, and has no name.
    """
    branches = {
        damping: gr.continuation(two_bodies(damping), "torque.0.harmonics.0.amplitude", (3.65, 3.75))
        for damping in (0.098, 0.1, 0.102)
    }
    distances, rows = [], []
    for branch in branches.values():
        doubling = branch.events["value"][branch.events["kind"] == "period doubling"].iloc[0]
        folds = branch.events[branch.events["kind"] == "fold"]
        rows.append(int((folds["value"] - doubling).abs().idxmin()))
        distances.append(np.sqrt(folds["value"][rows[-1]] - doubling))
    extrapolated = np.polyval(np.polyfit(distances, list(branches), 2), 0.0)
    for row, (damping, branch) in zip(rows[:2], list(branches.items())[:2], strict=True):
        curve = branch.boundary(row, "coupling.g.damping", (damping, 0.12))
        assert set(curve["special"].values) == {""}
        assert float(curve["second"][-1]) == pytest.approx(extrapolated, abs=1e-4)


def gear_pair(mean: float) -> gr.Model:
    """A pair whose doubled branch has a fold 1e-4 of w from where it leaves: two events lie beside each other."""
    couplings = [
        {"name": "mesh", "between": ["a", "b"], "stiffness": 2000.0, "damping": 1.0, "clearance": 0.002},
        {"name": "shaft", "between": ["a", "ground"], "stiffness": 300.0, "damping": 0.4},
        {"name": "load", "between": ["b", "ground"], "stiffness": 10.0, "damping": 0.2},
    ]
    torques = [
        {"on": "a", "mean": 0.0, "harmonics": [{"order": 1, "amplitude": 20.0}]},
        {"on": "b", "mean": mean},
    ]
    inertias = [{"name": "a", "J": 0.05}, {"name": "b", "J": 0.02}]
    tables = {"inertia": inertias, "coupling": couplings, "excitation": {"speed": 60.0}, "torque": torques}
    return gr.Model.from_tables({"schema": 1, "name": "pair", **tables})


def folds_of_doubled_branches(mean: float) -> tuple[Branch, pd.Series]:
    path = "torque.0.harmonics.0.amplitude"
    branch = gr.continuation(gear_pair(mean), path, (2.3, 2.5), start="linear")
    doubled = (branch.events["branch"] > 0) & (branch.events["kind"] == "fold")
    return branch, branch.events.loc[doubled, "value"]


@pytest.mark.long
def test_a_sharp_fold_beside_the_doubling_it_comes_from_is_followed() -> None:
    branch, folds = folds_of_doubled_branches(-2.0)
    curve = branch.boundary(int(folds.index[0]), "torque.1.mean", (-2.01, -1.99))
    for end in (0, -1):
        _, there = folds_of_doubled_branches(float(curve["second"][end]))
        assert float(curve["value"][end]) == pytest.approx(there.iloc[0], rel=1e-8)
    assert curve.attrs["notes"] == []


def test_a_curve_ends_where_the_clearance_closes() -> None:
    path = "coupling.gap.clearance"
    curve = over_frequency().boundary(0, path, (0.0, 2.0))
    assert 0.0 < float(curve["second"][0]) < 1e-4
    assert curve.attrs["notes"][0].startswith(f"The event is not found beyond {path} = ")


def test_on_the_way_it_meets_the_events_of_changed_models() -> None:
    branch = over_frequency()
    curve = branch.boundary(1, "torque.0.mean", (0.09, 0.11))
    changed = branch.model.with_({"torque.0.mean": 0.11})
    events = gr.continuation(changed, branch.path, branch.range).events
    folds = events[events["kind"] == "fold"]["value"].to_numpy()
    assert float(curve["value"][-1]) == pytest.approx(folds[0], abs=1e-9)


def test_a_range_without_the_models_own_value_is_refused() -> None:
    with pytest.raises(gr.ModelError, match=r"must contain the model's own torque.0.mean, 0\.1"):
        over_frequency().boundary(1, "torque.0.mean", (0.2, 0.3))
    with pytest.raises(gr.ModelError, match="must be a fold"):
        over_frequency().boundary(2, "torque.0.mean", (0.05, 0.3))


def clipped(mean: float) -> Branch:
    """A branch on which clipped damping is limited once more than before: an instant in contact without force."""
    contact = {"stiffness": 10.0, "damping": 0.5, "clearance": 1.0, "contact_damping": "clipped"}
    torque = {"on": "body", "mean": mean, "harmonics": [{"order": 1, "amplitude": 0.35}]}
    tables = {
        "inertia": [{"name": "body", "J": 1.0, "drag": 0.05}],
        "coupling": [{"name": "gap", "between": ["body", "ground"], **contact}],
        "excitation": {"speed": 1.4},
        "torque": [torque],
    }
    model = gr.Model.from_tables({"schema": 1, "name": "clipped", "units": "dimensionless", **tables})
    return gr.continuation(model, "excitation.speed", (1.34, 1.29))


@pytest.mark.long
@pytest.mark.parametrize("name", ["gap.pull", "gap.push"])
def test_the_touch_of_a_limiter_is_followed(name: str) -> None:
    """The gradient is continuous there: its trace, by matrix exponentials, changes by -5.74 times the root beyond.

    The touches of both limiters lie 2e-4 from each other: how they move is told by motions nearer than that.
    """
    means = 0.379, 0.38, 0.381
    branches = [clipped(mean) for mean in means]
    rows = [branch.events[branch.events["clearance"] == name] for branch in branches]
    (event,), values = rows[1].index, [float(row["value"].iloc[0]) for row in rows]
    assert rows[1]["grazing"].tolist() == ["compliant"]
    curve = branches[1].boundary(int(event), "torque.0.mean", (means[0], means[2]))
    assert curve["value"].values[[0, -1]] == pytest.approx([values[0], values[2]], abs=1e-11)
    moved = branches[1].gradients(int(event), ["torque.0.mean"])["gradient"].iloc[0]
    assert moved == pytest.approx((values[2] - values[0]) / 2e-3, abs=2e-4)


@pytest.mark.long
def test_a_neimark_sacker_bifurcation_ends_where_its_pair_comes_to_minus_one() -> None:
    """The end is not named; the curve itself does not turn."""
    shaft = "coupling.shaft.stiffness"
    tables = {
        "schema": 1,
        "name": "two gaps",
        "units": "dimensionless",
        "inertia": [{"name": "a", "J": 0.97, "drag": 0.01}, {"name": "b", "J": 0.43, "drag": 0.025}],
        "coupling": [
            {"name": "gap", "between": ["a", "b"], "stiffness": 4.8, "damping": 0.02, "clearance": 0.69},
            {"name": "shaft", "between": ["a", "ground"], "stiffness": 2.75, "damping": 0.03},
            {"name": "stop", "between": ["b", "ground"], "stiffness": 4.9, "damping": 0.02, "clearance": 0.5},
        ],
        "torque": [{"on": "a", "mean": 0.94, "harmonics": [{"order": 1, "amplitude": 2.76}]}],
    }
    start = {"angle": [-0.042, -0.316], "velocity": [5.0, 1.74]}
    model = gr.Model.from_tables({**tables, "excitation": {"speed": 1.6885}})
    branch = gr.continuation(model, "excitation.speed", (1.6885, 1.6845), cycles=2, start=start)
    assert list(branch.events["kind"]) == ["Neimark-Sacker"]
    curve = branch.boundary(0, shaft, (2.75, 3.7))
    assert set(curve["special"].values) == {""}
    end = float(curve["second"][-1])
    speed = float(curve["value"][-1])
    assert end == pytest.approx(2.831151, abs=2e-6)
    assert speed == pytest.approx(1.656032, abs=2e-6)


def test_every_special_point_is_drawn_and_named() -> None:
    assert set(SPECIAL) == set(KINDS)


def doubled(amplitude: float, begin: float, end: float, start: tuple[float, float]) -> Branch:
    """A branch of two periods over the speed, from near a state."""
    model = two_steps(0.99, amplitude=amplitude)
    states = {"angle": [start[0]], "velocity": [start[1]]}
    return gr.continuation(model, "excitation.speed", (begin, end), cycles=2, start=states)


@pytest.mark.long
def test_a_grazing_ends_where_its_extremum_meets_the_next_one() -> None:
    """The end is not named: a cubic tangency."""
    branch = doubled(3.5, 1.5205, 1.53, (-1.6385, 1.005))
    row = branch.events.index[branch.events["kind"] == "grazing"][0]
    curves = [branch.boundary(int(row), "torque.0.harmonics.0.amplitude", ends) for ends in ((3.3, 3.9), (3.45, 4.2))]
    assert {str(special) for curve in curves for special in curve["special"].values} == {""}
    points = np.array([[curve[name].values[-1] for name in ("second", "value")] for curve in curves])
    np.testing.assert_allclose(points[0], points[1], rtol=0, atol=5e-4)


@pytest.mark.long
def test_a_neimark_sacker_bifurcation_ends_with_its_pair() -> None:
    """Beyond the resonance the pair is two real multipliers that are inverse, and no event.

    The resonance is that of a Newton iteration of its own for a double multiplier -1; at the other end the curve turns.
    """
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "a", "J": 0.96, "drag": 0.016}, {"name": "b", "J": 0.87, "drag": 0.014}],
        "coupling": [
            {"name": "gap", "between": ["a", "b"], "stiffness": 12.0, "damping": 0.06, "clearance": 0.57},
            {"name": "shaft", "between": ["a", "ground"], "stiffness": 1.02, "damping": 0.03},
            {"name": "stop", "between": ["b", "ground"], "stiffness": 8.3, "damping": 0.06, "clearance": 0.24},
        ],
        "excitation": {"speed": 1.76},
        "torque": [{"on": "a", "mean": 1.1, "harmonics": [{"order": 1, "amplitude": 2.01}]}],
    }
    branch = gr.continuation(gr.Model.from_tables(tables), "excitation.speed", (1.056, 1.2))
    pairs = branch.events.index[(branch.events["kind"] == "Neimark-Sacker") & (branch.events["branch"] == 0)]
    curve = branch.boundary(int(pairs[0]), "coupling.shaft.stiffness", (0.612, 1.632))
    assert curve["special"].values[[0, -1]].tolist() == ["", "turning point"]
    ends = np.array([[curve[name].values[i] for name in ("second", "value")] for i in (0, -1)])
    np.testing.assert_allclose(ends, [[0.753800756, 1.07851498], [1.263678, 1.21738]], rtol=0, atol=2e-5)
