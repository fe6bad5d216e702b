"""Branches of a loaded gear pair whose stiffness alternates: its events, and where a slow sweep jumps.

At 1.566081343 the period doubles, in contact all along. What leaves there is vertical up to its grazing, and unstable
beyond, so going up the motion jumps.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.events.events_of_step import events_between
from gearrattle.engine.periodic.motion import Pass, joined
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.orbits import Branch
from gearrattle.orbits.stability import losses_of, ranges_of
from gearrattle.orbits.value_family import follower_over

LOST = 1.566081343
"""Speed at which the quiet motion loses its stability."""
ORIGINS = (0.0, 1.0, 2.0 * np.pi * 0.6)
"""Phases of the mesh cycle at t = 0: all pairs from there on, amid that, one pair less from there on."""


def pair(phase: float = 0.0) -> gr.Model:
    alternation = {"order": 1.0, "share": 0.6, "fewer": 0.4, "phase": phase}
    mesh = {"name": "gear", "between": ["pinion", "wheel"], "radii": [1.0, 1.0], "stiffness": 1.0, "damping": 0.08}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": name, "J": 2.0, "drag": 0.06} for name in ("pinion", "wheel")],
            "mesh": [{**mesh, "backlash": 2.0, "alternation": alternation}],
            "excitation": {"speed": 1.58},
            "torque": [{"on": "pinion", "mean": 0.3}, {"on": "wheel", "mean": -0.3}],
        }
    )


@cache
def branch_of(phase: float = 0.0) -> Branch:
    return gr.continuation(pair(phase), "excitation.speed", (1.54, 1.58))


@pytest.mark.parametrize("phase", [pytest.param(ORIGINS[1], marks=pytest.mark.long), ORIGINS[2]])
def test_events_do_not_depend_on_the_origin_of_time(phase: float) -> None:
    """Here two crossings of the gap and a change of the stiffness are exchanged at 1.548511."""
    columns = ["branch", "kind", "clearance", "grazing"]
    one, other = branch_of().events, branch_of(phase).events
    assert one["kind"].tolist() == ["period doubling", "grazing", "pattern"]
    assert one[columns].values.tolist() == other[columns].values.tolist()
    np.testing.assert_allclose(other["value"], one["value"], rtol=0, atol=1e-9)
    assert {point.word for point in branch_of().points} == {point.word for point in branch_of(phase).points}


def test_an_exchange_that_happens_thrice_at_once_names_its_clearance() -> None:
    """The motions of 2 T around the exchange, followed over 6 T."""
    once = branch_of().events.iloc[2]
    before, after = branch_of().points[once["point"]], branch_of().points[once["point"] + 1]
    follower = follower_over(pair(), "excitation.speed", (1.54, 1.58), 6, first=before.parameter)
    upward = after.parameter > before.parameter
    begin = follower.begin(before.motion.start, before.parameter, upward=upward)
    ends = sorted((before.parameter, after.parameter))
    (thrice,) = events_between(follower, begin, list(follower.follow(begin, *ends))[-1])
    assert (thrice.kind, once["kind"], thrice.watch, once["clearance"]) == ("pattern", "pattern", 0, "gear")
    assert thrice.point.parameter == pytest.approx(once["value"], abs=1e-9)


def test_a_grazing_of_a_vertical_branch_has_no_root() -> None:
    grazing = branch_of().events.iloc[1]
    assert (grazing["kind"], grazing["grazing"]) == ("grazing", "compliant")
    assert np.isnan(grazing["root"])


@pytest.mark.parametrize("phase", [*ORIGINS, -1e-17])
def test_a_motion_has_every_change_of_the_stiffness_once(phase: float) -> None:
    once, many = (PeriodMap(assemble(pair(phase)).system, cycles) for cycles in (1, 3))
    start = once.later(once.state_of(np.array([1.3, 0.0]), np.zeros(2)), 40)
    parts = list[Pass]()
    for _ in range(many.cycles):
        parts.append(once(parts[-1].end if parts else start))
    whole, together = many(start), joined(parts, many.system.inputs.period, many.cycles)
    for motion in (whole, together):
        times = motion.crossings.time / motion.period
        assert np.count_nonzero(motion.crossings.watch == 1) == 2 * many.cycles
        assert np.all(np.diff(times) >= 0.0)
        assert 0.0 < times[0] <= times[-1] <= many.cycles * (1.0 + 1e-12)
    assert np.array_equal(together.crossings.watch, whole.crossings.watch)
    np.testing.assert_allclose(together.crossings.time, whole.crossings.time, rtol=0, atol=1e-10)
    np.testing.assert_allclose(together.gradient, whole.gradient, rtol=0, atol=1e-10)


def test_where_nothing_stable_leaves_a_period_doubling_the_motion_jumps() -> None:
    branch = branch_of()
    (loss,) = losses_of(branch)
    assert (loss.upward, loss.branch, loss.kind, loss.jumps) == (True, 0, "period doubling", True)
    assert loss.value == pytest.approx(LOST, abs=1e-9)
    assert branch.sentence.endswith(
        "no known stable motion from 1.566 to 1.58; elsewhere one. Going up the motion jumps at 1.5661."
    )


def test_beyond_a_hard_loss_of_stability_runs_leave_for_a_motion_far_away() -> None:
    """A run begins near the quiet motion, below the loss and above it."""
    swings = dict[float, list[float]]()
    for speed in (1.5655, 1.567):
        model = pair().with_({"excitation.speed": speed})
        quiet = gr.periodic(model, start="linear")
        state = {**quiet.state, "velocity": quiet.state["velocity"] + np.array([1e-3, 0.0])}
        run = gr.simulate(model, "exact", cycles=6000, discard=5980, samples_per_cycle=64, initial=state)
        swings[speed] = [float(np.ptp(one.trajectory.deflection)) for one in (run, quiet.run)]
    assert swings[1.5655][0] < 1.1 * swings[1.5655][1]
    assert swings[1.567][0] > 5.0 * swings[1.567][1]


def test_a_vertical_branch_is_no_range() -> None:
    ranges = ranges_of(branch_of())
    assert all(abs(one.end - one.begin) > 1e-3 for one in ranges)
    assert [(one.branch, one.stable) for one in ranges] == [(0, True), (0, False), (1, False)]


def test_crossings_of_a_branch_are_those_of_corners() -> None:
    """In contact all along there are none, though the stiffness changes twice a period."""
    data = branch_of().data
    first = data["branch"].values == 0
    assert set(data["crossings"].values[first].tolist()) == {0}
    assert data["crossings"].values[~first].max() > 0


def test_a_sweep_needs_no_harmonic_beside_the_alternation() -> None:
    """A run without one is that with a negligible one."""
    sweep = {"excitation.sweep": {"from": 1.55, "to": 1.6, "over": 400.0}}
    start = {"angle": [0.75, -0.75], "velocity": [0.05, -0.05]}
    alone = pair().with_(sweep)
    tables = alone.to_tables()
    tables["torque"][0]["harmonics"] = [{"order": 1, "amplitude": 1e-13}]
    loaded = gr.Model.from_tables(tables)
    one, other = (
        gr.simulate(model, "exact", cycles=100, discard=0, samples_per_cycle=32, initial=start).trajectory
        for model in (alone, loaded)
    )
    np.testing.assert_allclose(one.deflection, other.deflection, rtol=0, atol=1e-10)
    assert np.ptp(one.deflection[-100:]) > 0.1


@pytest.mark.long
def test_a_run_up_follows_the_alternation() -> None:
    """A Runge-Kutta run with 5000 steps a period: its deflection over a period becomes nearer to the large motion at
    1.66813. Both motions come from the same steps at a constant speed; a period takes 1.1e-3 of speed.
    """
    runs = gr.continuation(pair(), "excitation.speed", (1.56, 1.75), isolated=True).run_up(3e-4)
    (jump,) = [one for one in runs.jumps if one.upward]
    assert (jump.kind, jump.words) == ("period doubling", "")
    assert jump.end == pytest.approx(LOST, abs=1e-9)
    assert jump.value == pytest.approx(1.66813, abs=3e-4)


@pytest.mark.long
def test_isolated_branches_that_only_an_end_of_the_range_meets_are_seen() -> None:
    """Two motions of 2 T swing by 5.79 and 5.86 at the speed 1.2781: ``every`` gives them. They meet at 1.27664."""
    tables = pair().to_tables()
    for inertia in tables["inertia"]:
        inertia["drag"] = 0.08
    tables["mesh"][0].update(damping=0.12, alternation={"order": 1.0, "share": 0.6, "fewer": 0.5})
    tables["torque"] = [{"on": "pinion", "mean": 0.12}, {"on": "wheel", "mean": -0.12}]
    branch = gr.continuation(gr.Model.from_tables(tables), "excitation.speed", (1.0, 1.3), isolated=True)
    (large,) = (curve for curve in branch.curves if abs(min(p.parameter for p in curve.points) - 1.27664) < 1e-4)
    follower = branch.follower(large)
    motions = [point.motion for _, point in large.motions_at(follower, 1.2781)]
    levels = [follower.family.map_at(1.2781).levels(motion) for motion in motions]
    assert sorted(float(high[0] - low[0]) for low, high, _ in levels) == pytest.approx([5.7926, 5.8615], abs=1e-4)
