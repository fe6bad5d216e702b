"""Motions followed in parts against the same followed as a whole, and branches of motions that grow disturbances."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.periodic import newton as correctors
from gearrattle.engine.periodic import point as points
from gearrattle.engine.periodic.compiled_course import outside_of
from gearrattle.engine.periodic.events.event_record import DOUBLING, FOLD, GRAZING
from gearrattle.engine.periodic.families import Family, PartedFamily
from gearrattle.engine.periodic.motion import Pass, Touch, Turns
from gearrattle.engine.periodic.newton import Corrector
from gearrattle.engine.periodic.point import Guess
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.orbits.followed_branch import Curve, followed
from gearrattle.orbits.value_family import family_of, follower_over
from tests.engine.periodic.test_families import both
from tests.orbits.test_consistency import contradictions_of

pytestmark = pytest.mark.compiled

SPEED = "excitation.speed"


def close(actual: np.ndarray, expected: np.ndarray, error: float = 1e-9) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=error * max(1.0, np.abs(expected).max(initial=0.0)))


def followed_both_ways(family: Family, guess: Guess, row: np.ndarray) -> tuple[Pass, Pass, np.ndarray, np.ndarray]:
    """A motion as a whole and in parts, with turning points, and its slopes."""
    corrector = Corrector(family, (family.scale, family.size))
    whole, slope = corrector.followed(guess, None, row)
    later = PartedFamily(family).starts(whole.start, float(guess.w[-1]) * family.unit)
    parted, other = corrector.followed(guess._replace(later=corrector.scale * later), None, row)
    assert parted.parts is not None
    assert len(parted.parts.start) == family.parts == 8 * family.cycles
    return whole, parted, slope, other


def sorted_turns(turns: Turns | None) -> tuple[np.ndarray, np.ndarray]:
    """Turning points and dips as tables, in order of time."""
    assert turns is not None
    tables = [np.array(turns[:6], dtype=float).T, np.array(turns.dips, dtype=float).T]
    first, second = (table[np.lexsort((table[:, 0], np.round(table[:, 2], 9)))] for table in tables)
    return first, second


@pytest.mark.parametrize("kind", ["general", "compiled"])
@pytest.mark.parametrize(("name", "cycles"), [("oscillator", 1), ("train", 1), ("train", 3)])
def test_a_motion_in_parts_is_the_whole(name: str, cycles: int, kind: str) -> None:
    general, compiled, value, state = both(name, cycles)
    family = general if kind == "general" else compiled
    w = np.append(state.y * family.scale / family.size, value / family.unit)
    row = np.linspace(1.0, 2.0, w.size)
    whole, parted, slope, other_slope = followed_both_ways(family, Guess(w, None), row / np.linalg.norm(row))
    close(parted.end.y * family.scale, whole.end.y * family.scale)
    close(parted.gradient, whole.gradient)
    close(other_slope, slope, 1e-7)
    close(parted.turned, whole.turned)
    np.testing.assert_array_equal(parted.crossings.watch, whole.crossings.watch)
    np.testing.assert_allclose(parted.crossings.time, whole.crossings.time, rtol=0, atol=1e-10 * whole.period)
    assert parted.period == pytest.approx(whole.period, rel=1e-14)
    assert parted.cycles == whole.cycles
    assert parted.turns is not None
    assert whole.turns is not None
    close(parted.turns.delay, whole.turns.delay, 1e-6)
    for own, expected in zip(sorted_turns(parted.turns), sorted_turns(whole.turns), strict=True):
        assert own.shape == expected.shape
        close(own[:, :3], expected[:, :3])
        for column in range(3, own.shape[1]):
            close(own[:, column], expected[:, column], 1e-6)
    assert len(sorted_turns(whole.turns)[0]) > 0 or name == "oscillator"  # which comes near no corner


def test_the_approach_to_a_corner_is_that_of_the_part_in_which_it_lies() -> None:
    """Its slopes are by the state at the start of that part: carried to the start they are those of the whole."""
    _, family, value, state = both("train", 1)
    turns = family.follow(state, value, None, np.eye(1, len(state.y) + 1, len(state.y))[0])[0].turns
    assert turns is not None
    parted = PartedFamily(family)
    later, parts = parted.starts(state, value), set()
    for watch, upward, time in zip(turns.watch, turns.upward, turns.time, strict=True):
        touch = Touch(int(watch), int(upward), float(time))
        whole, (motion, _) = family.follow(state, value, touch)[0].approach, parted.follow(state, later, value, touch)
        approach = motion.approach
        assert whole is not None
        assert whole.slope is not None
        assert approach is not None
        assert approach.slope is not None
        assert motion.parts is not None
        gradient, slope = np.eye(len(state.y)), np.zeros(len(state.y))
        for part in range(approach.part):
            gradient = motion.parts.gradient[part] @ gradient
            slope = motion.parts.gradient[part] @ slope + motion.parts.slope[part]
        carried = np.append(approach.slope[:-1] @ gradient, approach.slope[-1] + approach.slope[:-1] @ slope)
        assert approach.depth == pytest.approx(whole.depth, rel=1e-7, abs=1e-12)
        assert approach.time == pytest.approx(whole.time, abs=1e-9)
        assert approach.acceleration == pytest.approx(whole.acceleration, rel=1e-7)
        close(carried, whole.slope, 1e-6)
        parts.add(approach.part)
    assert len(parts) > 2


def oscillator_branch() -> Curve:
    """The branch of the backlash oscillator over its whole range."""
    model = gr.example("backlash_oscillator").with_({"excitation.frequency": 0.3})
    state = gr.periodic(model).motion.start
    follower = follower_over(model, "excitation.frequency", (0.3, 1.6), 1, first=0.3)
    return followed(follower, follower.begin(state, 0.3), (0.3, 1.6))


def test_a_branch_of_motions_in_parts_has_the_events_of_one_of_whole_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = oscillator_branch()
    assert all(point.later is None for point in whole.points)
    monkeypatch.setattr(correctors, "_LARGE", 0.0)
    monkeypatch.setattr(points, "_SMALL", 0.0)
    parted = oscillator_branch()
    assert all(point.later is not None for point in parted.points if point.touch is None)
    assert [event.kind for event in parted.events] == [event.kind for event in whole.events]
    for own, expected in zip(parted.events, whole.events, strict=True):
        assert own.point.parameter == pytest.approx(expected.point.parameter, abs=1e-9)
    assert parted.points[-1].parameter == whole.points[-1].parameter == 1.6
    assert contradictions_of(parted) == []


def test_motions_are_followed_as_a_whole_again_where_disturbances_grow_little(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(correctors, "_LARGE", 1.0)
    monkeypatch.setattr(points, "_SMALL", 1.0)
    curve = oscillator_branch()
    ways = [point.later is not None for point in curve.points]
    assert 0 < sum(ways) < len(ways)
    assert contradictions_of(curve) == []


@pytest.mark.long
def test_a_branch_whose_motions_grow_disturbances_a_hundred_million_times() -> None:
    """Case 2 of the paper, from 300 rad/s: with whole motions steps could not be longer than 1.5e-5."""
    model = gr.example("case2").with_({SPEED: 300.0})
    state = gr.periodic(model).motion.start
    follower = follower_over(model, SPEED, (300.0, 45.0), 1, first=300.0)
    curve = followed(follower, follower.begin(state, 300.0, upward=False), (45.0, 300.0))
    kinds = [event.kind for event in curve.events]
    assert [kinds.count(kind) for kind in (GRAZING, FOLD, DOUBLING)] == [23, 1, 1]
    assert len(kinds) == 25
    assert curve.points[-1].parameter == 300.0
    assert max(abs(point.multipliers[0]) for point in curve.points) > 1e8
    assert len(curve.points) < 100
    assert curve.notes == ()
    assert contradictions_of(curve) == []
    (fold,) = [event for event in curve.events if event.kind == FOLD]
    assert fold.point.parameter == pytest.approx(287.4207946, abs=1e-6)


def test_stiffness_that_alternates_by_the_clock_leaves_whole_periods() -> None:
    model = gr.example("alternating_mesh")
    families = [family_of(model, SPEED, model.excitation.omega, cycles, 1.0) for cycles in (1, 3)]
    assert [family.parts for family in families] == [1, 3]


@pytest.mark.parametrize("seed", range(8))
def test_what_clearances_cross_before_and_after_a_part(seed: int) -> None:
    rng, clearances = np.random.default_rng(seed), 4
    count = int(rng.integers(0, 9))
    watch, upward = rng.integers(0, clearances + 2, count), rng.integers(0, 2, count)  # two of them are auxiliaries
    crossings = Passages(np.arange(count) + 0.5, watch, upward, np.zeros(count), np.zeros((count, 0)))
    begins = tuple(int(one) for one in np.sort(rng.integers(0, count + 1, 2)))
    outside = outside_of(crossings, begins, clearances)
    endless = [(period * count + i, watch[i], upward[i]) for period in (-2, -1, 0, 1, 2) for i in range(count)]
    for k in range(clearances):
        before = [way for index, crossed, way in endless if crossed == k and index < begins[0]]
        after = [way for index, crossed, way in endless if crossed == k and index >= begins[1]]
        assert outside[:, k].tolist() == [before[-1] if before else -1, after[0] if after else -1]
