"""Peak-to-peak acceleration of sines."""

from __future__ import annotations

import pytest

from gearrattle.quantities.peak_to_peak import PeakToPeak
from tests.quantities.reading import evaluate, one, value
from tests.signals.handmade import sine, trajectory

QUANTITY = "peak-to-peak acceleration"


def test_twice_the_amplitude_whatever_the_mean() -> None:
    entries = evaluate(PeakToPeak(), trajectory(accelerations=(sine(4.0), sine(1.5, mean=100.0)), cycles=9))
    assert value(entries, "driver", QUANTITY) == pytest.approx(8.0, rel=1e-14)
    assert value(entries, "loose", QUANTITY) == pytest.approx(3.0, rel=1e-12)
    assert {item.unit for item in entries} == {"rad/s^2"}
    assert not any(item.note for item in entries)


def test_only_the_last_eight_cycles_count() -> None:
    motion = trajectory(accelerations=(sine(4.0), sine(1.0)), cycles=9)
    motion.acceleration[:64] = 1e3
    assert value(evaluate(PeakToPeak(), motion), "driver", QUANTITY) == pytest.approx(8.0, rel=1e-14)


def test_fewer_cycles_are_noted() -> None:
    entry = one(evaluate(PeakToPeak(), trajectory(cycles=3)), "driver", QUANTITY)
    assert entry.value == 0.0
    assert entry.note.endswith("fewer than 8 cycles: 3 cycles remain after the discarded ones")
    assert "last 3 T" in entry.formula
