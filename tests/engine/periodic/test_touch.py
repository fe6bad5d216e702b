"""How near a motion comes to a corner: the compiled loop against the same motion on a dense grid, and differences."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.periodic import compiled
from gearrattle.engine.periodic.period_map import State, Turns
from gearrattle.engine.periodic.touch import Touch
from gearrattle.orbits.family import family_of
from tests.engine.periodic.test_slope import PATHS, start, train

pytestmark = pytest.mark.compiled  # without compiled kernels every family is a general one

PATH, SPEED = "excitation.speed", 100.0
GRID = 8192


@pytest.mark.parametrize("inertias", [1, 2, 4])
@pytest.mark.parametrize("upward", [0, 1])
def test_an_extremum_near_a_corner_is_found_with_its_depth(inertias: int, upward: int) -> None:
    """Where the motion turns back, and how far that is from the next corner; from instants all over the period."""
    model, state = train(inertias), start(inertias)
    family = family_of(model, PATH, SPEED, 1, 10.0)
    period_map, side = family.map_at(SPEED), 1.0 if upward else -1.0
    flow, element = period_map.flow, period_map.system.clearances[0]
    march = period_map.marched(state, samples_per_cycle=GRID)
    inputs = flow.inputs_at(np.zeros(GRID + 1), np.linspace(0.0, 1.0, GRID + 1))
    z = np.column_stack([march.samples.states[: GRID + 1, : flow.states], inputs])
    x, corners = side * (z @ flow.deflection[element]), side * period_map.system.laws[element].corners
    tops = np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] > x[2:])) + 1
    for top in tops[x[tops] < corners.max()]:
        before, here, after = x[top - 1 : top + 2]
        bend = before - 2.0 * here + after
        highest = here - (after - before) ** 2 / (8.0 * bend)
        time = (top + 0.5 * (before - after) / bend) / GRID
        approach = family.follow(state, SPEED, Touch(0, upward, float(time) + 1e-3))[0].approach
        assert approach is not None
        assert approach.time == pytest.approx(time, abs=1e-6)
        assert approach.depth == pytest.approx(highest - corners[corners > highest].min(), abs=1e-8 * corners.max())
        curvature = bend * (GRID / period_map.length) ** 2
        assert side * approach.acceleration == pytest.approx(curvature, rel=1e-2)
    assert tops.size > 0


@pytest.mark.parametrize("inertias", [1, 4])
@pytest.mark.parametrize("path", ["excitation.speed", "coupling.gap.clearance", "coupling.gap.stiffness"])
def test_the_depths_of_all_turning_points_move_as_their_slopes_say(
    inertias: int, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the state at the start and by a parameter, which may move the corner: central differences of the depths."""
    monkeypatch.setattr(compiled, "_REACH", np.inf)
    model, state, value = train(inertias), start(inertias), PATHS[path]
    family = family_of(model, path, value, 1, value)
    count = len(state.y)

    def turns_at(change: np.ndarray) -> Turns:
        shifted = State(state.y + change[:count] / family.scale)
        turns = family.follow(shifted, value * (1.0 + change[count]), with_turns=True)[0].turns
        assert turns is not None
        return turns

    turns, step = turns_at(np.zeros(count + 1)), 1e-6
    largest = np.abs(turns.slope / np.append(family.scale, 1.0 / value)).max()
    assert set(turns.upward.tolist()) == {0, 1}
    assert (turns.depth > 0.0).any()
    assert (turns.depth < 0.0).any()
    for j, side in enumerate(np.eye(count + 1)):
        ends = [turns_at(sign * step * side) for sign in (-1.0, 1.0)]
        for end in ends:
            np.testing.assert_array_equal(end.watch, turns.watch)
            np.testing.assert_array_equal(end.upward, turns.upward)
        slope = turns.slope[:, j] * (value if j == count else 1.0 / family.scale[j])
        want = (ends[1].depth - ends[0].depth) / (2.0 * step)
        np.testing.assert_allclose(slope, want, rtol=0, atol=1e-6 * largest)
