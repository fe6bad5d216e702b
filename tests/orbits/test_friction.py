"""Branches of an oscillator whose joint has a clearance and friction: what the slider does adds no events."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.orbits.followed_branch import followed
from gearrattle.orbits.value_family import follower_over

SPEED = "excitation.speed"


def oscillator(speed: float) -> gr.Model:
    joint = {"stiffness": 1.0, "damping": 0.1, "damping_ratio": 1.0, "stiffness_ratio": 0.1, "clearance": 1.0}
    slider = {"hysteresis": 0.1, "stick_stiffness": 2.0}
    torque = {"on": "body", "mean": 0.1, "harmonics": [{"order": 1, "amplitude": 0.3}]}
    tables = {
        "inertia": [{"name": "body", "J": 1.0}],
        "coupling": [{"name": "joint", "between": ["body", "ground"], **joint, **slider}],
        "excitation": {"speed": speed},
        "torque": [torque],
    }
    return gr.Model.from_tables({"schema": 1, "name": "joint with friction", "units": "dimensionless", **tables})


def test_a_branch_over_the_mean_torque_begins_where_the_driveline_is_symmetric() -> None:
    """Without mean torque alone: there it meets the branch that comes back."""
    ends = (0.0, 0.05)
    there, back = (gr.continuation(oscillator(0.9), "torque.0.mean", range) for range in (ends, ends[::-1]))
    for one, other in ((there.points[-1], back.points[0]), (there.points[0], back.points[-1])):
        assert one.parameter == other.parameter
        np.testing.assert_allclose(one.state, other.state, rtol=0, atol=1e-8)


@pytest.mark.parametrize("ends", [(0.77, 0.785), (0.785, 0.77)])
def test_a_slider_that_sticks_at_the_end_of_the_period_or_at_its_start_is_no_event(ends: tuple[float, float]) -> None:
    """At 0.778963 the last of eight crossings passes the start of the period."""
    large = gr.periodic(oscillator(0.77), start={"angle": [2.5], "velocity": [0.0]})
    first = large if ends[0] == 0.77 else gr.periodic(oscillator(ends[0]), start=large)
    branch = gr.continuation(oscillator(ends[0]), SPEED, ends, start=first)
    assert branch.events.empty
    assert {len(point.motion.crossings.time) for point in branch.points} == {8}
    for point in branch.points:
        start, end = point.motion.start, point.motion.end
        assert np.array_equal(start.auxiliary_pieces, end.auxiliary_pieces)


@pytest.mark.parametrize("begin", [pytest.param(1.46, marks=pytest.mark.long), 1.6])
def test_the_root_of_a_grazing_is_that_of_the_multipliers_beside_it(begin: float) -> None:
    """The slider sticks where the corner is touched: both happen at once, in an order that rounding decides."""
    branch = gr.continuation(oscillator(begin), SPEED, (begin, 1.3))
    grazing = branch.events[branch.events["kind"] == "grazing"].iloc[0]
    event = next(event for event in branch.events_of_curves[int(grazing["branch"])] if event.kind == "grazing")
    cycles = branch.curves[int(grazing["branch"])].cycles
    at = branch.orbit_at(event.point, cycles)
    distance = 1e-7
    beyond = gr.periodic(oscillator(float(grazing["value"]) + distance), cycles, start=at)
    change = np.trace(beyond.motion.gradient) - np.trace(at.motion.gradient)
    assert grazing["root"] == pytest.approx(change / np.sqrt(distance), rel=5e-3)


@pytest.mark.parametrize("ends", [(0.6, 1.0), (0.705, 0.715)])
def test_a_branch_ends_at_the_edge_of_a_family_with_two_free_states(ends: tuple[float, float]) -> None:
    """Both sliders of a clutch stick all along; beside the edge, Newton's method takes a motion of it for any other."""
    stages = [
        {"stiffness": 0.3, "damping": 0.05, "until": 0.5, "hysteresis": 0.05, "stick_stiffness": 1.0},
        {"stiffness": 2.0, "damping": 0.1, "hysteresis": 0.3, "stick_stiffness": 5.0},
    ]
    torques = [
        {"on": "engine", "mean": 0.2, "harmonics": [{"order": 1, "amplitude": ends[0]}]},
        {"on": "gearbox", "mean": -0.2},
    ]
    inertias = [{"name": "engine", "J": 3.0, "drag": 0.1}, {"name": "gearbox", "J": 1.0, "drag": 0.1}]
    tables = {
        "inertia": inertias,
        "coupling": [{"name": "clutch", "between": ["engine", "gearbox"], "stages": stages}],
        "excitation": {"speed": 1.0},
        "torque": torques,
    }
    model = gr.Model.from_tables({"schema": 1, "name": "clutch", "units": "dimensionless", **tables})
    branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", ends)
    assert branch.events.empty
    assert len(branch.notes) == 1
    assert "the edge of a family with 2 free states at 0.7" in branch.notes[0]


def symmetric_pair(amplitude: float) -> gr.Model:
    """Two bodies and a gap with friction, alike in both directions."""
    gap = {"stiffness": 11.7, "damping": 0.14, "clearance": 0.83, "stiffness_ratio": 0.1, "damping_ratio": 0.3}
    shaft = {"stiffness": 2.24, "damping": 0.05}
    tables = {
        "inertia": [{"name": "a", "J": 0.53, "drag": 0.061}, {"name": "b", "J": 0.89, "drag": 0.109}],
        "coupling": [
            {"name": "input", "between": ["a", "ground"], **shaft},
            {"name": "gap", "between": ["a", "b"], **gap, "hysteresis": 0.32, "stick_stiffness": 7.81},
            {"name": "output", "between": ["b", "ground"], **shaft},
        ],
        "excitation": {"speed": 0.82},
        "torque": [{"on": "a", "harmonics": [{"order": 1, "amplitude": amplitude}]}],
    }
    return gr.Model.from_tables({"schema": 1, "name": "pair", "units": "dimensionless", **tables})


@pytest.mark.long
def test_a_grazing_is_of_what_crosses_its_bound_on_one_side_only() -> None:
    """Both halves touch at once; another corner is crossed more slowly, on both sides of the grazing."""
    ends = (4.35, 4.75)
    branch = gr.continuation(symmetric_pair(ends[0]), "torque.0.harmonics.0.amplitude", ends)
    grazings = [event for event in branch.events_of_curves[0] if event.kind == "grazing"]
    assert len(grazings) == 5
    for event in grazings:
        at = branch.orbit_at(event.point, 1)
        sides = (gr.periodic(symmetric_pair(event.point.parameter + side), start=at) for side in (-1e-5, 1e-5))
        few, many = (np.bincount(motion.motion.crossings.watch, minlength=2) for motion in sides)
        assert (few != many).nonzero()[0].tolist() == [event.watch]


def late_friction(amplitude: float) -> gr.Model:
    """A body on a spring in two stages; the friction of the second one is let go with what its spring holds."""
    friction = {"hysteresis": 0.4, "stick_stiffness": 5.0}
    stages = [{"stiffness": 0.5, "damping": 0.05, "until": 0.5}, {"stiffness": 2.0, "damping": 0.1, **friction}]
    tables = {
        "inertia": [{"name": "body", "J": 1.0, "drag": 0.15}],
        "coupling": [{"name": "clutch", "between": ["body", "ground"], "stages": stages}],
        "excitation": {"speed": 0.7},
        "torque": [{"on": "body", "mean": 1.2, "harmonics": [{"order": 1, "amplitude": amplitude}]}],
    }
    return gr.Model.from_tables({"schema": 1, "name": "late friction", "units": "dimensionless", **tables})


def lowest_later(state: State, amplitude: float) -> float:
    """The lowest deflection of the clutch 200 periods after an amplitude was changed."""
    period_map = PeriodMap(assemble(late_friction(amplitude)).system)
    return float(period_map.levels(period_map(period_map.later(state, 200)))[0, 0])


@pytest.mark.slow
def test_a_branch_ends_where_a_slider_is_let_go_with_its_torque() -> None:
    branch = gr.continuation(late_friction(0.76), "torque.0.harmonics.0.amplitude", (0.76, 0.9))
    end = branch.events.iloc[-1]
    assert (end["kind"], end["grazing"], end["clearance"]) == ("grazing", "release", "clutch")
    assert branch.notes == (
        f"A branch ends inside the range at {end['value']:.9g}: a slider is let go with its torque, "
        "and the motion jumps.",
    )
    assert f"Going up the motion jumps at {end['value']:.5g}." in branch.sentence
    last = branch.points[-1].motion.start
    below, above = (lowest_later(last, end["value"] + side) for side in (-1e-6, 1e-6))
    assert below == pytest.approx(0.5, abs=1e-5)
    assert above < 0.45


@pytest.mark.long
def test_unstable_motions_end_where_the_visit_that_lets_a_slider_go_vanishes() -> None:
    """The speed of that visit falls in proportion to the distance; beyond, Newton's method finds no motion nearby."""
    branch = gr.continuation(late_friction(0.85), "torque.0.harmonics.0.amplitude", (0.85, 0.7))
    assert branch.events["grazing"].iloc[-1] == "release"
    end = float(branch.events["value"].iloc[-1])
    speeds = {}
    for point in branch.points[-8:-1]:
        crossings = point.motion.crossings
        speeds[end - point.parameter] = float(np.abs(crossings.velocity[crossings.watch == 0]).min())
    distances = [distance for distance in speeds if 1e-6 < distance < 2e-4]
    assert len(distances) > 2
    shares = [speeds[distance] / distance for distance in distances]
    assert shares == pytest.approx([shares[-1]] * len(shares), rel=1e-2)


@pytest.mark.long
def test_no_motion_is_said_to_be_missing_where_the_map_jumps() -> None:
    """Two stable motions beside a gap in which no unstable one lies between them: the signs add up to 2."""
    motions = gr.periodic(late_friction(0.795), every=True)
    assert [motion.stable for motion in motions] == [True, True]
    assert motions[0].notes[0] == (
        "Whether all motions were found cannot be counted: a slider may be let go with its torque."
    )


def three_stages(speed: float) -> gr.Model:
    """Two bodies and a clutch in three stages, those with friction on the drive side."""
    stages = [
        {"stiffness": 0.74, "damping": 0.07, "until": 0.44},
        {"stiffness": 2.0, "damping": 0.05, "until": 0.713, "hysteresis": 0.112, "stick_stiffness": 7.616},
        {"stiffness": 5.0, "damping": 0.19, "hysteresis": 0.392, "stick_stiffness": 5.44},
    ]
    tables = {
        "inertia": [{"name": "a", "J": 1.14, "drag": 0.09}, {"name": "b", "J": 2.82, "drag": 0.15}],
        "coupling": [{"name": "clutch", "between": ["a", "b"], "stages": stages}],
        "excitation": {"speed": speed},
        "torque": [
            {"on": "a", "mean": 1.06, "harmonics": [{"order": 1, "amplitude": 0.94}]},
            {"on": "b", "mean": -1.06},
        ],
    }
    return gr.Model.from_tables({"schema": 1, "name": "three stages", "units": "dimensionless", **tables})


@pytest.mark.long
@pytest.mark.parametrize("ends", [(1.49, 1.5), (1.5, 1.49)])
def test_a_crossing_that_lets_a_slider_go_may_pass_the_begin_of_the_period(ends: tuple[float, float]) -> None:
    """At 1.494737. The slider holds its torque at the begin on one side only; the motion settles alike."""
    branch = gr.continuation(three_stages(ends[0]), SPEED, ends)
    assert branch.notes == ()
    assert branch.events.empty
    assert [curve.points[-1].parameter for curve in branch.curves] == [ends[1]]
    assert bool(branch.data["stable"].values.all())
    last = PeriodMap(assemble(three_stages(ends[1])).system)
    settled = last(last.later(branch.points[0].motion.start, 400))
    assert branch.points[-1].state == pytest.approx(settled.start.y, abs=1e-9)
    assert np.ptp(branch.data["peak_to_peak"].values) == pytest.approx(5.05e-2, rel=2e-2)


@pytest.mark.long
@pytest.mark.parametrize("last", [0.75, 1.4])
def test_the_end_of_a_branch_does_not_depend_on_its_steps(last: float) -> None:
    """A long step leads over the end to another branch; shorter ones go on from where it began."""
    friction = {"hysteresis": 0.15, "stick_stiffness": 5.5}
    stages = [{"stiffness": 0.64, "damping": 0.07, "until": 0.44}, {"stiffness": 6.5, "damping": 0.07, **friction}]
    tables = {
        "inertia": [{"name": "a", "J": 1.04, "drag": 0.22}],
        "coupling": [{"name": "clutch", "between": ["a", "ground"], "stages": stages}],
        "excitation": {"speed": 0.715},
        "torque": [{"on": "a", "harmonics": [{"order": 1, "amplitude": 1.48}]}],
    }
    model = gr.Model.from_tables({"schema": 1, "name": "clutch", "units": "dimensionless", **tables})
    follower = follower_over(model, SPEED, (0.715, last), 1, first=0.715)
    begin = follower.begin(gr.periodic(model).motion.start, 0.715)
    end = followed(follower, begin, (0.715, last)).events[-1]
    assert end.grazing is not None
    assert end.grazing.kind == "release"
    assert end.point.parameter == pytest.approx(0.735754853, abs=1e-8)


def clutch_between(
    inertias: tuple[float, float],
    drags: tuple[float, float],
    shaft: float,
    stages: list[dict[str, float]],
    **torque: float,
) -> dict[str, Any]:
    """A clutch between two bodies, and a shaft behind the second one."""
    bodies = [{"name": name, "J": J, "drag": drag} for name, J, drag in zip("ab", inertias, drags, strict=True)]
    harmonics = [{"order": 1, "amplitude": torque["amplitude"]}]
    return {
        "schema": 1,
        "name": "staged clutch",
        "units": "dimensionless",
        "inertia": bodies,
        "coupling": [
            {"name": "clutch", "between": ["a", "b"], "stages": stages},
            {"name": "shaft", "between": ["b", "ground"], "stiffness": shaft, "damping": 0.05},
        ],
        "torque": [{"on": "a", "mean": torque["mean"], "harmonics": harmonics}],
    }


@pytest.mark.long
def test_a_slider_that_is_let_go_sooner_than_it_slips_changes_the_pattern() -> None:
    """At 1.115218 the corner and the slip of the outermost stage exchange; the gradient is continuous."""
    stages = [
        {"stiffness": 0.6, "damping": 0.03, "until": 0.215, "hysteresis": 0.064, "stick_stiffness": 3.22},
        {"stiffness": 4.0, "damping": 0.09, "until": 0.516, "hysteresis": 0.192, "stick_stiffness": 4.508},
        {"stiffness": 10.0, "damping": 0.18, "hysteresis": 0.32, "stick_stiffness": 6.44},
    ]
    tables = clutch_between((0.73, 0.99), (0.075, 0.12), 1.0, stages, mean=0.29, amplitude=3.65)
    ends = (1.1150, 1.1155)
    branch = gr.continuation(gr.Model.from_tables({**tables, "excitation": {"speed": ends[0]}}), SPEED, ends)
    assert branch.notes == ()
    assert list(branch.events["kind"]) == ["pattern"]
    event, curve = branch.curves[0].events[0], branch.curves[0]
    follower = branch.follower(curve)
    neighbours = [follower.moved_along(event.point, side * 1e-8).motion for side in (-1.0, 1.0)]
    few, more = sorted((motion.crossings for motion in neighbours), key=lambda crossings: len(crossings.time))
    assert len(more.time) == len(few.time) + 1
    assert np.abs(neighbours[0].gradient - neighbours[1].gradient).max() < 1e-5 * np.abs(neighbours[0].gradient).max()


@pytest.mark.long
def test_a_begin_that_lets_a_slider_go_is_passed_without_a_note() -> None:
    """A step that leads over it by itself: at 1.6601857 the memory at the begin jumps, the motion does not."""
    stages = [
        {"stiffness": 0.354, "damping": 0.03, "until": 0.4, "hysteresis": 0.062, "stick_stiffness": 6.46},
        {"stiffness": 5.9, "damping": 0.18, "hysteresis": 0.31, "stick_stiffness": 12.92},
    ]
    tables = clutch_between((1.25, 1.11), (0.039, 0.084), 1.69, stages, mean=0.0, amplitude=1.07)
    ends = (1.6595, 1.661)
    branch = gr.continuation(gr.Model.from_tables({**tables, "excitation": {"speed": ends[0]}}), SPEED, ends)
    assert branch.notes == ()
    assert branch.events.empty
    pieces = [tuple(point.motion.start.auxiliary_pieces) for point in branch.points]
    assert len(set(pieces)) == 2
    assert branch.points[-1].parameter == ends[1]


@pytest.mark.long
def test_sliders_that_stick_at_one_instant_do_so_in_any_order() -> None:
    """From 1.178751 on the outer stage slips as well; then both sliders stick where the rate turns."""
    stages = [
        {"stiffness": 0.666, "damping": 0.03, "until": 0.335, "hysteresis": 0.064, "stick_stiffness": 4.65},
        {"stiffness": 11.1, "damping": 0.12, "hysteresis": 0.32, "stick_stiffness": 9.3},
    ]
    tables = clutch_between((1.01, 1.35), (0.085, 0.128), 2.49, stages, mean=0.62, amplitude=1.178)
    tables["torque"][0]["harmonics"].append({"order": 2, "amplitude": 0.3, "phase": 3.9})
    model = gr.Model.from_tables({**tables, "excitation": {"speed": 1.29}})
    branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", (1.178, 1.182))
    assert branch.notes == ()
    assert list(branch.events["kind"]) == ["grazing"]
    assert branch.events["value"][0] == pytest.approx(1.178751, abs=1e-6)
    orders = {tuple(point.motion.crossings.watch.tolist()) for point in branch.points[-20:]}
    assert len(orders) > 1  # otherwise rounding has not exchanged them here
    assert len({point.word for point in branch.points[-20:]}) == 1


@pytest.mark.long
def test_no_step_leads_over_a_release_to_another_branch() -> None:
    """The branch of 2 T went on beyond 0.641835448, with multipliers from 5e3 to 0.16 and a note."""
    stages = [
        {"stiffness": 0.354, "damping": 0.04, "until": 0.35, "hysteresis": 0.04, "stick_stiffness": 5.2},
        {"stiffness": 2.36, "damping": 0.1, "until": 0.84, "hysteresis": 0.12, "stick_stiffness": 7.28},
        {"stiffness": 5.9, "damping": 0.18, "hysteresis": 0.2, "stick_stiffness": 10.4},
    ]
    tables = clutch_between((0.57, 0.83), (0.138, 0.11), 2.1, stages, mean=0.67, amplitude=0.641)
    tables["torque"][0]["harmonics"][0]["phase"] = 0.5
    model = gr.Model.from_tables({**tables, "excitation": {"speed": 0.83}})
    branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", (0.641, 0.6425))
    ends = [(curve.cycles, curve.events[-1]) for curve in branch.curves]
    assert [(cycles, event.grazing.kind if event.grazing else "") for cycles, event in ends] == [
        (1, "release"),
        (2, "release"),
    ]
    assert [event.point.parameter for _, event in ends] == pytest.approx([0.641840342, 0.641835448], abs=1e-8)
    assert all("a slider is let go with its torque" in note for note in branch.notes)


@pytest.mark.parametrize("path", ["coupling.joint.hysteresis", "coupling.joint.clearance"])
def test_no_branch_begins_where_a_slider_or_a_corner_comes_or_goes(path: str) -> None:
    with pytest.raises(gr.ModelError, match=r"range: found 0; .*a corner or a slider of joint .*\(begin at the other"):
        gr.continuation(oscillator(1.46), path, (0.0, 0.1))


@pytest.mark.parametrize(("own", "other"), [(0.1, 0.0), (0.0, 0.1)])
def test_a_search_may_begin_on_a_motion_of_a_model_with_other_sliders(own: float, other: float) -> None:
    path = "coupling.joint.hysteresis"
    model, start = oscillator(1.46).with_({path: own}), gr.periodic(oscillator(1.46).with_({path: other}))
    assert gr.periodic(model, start=start).residual < 1e-9
    assert gr.periodic(model, start=start.run).residual < 1e-9


@pytest.mark.long
def test_a_branch_ends_just_before_its_slider_goes() -> None:
    path = "coupling.joint.hysteresis"
    branch = gr.continuation(oscillator(1.46), path, (0.02, 0.0))
    assert 0.0 < float(branch.data["value"][-1]) < 1e-9
    assert branch.notes[0] == f"At {path} = 0 a slider of joint comes or goes: branches end just before."
    without = gr.periodic(oscillator(1.46).with_({path: 0.0}))
    assert float(branch.data["peak_to_peak"][-1, 0]) == pytest.approx(
        float(np.ptp(without.run.data["deflection"].values)), rel=1e-3
    )


@pytest.mark.long
def test_the_curve_of_an_event_ends_just_before_its_slider_goes() -> None:
    path = "coupling.joint.hysteresis"
    branch = gr.continuation(oscillator(1.46), SPEED, (1.46, 1.3))
    smooth = branch.events[(branch.events["kind"] == "grazing") & ~branch.events["collision"]].index[0]
    curve = branch.boundary(int(smooth), path, (0.0, 0.11))
    assert 0.0 < float(curve["second"][0]) < 1e-4
    assert curve.attrs["notes"][0].startswith(f"The event is not found beyond {path} = ")
