"""What is said of a run-up does not depend on the points that a branch has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.orbits import Branch
from gearrattle.orbits.followed_branch import Curve
from tests.orbits.test_run_ups import SPEED, over_speed, spline


def with_half_of_the_points(branch: Branch) -> Branch:
    """The same branches without every second point, but near their ends and around events."""

    def thinned(curve: Curve) -> Curve:
        lengths = [point.length for point in curve.points]
        events = np.array([event.point.length for event in curve.events])
        kept = [
            point
            for i, point in enumerate(curve.points)
            if i % 2 == 0
            or not 2 <= i < len(lengths) - 2
            or np.any((lengths[i - 2] <= events) & (events <= lengths[i + 2]))
        ]
        return replace(curve, points=tuple(kept))

    return replace(branch, curves=tuple(thinned(curve) for curve in branch.curves))


def assert_same(runs: gr.RunUpJumps, others: gr.RunUpJumps) -> None:
    """Same events and reasons; jumps agree to 1e-5 of the range."""
    span = abs(runs.branch.range[1] - runs.branch.range[0])
    assert [(jump.upward, jump.kind, jump.words) for jump in runs.jumps] == [
        (jump.upward, jump.kind, jump.words) for jump in others.jumps
    ]
    for name in ("end", "value", "settles"):
        values, expected = ([getattr(jump, name) for jump in one.jumps] for one in (runs, others))
        np.testing.assert_allclose(values, expected, rtol=0.0, atol=1e-5 * span)


@pytest.mark.long
def test_a_fast_run_is_told_the_same_whichever_way_the_branch_was_followed() -> None:
    """Going down the run passes the part above the doubling at 293.08 within a period or two."""
    there = gr.continuation(spline(), SPEED, ("2500 rpm", "6000 rpm"))
    back = gr.continuation(spline(), SPEED, ("6000 rpm", "2500 rpm"))
    for rate in (7635.82, 10384.7):
        runs = there.run_up(rate)
        assert_same(back.run_up(rate), runs)
        assert_same(with_half_of_the_points(there).run_up(rate), runs)


def test_a_branch_with_a_quarter_of_the_points_has_the_same_jumps() -> None:
    sparse = with_half_of_the_points(with_half_of_the_points(over_speed()))
    assert len(sparse.points) < 0.4 * len(over_speed().points)
    assert_same(sparse.run_up(1e-3), over_speed().run_up(1e-3))
