"""Gradients of events: in closed form, and by locating the events of changed models."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.orbits import Branch
from gearrattle.orbits.stability_ranges import losses_of
from tests.orbits.test_branch import (
    AMPLITUDE,
    OSCILLATOR,
    body_with_backlash,
    over_amplitude,
    over_frequency,
    symmetric,
)
from tests.orbits.test_friction import oscillator as with_friction
from tests.orbits.test_run_ups import oscillator as with_gap

FREQUENCY = "excitation.frequency"
PATHS = ("torque.0.mean", "coupling.gap.kinematic_error.0.amplitude", "coupling.gap.damping", "inertia.body.J")


def amplitude(w: float) -> float:
    return float(0.05 * w**2 / abs(1.0 - w**2 + 0.1j * w))


@pytest.mark.parametrize("event", [0, 5])
def test_a_grazing_moves_as_its_closed_form_does(event: int) -> None:
    """Contact is lost where the amplitude of x = 1 + mean + amplitude cos is the mean: dW / d mean = 1 / amplitude'."""
    branch = over_frequency()
    w, h = float(branch.events["value"][event]), 1e-6
    want = 2.0 * h / (amplitude(w + h) - amplitude(w - h))
    table = branch.gradients(event, ["torque.0.mean", "coupling.gap.clearance"]).set_index("path")
    assert table.loc["torque.0.mean", "gradient"] == pytest.approx(want, rel=1e-5)
    assert abs(table.loc["coupling.gap.clearance", "gradient"]) < 1e-6  # the motion moves with its corner


@pytest.mark.parametrize("phase", [3.0, pytest.param(4.0, marks=pytest.mark.long)])
def test_a_grazing_does_not_depend_on_the_origin_of_time(phase: float) -> None:
    """The lower corner is touched between two crossings of the upper one that have the same directions."""
    path, grazings = "torque.0.harmonics.0.amplitude", []
    for own in (0.0, phase):
        joint = {"stiffness": 1.0, "damping": 0.1, "damping_ratio": 1.0, "stiffness_ratio": 0.1, "clearance": 1.0}
        harmonic = {"order": 1, "amplitude": 0.3, "phase": own}
        tables = {
            "inertia": [{"name": "body", "J": 1.0}],
            "coupling": [{"name": "joint", "between": ["body", "ground"], **joint}],
            "excitation": {"speed": 0.75},
            "torque": [{"on": "body", "mean": 0.1, "harmonics": [harmonic]}],
        }
        model = gr.Model.from_tables({"schema": 1, "name": "joint", "units": "dimensionless", **tables})
        branch = gr.continuation(model, path, (0.05, 0.6))
        row = int(branch.events.index[branch.events["kind"] == "grazing"][0])
        table = branch.gradients(row, ["torque.0.mean", "coupling.joint.stiffness"]).set_index("path")
        curve = branch.boundary(row, "torque.0.mean", (0.095, 0.105))
        assert curve["second"].values[[0, -1]].tolist() == [0.095, 0.105]
        ends = [*curve["value"].values[[0, -1]], table.loc["torque.0.mean", "gradient"]]
        grazings.append([*ends, table.loc["coupling.joint.stiffness", "gradient"]])
    np.testing.assert_allclose(grazings[0], grazings[1], rtol=0, atol=1e-7)
    chord = (grazings[0][1] - grazings[0][0]) / 0.01
    assert grazings[0][2] == pytest.approx(chord, rel=1e-3)


@pytest.mark.long
def test_a_grazing_beside_a_slip_moves_as_those_of_changed_models_do() -> None:
    """The slider begins to stick and the lower corner is touched at once."""
    path, ends = "excitation.speed", (0.80, 0.815)
    first = gr.periodic(with_friction(0.80), cycles=2, start={"angle": [2.5], "velocity": [0.0]})
    branch = gr.continuation(with_friction(0.80), path, ends, cycles=2, start=first)
    row = int(branch.events.index[branch.events["kind"] == "grazing"][0])
    table = branch.gradients(row, ["torque.0.mean", "coupling.joint.hysteresis"]).set_index("path")
    for changed, gradient in table["gradient"].items():
        value, moved = float(table.loc[changed, "value"]), []
        for side in (-2e-4, 2e-4):
            model = branch.model.with_({changed: value * (1.0 + side)})
            other = gr.continuation(model, path, ends, cycles=2, start=gr.periodic(model, 2, start=first))
            moved.append(float(other.events["value"][other.events["kind"] == "grazing"].iloc[0]))
        assert gradient == pytest.approx((moved[1] - moved[0]) / (4e-4 * value), rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("event", "ends"), [(1, (0.79, 0.84)), pytest.param(3, (0.3, 1.6), marks=pytest.mark.long)], ids=["upper", "lower"]
)
def test_a_fold_moves_as_those_of_changed_models_do(event: int, ends: tuple[float, float]) -> None:
    """Those of the changed models are located on a part of the branch that ends behind the fold."""
    branch = over_frequency()
    table = branch.gradients(event, PATHS).set_index("path")
    for path in PATHS:
        value = float(table.loc[path, "value"])
        h = 1e-4 * value
        moved = []
        for side in (-h, h):
            changed = gr.continuation(branch.model.with_({path: value + side}), branch.path, ends, start="linear")
            folds = changed.events["value"][changed.events["kind"] == "fold"]
            moved.append(folds.iloc[0 if event == 1 else 1])
        assert table.loc[path, "gradient"] == pytest.approx((moved[1] - moved[0]) / (2.0 * h), rel=1e-5)


def test_a_period_doubling_scales_with_the_torques() -> None:
    """At a fixed phase the motion over the backlash's stiffness is linear in both torques together."""
    branch = over_amplitude()
    row = branch.events.index[branch.events["kind"] == "period doubling"][0]
    table = branch.gradients(int(row), ["torque.0.mean", "coupling.flanks.clearance"]).set_index("path")
    value = float(branch.events["value"][row])
    assert table.loc["torque.0.mean", "per_10_percent"] == pytest.approx(0.1 * value, rel=1e-6)
    assert abs(table.loc["coupling.flanks.clearance", "per_10_percent"]) < 1e-6 * value


def test_what_moves_it_most_comes_first_and_the_value_itself_is_left_out() -> None:
    table = over_frequency().gradients(1)
    moves = np.abs(table["per_10_percent"].to_numpy())
    assert np.all(np.diff(moves) <= 0.0)
    assert not table["path"].str.startswith("excitation").any()
    assert not table["path"].str.startswith("simulation").any()
    assert set(PATHS) <= set(table["path"])


def test_a_grazing_moves_as_its_closed_form() -> None:
    """Up to it the response is linear: it grazes where mean |1 - W^2 + 0.1 i W| = 0.05 W^2, whatever the clearance."""
    branch = gr.continuation(gr.example("backlash_oscillator"), "excitation.frequency", (0.3, 1.6))
    rows = branch.events.index[branch.events["kind"] == "grazing"]
    assert len(rows) == 2
    for row in rows:
        w = float(branch.events["value"][row])
        size = abs(1.0 - w**2 + 0.1j * w)
        steep = 0.1 * (-2.0 * w * (1.0 - w**2) + 0.01 * w) / size - 0.1 * w
        table = branch.gradients(int(row), ["torque.0.mean", "coupling.mesh.clearance"]).set_index("path")
        assert table.loc["torque.0.mean", "gradient"] == pytest.approx(-size / steep, rel=5e-8)
        assert abs(table.loc["coupling.mesh.clearance", "gradient"]) < 5e-8


def test_a_slider_that_begins_to_slip_has_no_gradient_and_no_border() -> None:
    """The gradient of the motion jumps there, and there is no corner that its depth could be taken from."""
    branch = gr.continuation(with_friction(0.3302), "excitation.speed", (0.3302, 0.3306))
    (row, *_) = branch.events.index[branch.events["kind"] == "grazing"]
    with pytest.raises(gr.ModelError, match=r"found grazing at which .* jumps; must be a fold"):
        branch.gradients(int(row))
    with pytest.raises(gr.ModelError, match="jumps; must be a fold"):
        branch.boundary(int(row), "coupling.joint.stiffness", (0.9, 1.1))


def test_scatter_adds_variances() -> None:
    branch = over_frequency()
    deviations = {"torque.0.mean": 0.01, "coupling.gap.damping": 0.02}
    table = branch.gradients(1, list(deviations)).set_index("path")
    want = np.hypot(*(table.loc[path, "gradient"] * deviation for path, deviation in deviations.items()))
    assert branch.scatter(1, deviations) == pytest.approx(float(want), rel=1e-12)


def test_a_change_of_the_pattern_has_no_gradient() -> None:
    """Two bodies in gaps of their own, pushed alike but for their mass: their crossings exchange order."""
    gap = {**OSCILLATOR["coupling"][0]}
    tables = {
        **OSCILLATOR,
        "inertia": [{"name": "a", "J": 1.0}, {"name": "b", "J": 1.2}],
        "coupling": [
            {**gap, "name": "one", "between": ["a", "ground"]},
            {**gap, "name": "two", "between": ["b", "ground"]},
        ],
        "torque": [{"on": "a", "mean": 0.1}, {"on": "b", "mean": 0.1}],
        "excitation": {"frequency": 1.3},
    }
    branch = gr.continuation(gr.Model.from_tables(tables), "inertia.b.J", (1.2, 0.8))
    rows = branch.events.index[branch.events["kind"] == "pattern"]
    assert len(rows) > 0
    with pytest.raises(gr.ModelError, match="must be a fold"):
        branch.gradients(int(rows[0]))


@pytest.mark.parametrize(
    ("path", "words"),
    [("excitation.frequency", "followed over"), ("torque.0.on", "to a number"), ("mesh.gear.backlash", "mesh")],
)
def test_numbers_that_cannot_move_an_event_are_refused(path: str, words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        over_frequency().gradients(1, [path])


@pytest.mark.long
def test_a_doubling_beside_a_grazing_moves_as_those_of_changed_models_do() -> None:
    """The grazing lies 1.1e-5 of arclength beside it: steps as long as that gave 0.6819."""
    branches = [
        gr.continuation(with_gap(0.098, 0.19, 0.144 * factor), "excitation.speed", (0.45, 0.9))
        for factor in (1.0 - 1e-5, 1.0, 1.0 + 1e-5)
    ]
    less, own, more = (
        next(loss for loss in losses_of(branch) if loss.jumps and loss.kind == "period doubling") for branch in branches
    )
    (row,) = branches[1].gradients(own.event, ["torque.0.mean"]).itertuples()
    assert row.gradient == pytest.approx((more.value - less.value) / (2e-5 * 0.144), rel=1e-7)


def twice_touching(small: float) -> gr.Model:
    """Two swings in a period, that differ a little: the stiff stage is touched by one just after the other."""
    stages = [{"stiffness": 1.0, "damping": 0.1, "until": 1.0}, {"stiffness": 4.0, "damping": 0.1}]
    harmonics = [{"order": 2, "amplitude": 0.5}, {"order": 1, "amplitude": small, "phase": 0.5}]
    tables = {
        "inertia": [{"name": "body", "J": 1.0}],
        "coupling": [{"name": "joint", "between": ["body", "ground"], "stages": stages}],
        "excitation": {"speed": 0.3},
        "torque": [{"on": "body", "mean": 0.1, "harmonics": harmonics}],
    }
    return gr.Model.from_tables({"schema": 1, "name": "joint", "units": "dimensionless", **tables})


def test_each_of_two_grazings_side_by_side_moves_as_those_of_changed_models_do() -> None:
    """They are 1.3e-5 apart; motions beyond the first one gave the second a gradient 6 % too large."""
    path, small, model = "torque.0.harmonics.0.amplitude", "torque.0.harmonics.1.amplitude", twice_touching(1e-5)

    def grazings(model: gr.Model) -> np.ndarray:
        events = gr.continuation(model, path, (0.57, 0.59)).events
        assert events["kind"].tolist() == ["grazing", "grazing"]
        return events["value"].to_numpy()

    branch = gr.continuation(model, path, (0.57, 0.59))
    for changed, value, share in ((small, 1e-5, 1e-3), ("coupling.joint.stages.0.until", 1.0, 1e-6)):
        low, high = (grazings(model.with_({changed: value * (1.0 + side)})) for side in (-share, share))
        wanted = (high - low) / (2.0 * share * value)
        known = [branch.gradients(event, [changed])["gradient"].iloc[0] for event in (0, 1)]
        np.testing.assert_allclose(known, wanted, rtol=1e-6)


def spline(speed: float) -> gr.Model:
    """A spline with an error, and a shaft behind it."""
    stages = [{"stiffness": 0.0, "until": 0.0230413}, {"stiffness": 1002.2151, "damping": 0.3845975}]
    error = [{"order": 1, "amplitude": 0.00111329, "phase": -1.3501838}]
    harmonics = [
        {"order": 2, "amplitude": 18.916273, "phase": 1.0637263},
        {"order": 1, "amplitude": 3.891005, "phase": 0.8368222},
    ]
    tables = {
        "inertia": [
            {"name": "motor", "J": 0.0438793, "drag": 0.1592841},
            {"name": "load", "J": 0.0851381, "drag": 0.0781852},
        ],
        "coupling": [
            {"name": "spline", "between": ["motor", "load"], "stages": stages, "kinematic_error": error},
            {"name": "shaft", "between": ["load", "ground"], "stiffness": 1420.7763, "damping": 0.6594787},
        ],
        "excitation": {"speed": speed},
        "torque": [{"on": "motor", "mean": 1.0, "harmonics": harmonics}],
    }
    return gr.Model.from_tables({"schema": 1, "name": "spline", **tables})


@pytest.mark.long
def test_a_neimark_sacker_bifurcation_beside_a_grazing_moves_as_those_of_changed_models_do() -> None:
    """The grazing lies 1.2e-3 before it; differences of second order over steps of 1e-5 were off by 1e-4."""
    speed, share = 79.32908, 1e-6
    speeds = [speed * (1.0 + side) for side in (-share, 0.0, share)]
    branches = [gr.continuation(spline(one), "torque.0.mean", (0.0, 7.0)) for one in speeds]
    rows = [int(branch.events.index[branch.events["kind"] == "Neimark-Sacker"][0]) for branch in branches]
    low, own, high = (float(branch.events["value"][row]) for branch, row in zip(branches, rows, strict=True))
    assert own == pytest.approx(6.35174, abs=1e-5)
    moved = branches[1].gradients(rows[1], ["excitation.speed"])["gradient"].iloc[0]
    assert moved == pytest.approx((high - low) / (2.0 * share * speed), rel=1e-7)


@pytest.fixture(scope="module")
def closing() -> Branch:
    """A branch of 2 T that closes in a period doubling of that of 1 T, which is followed from there."""
    return gr.continuation(body_with_backlash(0.1216, 0.1555, 0.216, 0.46), FREQUENCY, (0.462, 0.466), cycles=2)


@pytest.fixture(scope="module")
def rejoining() -> Branch:
    """A branch without symmetry that ends where it joins the symmetric one."""
    return gr.continuation(symmetric(0.0), AMPLITUDE, (0.42, 0.37))


def test_the_doubling_at_which_a_branch_closes_moves_as_on_the_branch_that_it_joins(closing: Branch) -> None:
    assert closing.events["kind"].tolist() == ["period doubling"] * 2
    assert [curve.cycles for curve in closing.curves] == [2, 1]
    one, other = (closing.gradients(row).set_index("path")["gradient"] for row in (0, 1))
    assert other.notna().all()
    np.testing.assert_allclose(one[other.index], other, rtol=1e-7, atol=1e-10)
    deviations = {"torque.0.mean": 0.01, "inertia.body.drag": 0.002}
    assert closing.scatter(0, deviations) == pytest.approx(closing.scatter(1, deviations), rel=1e-7)


@pytest.mark.slow
def test_the_doubling_at_which_a_branch_closes_moves_as_those_of_changed_models_do(closing: Branch) -> None:
    path, drag, share = "inertia.body.drag", 0.1216, 1e-5
    low, high = (
        gr.continuation(closing.model.with_({path: drag * (1.0 + side)}), FREQUENCY, (0.462, 0.466), cycles=2)
        for side in (-share, share)
    )
    moved = float(high.events["value"][0] - low.events["value"][0])
    gradient = closing.gradients(0, [path])["gradient"].iloc[0]
    assert gradient == pytest.approx(moved / (2.0 * share * drag), rel=1e-7)


@pytest.mark.long
def test_the_border_of_the_doubling_at_which_a_branch_closes_is_that_of_the_other_branch(closing: Branch) -> None:
    one, other = (closing.boundary(row, "inertia.body.drag", (0.12, 0.123)) for row in (0, 1))
    assert one.attrs["notes"] == other.attrs["notes"] == []
    np.testing.assert_allclose(one["second"], other["second"], rtol=1e-9)
    np.testing.assert_allclose(one["value"], other["value"], rtol=1e-12)


def test_a_breaking_of_symmetry_moves_alike_on_both_branches(rejoining: Branch) -> None:
    """The motion scales with the gap and the torque together."""
    assert rejoining.events["kind"].tolist() == ["symmetry breaking"] * 2
    one, other = (rejoining.gradients(row).set_index("path")["gradient"] for row in (0, 1))
    assert other.notna().all()
    np.testing.assert_allclose(one[other.index], other, rtol=1e-7, atol=1e-10)
    assert one["coupling.gap.clearance"] == pytest.approx(float(rejoining.events["value"][0]), rel=1e-8)


@pytest.mark.slow
def test_a_breaking_of_symmetry_moves_as_those_of_changed_models_do(rejoining: Branch) -> None:
    table = rejoining.gradients(0).set_index("path")
    for path in ("inertia.body.drag", "coupling.gap.damping", "excitation.speed"):
        value, share = float(table.loc[path, "value"]), 1e-5
        low, high = (
            gr.continuation(rejoining.model.with_({path: value * (1.0 + side)}), AMPLITUDE, (0.42, 0.37))
            for side in (-share, share)
        )
        moved = float(high.events["value"][0] - low.events["value"][0])
        assert table.loc[path, "gradient"] == pytest.approx(moved / (2.0 * share * value), rel=1e-7)


@pytest.mark.long
@pytest.mark.parametrize("row", [0, 1])
def test_the_border_of_a_breaking_of_symmetry_goes_with_the_gap(rejoining: Branch, row: int) -> None:
    curve = rejoining.boundary(row, "coupling.gap.clearance", (0.5, 2.0))
    assert curve.attrs["kind"] == "symmetry breaking"
    assert curve.attrs["notes"] == []
    assert curve["second"].values[[0, -1]].tolist() == [0.5, 2.0]
    assert np.ptp(curve["value"].values / curve["second"].values) < 1e-11


def test_a_number_that_takes_the_symmetry_away_moves_no_breaking_of_it() -> None:
    """Two mean torques that cancel."""
    tables = symmetric(0.0).to_tables()
    tables["torque"] = [{**tables["torque"][0], "mean": 0.1}, {"on": "body", "mean": -0.1}]
    branch = gr.continuation(gr.Model.from_tables(tables), AMPLITUDE, (0.42, 0.37))
    table = branch.gradients(0).set_index("path")["gradient"]
    assert table[table.isna()].index.tolist() == ["torque.0.mean", "torque.1.mean"]
    with pytest.raises(gr.ModelError, match="cannot be changed alone for a breaking of symmetry"):
        branch.boundary(0, "torque.0.mean", (0.05, 0.2))
