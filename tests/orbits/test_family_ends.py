"""Where families of motions end: closed forms, how they move, and what happens just beyond."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.orbits import Branch

SPEED, AMPLITUDE = "excitation.speed", "torque.0.harmonics.0.amplitude"
DRIVE = [{"on": "a", "mean": 0.0, "harmonics": [{"order": 1, "amplitude": 1.0}]}]


def loose_gear(speed: float = 0.6, **drive: Any) -> gr.Model:
    """A driven body on a spring; behind a gap a body that nothing else holds."""
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "a", "J": 1.0, "drag": 0.1}, {"name": "b", "J": 0.2, "drag": 0.05}],
            "coupling": [
                {"name": "s", "between": ["a", "ground"], "stiffness": 1.0, "damping": 0.1},
                {"name": "gap", "between": ["a", "b"], "stiffness": 10.0, "damping": 0.5, "clearance": 1.0},
            ],
            "excitation": {"speed": speed},
            "torque": [DRIVE[0] | drive],
        }
    )


def link(between: str, stiffness: float, damping: float, **others: Any) -> dict[str, Any]:
    """A coupling of two bodies, told by their letters; a dot is the ground."""
    ends = ["ground" if letter == "." else letter for letter in between]
    return {"name": between.replace(".", "0"), "between": ends, "stiffness": stiffness, "damping": damping, **others}


def slider(speed: float = 0.5) -> gr.Model:
    """A body on a slider that sticks as long as its spring carries less than its limit."""
    stage = {"stiffness": 1.0, "damping": 0.05, "hysteresis": 0.5, "stick_stiffness": 2.0}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "a", "J": 1.0, "drag": 0.1}],
            "coupling": [{"name": "joint", "between": ["a", "ground"], "stages": [stage]}],
            "excitation": {"speed": speed},
            "torque": DRIVE,
        }
    )


def gap_closed(speed: float) -> float:
    """The amplitude at which the driven body of ``loose_gear`` swings by 1, half its gap."""
    return float(abs(1.0 - speed**2 + 0.2j * speed))


def limit_reached(speed: float) -> float:
    """The amplitude at which the spring of ``slider`` carries its limit: at a swing of 0.125."""
    return float(0.125 * abs(3.0 - speed**2 + 0.15j * speed))


def assert_same_back(branch: Branch) -> None:
    """Followed back from its last motion a branch has the same events in reverse order."""
    curve, (begin, end) = branch.curves[0], branch.range
    last = curve.points[-1]
    ends = (end, begin) if last.parameter == end else (begin, end)
    back = gr.continuation(branch.model, branch.path, ends, start=branch.orbit_at(last, curve.cycles))
    assert back.curves[0].note == ""
    assert back.curves[0].points[-1].parameter == begin
    events, again = (b.events[b.events["branch"] == 0] for b in (branch, back))
    assert again["kind"].tolist() == events["kind"].tolist()[::-1]
    np.testing.assert_allclose(again["value"], events["value"][::-1], rtol=0, atol=1e-9)


DRIVELINES = pytest.mark.parametrize(
    ("driveline", "end"), [(loose_gear, gap_closed), (slider, limit_reached)], ids=["loose gear", "slider"]
)


@DRIVELINES
def test_the_gradient_of_the_end_of_a_family_is_that_of_its_closed_form(
    driveline: Callable[[float], gr.Model], end: Callable[[float], float]
) -> None:
    speed = 0.55
    own = end(speed)
    branch = gr.continuation(driveline(speed), AMPLITUDE, (0.5 * own, 1.02 * own))
    events = branch.events
    event = int(events.index[events["kind"] == "end of a family"][0])
    assert events["value"][event] == pytest.approx(own, abs=1e-11)
    table = branch.gradients(event, ["excitation.speed"])
    difference = (end(speed + 1e-5) - end(speed - 1e-5)) / 2e-5
    assert table["gradient"][0] == pytest.approx(difference, rel=1e-6)


@pytest.mark.long
def test_an_end_that_moves_fast_has_the_gradient_of_its_closed_form() -> None:
    """Near the resonance: with less than 0.199 the gear never touches, whatever the speed."""
    amplitude = 0.1992
    speed = float(np.sqrt(0.98 - np.sqrt(0.98**2 - 1.0 + amplitude**2)))
    model = loose_gear(harmonics=[{"order": 1, "amplitude": amplitude}])
    branch = gr.continuation(model, SPEED, (0.98, speed + 1e-6), start="linear")
    assert branch.events["kind"].tolist() == ["end of a family"]
    assert branch.events["value"][0] == pytest.approx(speed, abs=1e-11)
    table = branch.gradients(0, [AMPLITUDE])
    slope = (2.0 * speed**3 - 1.96 * speed) / amplitude  # half of d/dw ((1 - w^2)^2 + 0.04 w^2), over the amplitude
    assert table["gradient"][0] == pytest.approx(1.0 / slope, rel=1e-5)


def test_the_end_of_a_family_between_two_bodies_moves_with_both_gaps() -> None:
    """Where one body swings more, the middle of the family moves half as fast as its edge, and not with the branch."""
    swings = {"a": (1.7, 1.0, 1.0), "c": (2.2, 0.7, 0.4)}  # stiffness, inertia, amplitude for a unit
    speed, gaps, mean = 0.9, (0.6, 0.31), 0.15
    responses = {name: 1.0 / abs(k - J * speed**2 + 0.2j * speed) for name, (k, J, _) in swings.items()}
    # the body floats between mean / 1.7 + amplitude * response - gap of a and gap of c - 0.1 / 2.2 - 0.4 * response
    own = (sum(gaps) - 0.1 / 2.2 - 0.4 * responses["c"] - mean / 1.7) / responses["a"]
    model = gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [
                {"name": "a", "J": 1.0, "drag": 0.1},
                {"name": "b", "J": 0.3, "drag": 0.05},
                {"name": "c", "J": 0.7, "drag": 0.1},
            ],
            "coupling": [
                link("a.", 1.7, 0.1),
                link("ab", 9.0, 0.4, clearance=gaps[0]),
                link("bc", 7.0, 0.4, clearance=gaps[1]),
                link("c.", 2.2, 0.1),
            ],
            "excitation": {"speed": speed},
            "torque": [
                {"on": "a", "mean": mean, "harmonics": [{"order": 1, "amplitude": 0.8 * own}]},
                {"on": "c", "mean": -0.1, "harmonics": [{"order": 1, "amplitude": 0.4, "phase": 1.1}]},
            ],
        }
    )
    branch = gr.continuation(model, AMPLITUDE, (0.8 * own, own + 1e-6), start="linear")
    assert branch.events["kind"].tolist() == ["end of a family"]
    assert branch.events["value"][0] == pytest.approx(own, abs=1e-11)
    table = branch.gradients(0, ["coupling.ab.clearance", "coupling.bc.clearance", "torque.0.mean"])
    right = {"coupling.ab.clearance": 1.0, "coupling.bc.clearance": 1.0, "torque.0.mean": -1.0 / 1.7}
    values = [right[path] / responses["a"] for path in table["path"]]
    np.testing.assert_allclose(table["gradient"], values, rtol=1e-6)


@pytest.mark.long
def test_what_a_family_does_not_depend_on_does_not_move_its_end() -> None:
    """A mean torque on the driven body moves the middle of the family, but not how long that is."""
    model = loose_gear(mean=0.05)
    out = gr.continuation(model, AMPLITUDE, (0.5, 0.7))
    touching = out.curves[0].points[-1]
    assert touching.pattern
    branch = gr.continuation(model, AMPLITUDE, (0.5, 0.7), start=out.orbit_at(touching, 1))
    events = branch.events
    ends = events.index[events["kind"] == "end of a family"]
    assert len(ends) == 1
    assert "grazing" not in set(events["kind"])
    table = branch.gradients(int(ends[0]), ["torque.0.mean", "inertia.b.J", "coupling.gap.stiffness"])
    np.testing.assert_allclose(table["gradient"], 0.0, rtol=0, atol=1e-7)


@pytest.mark.long
@DRIVELINES
def test_the_end_of_a_family_is_followed_over_a_second_value(
    driveline: Callable[[float], gr.Model], end: Callable[[float], float]
) -> None:
    own = end(0.5)
    branch = gr.continuation(driveline(0.5), AMPLITUDE, (0.5 * own, 1.02 * own))
    event = int(branch.events.index[branch.events["kind"] == "end of a family"][0])
    curve = branch.boundary(event, "excitation.speed", (0.45, 0.6))
    assert curve.attrs["notes"] == []
    assert curve["second"].values[[0, -1]].tolist() == [0.45, 0.6]
    values = [end(speed) for speed in curve["second"].values.tolist()]
    np.testing.assert_allclose(curve["value"].values, values, rtol=0, atol=1e-10)


@pytest.mark.long
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_curve_of_ends_of_families_ends_where_it_turns_back(way: float) -> None:
    """Two ends meet at the resonance: with less the gear never touches."""
    resonance = float(np.sqrt(0.98))
    least, amplitude = gap_closed(resonance), 0.2
    speed = float(np.sqrt(0.98 - way * np.sqrt(0.98**2 - 1.0 + amplitude**2)))
    model = loose_gear(harmonics=[{"order": 1, "amplitude": amplitude}])
    branch = gr.continuation(model, SPEED, (speed - 0.01 * way, speed + 1e-5 * way), start="linear")
    assert branch.events["kind"].tolist() == ["end of a family"]
    curve = branch.boundary(0, AMPLITUDE, (0.198, 0.2))
    assert curve["special"].values.tolist() == ["turning point", *[""] * (curve.sizes["point"] - 1)]
    assert curve["second"].values[0] == pytest.approx(least, abs=1e-11)
    assert curve["value"].values[0] == pytest.approx(resonance, abs=1e-7)
    values = curve["value"].values
    assert np.all(way * np.diff(values) < 0.0)
    np.testing.assert_allclose([gap_closed(one) for one in values], curve["second"], rtol=0, atol=1e-11)


@pytest.mark.long
def test_a_map_draws_where_a_gear_begins_to_touch() -> None:
    branch = gr.continuation(loose_gear(0.6), AMPLITUDE, (0.5, 0.8))
    motions = branch.map("excitation.speed", (0.55, 0.65), across=3, up=2)
    borders = [border for border in motions.borders if border.kind == "end of a family"]
    assert len(borders) == 1
    values = [gap_closed(speed) for speed in borders[0].second.tolist()]
    np.testing.assert_allclose(borders[0].value, values, rtol=0, atol=1e-10)


def train(bodies: dict[str, tuple[float, float]], couplings: list[Any], speed: float, harmonics: list[Any]) -> gr.Model:
    """Inertias and drags by name; couplings and harmonics as tables."""
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": name, "J": J, "drag": drag} for name, (J, drag) in bodies.items()],
            "coupling": couplings,
            "excitation": {"speed": speed},
            "torque": [{"on": "a", "harmonics": harmonics}],
        }
    )


def joint(**stage: float) -> dict[str, Any]:
    return {"name": "joint", "between": ["a", "ground"], "stages": [{"damping": 0.05, **stage}]}


TRAINS = {
    "doublings just beyond": (
        train(
            {"a": (0.41, 0.041), "b": (0.89, 0.0)},
            [link("a.", 1.89, 0.1), link("ab", 20.2, 0.4, clearance=1.18)],
            1.64,
            [{"order": 1, "amplitude": 0.92082}, {"order": 2, "amplitude": 0.49724, "phase": 2.6}],
        ),
        (1.3612, 2.1484),
        ["end of a family", "period doubling", "period doubling"],
    ),
    "a middle that moves fast": (
        train(
            {"a": (0.66, 0.14), "b": (0.26, 0.0)},
            [link("a.", 1.66, 0.05), link("ab", 26.7, 0.6, clearance=1.16)],
            1.52,
            [{"order": 1, "amplitude": 0.36896}, {"order": 2, "amplitude": 0.18448, "phase": 0.9}],
        ),
        (1.368, 1.6568),
        ["end of a family", *["period doubling"] * 2, "Neimark-Sacker", "fold", "fold"],
    ),
    "three bodies": (
        train(
            {"a": (0.39, 0.11), "b": (0.55, 0.0), "c": (0.57, 0.049)},
            [link("a.", 2.99, 0.12), link("ab", 0.65, 0.13), link("bc", 24.9, 0.83, clearance=0.44)],
            1.76,
            [{"order": 1, "amplitude": 1.9232}, {"order": 2, "amplitude": 0.76928, "phase": 2.1}],
        ),
        (1.9888, 1.6544),
        ["end of a family", "fold"],
    ),
    "out and in again": (
        train(
            {"a": (0.64, 0.108), "b": (1.21, 0.0)},
            [link("a.", 2.69, 0.08), link("ab", 2.5, 0.7, clearance=0.79)],
            1.94,
            [{"order": 1, "amplitude": 0.3638}, {"order": 3, "amplitude": 0.20009, "phase": 5.1}],
        ),
        (1.7848, 2.1728),
        ["end of a family"] * 2,
    ),
    "a slider": (
        train(
            {"a": (1.27, 0.028)},
            [joint(stiffness=0.9, hysteresis=0.24, stick_stiffness=2.13)],
            0.93,
            [{"order": 1, "amplitude": 0.1089}],
        ),
        (0.837, 1.023),
        ["end of a family"],
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("name", TRAINS)
def test_a_family_ends_the_same_on_both_ways(name: str) -> None:
    model, ends, kinds = TRAINS[name]
    branch = gr.continuation(model, SPEED, ends, start="linear")
    events = branch.events
    assert events.loc[events["branch"] == 0, "kind"].tolist() == kinds
    assert branch.curves[0].note == ""
    assert_same_back(branch)


@pytest.mark.parametrize(
    "beyond", [1e-6, 1e-9, 0.0, -1e-9, *(pytest.param(x, marks=pytest.mark.long) for x in (1e-7, -1e-7, -1e-5))]
)
def test_a_range_may_end_at_the_end_of_a_family(beyond: float) -> None:
    """The event is named as soon as the range leads beyond it by more than rounding."""
    own = gap_closed(0.6)
    branch = gr.continuation(loose_gear(0.6), AMPLITUDE, (0.8 * own, own * (1.0 + beyond)), start="linear")
    assert branch.notes == ()
    assert branch.data["value"].values[-1] == own * (1.0 + beyond)
    assert branch.events["kind"].tolist() == (["end of a family"] if beyond > 1e-8 else [])
    assert all(branch.curves[0].points[i].free for i in range(-3, -1)) or beyond > 0.0


@pytest.mark.parametrize("before", [1e-7, *(pytest.param(x, marks=pytest.mark.long) for x in (1e-5, 1e-6))])
@pytest.mark.parametrize("share", [0.04, 0.5, 0.9])
def test_a_range_may_begin_anywhere_in_a_family_near_its_end(share: float, before: float) -> None:
    """Also where the first motion is not in the middle of its family, and the first step leads beyond the end."""
    own = gap_closed(0.6)
    begin = own * (1.0 - before)
    model = loose_gear(0.6, harmonics=[{"order": 1, "amplitude": begin}])
    middle = gr.periodic(model, start="linear")
    (interval,), (a, _) = middle.family, middle.state["angle"]
    gap = interval.low + share * (interval.high - interval.low)
    start = {"angle": [a, a - gap], "velocity": middle.state["velocity"]}
    branch = gr.continuation(model, AMPLITUDE, (begin, 1.01 * own), start=start)
    events = branch.events
    assert events["kind"].tolist() == ["end of a family", "fold"]
    assert events["value"][0] == pytest.approx(own, abs=1e-11)


def test_a_branch_ends_at_the_edge_of_a_family_with_several_free_states() -> None:
    tables = loose_gear().to_tables()
    tables["inertia"].append({"name": "c", "J": 0.2, "drag": 0.1})
    tables["coupling"].append(
        {"name": "wide", "between": ["a", "c"], "stiffness": 1.0, "damping": 0.1, "clearance": 2.0}
    )
    branch = gr.continuation(gr.Model.from_tables(tables), AMPLITUDE, (0.2, 1.0), start="linear")
    assert branch.events["kind"].tolist() == []
    assert "the edge of a family with 2 free states" in branch.notes[0]
    assert branch.data["value"].values[-1] <= gap_closed(0.6)
