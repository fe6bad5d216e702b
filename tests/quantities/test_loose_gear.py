"""The loose-gear test: who is loose, and by how much."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gearrattle.quantities.loose_gear import LooseGear
from gearrattle.trajectory import Layout
from tests.quantities.reading import evaluate, value
from tests.signals.handmade import layout, sine, still, trajectory

criterion = LooseGear()


def test_driver_to_loose_gear_with_its_ratio() -> None:
    # J = 0.5, R_driver/R_loose = 3, peak 4, drag 3: ratio 2, so 6.02 dB; the loose gear's own 999 plays no part
    entries = evaluate(criterion, trajectory(accelerations=(sine(4.0), sine(999.0))))
    assert value(entries, "gear", "peak acceleration of the driver driver") == pytest.approx(4.0, rel=1e-14)
    assert value(entries, "gear", "torque ratio of loose") == pytest.approx(2.0, rel=1e-14)
    assert value(entries, "gear", "margin") == pytest.approx(20 * math.log10(2.0), rel=1e-13)


def test_loose_gear_named_first_in_the_mesh() -> None:
    plate = layout(between=np.array([[0, -1], [1, 0]]), radii=np.array([[1.0, 1.0], [0.02, 0.06]]))
    entries = evaluate(criterion, trajectory(plate, accelerations=(sine(4.0), still)))
    assert value(entries, "gear", "torque ratio of loose") == pytest.approx(2.0, rel=1e-14)


def test_peak_is_the_largest_magnitude_of_the_steady_part() -> None:
    motion = trajectory(accelerations=(sine(1.0, mean=-2.0), still), cycles=4, discard=1)
    motion.acceleration[:64] = 50.0
    assert value(evaluate(criterion, motion), "gear", "torque ratio of loose") == pytest.approx(1.5, rel=1e-13)


def test_driver_at_rest_has_a_margin_without_bound() -> None:
    assert value(evaluate(criterion, trajectory()), "gear", "margin") == -math.inf


@pytest.mark.parametrize(
    "plate",
    [
        layout(drag_torque=np.zeros(2)),
        layout(drag_torque=np.array([3.0, 0.0])),  # the driver hangs on its spring
        layout(between=np.array([[1, -1], [0, 1]]), drag_torque=np.array([0.0, 3.0])),
    ],
    ids=["no drag torque", "driver is held by a spring", "gear is held by a spring"],
)
def test_no_loose_gear_no_entry(plate: Layout) -> None:
    motion = trajectory(plate, accelerations=(sine(4.0), sine(1.0)))
    assert evaluate(criterion, motion) == []


def test_gear_in_two_meshes_is_an_idler_not_loose() -> None:
    plate = layout(is_mesh=np.array([True, True]), between=np.array([[1, 0], [0, 1]]), radii=np.full((2, 2), 0.05))
    assert evaluate(criterion, trajectory(plate)) == []


@pytest.mark.parametrize(("stiffness", "loose"), [(0.0, True), (1e-3, False)], ids=["damper", "spring"])
def test_only_a_spring_holds_a_gear_a_mere_damper_does_not(stiffness: float, loose: bool) -> None:
    plate = layout(between=np.array([[0, 1], [0, 1]]), stiffness=np.array([stiffness, 100.0]))
    assert bool(evaluate(criterion, trajectory(plate, accelerations=(sine(4.0), still)))) is loose
