"""What is derived from a run along a sweep follows the speed: nothing is that of the first speed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.recording import Channel, Recording

Array = np.ndarray

FIRST, LAST, OVER = 100.0, 300.0, 0.4
TABLE = {"speed": [50.0, 160.0, 350.0], "value": [1.0, 2.2, 7.0]}
INERTIA, REDUCTION = 0.02, 2.0
RESTING: dict[str, Any] = {"initial": "static", "audit": False}


def speed_at(time: Array) -> Array:
    """The speed of the sweep."""
    return FIRST + (LAST - FIRST) * np.minimum(time / OVER, 1.0)


def drag_at(time: Array) -> Array:
    """The drag torque by its table, written out."""
    speed = speed_at(time)
    return np.where(speed < 160.0, 1.0 + (speed - 50.0) * 1.2 / 110.0, 2.2 + (speed - 160.0) * 4.8 / 190.0)


def loose_gear(drag_torque: object = TABLE, **changes: object) -> gr.Model:
    """A driver on a spring, or moved, and a loose gear on it."""
    tables: dict[str, Any] = {
        "schema": 1,
        "inertia": [
            {"name": "driver", "J": 0.1, "drag": 0.2},
            {"name": "gear", "J": INERTIA, "drag": 0.01, "drag_torque": drag_torque},
        ],
        "coupling": [{"name": "spring", "between": ["driver", "ground"], "stiffness": 6000.0, "damping": 0.5}],
        "mesh": [
            {
                "name": "mesh",
                "between": ["driver", "gear"],
                "radii": [0.06, 0.03],
                "stiffness": 2e7,
                "damping": 200.0,
                "backlash": 1e-4,
            }
        ],
        "excitation": {"sweep": {"from": FIRST, "to": LAST, "over": OVER}},
        "torque": [{"on": "driver", "harmonics": [{"order": 2, "amplitude": 40.0}]}],
    }
    return gr.Model.from_tables(tables | changes)


def moved() -> gr.Model:
    """The same with a driver of prescribed motion, whose acceleration rises with the square of the speed."""
    motion = {"on": "driver", "harmonics": [{"order": 2, "amplitude": 1e-3}]}
    return loose_gear(motion=[motion], coupling=[], torque=[])


def needed(run: gr.Run) -> Array:
    """The torque that the loose gear needs at every sample, over its drag torque there."""
    acceleration = run.data.acceleration.sel(inertia="driver").values
    return np.asarray(INERTIA * REDUCTION * np.abs(acceleration) / drag_at(run.data.time.values))


def ratio_of(table: Any, quantity: str) -> tuple[float, float]:
    """A value of a table of criteria or metrics, and its error."""
    row = table[table.quantity == quantity].iloc[0]
    return float(row.value), float(row.error)


def test_the_drive_torque_follows_the_table_of_the_drag_torque() -> None:
    tables: dict[str, Any] = {
        "schema": 1,
        "inertia": [
            {"name": "a", "J": 0.1, "drag": 0.2, "drag_torque": {"speed": [50.0, 350.0], "value": [1.0, 7.0]}},
            {"name": "b", "J": 0.02, "drag": 0.5},
        ],
        "coupling": [{"name": "spring", "between": ["a", "b"], "stiffness": 800.0}],
        "excitation": {"sweep": {"from": FIRST, "to": LAST, "over": OVER}},
        "torque": [{"on": "b", "mean": 0.5}],
        "motion": [{"on": "a", "harmonics": [{"order": 2, "amplitude": 0.01}]}],
    }
    run = gr.simulate(gr.Model.from_tables(tables), **RESTING)
    a = run.data.sel(inertia="a", motion="a", element="spring")
    left = a.drive_torque - 0.1 * a.acceleration - 0.2 * a.velocity - a.element_torque
    time = run.data.time.values
    expected = 1.0 + (speed_at(time) - 50.0) * 6.0 / 300.0
    assert (expected[0], expected[-1]) == (2.0, 6.0)
    assert np.max(np.abs(left.values - expected)) < 1e-12 * float(np.max(np.abs(a.drive_torque)))


def test_the_margin_of_a_moved_driver_is_the_largest_of_all_samples() -> None:
    run = gr.simulate(moved(), **RESTING)
    expected = needed(run).max()
    frozen = (needed(run) * drag_at(run.data.time.values)).max() / drag_at(np.zeros(1))[0]
    assert expected < 0.4 * frozen
    assert ratio_of(gr.metrics(run, names=["separation"]), "separation ratio")[0] == pytest.approx(expected, rel=1e-12)
    judged = {row.quantity: row.value for row in gr.criteria(run).of("loose_gear")}
    assert judged["torque ratio of gear"] == pytest.approx(expected, rel=1e-12)
    assert judged["margin"] == pytest.approx(20.0 * np.log10(expected), abs=1e-11)


def test_the_margin_of_a_free_driver_bounds_the_motion_between_samples() -> None:
    coarse = gr.simulate(loose_gear(), **RESTING, samples_per_cycle=64)
    dense = needed(gr.simulate(loose_gear(), **RESTING, samples_per_cycle=8192)).max()
    value, error = ratio_of(gr.metrics(coarse, names=["separation"]), "separation ratio")
    assert needed(coarse).max() <= value * (1.0 + 1e-12)
    assert value <= dense * (1.0 + 1e-6)
    assert dense <= (value + error) * (1.0 + 1e-9)
    assert error < 0.2 * value


def test_a_table_of_one_value_is_that_value() -> None:
    flat = gr.simulate(loose_gear({"speed": [50.0, 350.0], "value": [3.0, 3.0]}), **RESTING)
    plain = gr.simulate(loose_gear(3.0), **RESTING)
    for quantity in ("separation ratio", "separation margin"):
        value, error = ratio_of(gr.metrics(flat, names=["separation"]), quantity)
        assert value == pytest.approx(ratio_of(gr.metrics(plain, names=["separation"]), quantity)[0], rel=1e-12)
        assert error < 1e-12


def test_chunks_have_the_ratio_of_the_whole() -> None:
    whole = gr.simulate(loose_gear(), **RESTING)
    chunks = gr.stream(loose_gear(), chunk=2, **RESTING)
    expected = ratio_of(gr.metrics(whole, names=["separation"]), "separation ratio")
    assert ratio_of(gr.metrics(chunks, names=["separation"]), "separation ratio") == pytest.approx(expected, rel=1e-9)


def test_a_gear_without_a_drag_torque_at_the_first_speed_is_loose() -> None:
    run = gr.simulate(loose_gear({"speed": [100.0, 300.0], "value": [0.0, 6.0]}), **RESTING)
    table = gr.metrics(run, names=["separation"])
    assert list(table.quantity) == ["separation ratio", "separation margin"]


@pytest.mark.parametrize("speed", [120.0, 200.0])
def test_a_recording_has_the_drag_torque_of_its_own_speed(speed: float) -> None:
    model = loose_gear().with_({"excitation.sweep": None, "excitation.speed": FIRST})
    time = np.linspace(0.0, 1.0, 4001)
    acceleration = 50.0 * np.cos(2.0 * np.pi * 10.0 * time)
    channel = Channel("a", "acceleration", "driver", "rad/s^2", acceleration)
    table = gr.metrics(Recording(time, (channel,), "made"), model, ["separation"], speed=speed)
    expected = INERTIA * REDUCTION * 50.0 / np.interp(speed, TABLE["speed"], TABLE["value"])
    assert ratio_of(table, "separation ratio")[0] == pytest.approx(expected, rel=1e-4)


def test_a_recorded_speed_is_followed_sample_by_sample() -> None:
    model = loose_gear().with_({"excitation.sweep": None, "excitation.speed": FIRST})
    time = np.linspace(0.0, 1.0, 4001)
    speed = 150.0 + 100.0 * time
    acceleration = np.full(time.size, 50.0)
    channels = (
        Channel("a", "acceleration", "driver", "rad/s^2", acceleration),
        Channel("n", "speed", "driver", "rad/s", speed),
    )
    table = gr.metrics(Recording(time, channels, "made"), model, ["separation"])
    period = 2.0 * np.pi / (2.0 * speed.mean())
    begin = 1.0 - np.floor(1.0 / period) * period  # the last whole periods are taken
    expected = INERTIA * REDUCTION * 50.0 / np.interp(150.0 + 100.0 * begin, TABLE["speed"], TABLE["value"])
    assert ratio_of(table, "separation ratio")[0] == pytest.approx(expected, rel=1e-4)


def test_a_speed_beyond_the_table_gives_no_ratio() -> None:
    model = loose_gear().with_({"excitation.sweep": None, "excitation.speed": FIRST})
    time = np.linspace(0.0, 1.0, 4001)
    channel = Channel("a", "acceleration", "driver", "rad/s^2", np.sin(60.0 * time))
    table = gr.metrics(Recording(time, (channel,), "made"), model, ["separation"], speed=400.0)
    assert np.isnan(ratio_of(table, "separation ratio")[0])
    assert "not covered" in table.note.iloc[0]


def test_orders_have_no_amplitude_along_a_sweep() -> None:
    rows = gr.criteria(gr.simulate(loose_gear(), **RESTING)).of("spectrum")
    of_orders = [row for row in rows if "order" in row.quantity or "harmonic" in row.quantity]
    assert of_orders
    assert all(np.isnan(row.value) for row in of_orders)
    assert all("order_map" in row.note for row in of_orders)
