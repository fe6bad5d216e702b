"""Spectra and orders of runs and recordings: closed forms, linear response, refusals with a remedy."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.recording import Channel, Recording

EXAMPLES = Path(__file__).parents[3] / "examples"
RPM = np.pi / 30.0
RATE = 5000.0
TIME = 3.0 + np.arange(50_000) / RATE
SPEED = 2.0 * np.pi * (12.0 + 2.5 * (TIME - 3.0))
ANGLE = 2.0 * np.pi * (12.0 * (TIME - 3.0) + 1.25 * (TIME - 3.0) ** 2)
WAVE = 2.0 * np.sin(2.0 * ANGLE + 0.3) + 0.1 * np.sin(12.0 * ANGLE)


def record(*more: Channel, wave: np.ndarray = WAVE, speed: np.ndarray = SPEED) -> Recording:
    shaft = Channel("n", "speed", "", "rad/s", speed)
    return Recording(TIME, (Channel("a", "acceleration", "hub", "rad/s^2", wave), shaft, *more), "rig.csv")


@cache
def linear() -> gr.Model:
    """Return the example of a run-up without clearances and transmission errors, slower."""
    tables = gr.load(EXAMPLES / "run_up.toml").to_tables()
    for coupling in tables["coupling"]:
        for key in ("stages", "coast_stages", "clearance"):
            coupling.pop(key, None)
        if coupling["name"] == "damper":
            coupling.update(stiffness=350.0, damping=1.0)
    for mesh in tables["mesh"]:
        mesh.pop("backlash")
        mesh.pop("transmission_error")
    tables["excitation"] = {"sweep": {"from": 800.0 * RPM, "to": 3000.0 * RPM, "over": 12.0}}
    return gr.Model.from_tables(tables)


@cache
def run_up() -> gr.Run:
    return gr.simulate(linear())


def response(order: float, speeds: np.ndarray, name: str) -> np.ndarray:
    """Return the complex amplitude of an acceleration to a unit torque on the flywheel, at steady speeds."""
    tables = linear().to_tables()
    names = [entry["name"] for entry in tables["inertia"]]
    size = len(names)
    inertia = np.diag([entry["J"] for entry in tables["inertia"]])
    damping, stiffness = np.diag([entry.get("drag", 0.0) for entry in tables["inertia"]]), np.zeros((size, size))
    for part in [*tables["coupling"], *tables["mesh"]]:
        row = np.zeros(size)
        first, second = part.get("radii", (1.0, 1.0))
        row[names.index(part["between"][0])], row[names.index(part["between"][1])] = first, -second
        stiffness += part["stiffness"] * np.outer(row, row)
        damping += part["damping"] * np.outer(row, row)
    load = np.zeros(size)
    load[names.index("flywheel")] = 1.0
    actual = [
        -(w**2) * np.linalg.solve(stiffness + 1j * w * damping - w**2 * inertia, load)
        for w in (order * speeds).tolist()
    ]
    return np.array(actual)[:, names.index(name)]


@pytest.mark.parametrize(
    ("order", "speeds", "torques", "phase"),
    [
        (2.0, [700.0, 1500.0, 3000.0], [50.0, 70.0, 40.0], 0.0),
        (4.0, [700.0, 3000.0], [18.0, 25.0], np.deg2rad(35.0)),
        (6.0, [700.0, 3000.0], [6.0, 6.0], np.deg2rad(70.0)),
    ],
)
def test_orders_of_a_slow_run_up_are_the_linear_response(
    order: float, speeds: list[float], torques: list[float], phase: float
) -> None:
    cuts = gr.spectral.order_cuts(run_up(), "acceleration.input_shaft", [2.0, 4.0, 6.0], turns=4, over="speed")
    inner = cuts.sel(order=order, speed=slice(850.0 * RPM, 2950.0 * RPM))
    at = inner.speed.values
    torque = np.interp(at, np.array(speeds) * RPM, torques)
    expected = torque * np.exp(1j * phase) * response(order, at, "input_shaft")
    actual = inner.amplitude.values * np.exp(1j * inner.phase.values)
    assert np.abs(actual - expected).max() < 0.01 * np.abs(expected).max()


def test_the_order_map_of_a_run_up_says_the_same() -> None:
    cuts = gr.spectral.order_cuts(run_up(), "acceleration.input_shaft", [2.0, 4.0, 6.0], turns=4)
    actual = gr.spectral.order_map(run_up(), "acceleration.input_shaft", turns=4).interp(time=cuts.time[2:-2])
    assert actual.amplitude.sel(order=[2.0, 4.0, 6.0]).values == pytest.approx(cuts.amplitude.values[2:-2], rel=0.01)
    assert actual.attrs["units"] == "rad/s^2"
    assert actual.attrs["shaft"] == "the reference shaft"


def test_a_steady_run_shows_its_harmonic_at_its_order() -> None:
    model = gr.load(EXAMPLES / "paper" / "case3_loaded.toml")
    run = gr.simulate(model, cycles=40, discard=20)
    t = run.trajectory
    actual = gr.spectral.order_map(run, "velocity.flywheel", turns=20, window="boxcar")
    part = t.velocity[20 * t.samples_per_cycle : -1, 0]
    share = 2.0 * np.abs(np.fft.rfft(part)[20]) / part.size
    assert actual.amplitude.sel(order=1.0).values == pytest.approx([share], rel=1e-4)
    assert actual.speed.values == pytest.approx(t.layout.omega)
    assert actual.time.values[0] > 20 * t.layout.period


def test_a_recording_shows_the_orders_it_was_made_of() -> None:
    actual = gr.spectral.order_map(record(), "acceleration.hub", highest=20.0, over="speed")
    assert actual.amplitude.dims == ("speed", "order")
    assert actual.amplitude.sel(order=2.0).values == pytest.approx(2.0, rel=2e-4)
    assert actual.phase.sel(order=2.0).values == pytest.approx(0.3, abs=1e-4)
    assert actual.amplitude.sel(order=12.0).values == pytest.approx(0.1, rel=2e-3)
    assert (actual.amplitude.attrs["units"], actual.speed.attrs["units"]) == ("rad/s^2", "rad/s")
    assert actual.time.values == pytest.approx(3.0 + (actual.speed.values / (2.0 * np.pi) - 12.0) / 2.5, abs=0.01)


def test_speed_angle_and_constant_lead_to_the_same_orders() -> None:
    angle = Channel("phi", "shaft angle", "", "rad", ANGLE)
    by_speed = gr.spectral.order_map(record(angle), "a", speed="n", highest=20.0)
    by_angle = gr.spectral.order_map(record(angle), "a", highest=20.0)
    assert by_angle.attrs["shaft"] == "phi"
    assert by_angle.amplitude.values == pytest.approx(by_speed.amplitude.values, abs=1e-6)
    steady = np.sin(2.0 * np.pi * 50.0 * (TIME - 3.0))
    held = gr.spectral.order_map(Recording(TIME, (Channel("x", "", "", "V", steady),), "x"), "x", speed="1500 rpm")
    assert held.amplitude.sel(order=2.0).values == pytest.approx(1.0, rel=2e-4)


def test_a_shaft_that_turns_backwards_throughout_is_turned_round() -> None:
    actual = gr.spectral.order_map(record(speed=-SPEED), "a", highest=20.0)
    assert "sign turned" in actual.attrs["shaft"]
    assert actual.amplitude.sel(order=2.0).values == pytest.approx(2.0, rel=2e-4)


def test_a_speed_that_comes_back_is_gathered_by_steps() -> None:
    swing = 2.0 * np.pi * (20.0 + 6.0 * np.sin(2.0 * np.pi * 0.3 * TIME))
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (swing[1:] + swing[:-1]))]) / RATE
    back = record(wave=1.5 * np.sin(2.0 * turned), speed=swing)
    with pytest.raises(ModelError, match="speed_step"):
        gr.spectral.order_map(back, "a", over="speed")
    actual = gr.spectral.order_map(back, "a", turns=4, speed_step="100 rpm")
    assert np.all(np.diff(actual.speed.values) > 0.0)
    assert int(actual.blocks.sum()) == gr.spectral.order_map(back, "a", turns=4).sizes["time"]
    assert actual.amplitude.sel(order=2.0).values == pytest.approx(1.5, rel=1e-3)


def test_psd_holds_the_power_and_its_limits_their_factors() -> None:
    rng = np.random.default_rng(4)
    noisy = Recording(TIME, (Channel("x", "sound pressure", "cab", "Pa", 0.3 * rng.standard_normal(TIME.size)),), "x")
    actual = gr.spectral.psd(noisy, "sound pressure.cab", resolution="10 Hz")
    assert float(actual.density.integrate("frequency")) == pytest.approx(0.09, rel=0.02)
    assert actual.density.attrs["units"] == "(Pa)^2/Hz"
    assert actual.attrs["resolution"] == pytest.approx(10.0)
    assert bool((actual.low < actual.density).all())
    assert bool((actual.high > actual.density).all())


def test_coherence_and_cross_psd_of_a_known_mixture() -> None:
    rng = np.random.default_rng(6)
    x = rng.standard_normal(TIME.size)
    y = 2.0 * x + 2.0 * rng.standard_normal(TIME.size)  # coherence one half
    pair = Recording(TIME, (Channel("x", "force", "damper", "N m", x), Channel("y", "torque", "hub", "N m", y)), "r")
    actual = gr.spectral.coherence(pair, "y", "x", resolution=20.0)
    inside = (actual.low <= 0.5) & (actual.high >= 0.5)
    assert float(inside.mean()) > 0.9
    assert float(actual.coherence.mean()) == pytest.approx(0.5, abs=0.02)
    assert actual.attrs["threshold"] < 0.02
    crossed = gr.spectral.cross_psd(pair, "y", "x", resolution=20.0)
    assert float(np.abs(crossed.response - 2.0).max()) < 4.0 * float(crossed.radius.max())
    assert complex(crossed.response.mean()).real == pytest.approx(2.0, rel=0.02)
    assert crossed.response.attrs["units"] == "(N m)/(N m)"


def test_a_waterfall_has_times_speeds_and_units() -> None:
    actual = gr.spectral.waterfall(record(), "a", resolution="10 Hz", highest="600 Hz")
    assert actual.dims == ("time", "frequency")
    assert float(actual.frequency.max()) == pytest.approx(600.0)
    ridge = actual.frequency.values[actual.values.argmax(axis=1)]
    assert ridge == pytest.approx(2.0 * actual.speed.values / (2.0 * np.pi), abs=10.0)
    assert actual.attrs["units"] == "rad/s^2"
    stepped = gr.spectral.waterfall(record(), "a", resolution="10 Hz", speed_step="50 rpm", orders=[2.0])
    assert stepped.dims == ("speed", "order")
    power = gr.spectral.waterfall(record(), "a", scaling="density", window="boxcar", overlap=0.0)
    assert float(power.integrate("frequency").mean()) == pytest.approx(2.0 + 0.005, rel=0.01)
    timeless = gr.spectral.waterfall(Recording(TIME, record().channels[:1], "x"), "a")
    assert "speed" not in timeless.coords


def test_a_simulated_run_says_what_folds_back() -> None:
    run = gr.simulate(gr.load(EXAMPLES / "run_up.toml"), cycles=4)
    assert "order 40 reaches 2000 Hz" in gr.spectral.psd(run, "acceleration.hub").attrs["notes"]
    assert gr.spectral.psd(run_up(), "acceleration.hub").attrs["notes"] == ""


def uneven() -> Recording:
    return Recording(TIME**1.01, record().channels, "rig.csv")


def stopping() -> Recording:
    return record(speed=SPEED - SPEED[25_000])


REFUSED: list[tuple[Callable[[], Any], tuple[str, ...]]] = [
    (lambda: gr.spectral.psd(record(), "b"), ("rig.csv", "a, n")),
    (lambda: gr.spectral.psd(uneven(), "a"), ("uniform", "rate =")),
    (lambda: gr.spectral.psd(record(), "a", resolution="0.01 Hz"), ("100 s", "10 s")),
    (lambda: gr.spectral.psd(record(), "a", resolution="10 rpm"), ("resolution", "frequency")),
    (lambda: gr.spectral.psd(record(), "a", window="ham"), ("window", "hann")),
    (lambda: gr.spectral.psd(record(), "a", overlap=1.0), ("overlap", "below 1")),
    (lambda: gr.spectral.psd(record(), "a", level=1.0), ("level",)),
    (lambda: gr.spectral.psd(record(wave=WAVE * np.where(TIME > 4.0, np.nan, 1.0)), "a"), ("finite", "nan at sample")),
    (lambda: gr.spectral.coherence(record(), "a", "n", resolution="0.1 Hz"), ("1 segment",)),
    (lambda: gr.spectral.order_map(Recording(TIME, record().channels[:1], "x"), "a"), ("speed", "1500 rpm")),
    (lambda: gr.spectral.order_map(record(), "a", speed="m"), ("no channel and no speed", "a, n")),
    (lambda: gr.spectral.order_map(record(), "n", speed="a"), ("acceleration", "the shaft needs")),
    (lambda: gr.spectral.order_map(stopping(), "a"), ("turns back", "3 s", "cut the record")),
    (lambda: gr.spectral.order_map(record(), "a", highest=60.0), ("highest order", "0.4", "at most")),
    (lambda: gr.spectral.order_map(record(), "a", overlap=1.0 - 1e-9), ("larger than", "lower the overlap")),
    (
        lambda: gr.spectral.order_map(record(speed=SPEED * np.where(TIME > 4.0, np.nan, 1.0)), "a"),
        ("rig.csv: n", "nan"),
    ),
    (lambda: gr.spectral.waterfall(record(), "a", overlap=0.9999, resolution=1.0), ("larger than", "overlap")),
    (lambda: gr.spectral.order_map(record(), "a", turns=500), ("turns", "500")),
    (lambda: gr.spectral.order_map(record(), "a", turns=0), ("turns", "a whole number from 1")),
    (lambda: gr.spectral.order_map(record(), "a", over="order"), ("over", "speed")),
    (lambda: gr.spectral.order_cuts(record(), "a", [2.0, 2.01]), ("separated from each other", "turns=100")),
    (lambda: gr.spectral.order_cuts(record(), "a", []), ("orders",)),
    (lambda: gr.spectral.waterfall(record(), "a", scaling="power"), ("scaling", "density")),
    (lambda: gr.spectral.waterfall(record(), "a", orders=[500.0]), ("orders", "raise highest")),
    (lambda: gr.spectral.waterfall(record(), "a", speed_step="0 rpm"), ("speed_step", "greater than zero")),
    (lambda: gr.spectral.psd(run_up(), "acceleration.hubb"), ("channel", "did you mean")),
    (lambda: gr.spectral.order_map(run_up(), "acceleration.hub", speed="1500 rpm"), ("sweep", "leave speed out")),
]


@pytest.mark.parametrize("number", range(len(REFUSED)))
def test_refusals_say_what_and_why(number: int) -> None:
    call, words = REFUSED[number]
    with pytest.raises(ModelError) as caught:
        call()
    text = str(caught.value)
    assert [word for word in words if word not in text] == [], text


def test_pulses_alone_are_pointed_to_a_mapping() -> None:
    pulses = Recording(TIME, (record().channels[0], Channel("z", "pulses", "", "1", np.sign(WAVE))), "x")
    with pytest.raises(ModelError, match="pulses_per_turn"):
        gr.spectral.order_map(pulses, "a")
