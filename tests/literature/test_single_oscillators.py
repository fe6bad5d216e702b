"""V1, V2, V3, V7: one inertia to ground, free vibration through corners, periods and amplitudes in closed form."""

from __future__ import annotations

from dataclasses import replace
from math import asin, atan2, exp, pi, sqrt

import numpy as np
import pytest

import gearrattle as gr
from tests.literature import systems
from tests.oracles.driveline import Driveline


def simulate(model: Driveline, cycles: int, samples: int) -> gr.Run:
    return gr.simulate(gr.loads(model.toml()), algorithm="exact", cycles=cycles, samples_per_cycle=samples, discard=0)


def regions(run: gr.Run) -> list[tuple[int, int]]:
    return list(zip(run.events["from_region"], run.events["to_region"], strict=True))


def test_v1_gap_oscillator_keeps_time_for_hundreds_of_periods():
    run = simulate(systems.gap_oscillator(), 300, 2)
    w = 2.0
    b = 0.5
    A = 1.25
    contact, flight = pi / w, 2 * b / (w * (A - b))
    count = len(run.events)
    i = np.arange(count)
    want = pi / (2 * w) + (i // 2) * contact + ((i + 1) // 2) * flight
    assert want[-1] <= 300 * 2 * pi < want[-1] + max(contact, flight)
    assert want[4] - want[0] == pytest.approx(4.47492598692312657, rel=1e-15)
    assert np.max(np.abs(run.events["time"] - want)) < 1e-10
    assert regions(run) == [[(1, 0), (0, -1), (-1, 0), (0, 1)][j % 4] for j in i]
    assert np.allclose(np.abs(run.events["velocity"]), w * (A - b), rtol=1e-12, atol=0)


def test_v2_trilinear_period_and_amplitude():
    ki = 0.64
    ko = 9.0
    b = 0.2
    v0 = 0.7
    vb, y0 = sqrt(v0**2 - ki * b**2), ki * b / ko
    period = 4 * (asin(b * sqrt(ki) / v0) / sqrt(ki) + atan2(vb, sqrt(ko) * y0) / sqrt(ko))
    assert period == pytest.approx(3.16407419339278037, rel=1e-15)
    model = replace(systems.trilinear(), speed=repr(2 * pi / period))
    run = simulate(model, 50, 4)
    times = run.events["time"].to_numpy()
    assert regions(run) == [(0, 1), (1, 0), (0, -1), (-1, 0)] * 50
    assert np.allclose(times[4:] - times[:-4], period, rtol=0, atol=1e-12)
    turning = run.data["deflection"].sel(clearance="spring").values[1::4]
    assert np.allclose(turning, 0.413378901687433091, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("damped", "z1", "z2"), [(False, 0.0, 0.0), (True, 0.02, 0.05)])
def test_v3_bilinear_oscillator(damped, z1, z2):
    run = simulate(systems.bilinear(damped), 12, 8)
    half1, half2 = pi / sqrt(1 - z1**2), pi / (3 * sqrt(1 - z2**2))
    ratio = exp(-pi * (z1 / sqrt(1 - z1**2) + z2 / sqrt(1 - z2**2)))
    if damped:
        assert half1 + half2 == pytest.approx(4.19073016830816, rel=1e-14)
        assert ratio == pytest.approx(0.802421880122602, rel=1e-14)
    else:
        assert 2 * pi / (half1 + half2) == pytest.approx(2 * 1 * 3 / (1 + 3), rel=1e-14)
    i = np.arange(len(run.events))
    want = (i // 2 + 1) * half1 + ((i + 1) // 2) * half2
    assert want[-1] <= 24 * pi < want[-1] + half1
    assert np.max(np.abs(run.events["time"] - want)) < 1e-12 * 24 * pi
    upward = run.events["velocity"].to_numpy()[1::2]
    assert np.allclose(upward, ratio ** np.arange(1, len(upward) + 1), rtol=1e-12, atol=0)
    assert regions(run) == [[(0, -1), (-1, 0)][j % 2] for j in i]
    assert set(np.unique(run.data["region"])) == {-1, 0}


def test_v7_three_stage_clutch():
    period, amplitude = 0.054843526866589971, 0.446941805543020714
    model = replace(systems.three_stage_clutch(), speed=repr(2 * pi / period))
    run = simulate(model, 40, 4)
    assert len(run.events) == 8 * 40
    times = run.events["time"].to_numpy()
    assert np.allclose(times[8:] - times[:-8], period, rtol=0, atol=1e-13)
    assert regions(run) == [(0, 1), (1, 2), (2, 1), (1, 0), (0, -1), (-1, -2), (-2, -1), (-1, 0)] * 40
    quarter = run.data["deflection"].sel(clearance="clutch").values[1::2]
    assert np.allclose(quarter, np.where(np.arange(80) % 2, -amplitude, amplitude), rtol=0, atol=1e-11)
    torque = 50 * 0.05 + 600 * 0.15 + 3000 * (amplitude - 0.2)
    assert np.allclose(np.abs(run.data["force"].sel(clearance="clutch").values[1::2]), torque, rtol=1e-11, atol=0)
