"""Steps of a branch of the paper's case 1 that hold several events, or seem to hold one that is none.

Each begins at a motion of the branch from 300 rad/s down, of which the state is written here.
"""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import DOUBLING, FOLD, GRAZING, NEIMARK_SACKER
from gearrattle.engine.periodic.period_map import State
from gearrattle.orbits.curve import followed
from gearrattle.orbits.family import family_of
from tests.orbits.test_consistency import contradictions_of

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
