"""Steps of a branch of the paper's case 1 that hold several events, or seem to hold one that is none.

Each begins at a motion of the branch from 300 rad/s down, of which the state is written here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import BREAKING, DOUBLING, FOLD, GRAZING, NEIMARK_SACKER
from gearrattle.engine.periodic.events.events_of_step import events_between
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.point import appended, turned_around
from gearrattle.orbits.followed_branch import followed
from gearrattle.orbits.value_family import family_of, follower_over
from tests.orbits.test_consistency import contradictions_of
from tests.orbits.test_laws import symmetric

pytestmark = pytest.mark.compiled

SPEED = "excitation.speed"
OUT_AND_BACK = """
    0.06214418381612598 5.000935932785841e-05 5.736117701669057e-4
    -6.3010377362170065 5.793007069164071 5.9134010202344385 5.913524944165674
"""
ONE_FOLD = """
    0.0625195162845705 5.000989200202749e-05 5.842458611046223e-4
    -6.232975238361221 5.588790483026081 5.617568247351332 5.617593155141215
"""
TOUCHES = """
    0.046927042681412984 -4.7727994192270744e-05 4.936158591296997e-4
    -15.906845561088158 -22.87930661155217 -22.937130712033614 -23.032043704083495
"""


@pytest.mark.parametrize(
    ("start", "first", "last", "expected"),
    [
        pytest.param(
            OUT_AND_BACK,
            147.7259960507107,
            147.70,
            [(GRAZING, 147.7197261), (DOUBLING, 147.7196957), (DOUBLING, 147.7112814)],
            id="a multiplier passes -1 just behind a grazing, and comes back",
        ),
        pytest.param(
            ONE_FOLD,
            149.10287773014363,
            149.0,
            [(GRAZING, 149.0615376), (NEIMARK_SACKER, 149.0615365), (FOLD, 149.0614660)],
            id="a pair outside becomes two real multipliers, one of which passes 1",
        ),
        pytest.param(
            TOUCHES,
            53.063293353444024,
            53.059,
            [(NEIMARK_SACKER, 53.0604058), (GRAZING, 53.0600641), (NEIMARK_SACKER, 53.0599231), (GRAZING, 53.0599188)],
            id="one touch begins and another one ends: nothing is exchanged",
        ),
    ],
)
def test_a_step_has_the_events_that_shorter_steps_have(
    start: str, first: float, last: float, expected: list[tuple[str, float]]
) -> None:
    for longest in (1.0 / 60.0, 1.0 / 600.0):
        family = family_of(gr.example("case1"), SPEED, first, 1, 255.0)
        follower = Continuation(family, longest=longest)
        begin = follower.begin(State(np.array(start.split(), dtype=float)), first, upward=False)
        curve = followed(follower, begin, (last, first + 0.1))
        events = [(event.kind, event.point.parameter) for event in curve.events][: len(expected)]
        assert [kind for kind, _ in events] == [kind for kind, _ in expected]
        for (_, value), (_, expected_value) in zip(events, expected, strict=True):
            assert value == pytest.approx(expected_value, abs=2e-7)
        assert contradictions_of(curve) == []


def chain(parts: list[tuple[float, float, dict[str, Any]]], torques: list[dict[str, Any]]) -> gr.Model:
    """Bodies from the ground on: inertia, drag and what couples it to the one before."""
    names = ["ground", *(f"b{i}" for i in range(len(parts)))]
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": names[i + 1], "J": J, "drag": drag} for i, (J, drag, _) in enumerate(parts)],
            "coupling": [
                {
                    "name": f"c{i}",
                    "between": [names[i + 1], names[i]] if i == 0 else [names[i], names[i + 1]],
                    **coupling,
                }
                for i, (_, _, coupling) in enumerate(parts)
            ],
            "excitation": {"speed": 1.0},
            "torque": torques,
        }
    )


STAGES = [
    {"stiffness": 2.39, "until": 0.396, "damping": 0.0365},
    {"stiffness": 11.9, "until": 0.941, "damping": 0.0365},
    {"stiffness": 23.9, "damping": 0.073},
]
STAGED = chain(
    [
        (1.33, 0.0136, {"stiffness": 1.71, "damping": 0.00775}),
        (1.62, 0.0144, {"stiffness": 7.87, "damping": 0.0382}),
        (1.52, 0.0034, {"stiffness": 2.87, "damping": 0.0352}),
        (1.86, 0.00845, {"stages": STAGES}),
    ],
    [
        {
            "on": "b0",
            "mean": 0.552,
            "harmonics": [
                {"order": 1, "amplitude": 1.24, "phase": 5.54},
                {"order": 2, "amplitude": 0.181, "phase": 2.22},
            ],
        },
        {"on": "b3", "mean": -0.345},
    ],
)
TWO_GAPS = chain(
    [
        (0.429, 0.00259, {"stiffness": 2.77, "damping": 0.00776}),
        (1.3, 0.00416, {"stiffness": 26.7, "damping": 0.0157, "clearance": 0.893, "stiffness_ratio": 0.05}),
        (
            0.849,
            0.00424,
            {
                "stiffness": 11.0,
                "damping": 0.00562,
                "clearance": 0.529,
                "stiffness_ratio": 0.05,
                "damping_ratio": 0.3,
            },
        ),
    ],
    [
        {"on": "b0", "mean": 0.298, "harmonics": [{"order": 1, "amplitude": 2.928, "phase": 3.92}]},
        {"on": "b2", "mean": -0.228},
    ],
)
ONE_GAP = chain(
    [(1.18, 0.0622, {"stiffness": 1.14, "damping": 0.236, "clearance": 0.334, "damping_ratio": 1.0})],
    [{"on": "b0", "mean": 0.409, "harmonics": [{"order": 1, "amplitude": 1.04, "phase": 5.85}]}],
).with_({"excitation.speed": 2.02})


@pytest.mark.parametrize(
    ("model", "path", "cycles", "motions", "expected"),
    [
        pytest.param(
            STAGED,
            SPEED,
            1,
            [
                (
                    1.4847006962610818,
                    """0.2983343378920704 0.6677872749955018 0.0071383670682199285 0.7811103463367046
                    -1.0282052427696824 -1.4095603047750076 -0.7237509666660552 1.684673893174818""",
                ),
                (
                    1.4846982325406077,
                    """0.2831516013773669 0.6699573938844575 0.010430763658485291 0.7882165292547363
                    -1.0207032936905667 -1.4063742256942484 -0.7203695388447064 1.6762438230701462""",
                ),
            ],
            [(NEIMARK_SACKER, 1.4847038569), (FOLD, 1.4847039331)],
            id="a pair leaves the circle, at the fold a real one comes inside",
        ),
        pytest.param(
            TWO_GAPS,
            SPEED,
            1,
            [
                (
                    1.7132203483238726,
                    """-0.432253730092872 -0.4672763400932953 -0.6148025798977632
                    -1.7139609785565382 0.06419312955457354 0.747466027445688""",
                ),
                (
                    1.7231849887474067,
                    """-0.42833948366810876 -0.4692703182799693 -0.6157165103618588
                    -1.736834875306927 0.06271745000238724 0.7545766601160192""",
                ),
            ],
            [(NEIMARK_SACKER, 1.7206915294), (NEIMARK_SACKER, 1.7213470708), (DOUBLING, 1.7224421740)],
            id="one pair leaves the circle, another one enters it",
        ),
        pytest.param(
            ONE_GAP,
            "coupling.c0.stiffness",
            2,
            [
                (1.6694936360096766, "0.3397921234611702 -0.017969382656818363"),
                (1.6738795848090926, "0.33208104985793707 -0.017410031876944763"),
            ],
            [(GRAZING, 1.6704343651), (GRAZING, 1.6733327590)],
            id="a touch at one corner begins, one at the other corner ends",
        ),
    ],
)
def test_events_of_a_step_that_leave_its_ends_alike_are_seen(
    model: gr.Model, path: str, cycles: int, motions: list[tuple[float, str]], expected: list[tuple[str, float]]
) -> None:
    """Values from another solution: own multipliers of the periodic motion on both sides, own crossings."""
    follower = follower_over(model, path, (0.5, 2.0), cycles, first=motions[0][0])
    before, after = (follower.begin(State(np.array(y.split(), dtype=float)), value) for value, y in motions)
    way = after.w - before.w
    before, after = (turned_around(point) if point.tangent @ way < 0.0 else point for point in (before, after))
    events = events_between(follower, before, appended(before, after))
    assert [event.kind for event in events] == [kind for kind, _ in expected]
    assert [event.point.parameter for event in events] == pytest.approx([value for _, value in expected], abs=2e-9)


def test_a_step_of_no_length_holds_nothing() -> None:
    """One ends where a change lies at an end of a step; a multiplier near the circle may not have moved in it."""
    branch = gr.continuation(gr.example("backlash_oscillator").with_({"torque.0.mean": 0.0322}), SPEED, (0.3, 0.7))
    doublings = [event for event in branch.curves[0].events if event.kind == DOUBLING]
    assert doublings
    for event in doublings:
        assert events_between(branch.follower(branch.curves[0]), event.point, event.point) == []


def test_a_fold_beside_the_doubling_where_a_branch_ends_is_named() -> None:
    """At 0.753585295, 4.4e-7 from the doubling; between them a grazing."""
    model = chain(
        [
            (
                1.003,
                0.0,
                {
                    "stiffness": 0.7264,
                    "damping": 0.1312,
                    "clearance": 1.4753,
                    "stiffness_ratio": 0.3,
                    "damping_ratio": 1.0,
                },
            ),
            (0.6151, 0.0, {"stiffness": 2.9042, "damping": 0.2623, "clearance": 0.4075, "damping_ratio": 0.3}),
        ],
        [{"on": "b1", "mean": 0.3231, "harmonics": [{"order": 1, "amplitude": 1.7053}]}],
    )
    branch = gr.continuation(model, SPEED, (0.733, 0.755))
    (doubled,) = (curve for curve in branch.curves if curve.origin == DOUBLING)
    assert [event.kind for event in doubled.events] == [GRAZING, FOLD, GRAZING, DOUBLING]
    assert doubled.events[1].point.parameter == pytest.approx(0.7535852947, abs=1e-9)


def test_two_period_doublings_within_a_step_are_seen() -> None:
    """A multiplier goes to -1.0002 and back; at the mean torque 0.03229 it turns back before -1."""

    def doublings(mean: float) -> list[float]:
        branch = gr.continuation(gr.example("backlash_oscillator").with_({"torque.0.mean": mean}), SPEED, (0.3, 1.1))
        is_chosen = (branch.events["branch"] == 0) & (branch.events["kind"] == DOUBLING)
        return [value for value in branch.events.loc[is_chosen, "value"].tolist() if 0.6 < value < 0.7]

    assert doublings(0.03228244) == pytest.approx([0.638917490, 0.639409805], abs=1e-8)
    assert doublings(0.032283) == pytest.approx([0.638938170, 0.639393815], abs=1e-8)
    assert doublings(0.03229) == []


@pytest.mark.parametrize("span", [pytest.param((0.33, 0.30), marks=pytest.mark.long), (0.316, 0.313)])
def test_two_breakings_of_symmetry_within_a_step_are_no_folds(span: tuple[float, float]) -> None:
    contact = {"stiffness": 1.0, "damping": 0.23286, "damping_ratio": 1.0, "stiffness_ratio": 0.05, "clearance": 1.0}
    model = gr.Model.from_tables(
        {
            "schema": 1,
            "name": "symmetric oscillator",
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0}],
            "coupling": [{"name": "gap", "between": ["body", "ground"], **contact}],
            "excitation": {"speed": 0.5},
            "torque": [{"on": "body", "harmonics": [{"order": 1, "amplitude": 2.0}]}],
        }
    )
    branch = gr.continuation(model, SPEED, span)
    events = branch.events[(branch.events["branch"] == 0) & (branch.events["value"].between(0.3137, 0.315))]
    assert sorted(set(events["kind"])) == [GRAZING, BREAKING]
    breakings = events.loc[events["kind"] == BREAKING, "value"].to_numpy(float)
    assert breakings == pytest.approx([0.3141919, 0.3140819], abs=1e-7)


@pytest.mark.long
def test_branches_join_alike_whatever_the_steps() -> None:
    """A branch of 2 T folds twice beside its joint; a step over all of that must not go on along its own image."""

    def course(step_limit: float | None) -> list[tuple[object, ...]]:
        model = symmetric(1.2, 0.5)
        branch = gr.continuation(model, "excitation.frequency", (0.45, 0.2), step_limit=step_limit)
        return [
            (curve.cycles, curve.origin, *((event.kind, round(event.point.parameter, 7)) for event in curve.events))
            for curve in branch.curves
        ]

    free = course(None)
    assert len(free) == 9
    assert [kind for kind, _ in free[5][-3:]] == [FOLD, GRAZING, DOUBLING]
    for step_limit in (0.01, 0.003, 0.001):
        assert course(step_limit) == free


@pytest.mark.long
def test_a_limiter_changes_in_the_step_in_which_contact_is_lost() -> None:
    """Where contact is nearly lost the damping is limited twice more; then contact is lost."""
    contact = {"stiffness": 10.0, "damping": 0.5, "clearance": 1.0, "contact_damping": "clipped"}
    torque = {"on": "body", "mean": 0.38, "harmonics": [{"order": 1, "amplitude": 0.35}]}
    model = gr.Model.from_tables(
        {
            "schema": 1,
            "name": "clipped oscillator",
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0, "drag": 0.05}],
            "coupling": [{"name": "gap", "between": ["body", "ground"], **contact}],
            "excitation": {"speed": 1.4},
            "torque": [torque],
        }
    )
    begin = gr.periodic(model)
    branches = []
    for longest in (1.0 / 5.0, 1.0 / 40.0):
        follower = Continuation(family_of(model, SPEED, 1.4, 1, 0.2), longest=longest)
        branches.append(followed(follower, follower.begin(begin.motion.start, 1.4, upward=False), (1.2, 1.4)).events)
    coarse, fine = branches
    assert [event.watch for event in coarse].count(0) == 1
    assert max(event.watch for event in coarse) > 0
    (lost,) = (event for event in coarse if event.watch == 0)
    assert lost.grazing is not None
    assert [event.watch for event in fine] == [event.watch for event in coarse]
    values = [event.point.parameter for event in coarse]
    assert [event.point.parameter for event in fine] == pytest.approx(values, abs=1e-9)
    (again,) = (event for event in fine if event.watch == 0)
    assert again.grazing is not None
    assert again.grazing.root == pytest.approx(lost.grazing.root, rel=1e-5)
    near, end = (lost.point.parameter - distance for distance in (0.0, 1e-6))
    traces = [gr.periodic(model.with_({SPEED: value}), start=begin).multipliers.sum().real for value in (near, end)]
    assert lost.grazing.root == pytest.approx((traces[1] - traces[0]) / 1e-3, rel=0.02)
