"""The torque of engines: against the work of the cycle, quadrature, and the series of the oscillating masses."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.model.engine import Engine

SIX = {"bore": "105 mm", "stroke": "137 mm", "rod": "0.207 m", "mass": "2.521 kg", "crankcase": "1 bar"}
"""A six-cylinder diesel, as published with doi 10.1243/14644193JMBD126."""


def trace(points: int = 721) -> tuple[np.ndarray, np.ndarray]:
    """Return a made-up pressure: compression and expansion about the firing dead centre at 0, and 1 bar elsewhere."""
    angle = np.linspace(0.0, 4.0 * np.pi, points)
    away = np.remainder(angle + 2.0 * np.pi, 4.0 * np.pi) - 2.0 * np.pi
    return angle, 1e5 + 60e5 * np.exp(-(((away - 0.15) / 0.5) ** 2)) + 20e5 * np.exp(-(((away - 0.5) / 0.6) ** 2))


def engine(cylinders: int, **extra: Any) -> dict[str, Any]:
    angle, pressure = trace()
    return {"cylinders": cylinders, **SIX, "pressure": {"angle": angle.tolist(), "value": pressure.tolist()}, **extra}


def validated(cylinders: int, **extra: Any) -> Engine:
    return Engine.model_validate(engine(cylinders, **extra))


@pytest.mark.parametrize("cylinders", [1, 3, 4, 6])
def test_mean_torque_is_the_work_of_the_cycle(cylinders: int) -> None:
    """4 pi times the mean torque is the integral of p dV, each volume from the closed form of the piston's way."""
    actual = gr.gas_torque(**engine(cylinders), speed="1500 rpm")
    angle, pressure = trace(200_001)
    share = 0.0685 / 0.207
    way = 0.0685 * (1 - np.cos(angle)) + 0.207 * (1 - np.sqrt(1 - (share * np.sin(angle)) ** 2))
    volume = 0.25 * math.pi * 0.105**2 * way
    work = cylinders * float(np.sum(0.5 * (pressure[1:] + pressure[:-1]) * np.diff(volume)))
    assert actual.work == pytest.approx(work, rel=1e-6)
    assert actual.mean == actual.work / (4.0 * np.pi)


def test_piston_derivatives_are_those_of_its_way() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 41)
    share, h = 0.0685 / 0.207, 1e-4

    def way(phi: np.ndarray) -> np.ndarray:
        return np.asarray(0.0685 * (1 - np.cos(phi)) + 0.207 * (1 - np.sqrt(1 - (share * np.sin(phi)) ** 2)))

    first, second = validated(1).piston(angle)
    assert first == pytest.approx((way(angle + h) - way(angle - h)) / (2 * h), abs=1e-9)
    assert second == pytest.approx((way(angle + h) - 2 * way(angle) + way(angle - h)) / h**2, abs=1e-7)


def test_gas_lines_are_those_of_quadrature() -> None:
    single = validated(1, mass=0.0)
    gas, masses = single.waves()
    assert masses == ()
    for wave in gas[::20]:
        breaks = np.linspace(0.0, 4.0 * np.pi, 25)

        def part(turn: Any, wave: Any = wave, breaks: Any = breaks) -> float:
            def value(phi: float) -> float:
                return float(single.gas_torque(np.array([phi]))[0] * turn(wave.order * phi))

            return sum(quad(value, a, b, epsabs=1e-7, limit=60)[0] for a, b in pairwise(breaks)) / (2.0 * np.pi)

        line = complex(part(np.sin), part(np.cos))
        assert wave.amplitude == pytest.approx(abs(line), rel=1e-5, abs=1e-4)
        assert np.exp(1j * wave.phase) == pytest.approx(line / abs(line), abs=1e-4)


def test_orders_of_the_oscillating_masses() -> None:
    """Known series of the torque, m r^2 Omega^2 times (lambda/4, -1/2, -3 lambda/4, -lambda^2/4), less by lambda^3."""
    omega = 157.0
    mass = 2.521
    radius = 0.0685
    flat = {"angle": np.linspace(0.0, 4.0 * np.pi, 10).tolist(), "value": [1e5] * 10}
    for share in (0.05, 0.1, 0.2):
        inputs = {**engine(1), "rod": radius / share, "pressure": flat}
        actual = gr.gas_torque(**inputs, speed=omega)
        assert actual.gas == ()
        sines = {w.order: w.amplitude * math.cos(w.phase) for w in actual.masses}
        expected = {1.0: share / 4.0, 2.0: -0.5, 3.0: -0.75 * share, 4.0: -(share**2) / 4.0}
        for order, factor in expected.items():
            assert sines[order] == pytest.approx(mass * radius**2 * omega**2 * factor, rel=share**2, abs=0.0)
        assert {w.order for w in actual.masses} <= set(range(1, 13))
        assert all(abs(math.sin(w.phase)) < 1e-9 for w in actual.masses if w.order <= 4)


@pytest.mark.parametrize("cylinders", [3, 4, 6])
def test_even_firing_leaves_multiples_of_half_the_cylinders(cylinders: int) -> None:
    actual = gr.gas_torque(**engine(cylinders), speed="1500 rpm", orders=8)
    assert actual.harmonics
    assert all(wave.order % (0.5 * cylinders) == 0.0 for wave in actual.harmonics)
    single = {w.order: w for w in gr.gas_torque(**engine(1), speed="1500 rpm", orders=8).harmonics}
    for wave in actual.harmonics:
        assert wave.amplitude == pytest.approx(cylinders * single[wave.order].amplitude, rel=1e-9)


def test_firing_angles_shift_a_cylinder() -> None:
    shift = 1.3
    one, other = (gr.gas_torque(**engine(1, firing=[f]), speed=100.0) for f in (0.0, shift))
    for a, b in zip(one.harmonics, other.harmonics, strict=True):
        assert np.exp(1j * (b.phase + a.order * shift)) == pytest.approx(np.exp(1j * a.phase), abs=1e-6)
    pair = gr.gas_torque(**engine(2, firing=[0.0, shift]), speed=100.0)
    assert pair.mean == pytest.approx(2.0 * one.mean, rel=1e-12)


def test_a_trace_from_a_file(tmp_path: Path) -> None:
    angle, pressure = trace()
    rows = "\n".join(f"{math.degrees(a)!r},{p / 1e5!r}" for a, p in zip(angle.tolist(), pressure.tolist(), strict=True))
    (tmp_path / "p.csv").write_text(f"phi [deg], p [bar]\n{rows}\n")
    inputs = {**engine(4), "pressure": {"file": str(tmp_path / "p.csv"), "angle": "phi", "value": "p"}}
    one, other = (gr.gas_torque(**entry, speed=100.0) for entry in (inputs, engine(4)))
    assert [w.amplitude for w in one.harmonics] == pytest.approx([w.amplitude for w in other.harmonics], rel=1e-9)


DRIVELINE = """
schema = 1
[[inertia]]
name = "crank"
J = 2.3
[[inertia]]
name = "load"
J = 1.0
[[coupling]]
name = "shaft"
between = ["crank", "load"]
stiffness = 2e4
damping = 20
clearance = 0.01
stiffness_ratio = 0.1
[excitation]
speed = "1500 rpm"
[[torque]]
on = "load"
mean = -100
"""


def driven(cylinders: int, **extra: Any) -> gr.Model:
    tables = gr.loads(DRIVELINE).to_tables()
    torque = [*tables["torque"], {"on": "crank", "engine": engine(cylinders, **extra)}]
    return gr.Model.from_tables({**tables, "torque": torque})


def test_an_engine_in_a_model_is_its_harmonics() -> None:
    model = driven(6)
    reported = gr.gas_torque(**engine(6), speed="1500 rpm").to_table()
    plain = model.with_({"torque.1": {"on": "crank", **reported}})
    one, other = assemble(model).system.inputs, assemble(plain).system.inputs
    assert one.mean == pytest.approx(other.mean, rel=1e-14)
    assert one.torque_sine == pytest.approx(other.torque_sine, rel=1e-12, abs=1e-12)
    assert one.torque_cosine == pytest.approx(other.torque_cosine, rel=1e-12, abs=1e-12)
    assert gr.loads(model.to_toml()) == model
    faster = model.with_({"excitation.speed": "3000 rpm"})
    waves = [model.torques[1].harmonics[-1], faster.torques[1].harmonics[-1]]
    assert waves[1].amplitude == pytest.approx(4.0 * waves[0].amplitude, rel=1e-14)


def test_masses_follow_a_sweep() -> None:
    """Along a sweep the masses' torque grows with the square of the speed; at one speed it is that of the harmonics."""
    from gearrattle.assembly import signals_of

    model = driven(4, orders=4).with_({"excitation.sweep": {"from": 100.0, "to": 200.0, "over": 1.0}})
    signals = signals_of(model.with_({"simulation.cycles": 40}))
    assert signals is not None
    time = np.linspace(0.0, 0.99, 80)
    speed, angle = 100.0 + 100.0 * time, 100.0 * time + 50.0 * time**2
    expected = np.zeros_like(time)
    motor = validated(4, orders=4)
    for waves, factor in zip(motor.waves(), (np.ones_like(speed), speed**2), strict=True):
        for wave in waves:
            expected += factor * wave.amplitude * np.sin(wave.order * angle + wave.phase)
    actual = signals.at(time) @ signals.torque[0]
    assert actual == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(np.abs(expected).max()))


def test_other_forms_of_the_model_know_the_engine() -> None:
    model = driven(6)
    scaled = gr.nondimensionalize(model)
    assert scaled.model.torques[1].harmonics
    run, back = gr.simulate(model, cycles=4), scaled.restore(gr.simulate(scaled.model, cycles=4))
    assert back.trajectory.angle == pytest.approx(run.trajectory.angle, rel=1e-7, abs=1e-9)
    assert gr.reduce(model, "1 Hz").model.torques


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rod": "60 mm"}, "longer than half the stroke"),
        ({"cylinders": 0}, "whole number from 1"),
        ({"bore": "105 N"}, "bore"),
        ({"firing": [0.0, 1.0]}, "one angle for each of the 6"),
        ({"pressure": {"angle": [0, 1, 2, 3], "value": [1, 1, 1, 1]}}, "must cover one cycle, 720 deg"),
        ({"pressure": {"angle": [0, 1, 2, 99], "value": [1, 1, 1, 1]}}, "must cover one cycle, 720 deg"),
        ({"pressure": {"time": [0, 1, 2, 3], "value": [1, 1, 1, 1]}}, "time is an unknown key"),
        ({"pressure": {"file": "none.csv", "angle": "phi", "value": "p"}}, "none.csv: no such file"),
    ],
)
def test_bad_engines(change: dict[str, Any], words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        gr.gas_torque(**{**engine(6), **change}, speed="1500 rpm")
    with pytest.raises(gr.ModelError, match=words):
        driven(6, **{k: v for k, v in change.items() if k != "cylinders"}) if "cylinders" not in change else driven(0)


def test_an_engine_stands_alone_in_its_table() -> None:
    tables = driven(4).to_tables()
    tables["torque"][1]["mean"] = 5.0
    with pytest.raises(gr.ModelError, match="mean cannot be given together with it"):
        gr.Model.from_tables(tables)
