"""Inputs along sweeps and records, as they are used, against their formulas in fifty digits."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import gearrattle as gr
from gearrattle.assembly.input_signals import signals_of
from gearrattle.engine.system.run_up_phase import Ramp
from gearrattle.engine.system.run_up_signals import Tone
from gearrattle.engine.system.specified_inputs import NotKept, Swept, checked, turns
from tests.architecture.places import EXAMPLES

TOML = """
schema = 1
inertia = [ {{ name = "body", J = 0.04 }} ]
coupling = [ {{ name = "spring", between = ["body", "ground"], stiffness = 250.0, damping = 0.05 }} ]
[excitation]
sweep = {{ from = {first}, to = {last}, over = {over} }}
[[torque]]
on = "body"
mean = {{ speed = {speeds}, value = {values} }}
{harmonics}
[simulation]
initial = "zero"
"""


def swept(ramp: tuple[float, float, float], speeds: list[float], values: list[float], extra: str = "") -> gr.Model:
    first, last, over = ramp
    return gr.loads(
        TOML.format(first=first, last=last, over=over, speeds=speeds, values=values, harmonics=extra), "model"
    )


@pytest.mark.parametrize(
    ("ramp", "speeds", "values"),
    [
        ((100.0, 300.0, 2.0), [100.0, 110.0, 300.0], [0.0, 5.0, 2.0]),
        ((10.0, 300.0, 3e-5), [10.0, 40.0, 300.0], [0.0, 5.0, 2.0]),
        ((10.0, 300.0, 3e-5), [10.0, 10.0 + 1e-4, 300.0], [0.0, 5.0, 2.0]),
        ((300.0, 100.0, 2.0), [100.0, 299.999, 300.0], [2.0, 5.0, 0.0]),
        ((300.0, 100.0, 2.0), [100.0, 100.0001, 300.0], [2.0, 5.0, 0.0]),
    ],
)
@pytest.mark.parametrize("extra", ["", "harmonics = [ { order = 2, amplitude = 1.0 } ]"], ids=["table", "harmonic"])
def test_a_table_is_followed_from_the_first_instant(ramp, speeds, values, extra) -> None:
    first, last, over = ramp
    signals = signals_of(swept(ramp, speeds, values, extra))
    knots = signals.knots
    times = np.unique(np.concatenate([[0.0], 0.5 * (knots[1:] + knots[:-1]), np.geomspace(1e-9, 1.0, 60) * over]))
    speed = first + (last - first) * np.minimum(times / over, 1.0)
    angle = 2.0 * (first * np.minimum(times, over) + 0.5 * (last - first) / over * np.minimum(times, over) ** 2)
    angle += 2.0 * last * np.maximum(times - over, 0.0)
    want = np.interp(speed, speeds, values) - values[speeds.index(first)] + (np.sin(angle) if extra else 0.0)
    steepest = np.abs(np.diff(values) / np.diff(speeds)).max()
    off = np.abs(signals.at(times)[:, 0] - want)
    assert off.max() < 1e-12 * 6.0 + 8e-16 * max(first, last) * (steepest + 2.0 * knots[-1])


def test_the_motion_of_a_table_is_that_of_an_integral() -> None:
    """x'' + 2 d x' + w^2 x = T / J by Duhamel's integral over the table's straight pieces."""
    run = gr.simulate(swept((100.0, 300.0, 2.0), [100.0, 110.0, 300.0], [0.0, 5.0, 2.0]), samples_per_cycle=8)
    decay, root = 0.5 * 0.05 / 0.04, np.sqrt(250.0 / 0.04)
    turning = np.sqrt(root**2 - decay**2)
    node, weight = np.polynomial.legendre.leggauss(24)
    time = run.data.time.values
    for i in range(1, len(time), 29):
        ends = np.unique(
            np.concatenate(
                [
                    np.linspace(0.0, time[i], 1 + int(time[i] / 0.02)),
                    [0.0, min(0.1, time[i])],
                    [min(2.0, time[i]), time[i]],
                ]
            )
        )
        half, middle = 0.5 * np.diff(ends)[:, None], 0.5 * (ends[1:] + ends[:-1])[:, None]
        at = middle + half * node
        torque = np.interp(100.0 + 100.0 * np.minimum(at, 2.0), [100.0, 110.0, 300.0], [0.0, 5.0, 2.0])
        past = time[i] - at
        want = np.sum(half * weight * torque * np.exp(-decay * past) * np.sin(turning * past)) / (0.04 * turning)
        assert run.data["angle"].values[i, 0] == pytest.approx(want, rel=0, abs=1e-13)


def test_fractions_of_a_turn_in_double_doubles() -> None:
    ramp = Ramp(83.0, 314.15, 10.0)
    time = np.random.default_rng(0).uniform(0.0, 20.0, 200)
    rest = np.random.default_rng(1).uniform(-0.5, 0.5, 200) * np.spacing(time)
    with mpmath.workdps(50):
        for t, r, turn in zip(time.tolist(), rest.tolist(), turns(ramp, 187.0, time, rest).tolist(), strict=True):
            at, over = mpmath.mpf(t) + mpmath.mpf(r), mpmath.mpf(ramp.over)
            begin, end = mpmath.mpf(ramp.begin), mpmath.mpf(ramp.end)
            rising = begin * at + (end - begin) * at**2 / (2 * over)
            angle = rising if t <= ramp.over else (begin + end) * over / 2 + end * (at - over)
            off = 187 * angle / (2 * mpmath.pi) - mpmath.mpf(turn)
            assert abs(off - mpmath.nint(off)) < 1e-16


def test_two_derivatives_along_a_ramp() -> None:
    """Of an amplitude that is a square of the speed, while that rises and later: against differences of the value."""
    amplitudes = np.array([[0.3, 2e-3, -1e-5]])
    swept_tone = Tone(1.5, 0.4, np.array([50.0, 200.0]), amplitudes)
    specified = Swept(Ramp(60.0, 180.0, 1.0), (swept_tone,), smooth=True)
    step = 1e-5
    for time in (np.linspace(0.1, 0.9, 33), np.linspace(1.1, 1.9, 33)):
        for derivative in (1, 2):
            lower, upper = (specified.at(time + side * step, derivative=derivative - 1) for side in (-1.0, 1.0))
            actual = specified.at(time, derivative=derivative)
            assert np.abs(actual - (upper - lower) / (2.0 * step)).max() < 1e-5 * np.abs(actual).max()


@pytest.mark.parametrize("name", ["run_up", "measured_flywheel"])
def test_polynomials_that_are_wrong_in_one_interval_are_refused(name: str) -> None:
    signals = signals_of(gr.load(EXAMPLES / f"{name}.toml"))
    checked(signals)
    for interval in (0, len(signals.coefficients) // 2, len(signals.coefficients) - 1):
        for channel, entry in enumerate(signals.specified):
            coefficients = signals.coefficients.copy()
            coefficients[interval, channel, 0] += 1e-11 * entry.sizes[0]
            with pytest.raises(NotKept):
                checked(replace(signals, coefficients=coefficients))


def test_a_record_is_its_spline_however_near_its_points() -> None:
    rng = np.random.default_rng(5)
    time = np.unique(np.concatenate([np.linspace(0.0, 1.0, 60), 0.5 + np.geomspace(1e-11, 1e-3, 20), [1e-12]]))
    value = np.cumsum(rng.normal(size=time.size) * np.diff(time, prepend=0.0))
    text = f"signal = {{ time = {time.tolist()}, value = {value.tolist()} }}"
    model = swept((100.0, 101.0, 0.5), [99.0, 102.0], [1.0, 2.0]).to_toml()
    torque = f'\n[[torque]]\non = "body"\n{text}\n'
    signals = signals_of(gr.loads(model + torque, "model"))
    spline, at = CubicSpline(time, value), rng.uniform(0.0, 0.5, 400)
    off = signals.at(at)[:, 0] - spline(at)
    assert np.abs(off - off.mean()).max() < 1e-12 * np.abs(spline(at)).max()


@pytest.mark.parametrize(
    ("ramp", "speeds", "values"),
    [  # corners within 1e-13 of the run before the sweep's end; a steep table; corners behind the end of the run
        ((378.0, 343.0, 6e-8), [343.0, 343.0000005, 378.0], [1.0, -2.0, 3.0]),
        ((20.0, 220.0, 1e-7), [20.0, 219.9999999, 220.0], [1.0, -2.0, 3.0]),
        ((119.4, 133.4, 0.067), [119.4, 133.3999999, 133.4], [1.0, -2.0, 3.0]),
        ((348.0, 345.0, 0.0218), [345.0, 345.00000003, 348.0], [1.0, -2.0, 3.0]),
        ((343.0, 356.0, 0.0101), [343.0, 355.5, 355.51, 356.0], [1.0, -2.0, 3.0, 1.0]),
    ],
)
@pytest.mark.parametrize("cycles", [1, 2, 3, 4])
def test_a_steep_table_is_represented_wherever_its_corners_stand(ramp, speeds, values, cycles: int) -> None:
    extra = f"harmonics = [ {{ order = 6, amplitude = {{ speed = {speeds}, value = {values} }} }} ]"
    model = swept(ramp, speeds, values, extra).with_({"simulation.cycles": cycles})
    first, last, over = ramp
    signals = signals_of(model)
    at = np.linspace(0.0, signals.knots[-1], 1001)[1:]
    inside = np.minimum(at, over)
    speed = first + (last - first) * inside / over
    table = np.interp(speed, speeds, values)
    angle = first * inside + 0.5 * (last - first) / over * inside**2 + last * (at - inside)
    want = table - values[speeds.index(first)] + table * np.sin(6.0 * angle)
    steepest = np.abs(np.diff(values) / np.diff(speeds)).max()
    assert np.abs(signals.at(at)[:, 0] - want).max() < 1e-11 + 1e-15 * max(first, last) * steepest
