"""How often forecasts come true on drivelines drawn anew: a score table, held to what it has been."""

from __future__ import annotations

import pytest
from benchmarks.advice import TIMES, shares, tried
from benchmarks.drivelines import FILES, drawn

EACH = 4
LEAST = {
    "regime": 0.90,
    "mean slope": 0.85,
    "function calls": 0.85,
    "crossings a cycle": 0.85,
    "predictable cycles": 0.90,
    "corners": 0.75,
}


@pytest.mark.long
def test_forecasts_come_true_as_often_as_the_page_says() -> None:
    drivelines = list(drawn(bodies=EACH))
    assert len(drivelines) == len(FILES) * EACH >= 30
    actual = shares(tried(drivelines, 100, 50))
    table = "\n".join(f"{quantity:20} {route:28} {a}/{b}" for (quantity, route), (a, b) in actual.items())
    assert {quantity for quantity, _ in actual} == {*LEAST, TIMES}
    for (quantity, route), (right, total) in actual.items():
        if quantity != TIMES and route != "equivalent linearisation":
            assert right / total >= LEAST[quantity], table
