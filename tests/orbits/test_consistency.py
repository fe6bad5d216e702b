"""What the points and events of a branch must agree on, whatever the driveline.

A step without a fold goes one way: its events lie between the values at its ends. Where the value turns back there is a
fold. Crossings appear and vanish in pairs, one for every grazing, and multipliers cross the circle at events alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.periodic.events.event_record import BREAKING, DOUBLING, FOLD, GRAZING, NEIMARK_SACKER, Event
from gearrattle.engine.periodic.point import Point
from gearrattle.orbits.branch import Branch
from gearrattle.orbits.branch_switching import branches_missed
from gearrattle.orbits.followed_branch import Curve
from gearrattle.orbits.stability_ranges import losses_of, ranges_of

CIRCLE = 1e-5  # multipliers nearer to the circle than this are on it
ROUNDING = 1e-10  # of the value
KNOWN, UNKNOWN = 1e-6, -2  # a multiplier farther from where it crosses, at a sharp fold, may be another one
SPEED = "excitation.speed"


def contradictions(branch: Branch) -> list[str]:
    """What is wrong with the steps of all branches."""
    return [line for curve in branch.curves for line in contradictions_of(curve)]


def contradictions_of(curve: Curve) -> list[str]:
    lines = []
    for i, (before, after) in enumerate(curve.steps()):
        joins = bool(curve.events) and curve.events[-1].point.length >= curve.points[-1].length
        is_last = i == len(curve.points) - 2
        is_shared = (i == 0 and bool(curve.origin)) or (is_last and joins)  # one multiplier is 1 there but for rounding
        wrong = wrong_in(before, after, events_in(curve, before, after), is_shared)
        lines += [f"{before.parameter:.9g} to {after.parameter:.9g}: {line}" for line in wrong]
    for first, middle, last in zip(curve.points, curve.points[1:], curve.points[2:], strict=False):
        changes = middle.parameter - first.parameter, last.parameter - middle.parameter
        turns = changes[0] * changes[1] < 0.0 and min(map(abs, changes)) > ROUNDING
        if turns and FOLD not in [event.kind for event in events_in(curve, first, last)]:
            lines.append(f"{middle.parameter:.9g}: the value turns back without a fold")
    return lines


def events_in(curve: Curve, first: Point, last: Point) -> list[Event]:
    return [event for event in curve.events if first.length <= event.point.length <= last.length]


def wrong_in(before: Point, after: Point, inside: list[Event], is_shared: bool) -> list[str]:
    """What is wrong with one step and its events; the first point of a branch may be shared with another one."""
    kinds, lines = [event.kind for event in inside], []
    low, high = sorted((before.parameter, after.parameter))
    tolerance = 1e-9 * max(1.0, abs(high))
    values = [event.point.parameter for event in inside]
    if FOLD not in kinds and not all(low - tolerance <= value <= high + tolerance for value in values):
        lines.append(f"events at {values}")
    change = len(after.motion.crossings.time) - len(before.motion.crossings.time)
    if abs(change) > 2 * kinds.count(GRAZING):
        lines.append(f"{change} crossings more with {kinds.count(GRAZING)} grazings")
    near = [np.abs(np.abs(point.multipliers) - 1.0).min(initial=1.0) < CIRCLE for point in (before, after)]
    if (
        not any(near)
        and not is_shared
        and unstable(before) != unstable(after)
        and not set(kinds) - {GRAZING, "pattern"}
    ):
        lines.append(f"{unstable(before)} unstable directions, then {unstable(after)}")
    if not any(near) and not is_shared and GRAZING not in kinds and not any(event.is_collision for event in inside):
        count = unstable(before)
        for event in inside:
            count = unstable_behind(event, count)
        if count not in (UNKNOWN, unstable(after)):
            lines.append(f"{unstable(before)} unstable directions, then {unstable(after)}, with {kinds}")
    return lines


def unstable(point: Point) -> int:
    return int(np.count_nonzero(np.abs(point.multipliers) > 1.0))


def unstable_behind(event: Event, count: int) -> int:
    """How many unstable directions are left behind an event of so many before it; -1 if the event has others."""
    values, pair = event.point.multipliers, event.point.multipliers[event.point.multipliers.imag > 1e-9]
    pair = pair[np.argsort(np.abs(np.abs(pair) - 1.0))][:1]
    crossing = {FOLD: [1.0], BREAKING: [1.0], DOUBLING: [-1.0], NEIMARK_SACKER: [*pair, *pair.conj()]}.get(
        event.kind, []
    )
    if not crossing or count in (UNKNOWN, -1):
        return count
    for value in crossing:
        nearest = int(np.argmin(np.abs(values - value)))
        if abs(values[nearest] - value) > KNOWN:
            return UNKNOWN
        values = np.delete(values, nearest)
    others = int(np.count_nonzero(np.abs(values) > 1.0))
    return 2 * others + len(crossing) - count if count in (others, others + len(crossing)) else -1


def test_it_tells_of_what_is_wrong() -> None:
    """A branch without its events contradicts itself."""
    branch = gr.continuation(gr.example("backlash_oscillator"), SPEED, (1.2, 0.6))
    assert contradictions(branch) == []
    curve = branch.curves[0]
    for kind in (FOLD, GRAZING):
        fewer = Curve(1, curve.points, tuple(event for event in curve.events if event.kind != kind))
        assert contradictions_of(fewer)


def oscillator(mean: float, frequency: float) -> dict[str, Any]:
    """A three-stage clutch on the ground under two harmonics."""
    stages = [
        {"stiffness": 0.3, "damping": 0.03, "until": 0.4},
        {"stiffness": 1.5, "damping": 0.06, "until": 1.1},
        {"stiffness": 3.8, "damping": 0.06},
    ]
    harmonics = [
        {"order": 2, "amplitude": 0.75, "phase": 3.12},
        {"order": 3, "amplitude": 2.4, "phase": 0.05},
    ]
    return {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "body", "J": 1.84}],
        "coupling": [{"name": "clutch", "between": ["body", "ground"], "stages": stages}],
        "excitation": {"speed": frequency},
        "torque": [{"on": "body", "mean": mean, "harmonics": harmonics}],
    }


@pytest.mark.slow
def test_a_doubled_branch_that_folds_soon_after_it_leaves_has_its_fold() -> None:
    """Its motions grow by 1e-3 of a unit up to a grazing, then fold; 2e-2 away it has turned back."""
    model, tables = gr.Model.from_tables(oscillator(0.19, 1.75)), []
    for limit in (None, 0.01):
        branch = gr.continuation(model, SPEED, (2.28, 1.23), step_limit=limit)
        assert contradictions(branch) == []
        assert branch.notes == ()
        tables.append(branch.events[branch.events["branch"] == 1])
    assert tables[0]["kind"].tolist()[:3] == [GRAZING, FOLD, GRAZING]
    assert tables[0]["kind"].tolist() == tables[1]["kind"].tolist()
    np.testing.assert_allclose(tables[0]["value"], tables[1]["value"], rtol=0, atol=1e-8)
    doubling = branch.events[branch.events["kind"] == DOUBLING].iloc[0]["value"]
    assert doubling < tables[0]["value"].iloc[0] < tables[0]["value"].iloc[1]


@pytest.mark.long
def test_a_narrow_range_has_the_branches_of_a_wider_one() -> None:
    """Grazings with folds and period doublings 1e-9 beside them, seen from 1 and from 0.1 rad/s of 180."""
    wide, narrow = (gr.continuation(gr.example("case1"), SPEED, ends) for ends in ((181.0, 180.0), (180.3, 180.2)))
    for branch in (wide, narrow):
        assert contradictions(branch) == []
        assert all(note.startswith("What leaves at ") for note in branch.notes)
    doublings = [event.point.parameter for event in wide.curves[0].events if event.kind == DOUBLING]
    joined = [curve.points[end].parameter for curve in wide.curves[1:] for end in (0, -1)]
    assert sorted(doublings) == pytest.approx(sorted(joined), abs=1e-8)  # every one begins or ends a branch
    values = np.array([event.point.parameter for event in wide.curves[0].events])
    for event in narrow.curves[0].events:
        assert np.abs(values - event.point.parameter).min() < 1e-8


@pytest.mark.long
def test_where_motions_jump_does_not_depend_on_the_steps() -> None:
    """In steps of the length that the branch allows, the last one of a doubled branch holds another doubling."""
    losses = []
    for limit in (None, 0.003):
        branch = gr.continuation(gr.example("case1"), SPEED, (181.0, 180.2), step_limit=limit)
        losses.append([(loss.kind, loss.upward, loss.jumps, loss.value) for loss in losses_of(branch)])
    coarse, fine = ([loss[:-1] for loss in some] for some in losses)
    assert coarse == fine
    assert (DOUBLING, True, False) in coarse
    folds = branch.events["value"][branch.events["kind"] == FOLD]
    unstable = sorted(set(folds) - {loss[-1] for loss in losses[-1]})
    assert unstable == pytest.approx([180.34024797], abs=1e-8)  # where unstable motions turn back nothing jumps
    np.testing.assert_allclose(*([loss[-1] for loss in some] for some in losses), rtol=0, atol=1e-8)


def trains(*, inertia: dict[str, float], drag: dict[str, float], torque: dict[str, Any], **coupling: Any) -> gr.Model:
    """Two inertias in a row, the first one driven: a coupling of stages between them, and a shaft to the ground."""
    first, second = inertia
    shaft = {"name": "shaft", "between": [second, "ground"], **coupling.pop("shaft")}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": name, "J": J, "drag": drag.get(name, 0.0)} for name, J in inertia.items()],
            "coupling": [{"name": "stages", "between": [first, second], **coupling}, shaft],
            "excitation": {"speed": 20.0},
            "torque": [{"on": first, **torque}],
        }
    )


def stages(*values: tuple[float, float, float | None]) -> list[dict[str, float]]:
    rows = ({"stiffness": k, "damping": c, "until": until} for k, c, until in values)
    return [{key: value for key, value in row.items() if value is not None} for row in rows]


def harmonics(*values: tuple[float, float, float]) -> list[dict[str, float]]:
    return [{"order": order, "amplitude": amplitude, "phase": phase} for order, amplitude, phase in values]


def symmetric_clutch() -> gr.Model:
    return trains(
        inertia={"disc": 0.04746, "hub": 0.04953},
        drag={"disc": 0.02, "hub": 0.05},
        stages=stages((126.7, 0.2565, 0.06737), (874.5, 0.6737, None)),
        shaft={"stiffness": 874.5, "damping": 0.6882},
        torque={"harmonics": harmonics((1, 52.77, 2.2), (3, 5.395, 3.008))},
    )


@pytest.mark.long
def test_both_branches_leave_a_breaking_beside_a_grazing_and_a_fold() -> None:
    """They are mirror images: their events are the same, whichever way and with whatever steps they are followed."""
    model, tables = symmetric_clutch(), []
    for ends, limit in (((22.0, 66.0), None), ((41.0, 35.0), None), ((39.9, 40.6), 0.02)):
        branch = gr.continuation(model, SPEED, ends, step_limit=limit)
        assert branch.notes == ()
        assert [curve.origin for curve in branch.curves] == ["", BREAKING, BREAKING]
        one, other = (
            sorted((event.kind, event.point.parameter) for event in curve.events if event.kind != BREAKING)
            for curve in branch.curves[1:]
        )
        for table in (other, *tables):
            assert [kind for kind, _ in table] == [kind for kind, _ in one]
            np.testing.assert_allclose([value for _, value in table], [value for _, value in one], rtol=1e-9)
        tables.append(one)
    both, ends, shown = branch.curves, (39.9, 40.6), str
    assert branches_missed(both, 1, ends, shown) == []
    for known, left in ((both[:2], "2 symmetry breakings"), (both[:1], "2 symmetry breakings")):
        (note,) = branches_missed(known, 1, ends, shown)
        assert note.startswith(f"Not everything that leaves at {left} (40.")


@pytest.mark.long
def test_folds_beside_a_grazing_beside_a_doubling_are_there_both_ways() -> None:
    """Two folds 1.4e-6 rad/s apart beside a grazing: the last step down to the doubling holds all three."""
    model = trains(
        inertia={"flywheel": 0.140468, "gearbox": 0.00890142},
        drag={"flywheel": 0.380522},
        stages=stages((57.9275, 0.0810802, 0.0632372), (309.917, 0.18754, None)),
        coast_stages=stages((49.4083, 0.0748831, 0.0415717), (309.917, 0.18754, None)),
        shaft={"stiffness": 1631.22, "damping": 1.33063},
        torque={
            "mean": 39.8586,
            "harmonics": harmonics((2, 33.0734, 1.44297), (1, 4.75972, 2.28192), (0.5, 7.78433, -1.25845)),
        },
    )
    folds = []
    for ends in ((15.0, 12.8), (12.8, 15.0)):
        branch = gr.continuation(model, SPEED, ends)
        values = branch.events["value"][branch.events["kind"] == FOLD]
        folds.append(sorted(value for value in values if abs(value - 12.8614) < 1e-3))
    assert len(folds[0]) == 2
    np.testing.assert_allclose(*folds, rtol=1e-11)


def test_two_doublings_within_a_step_lose_and_gain_stability() -> None:
    """Between them, from 0.638917 to 0.639410, the stable motions have twice the period."""
    model = gr.example("backlash_oscillator").with_({"torque.0.mean": 0.03228244})
    branch = gr.continuation(model, SPEED, (0.6, 0.66), start="linear")
    first, second = (float(value) for value in branch.events["value"][branch.events["kind"] == DOUBLING][:2])
    losses = [(loss.value, loss.upward, loss.jumps) for loss in losses_of(branch) if loss.kind == DOUBLING]
    assert losses == [(first, True, False), (second, False, False)]
    middle = model.with_({SPEED: 0.5 * (first + second)})
    assert not gr.periodic(middle, start="linear").stable
    assert not [one for one in ranges_of(branch) if one.branch == 0 and one.stable and one.begin < 0.6392 < one.end]


def drawn(seed: int) -> tuple[gr.Model, str, tuple[float, float]]:
    """A driveline of one or two bodies with a staged clutch and sometimes a gap, and what varies over which range."""
    generator = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        return float(generator.uniform(low, high))

    bodies = ["a", "b"][: 1 + seed % 2]
    ends = [*bodies, "ground"]
    widths = sorted(between(0.2, 1.3) for _ in range(2))
    stiffness = np.cumsum([between(0.2, 1.0), between(0.5, 3.0), between(1.0, 4.0)])
    stages = [{"stiffness": float(k), "damping": between(0.02, 0.2)} for k in stiffness]
    clutch = {"name": "clutch", "between": ends[:2], "stages": [*stages]}
    for stage, width in zip(stages, widths, strict=False):
        stage["until"] = width
    rest = {"stiffness": between(0.8, 3.0), "damping": between(0.1, 0.3), "clearance": between(0.6, 1.2)}
    gaps = [{"name": "gap", "between": ends[1:], **rest}] if len(bodies) > 1 else []
    orders = generator.choice([1, 2, 3], size=2, replace=False).tolist()
    harmonics = [{"order": int(n), "amplitude": between(0.4, 2.4), "phase": between(0.0, 6.0)} for n in sorted(orders)]
    speed = between(0.8, 2.4)
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": name, "J": between(0.8, 2.0), "drag": 0.01} for name in bodies],
        "coupling": [clutch, *gaps],
        "excitation": {"speed": speed},
        "torque": [{"on": "a", "mean": between(0.0, 0.3), "harmonics": harmonics}],
    }
    paths = {
        SPEED: (1.3 * speed, 0.7 * speed),
        "torque.0.mean": (0.8, -0.05),
        "torque.0.harmonics.0.amplitude": (0.1, 3.0),
    }
    path = list(paths)[seed % 3]
    return gr.Model.from_tables(tables), path, paths[path]


def test_a_change_of_the_pattern_has_one_name_whichever_way_it_is_passed() -> None:
    model, path, ends = drawn(15)
    there = gr.continuation(model, path, ends)
    back = gr.continuation(model, path, ends[::-1], start=there.orbit(len(there.curves[0].points) - 1))
    exchanges = [
        table[(table["kind"] == "pattern") & (table["branch"] == 0)].sort_values("value")
        for table in (there.events, back.events)
    ]
    assert len(exchanges[0]) == 6
    np.testing.assert_allclose(exchanges[0]["value"], exchanges[1]["value"], rtol=0, atol=1e-8)
    assert exchanges[0]["clearance"].tolist() == exchanges[1]["clearance"].tolist() == ["clutch"] * 6


@pytest.mark.long
@pytest.mark.parametrize("seed", range(40))
def test_branches_of_random_drivelines_agree_with_themselves(seed: int) -> None:
    model, path, ends = drawn(seed)
    assert contradictions(gr.continuation(model, path, ends)) == []


@pytest.mark.long
@pytest.mark.parametrize("seed", range(60))
def test_events_of_random_drivelines_do_not_depend_on_the_steps(seed: int) -> None:
    model, path, ends = drawn(seed)
    last = ends[0] + 0.35 * (ends[1] - ends[0])
    tables = []
    for step_limit in (None, abs(last - ends[0]) / 250.0):
        events = gr.continuation(model, path, (ends[0], last), step_limit=step_limit).events
        tables.append(events[events["branch"] == 0])
    coarse, fine = tables
    assert coarse["kind"].tolist() == fine["kind"].tolist()
    values = (table["value"].to_numpy(np.float64) for table in (coarse, fine))
    np.testing.assert_allclose(*values, rtol=1e-7, atol=1e-7)


@pytest.mark.long
def test_two_breakings_of_symmetry_within_a_step_are_seen_from_every_motion() -> None:
    """Between them the symmetric motion is stable; the motions at both ends of the range have no symmetry."""
    free = {"stiffness": 0.0, "damping": 0.0, "until": 0.030679785582553517}
    first = {"stiffness": 627.7778176655298, "damping": 0.3610934749494195, "until": 0.019519609225427913}
    spline = [free, {"stiffness": 1790.2679683901483, "damping": 0.4411313230924941}]
    shaft = [first, {"stiffness": 2671.4428719053817, "damping": 0.7448856424041294}]
    harmonics = [
        {"order": 1, "amplitude": 106.10329887963277, "phase": -1.197204143286052},
        {"order": 3, "amplitude": 13.576119205836687, "phase": -1.5504426498665567},
    ]
    tables = {
        "schema": 1,
        "inertia": [
            {"name": "motor", "J": 0.03794545781008381, "drag": 0.028284994686437893},
            {"name": "load", "J": 0.034560778247544416, "drag": 0.04312718697073917},
        ],
        "coupling": [
            {"name": "spline", "between": ["motor", "load"], "stages": spline},
            {"name": "shaft", "between": ["load", "ground"], "stages": shaft},
            {
                "name": "centre",
                "between": ["motor", "ground"],
                "stiffness": 177.26076419657957,
                "damping": 0.20205231006130198,
            },
        ],
        "excitation": {"speed": 80.0},
        "torque": [{"on": "motor", "harmonics": harmonics}],
    }
    model = gr.Model.from_tables(tables)
    for ends in ((79.0, 84.0), (84.0, 79.0)):
        branch = gr.continuation(model, "excitation.speed", ends)
        assert set(branch.events["kind"]) <= {"symmetry breaking", "pattern"}
        (own,) = (c for c in branch.curves if {c.points[0].parameter, c.points[-1].parameter} == {79.0, 84.0})
        breakings = [event.point.parameter for event in own.events if event.kind == "symmetry breaking"]
        assert breakings == pytest.approx([81.323909083, 81.764251689], abs=1e-8)
        assert [not curve.notes for curve in branch.curves] == [True] * 5
        assert branch.notes == ()
