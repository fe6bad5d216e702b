"""Where a spline through few points leaves them, and what is said of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import gearrattle as gr
from gearrattle.assembly import record_notes
from gearrattle.assembly.records import swings
from gearrattle.model import Signal

CASE_1 = np.array([0.0, 1.0, 1.05, 3.0]), np.array([0.0, 0.0, 50.0, 50.0])
TOML = """
schema = 1
{units}
inertia = [ {{ name = "drive", J = 1.0 }}, {{ name = "body", J = 1.0 }} ]
coupling = [ {{ name = "shaft", between = ["drive", "body"], stiffness = 100.0 }} ]
[excitation]
frequency = 1.0
{driven}
[simulation]
initial = "zero"
cycles = 2
discard = 0
samples_per_cycle = 8
"""
POINTS = "time = [0.0, 1.0, 1.05, 3.0], value = [0.0, 0.0, 50.0, 50.0]"


def model(driven: str, units: str = "") -> gr.Model:
    return gr.loads(TOML.format(driven=driven, units=units))


def dense(time: np.ndarray, value: np.ndarray) -> tuple[float, float]:
    """Return by how much the spline leaves its neighbours above and below, from many points of every interval."""
    spline, above, below = CubicSpline(time, value), 0.0, 0.0
    for i in range(len(time) - 1):
        values = spline(np.linspace(time[i], time[i + 1], 4001))
        above = max(above, float(values.max() - max(value[i : i + 2])))
        below = max(below, float(min(value[i : i + 2]) - values.min()))
    return above, below


def test_four_points_of_a_step() -> None:
    low, high = sorted(swings(Signal(*CASE_1)), key=lambda swing: swing.value)
    assert (round(low.value), round(low.neighbour, 9)) == (-308, 0.0)
    assert (round(high.value), round(high.neighbour, 9)) == (1045, 50.0)
    assert CubicSpline(*CASE_1)(low.time) == pytest.approx(low.value, rel=1e-13)


def test_six_points_of_a_pulse() -> None:
    time, value = np.array([0.0, 1.0, 1.001, 1.05, 1.051, 3.0]), np.array([0.0, 0.0, 50.0, 50.0, 0.0, 0.0])
    lowest = min(swings(Signal(time, value)), key=lambda swing: swing.value)
    assert lowest.value == pytest.approx(-599e3, abs=500.0)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("scale", [1.0, -3.0])
def test_swings_are_those_of_a_dense_grid(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    time = np.sort(rng.uniform(0.0, 1.0, int(rng.integers(4, 30))))
    value = np.cumsum(rng.normal(size=time.size))
    above, below = dense(time, scale * value)
    expected = [size for size in (above, below) if size > 0.05 * np.ptp(scale * value)]
    actual = [abs(swing.value - swing.neighbour) for swing in swings(Signal(time, value, scale=scale))]
    np.testing.assert_allclose(actual, expected, rtol=1e-5)


def test_a_dense_record_has_none() -> None:
    time = np.linspace(0.0, 3.0, 301)
    assert swings(Signal(time, np.sin(2.0 * np.pi * 7.0 * time))) == ()
    assert swings(Signal(time, np.full(301, 5.0))) == ()


@pytest.mark.parametrize("interpolation", ["linear", "step"])
def test_lines_and_steps_never_do(interpolation: str) -> None:
    text = f'[[torque]]\non = "body"\nsignal = {{ {POINTS}, interpolation = "{interpolation}" }}'
    assert record_notes(model(text)) == ()


@pytest.mark.parametrize(
    ("driven", "units", "words"),
    [
        (
            f'[[torque]]\non = "body"\nsignal = {{ {POINTS} }}',
            "",
            ("torque on body", "1045 N m at 2.226 s", "50 N m and -307.6 N m at 0.4517 s", '"linear" and "step"'),
        ),
        (
            f'[[motion]]\non = "drive"\nspeed = {{ {POINTS} }}',
            "",
            ("speed of drive", "1045 rad/s at", '"linear" stays'),
        ),
        (
            f'[[motion]]\non = "drive"\nangle = {{ {POINTS} }}',
            "",
            ("angle of drive", "1045 rad at", "a speed in its place"),
        ),
        (
            f'[[torque]]\non = "body"\nsignal = {{ {POINTS} }}',
            'units = "dimensionless"',
            ("reaches 1045 at 2.226, beside a point of 50 and -307.6 at 0.4517,",),
        ),
    ],
)
def test_a_note_says_how_far_and_where(driven: str, units: str, words: tuple[str, ...]) -> None:
    (note,) = record_notes(model(driven, units))
    assert all(word in note for word in words), note
    assert note in gr.simulate(model(driven, units).with_({"excitation.frequency": 7.0}), cycles=1).trajectory.notes


def test_the_pressure_of_an_engine() -> None:
    """A trace that jumps from compression to combustion at a dead centre, point by point every 60 degrees."""
    angle = np.arange(0.0, 720.0, 60.0)
    pressure = np.where(angle == 360.0, 60.0, np.where(angle == 420.0, 55.0, 1.0))
    trace = f"angle = {[f'{a:g} deg' for a in angle.tolist()]}, value = {[f'{p:g} bar' for p in pressure.tolist()]}"
    engine = '[[torque]]\non = "drive"\n[torque.engine]\ncylinders = 1\nbore = 0.08\nstroke = 0.08\nrod = 0.14\n'
    (note,) = record_notes(model(f"{engine}pressure = {{ {trace} }}"))
    assert "pressure of the engine on drive" in note
    assert " Pa at " in note
    assert " rad, beside" in note
    lines = model(f'{engine}pressure = {{ {trace}, interpolation = "linear" }}')
    assert record_notes(lines) == ()
    made, crank = lines.torques[0].engine, np.radians([330.0, 390.0, 400.0, 719.0])
    assert made is not None
    expected = np.interp(np.degrees(crank), [*angle, 720.0], [*pressure, pressure[0]]) * 1e5 - made.crankcase
    first = made.piston(crank)[0]
    np.testing.assert_allclose(made.gas_torque(crank), expected * np.pi / 4.0 * 0.08**2 * first, rtol=1e-12)
