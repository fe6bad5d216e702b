"""Drivelines without damping: multipliers lie on the unit circle all along, and leave it where two pairs meet."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr

SPEED, SHAFT = "excitation.speed", "coupling.shaft.stiffness"


def undamped(bodies: int, mean: float, amplitude: float, speed: float, shaft: float = 2.7) -> gr.Model:
    """One body in a gap, or two with a shaft behind it."""
    couplings: list[dict[str, Any]] = [
        {"name": "gap", "between": ["a", "b" if bodies == 2 else "ground"], "stiffness": 1.0, "clearance": 1.0}
    ]
    if bodies == 2:
        couplings.append({"name": "shaft", "between": ["b", "ground"], "stiffness": shaft})
    return gr.Model.from_tables(
        {
            "schema": 1,
            "name": "undamped",
            "units": "dimensionless",
            "inertia": [{"name": name, "J": 1.0} for name in "ab"[:bodies]],
            "coupling": [{"damping": 0.0, **coupling} for coupling in couplings],
            "excitation": {"speed": speed},
            "torque": [{"on": "a", "mean": mean, "harmonics": [{"order": 1, "amplitude": amplitude}]}],
        }
    )


def meeting(shaft: float) -> tuple[gr.Branch, int]:
    """The branch over speed on which two pairs meet, and that event's row."""
    branch = gr.continuation(undamped(2, 0.5, 0.1, 0.63, shaft), SPEED, (0.55, 0.75))
    rows = np.flatnonzero(branch.events["kind"] == "Neimark-Sacker")
    assert len(rows) == 1
    return branch, int(rows[0])


def test_a_pair_that_stays_on_the_circle_is_no_event() -> None:
    """Contact is lost where the amplitude 0.05 / (w**2 - 1) is the mean deflection of 0.1 behind the corner."""
    branch = gr.continuation(undamped(1, 0.1, 0.05, 1.4), SPEED, (1.1, 2.5))
    moduli = np.abs([point.multipliers for point in branch.curves[0].points])
    np.testing.assert_allclose(moduli, 1.0, rtol=0.0, atol=1e-13)
    assert list(branch.events["kind"]) == ["grazing"]
    assert branch.events["value"][0] == pytest.approx(np.sqrt(1.5), rel=1e-12)


def test_two_pairs_that_meet_leave_the_circle_in_fours() -> None:
    branch, row = meeting(2.7)
    points = branch.curves[0].points
    index = int(branch.events["point"][row])
    before, after = (np.abs(point.multipliers) for point in points[index : index + 2])
    assert (before.max() > 1.0 + 1e-3) != (after.max() > 1.0 + 1e-3)
    event = next(event for event in branch.curves[0].events if event.kind == "Neimark-Sacker")
    four = np.sort_complex(event.point.multipliers)
    assert abs(four[0] - four[1].conj()) < 1e-5
    assert np.ptp(np.abs(four.imag)) < 1e-5
    assert not branch.events["collision"][row]


@pytest.mark.long
def test_where_two_pairs_meet_moves_as_in_changed_models() -> None:
    branch, row = meeting(2.7)
    changed = [meeting(2.7 * (1.0 + sign * 1e-4)) for sign in (-1.0, 1.0)]
    values = [float(other.events["value"][own]) for other, own in changed]
    measured = (values[1] - values[0]) / (2.0 * 2.7e-4)
    assert branch.gradients(row, [SHAFT])["gradient"][0] == pytest.approx(measured, rel=1e-5)
