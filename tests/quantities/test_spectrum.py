"""Spectral entries of accelerations made of known lines."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gearrattle.quantities.evaluation import judge
from gearrattle.quantities.spectrum import AccelerationSpectrum
from gearrattle.trajectory import Array
from tests.quantities.reading import evaluate, one, value
from tests.signals.handmade import layout, sine, trajectory

criterion = AccelerationSpectrum()


def _rich(time: Array) -> Array:
    return sine(4.0)(time) + sine(1.0, 0.5, 0.3)(time) + sine(0.5, 3.0)(time) + sine(0.2, 5.0)(time)


def test_excited_orders_super_and_sub_harmonics() -> None:
    motion = trajectory(accelerations=(_rich, sine(2.0, mean=9.0)), cycles=40, discard=8)
    entries = evaluate(criterion, motion)
    driver = {item.quantity: item.value for item in entries if item.subject == "driver"}
    assert driver["amplitude at order 1"] == pytest.approx(4.0, rel=1e-12)
    assert driver["super-harmonics present"] == 2.0
    assert driver["order of the strongest super-harmonic"] == 3.0
    assert driver["amplitude of the strongest super-harmonic"] == pytest.approx(0.5, rel=1e-11)
    assert driver["sub-harmonics present"] == 1.0
    assert driver["order of the strongest sub-harmonic"] == 0.5
    assert driver["amplitude of the strongest sub-harmonic"] == pytest.approx(1.0, rel=1e-11)
    assert value(entries, "loose", "super-harmonics present") == 0.0
    assert value(entries, "loose", "sub-harmonics present") == 0.0


def test_density_of_a_sine() -> None:
    motion = trajectory(accelerations=(_rich, sine(2.0, 6.0, mean=9.0)), cycles=40)
    entries = evaluate(criterion, motion)
    assert value(entries, "loose", "rms of the fluctuation") == pytest.approx(math.sqrt(2.0), rel=1e-12)
    assert value(entries, "loose", "order of the density's peak") == pytest.approx(6.0, rel=1e-12)
    assert value(entries, "loose", "density at its peak") == pytest.approx(2.0 / (1.5 / 8), rel=1e-12)
    assert "Hann, 8 cycles a segment" in one(entries, "loose", "rms of the fluctuation").formula
    density = judge(motion).spectra
    assert density is not None
    assert density.density.shape == (density.frequency.size, 2)


def test_orders_refer_to_omega_where_the_period_is_not_a_turn() -> None:
    plate = layout(orders=np.array([2.0]), period=0.5)
    entries = evaluate(criterion, trajectory(plate, accelerations=(sine(4.0, 2.0), sine(1.0, 1.0)), cycles=40))
    assert value(entries, "driver", "amplitude at order 2") == pytest.approx(4.0, rel=1e-12)
    assert value(entries, "driver", "order of the density's peak") == pytest.approx(2.0, rel=1e-12)
    assert value(entries, "loose", "order of the strongest sub-harmonic") == 1.0


def test_an_order_beyond_the_samples_is_said() -> None:
    plate = layout(orders=np.array([1.0, 20.0]))
    entries = evaluate(criterion, trajectory(plate, accelerations=(sine(4.0), sine(1.0)), samples=32))
    beyond = one(entries, "driver", "amplitude at order 20")
    assert math.isnan(float(beyond.value))
    assert beyond.note == "order 20 is not resolved by 32 samples a cycle"


def test_too_short_for_lines_is_said() -> None:
    entries = evaluate(criterion, trajectory(accelerations=(_rich, _rich), cycles=9))
    assert value(entries, "driver", "super-harmonics present") == 2.0
    sub = one(entries, "driver", "sub-harmonics present")
    assert math.isnan(float(sub.value))
    assert sub.note == "sub-harmonics not sought: fewer than 16 steady cycles"


def test_too_few_samples_for_a_density_is_said() -> None:
    entry = one(evaluate(criterion, trajectory(cycles=2, samples=1)), "driver", "rms of the fluctuation")
    assert math.isnan(float(entry.value))
    assert "at least 4 samples" in entry.note


def test_free_vibration_has_no_orders() -> None:
    entries = evaluate(criterion, trajectory(layout(orders=np.empty(0)), accelerations=(_rich, _rich), cycles=20))
    assert {item.quantity for item in entries} == {
        "rms of the fluctuation",
        "order of the density's peak",
        "density at its peak",
    }
