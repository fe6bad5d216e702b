"""Two crossings that exchange their order and do so again within one step of a branch.

Two oscillators stand on the ground, each with its own gap, and know nothing of one another. Over the speed the instant
at which the second one comes back into its gap has a latest value after that of the first one. A phase of its torque
moves all its crossings by that much less a little: then it comes later over a short range of speeds alone. The phase
moves nothing else, so the instants of the branch without it tell at which speeds the order changes.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.periodic.events.event_record import PATTERN
from gearrattle.engine.periodic.point import Point
from gearrattle.orbits import Branch, value_family

SPEED = "excitation.speed"
ENDS = (1.72, 1.66)
LITTLE = 2e-8  # periods by which the order is exchanged at most


def model_of(phase: float = 0.0) -> gr.Model:
    stages = [
        [{"stiffness": 0.3 * k, "damping": 0.1, "until": 0.4}, {"stiffness": k, "damping": 0.1}] for k in (1.0, 2.5)
    ]
    harmonics = {"order": 1, "amplitude": 1.0}, {"order": 1, "amplitude": 1.6, "phase": phase}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": name, "J": 1.0} for name in "ab"],
            "coupling": [
                {"name": f"to_{name}", "between": [name, "ground"], "stages": stages[i]} for i, name in enumerate("ab")
            ],
            "excitation": {"speed": ENDS[0]},
            "torque": [{"on": name, "mean": 0.1, "harmonics": [harmonics[i]]} for i, name in enumerate("ab")],
        }
    )


def later(point: Point) -> float:
    """By how many periods the second oscillator comes back into its gap later than the first one."""
    crossings, times = point.motion.crossings, point.motion.crossings.time / point.motion.period
    first, second = (times[(crossings.watch == watch) & (crossings.upward == 0)] for watch in (0, 1))
    return float(second[second > 0.9][0] - first[0])


@cache
def branch_without_phase() -> Branch:
    return gr.continuation(model_of(), SPEED, ENDS)


@cache
def latest() -> tuple[float, float]:
    """The speed at which it comes latest, and by how many periods."""
    points = branch_without_phase().curves[0].points
    delays = [later(point) for point in points]
    chosen = slice(int(np.argmax(delays)) - 2, int(np.argmax(delays)) + 3)
    middle = points[int(np.argmax(delays))].parameter
    curve = np.polynomial.Polynomial.fit([p.parameter - middle for p in points[chosen]], delays[chosen], 4)
    turning = next(root.real for root in curve.deriv().roots() if abs(root) < 1e-3)
    return middle + turning, float(curve(turning))


@pytest.fixture(params=["compiled", "general"])
def loop(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Drivelines are followed by the compiled loop, or by none."""
    if request.param == "general":
        monkeypatch.setattr(value_family, "is_compiled", lambda _: False)


@pytest.mark.long
@pytest.mark.usefixtures("loop")
@pytest.mark.parametrize("ends", [ENDS, ENDS[::-1]])
def test_an_order_that_is_exchanged_and_back_within_a_step_is_two_events(ends: tuple[float, float]) -> None:
    speed, delay = latest()
    branch = gr.continuation(model_of(2.0 * np.pi * (delay - LITTLE)), SPEED, ends)
    events = [event for event in branch.curves[0].events if event.kind == PATTERN]
    values = sorted(event.point.parameter for event in events)
    assert len(values) == 2
    assert [event.watch for event in events] == [0, 0]
    assert values[0] < speed < values[1] < values[0] + 3e-4
    for value in values:
        motion = gr.periodic(model_of().with_({SPEED: value}))
        assert later(motion) == pytest.approx(delay - LITTLE, abs=1e-11)


def test_delays_of_crossings_are_the_slopes_of_their_instants() -> None:
    """Against differences of the instants of points that follow one another, which have an error of third order."""
    points = branch_without_phase().curves[0].points
    checked = 0
    for before, after in pairwise(points):
        one, other = before.motion.crossings, after.motion.crossings
        is_same = np.array_equal(one.watch, other.watch) and np.array_equal(one.upward, other.upward)
        if not is_same or before.motion.turns is None or after.motion.turns is None:
            continue
        length = float(np.linalg.norm(after.w - before.w))
        instants = [point.motion.crossings.time / point.motion.period for point in (before, after)]
        change = np.remainder(instants[1] - instants[0] + 0.5, 1.0) - 0.5
        mean = 0.5 * length * (before.motion.turns.delay + after.motion.turns.delay)
        np.testing.assert_allclose(mean, change, rtol=0, atol=3e-3 * np.abs(change).max())
        checked += 1
    assert checked > len(points) // 2
