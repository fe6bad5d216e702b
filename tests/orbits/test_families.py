"""What is free in a motion that is one of a family, and how far."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.orbits.motion_families import directions_of, state_names

TRAIN: dict[str, Any] = {
    "schema": 1,
    "inertia": [{"name": "engine", "J": 0.1, "drag": 0.01}, {"name": "wheel", "J": 0.02, "drag": 0.01}],
    "coupling": [
        {"name": "gap", "between": ["engine", "wheel"], "stiffness": 2000.0, "damping": 0.3, "clearance": 0.01}
    ],
    "excitation": {"speed": 100.0},
    "torque": [{"on": "engine", "harmonics": [{"order": 1, "amplitude": 0.5}]}],
}


def train(drag: float = 0.01, means: float = 0.0, **coupling: Any) -> gr.Model:
    torque = [
        {"on": "engine", "mean": means, "harmonics": [{"order": 1, "amplitude": 0.5}]},
        {"on": "wheel", "mean": -means},
    ]
    inertia = [{**body, "drag": drag} for body in TRAIN["inertia"]]
    return gr.Model.from_tables(
        {**TRAIN, "inertia": inertia, "torque": torque, "coupling": [{**TRAIN["coupling"][0], **coupling}]}
    )


def test_a_body_that_floats_may_stand_anywhere_in_its_gap() -> None:
    """The wheel stands still while the engine swings by a: the deflection at t = 0 lies between -b and b, less a."""
    orbit = gr.periodic(train(), start="zero")
    (interval,) = orbit.family
    assert interval.name == "deflection.gap"
    swing = orbit.run.data["deflection"].values[:, 0]
    want = [-0.01 - swing.min() + swing[0], 0.01 - swing.max() + swing[0]]
    np.testing.assert_allclose([interval.low, interval.high], want, rtol=0, atol=1e-9)
    assert orbit.stable
    assert orbit.notes[0].startswith("The motion is one of a family")


def test_a_train_without_drag_keeps_any_speed_and_is_given_at_the_speed_zero() -> None:
    orbit = gr.periodic(train(drag=0.0, means=2.0))
    (interval,) = orbit.family
    assert interval.name.startswith("velocity")
    assert (interval.low, interval.high) == (-np.inf, np.inf)
    assert abs(orbit.motion.turned[0]) < 1e-9


def test_a_slider_that_never_slips_is_free_between_the_torques_at_which_it_would() -> None:
    orbit = gr.periodic(train(means=2.0, hysteresis=40.0))
    assert orbit.free == 1
    (interval,) = orbit.family
    assert interval.low < interval.value < interval.high
    assert np.isfinite([interval.low, interval.high]).all()


def test_two_sliders_that_never_slip_are_free_each_by_itself() -> None:
    """In series both feel the same torque; the range of one is what it is alone while the other stands."""
    tables = train(means=2.0, hysteresis=40.0).to_tables()
    wheel = {"name": "rim", "J": 0.01, "drag": 0.01}
    rim = {**tables["coupling"][0], "name": "bush", "between": ["wheel", "rim"]}
    model = gr.Model.from_tables(
        {**tables, "inertia": [*tables["inertia"], wheel], "coupling": [*tables["coupling"], rim]}
    )
    orbit = gr.periodic(model)
    assert orbit.free == 2
    intervals = orbit.family
    names = [interval.name for interval in intervals]
    assert len(set(names)) == 2
    for interval in intervals:
        assert interval.low < interval.value < interval.high
    for interval in intervals:
        index = state_names(model).index(interval.name)
        others = [state_names(model).index(name) for name in names if name != interval.name]
        for chosen, direction in directions_of(orbit.period_map, orbit.motion):
            assert (direction[index] == pytest.approx(0.0, abs=1e-9 * np.abs(direction).max())) == (chosen in others)


def test_one_that_slips_is_isolated() -> None:
    orbit = gr.periodic(train(means=2.0, hysteresis=0.02))
    assert orbit.family == ()
    assert np.abs(orbit.multipliers).min() < 1e-12


def test_torques_that_do_not_balance_are_refused_without_drag() -> None:
    model = train(drag=0.0, means=2.0).with_({"torque.1.mean": -1.9})
    with pytest.raises(gr.ModelError, match="must balance"):
        gr.periodic(model)
