"""How near a motion comes to a corner: the compiled loop against the same motion on a dense grid, and differences."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.periodic import compiled_course
from gearrattle.engine.periodic.grazing_depth import before_touch
from gearrattle.engine.periodic.motion import State, Touch, Turns
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.value_family import family_of
from tests.engine.periodic.test_slope import PATHS, start, train

pytestmark = pytest.mark.compiled  # without compiled kernels every family is a general one

PATH, SPEED = "excitation.speed", 100.0
GRID = 8192


def sampled(inertias: int) -> tuple[np.ndarray, np.ndarray]:
    """Deflection of the gap over one period on the grid, and its corners."""
    period_map = family_of(train(inertias), PATH, SPEED, 1, 10.0).map_at(SPEED)
    flow, element = period_map.flow, period_map.system.clearances[0]
    march = period_map.marched(start(inertias), samples_per_cycle=GRID)
    inputs = flow.inputs_at(np.zeros(GRID + 1), np.linspace(0.0, 1.0, GRID + 1))
    z = np.column_stack([march.samples.states[: GRID + 1, : flow.states], inputs])
    return z @ flow.deflection[element], period_map.system.laws[element].corners


@pytest.mark.parametrize("inertias", [2, 4])
def test_no_turning_point_and_no_dip_of_the_rate_is_missed(inertias: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Instants at which the deflection turns, or its rate comes nearest to zero, on a dense grid."""
    monkeypatch.setattr(compiled_course, "_REACH", np.inf)
    family = family_of(train(inertias), PATH, SPEED, 1, 10.0)
    row = np.append(np.zeros(len(family.scale)), 1.0)
    turns = family.follow(start(inertias), SPEED, None, row)[0].turns
    assert turns is not None
    x, _ = sampled(inertias)
    rate = np.diff(x) * GRID
    expected = (np.flatnonzero(rate[:-1] * rate[1:] < 0.0) + 1.0) / GRID
    times = np.unique(turns.time[turns.watch == 0])
    assert len(times) == len(expected)
    np.testing.assert_allclose(times, expected, rtol=0, atol=1.5 / GRID)
    before, here, after = np.abs(rate[:-2]), np.abs(rate[1:-1]), np.abs(rate[2:])
    is_one_sign = (rate[:-2] * rate[1:-1] > 0.0) & (rate[1:-1] * rate[2:] > 0.0)
    nearest = np.flatnonzero((here < before) & (here < after) & is_one_sign) + 1
    dips = turns.dips
    own = dips.watch == 0
    assert nearest.size > 0
    np.testing.assert_allclose(dips.time[own], (nearest + 0.5) / GRID, rtol=0, atol=1.5 / GRID)
    np.testing.assert_allclose(dips.depth[own], -np.abs(rate[nearest]), rtol=1e-3, atol=1e-6 * np.abs(rate).max())


@pytest.mark.parametrize("inertias", [1, 2, 4])
@pytest.mark.parametrize("upward", [0, 1])
def test_an_extremum_near_a_corner_is_found_with_its_depth(inertias: int, upward: int) -> None:
    """Where the motion turns back, and how far that is from the next corner; from instants all over the period."""
    model, state = train(inertias), start(inertias)
    family = family_of(model, PATH, SPEED, 1, 10.0)
    length, side = family.map_at(SPEED).length, 1.0 if upward else -1.0
    x, corners = (side * part for part in sampled(inertias))
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
        curvature = bend * (GRID / length) ** 2
        assert side * approach.acceleration == pytest.approx(curvature, rel=1e-2)
    assert tops.size > 0


@pytest.mark.parametrize("inertias", [1, 4])
@pytest.mark.parametrize("path", ["excitation.speed", "coupling.gap.clearance", "coupling.gap.stiffness"])
def test_the_depths_of_all_turning_points_move_as_their_slopes_say(
    inertias: int, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Along the change by which the motion ends as far from its start as before: central differences of the depths.

    The parameter may move the corner.
    """
    monkeypatch.setattr(compiled_course, "_REACH", np.inf)
    model, state, value = train(inertias), start(inertias), PATHS[path]
    family = family_of(model, path, value, 1, value)
    count, units = len(state.y), np.append(1.0 / family.scale, value)

    def turns_at(change: np.ndarray, row: np.ndarray) -> Turns:
        shifted = State(state.y + change[:count])
        turns = family.follow(shifted, value + change[count], None, row)[0].turns
        assert turns is not None
        return turns

    motion, slope = family.follow(state, value)
    equations = np.column_stack([motion.gradient - np.eye(count), slope])
    for row in np.eye(count + 1) / units:
        direction = np.linalg.solve(np.vstack([equations, row]), np.append(np.zeros(count), 1.0))
        step = 1e-6 / np.linalg.norm(direction / units)
        turns = turns_at(np.zeros(count + 1), row)
        assert set(turns.upward.tolist()) == {0, 1}
        assert (turns.depth > 0.0).any()
        assert (turns.depth < 0.0).any()
        ends = [turns_at(sign * step * direction, row) for sign in (-1.0, 1.0)]
        for end in ends:
            np.testing.assert_array_equal(end.watch, turns.watch)
            np.testing.assert_array_equal(end.upward, turns.upward)
        for own, *others in ((turns, *ends), (turns.dips, *(end.dips for end in ends))):
            named = {"depth": "slope", "time": "time_slope", "level": "level_slope"}
            for name in named if hasattr(own, "level") else ("depth", "time"):
                low, high = (getattr(other, name) for other in others)
                slopes = getattr(own, named[name])
                want = (high - low) / (2.0 * step)
                np.testing.assert_allclose(slopes, want, rtol=0, atol=2e-6 * np.abs(slopes).max(initial=0.0))


def test_a_touch_beyond_the_end_of_a_motion_is_lost() -> None:
    """Newton's method for the instant of an extremum may leave the motion."""
    period_map = family_of(train(2), PATH, SPEED, 1, 10.0).map_at(SPEED)
    with pytest.raises(ConvergenceError, match="lost"):
        before_touch(period_map, start(2), Touch(0, 1, 1.2))
