"""Impact statistics of a log written by hand."""

from __future__ import annotations

import math

import pytest

from gearrattle.quantities.contact import ContactShare
from gearrattle.quantities.impact_statistics import ImpactStatistics
from gearrattle.quantities.regime import ImpactRegime
from tests.quantities.reading import evaluate, one, value
from tests.signals.handmade import Row, layout, staged, trajectory

criterion = ImpactStatistics()
MASS = 1.0 / 0.0026  # of the plate: 1 / (0.06^2 / 2 + 0.02^2 / 0.5)
ROWS: list[Row] = [
    (0.5, 0, 0, 1, 9.0, 0.0),  # before the window
    (0.6, 0, 1, 0, -9.0, 9.0),
    (1.0, 0, 0, 1, 0.5, 9.0),
    (1.5, 0, 1, 0, -0.5, 12.0),
    (2.0, 0, 0, -1, -1.0, 12.0),
    (2.5, 0, -1, 0, 1.0, 11.0),
    (4.5, 0, 0, 1, 0.6, 11.0),
]


def test_rates_speeds_and_impulses() -> None:
    entries = evaluate(criterion, trajectory(layout(), ROWS, cycles=5, discard=1, final=13.0))
    values = {item.quantity: item.value for item in entries}
    assert values == {
        "impacts per cycle": 0.75,
        "drive-side impacts per cycle": 0.5,
        "coast-side impacts per cycle": 0.25,
        "impacts per second": 0.75,
        "mean approach speed": pytest.approx(0.7, rel=1e-15),
        "largest approach speed": 1.0,
        "mean impact momentum": pytest.approx(MASS * 0.7, rel=1e-14),
        "largest impact momentum": pytest.approx(MASS, rel=1e-14),
        "mean impact energy": pytest.approx(0.5 * MASS * (0.25 + 1.0 + 0.36) / 3.0, rel=1e-14),
        "largest impact energy": pytest.approx(0.5 * MASS, rel=1e-14),
        "mean exchanged momentum": pytest.approx(MASS * (1.0 + 2.0 + 0.6) / 3.0, rel=1e-14),  # the last still open
        "largest exchanged momentum": pytest.approx(2.0 * MASS, rel=1e-14),
        "mean contact impulse": 2.0,
        "largest contact impulse": 3.0,
    }
    assert one(entries, "gear", "mean contact impulse").unit == "N s"
    assert one(entries, "gear", "mean impact momentum").unit == "N s"
    assert one(entries, "gear", "mean impact energy").unit == "J"
    assert one(entries, "gear", "mean approach speed").unit == "m/s"
    assert "ends within a contact" in one(entries, "gear", "mean contact impulse").note


def test_rate_per_second_follows_the_period() -> None:
    rows: list[Row] = [(0.3, 0, 0, 1, 1.0, 0.0), (0.4, 0, 1, 0, -1.0, 1.0)]
    entries = evaluate(criterion, trajectory(layout(period=0.25), rows, cycles=4))
    assert value(entries, "gear", "impacts per cycle") == 0.25
    assert value(entries, "gear", "impacts per second") == 1.0
    assert not any(item.note for item in entries)


def test_without_impacts_only_the_rates() -> None:
    entries = evaluate(criterion, trajectory())
    assert [item.value for item in entries] == [0.0] * 4


def test_units_of_a_coupling() -> None:
    plate = staged([-1.0, 1.0], -1, [5.0, 0.0, 5.0])
    entries = evaluate(criterion, trajectory(plate, [(0.5, 0, 0, 1, 0.5, 0.0)], final=1.0))
    assert one(entries, "spring", "largest contact impulse").unit == "N m s"
    assert one(entries, "spring", "largest approach speed").unit == "rad/s"


def test_missing_force_integral_is_said() -> None:
    entries = evaluate(criterion, trajectory(rows=[(0.5, 0, 0, 1, 0.5, math.nan)], final=math.nan))
    impulse = one(entries, "gear", "largest contact impulse")
    assert math.isnan(float(impulse.value))
    assert impulse.note == "gear: no contact impulses, for by hand supplies no force integral"
    assert value(entries, "gear", "largest approach speed") == 0.5


@pytest.mark.parametrize(
    ("slopes", "centre", "impacts"),
    [([5.0, 9.0], "-1 and 0", 0.0), ([0.0, 9.0], "-1", 1.0), ([5.0, 0.0], "0", 1.0)],
)
def test_the_formula_says_the_centre_where_zero_is_a_corner(slopes: list[float], centre: str, impacts: float) -> None:
    """Contact begins between -1 and 0 only if one of them is a free gap; |to| > |from| does not tell that."""
    plate = staged([0.0], -1, slopes)
    rows: list[Row] = [(0.2, 0, 0, -1, -0.5, 0.0), (0.7, 0, -1, 0, 0.5, 0.0)]
    motion = trajectory(plate, rows, final=1.0)
    words = f"; delta = 0 is a corner, the centre is region {centre}"
    for entry in (ImpactStatistics(), ContactShare(), ImpactRegime()):
        for item in evaluate(entry, motion):
            if item.subject == "spring" and not item.quantity.startswith("share of region"):
                assert item.formula.endswith(words)
    assert value(evaluate(criterion, motion), "spring", "impacts per cycle") == impacts / motion.cycles
    plain = trajectory(staged([-1.0, 1.0], -1, [5.0, 0.0, 5.0]), [(0.5, 0, 0, 1, 0.5, 0.0)], final=1.0)
    assert not any("centre is region" in item.formula for item in evaluate(criterion, plain))
