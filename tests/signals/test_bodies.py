"""Loose gears, reduced inertias and mean speeds of plates written by hand."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals import find_impacts, is_gap, loose_gears, reduced_inertia, speed_ratios
from tests.signals.handmade import chain, layout, staged, trajectory


def test_the_loose_gear_and_its_driver() -> None:
    """The gear with drag and one mesh alone is loose; R_driver / R_loose = 0.06 / 0.02."""
    (actual,) = loose_gears(layout())
    assert (actual.mesh, actual.loose, actual.driver) == (1, 1, 0)
    assert actual.reduction == pytest.approx(3.0, rel=1e-15)
    assert loose_gears(layout(drag_torque=np.array([0.0, 0.0]))) == ()
    assert loose_gears(layout(drag_torque=np.array([3.0, 0.0]))) == ()  # the driver hangs on a spring


def test_reduced_inertia_by_hand() -> None:
    """1/m = 0.06^2/2 + 0.02^2/0.5 = 0.0026 1/kg; a spring to ground bears the driver alone."""
    assert reduced_inertia(layout(), 1) == pytest.approx(1.0 / 0.0026, rel=1e-14)
    assert reduced_inertia(layout(), 0) == pytest.approx(2.0, rel=1e-15)


def test_mean_speeds_follow_the_radii() -> None:
    """A driver of 0.06 turns its gear of 0.02 three times as fast; what nothing connects has no speed."""
    assert speed_ratios(layout()).tolist() == pytest.approx([1.0, 3.0], rel=1e-15)
    assert speed_ratios(layout(reference=1)).tolist() == pytest.approx([1.0 / 3.0, 1.0], rel=1e-15)
    apart = layout(between=np.array([[0, -1], [0, -1]]))
    assert np.isnan(speed_ratios(apart)[1])


def test_a_gap_is_free_at_its_centre() -> None:
    """A gap proper has no stiffness there, a staged spring has."""
    assert is_gap(layout(), 0)
    assert not is_gap(staged([-1.0, 1.0], -1, [5.0, 1.0, 5.0]), 0)


def test_departure_is_the_velocity_at_the_return() -> None:
    """What the log says at the end of the contact; nothing where the motion ends first."""
    rows = [(0.25, 0, 0, 1, 0.5, 0.0), (0.75, 0, 1, 0, -0.4, 3.0), *chain([0, -1], [1.5])]
    actual = find_impacts(trajectory(rows=rows))
    assert actual.departure[0] == -0.4
    assert np.isnan(actual.departure[1])
