"""The same for drivelines that the compiled loop does not follow; their turning points against those of the loop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import gearrattle as gr
from gearrattle.engine.periodic.compiled_course import reaches
from gearrattle.engine.periodic.families import CompiledFamily, GeneralFamily
from gearrattle.engine.periodic.motion import Dips, Touch, Turns
from gearrattle.orbits import value_family
from tests.engine.periodic.test_grazing import DRAG, MEAN, with_slider
from tests.engine.periodic.test_slope import PATHS, start, train
from tests.orbits.test_hidden_touches import BELOW, grazings_of, highest, model_of, rigidity

pytestmark = pytest.mark.compiled

ABOVE = 1e-7  # by which the response exceeds the stop: within a tenth of a thousandth of the range
BODIES, STOPS = 24, 5
LINK = 0.02  # stiffness between the bodies of the chain
FREQUENCY = "excitation.frequency"
PHASE = "torque.0.harmonics.1.phase"


class Hidden(NamedTuple):
    """Two touches within a small part of a step: amplitudes of the harmonics, and where the motion grazes."""

    amplitudes: tuple[float, ...]
    grazings: list[float]
    span: tuple[float, float]


def over_frequency() -> Hidden:
    """The response has its largest value a little above the stop."""
    least = minimize_scalar(lambda w: abs(rigidity(w)), bounds=(0.8, 1.2), method="bounded", options={"xatol": 1e-12})
    amplitude = (1.0 - MEAN) * (1.0 + ABOVE) * float(least.fun)
    spans = (0.9, least.x), (least.x, 1.1)
    ends = [brentq(lambda w: amplitude / abs(rigidity(w)) - (1.0 - MEAN), *span, xtol=1e-14) for span in spans]
    return Hidden((amplitude,), ends, (0.7, 1.3))


def over_phase() -> Hidden:
    """The largest deflection has its least value a little below the stop."""
    shape = (0.3, 0.06)
    least = minimize_scalar(lambda p: highest(p, shape), bounds=(0.0, 6.0), method="bounded", options={"xatol": 1e-9})
    factor = (1.0 - MEAN) * (1.0 - BELOW) / (float(least.fun) - MEAN)
    amplitudes = factor * shape[0], factor * shape[1]
    spans = (least.x - 0.3, least.x), (least.x, least.x + 0.3)
    ends = [brentq(lambda p: highest(p, amplitudes) - 1.0, *span, xtol=1e-12) for span in spans]
    return Hidden(amplitudes, ends, (float(least.x) - 0.6, float(least.x) + 0.7))


def harmonics(hidden: Hidden) -> list[dict[str, float]]:
    return [{"order": n, "amplitude": amplitude} for n, amplitude in enumerate(hidden.amplitudes, 1)]


@pytest.fixture
def general(monkeypatch: pytest.MonkeyPatch) -> None:
    """No driveline is followed by the compiled loop."""
    monkeypatch.setattr(value_family, "is_compiled", lambda _: False)


@pytest.mark.long
@pytest.mark.usefixtures("general")
@pytest.mark.parametrize("limit", [0.01, 0.05, 0.5, None])
def test_a_touch_that_comes_and_goes_within_a_step_is_two_grazings(limit: float | None) -> None:
    hidden = over_frequency()
    grazings = grazings_of(model_of(harmonics(hidden)), FREQUENCY, hidden.span, limit)
    np.testing.assert_allclose(grazings, hidden.grazings, rtol=0, atol=1e-8)


@pytest.mark.long
@pytest.mark.usefixtures("general")
@pytest.mark.parametrize("limit", [0.01, None])
def test_a_touch_that_goes_and_comes_back_within_a_step_is_two_grazings(limit: float | None) -> None:
    hidden = over_phase()
    grazings = grazings_of(model_of(harmonics(hidden)), PHASE, hidden.span, limit)
    np.testing.assert_allclose(grazings, hidden.grazings, rtol=0, atol=1e-7)


@pytest.mark.long
@pytest.mark.parametrize("limit", [0.05, None])
def test_with_a_slider_behind_the_stop_that_does_not_slip_they_are_the_same(limit: float | None) -> None:
    """Up to the stop the motion is linear, and a touch so light does not carry the slider to its torque."""
    hidden = over_frequency()
    model = gr.Model.from_tables({**with_slider().to_tables(), "torque": [torque(hidden)]})
    assert isinstance(value_family.family_of(model, FREQUENCY, 0.8, 1, 1.0), GeneralFamily)
    grazings = grazings_of(model, FREQUENCY, hidden.span, limit)
    np.testing.assert_allclose(grazings, hidden.grazings, rtol=0, atol=1e-8)


def torque(hidden: Hidden) -> dict[str, object]:
    return {"on": "body", "mean": MEAN, "harmonics": harmonics(hidden)}


def chain(amplitude: float) -> gr.Model:
    """Oscillators in a row, each with its spring and weakly coupled to the next, the first few of them with stops."""
    names = [f"b{i}" for i in range(BODIES)]
    springs = [{"name": f"s{i}", "between": [name, "ground"], "stiffness": 1.0} for i, name in enumerate(names)]
    links = [{"name": f"l{i}", "between": names[i : i + 2], "stiffness": LINK} for i in range(BODIES - 1)]
    stops = [
        {"name": f"stop{i}", "between": [names[i], "ground"], "stiffness": 5.0, "clearance": 1.0 if i == 0 else 3.0}
        for i in range(STOPS)
    ]
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": name, "J": 1.0, "drag": DRAG} for name in names],
            "coupling": [*springs, *links, *stops],
            "excitation": {"frequency": 0.8},
            "simulation": {"initial": "zero"},
            "torque": [{"on": "b0", "mean": MEAN, "harmonics": [{"order": 1, "amplitude": amplitude}]}],
        }
    )


def response(w: float) -> float:
    """Amplitude of the first body of the linear chain for a unit of the torque."""
    links = np.diff(np.eye(BODIES), axis=0)
    rigid = np.eye(BODIES) * rigidity(w) + LINK * links.T @ links
    return float(abs(np.linalg.solve(rigid, np.eye(BODIES)[0])[0]))


@pytest.mark.long
def test_in_a_chain_of_many_bodies_and_stops_they_are_found_too() -> None:
    """Its motions are followed without tables; up to the stops it is linear."""
    most = minimize_scalar(lambda w: -response(w), bounds=(0.9, 1.2), method="bounded", options={"xatol": 1e-12})
    links = np.diff(np.eye(BODIES), axis=0)
    mean = float(np.linalg.solve(np.eye(BODIES) + LINK * links.T @ links, MEAN * np.eye(BODIES)[0])[0])
    amplitude = (1.0 - mean) * (1.0 + ABOVE) / -float(most.fun)
    spans = (0.95, most.x), (most.x, 1.1)
    ends = [brentq(lambda w: amplitude * response(w) - (1.0 - mean), *span, xtol=1e-14) for span in spans]
    model = chain(amplitude)
    assert isinstance(value_family.family_of(model, FREQUENCY, 0.9, 1, 1.0), GeneralFamily)
    branch = gr.continuation(model, FREQUENCY, (0.9, 1.15))
    assert branch.notes == ()
    np.testing.assert_allclose(branch.events["value"], ends, rtol=0, atol=1e-8)


CASES = {"case1": (190.0, 255.0), "backlash_oscillator": (1.2, 1.3)}
"""Speeds of examples, and units of the speed."""


@pytest.mark.parametrize("name", [*CASES, *PATHS])
def test_turning_points_are_those_of_the_compiled_loop(name: str) -> None:
    """Of periodic motions of examples over the speed, and of some motion of a train over its values."""
    path = "excitation.speed" if name in CASES else name
    value, unit = CASES[name] if name in CASES else (PATHS[name], PATHS[name])
    model = (gr.example(name) if name in CASES else train(4, gaps=2)).with_({path: value})
    compiled = value_family.family_of(model, path, value, 1, unit)
    assert isinstance(compiled, CompiledFamily)
    state = gr.periodic(model).motion.start if name in CASES else start(4)
    row = np.append(np.zeros(len(state.y)), 1.0 / unit)
    want, actual = (one.follow(state, value, None, row)[0].turns for one in (compiled, compiled._general))
    assert want is not None
    assert actual is not None
    corner = 4.0 * reaches(compiled.map_at(value).system).min()
    assert want.watch.size + want.dips.watch.size > 0
    for one, other in ((want, actual), (want.dips, actual.dips)):
        assert_alike(one, other, corner)
    assert want.delay.size > 0
    np.testing.assert_allclose(actual.delay, want.delay, rtol=1e-5, atol=1e-8 * np.abs(want.delay).max())


def assert_alike(want: Turns | Dips, actual: Turns | Dips, corner: float) -> None:
    """The same turning points or dips; depths to 1e-9 of the corner, slopes to 1e-5."""
    one, other = in_order(want), in_order(actual)
    for name in ("watch", "upward"):
        np.testing.assert_array_equal(other[name], one[name])
    np.testing.assert_allclose(other["time"], one["time"], rtol=0, atol=1e-8)
    for name in ("depth", "level"):
        if name in one:
            np.testing.assert_allclose(other[name], one[name], rtol=0, atol=1e-9 * corner)
    for name in ("slope", "time_slope", "level_slope"):
        if name in one:
            size = np.abs(one[name]).max(initial=0.0)
            np.testing.assert_allclose(other[name], one[name], rtol=1e-5, atol=1e-8 * size)


def in_order(turns: Turns | Dips) -> dict[str, np.ndarray]:
    """The arrays of turning points or dips, in an order that rounding does not change."""
    order = np.lexsort((turns.depth, turns.upward, turns.watch, np.round(turns.time, 7)))
    return {name: part[order] for name, part in turns._asdict().items() if name not in ("dips", "delay")}


@pytest.mark.parametrize("path", PATHS)
def test_the_slopes_of_a_depth_by_the_whole_state_are_those_of_the_compiled_loop(path: str) -> None:
    value, state = PATHS[path], start(2)
    compiled = value_family.family_of(train(2), path, value, 1, value)
    assert isinstance(compiled, CompiledFamily)
    turns = compiled.follow(state, value, None, np.append(np.zeros(len(state.y)), 1.0))[0].turns
    assert turns is not None
    k = int(np.argmin(turns.depth))
    touch = Touch(int(turns.watch[k]), int(turns.upward[k]), float(turns.time[k]))
    (motion, by_value), (other, other_by_value) = (
        one.follow(state, value, touch) for one in (compiled, compiled._general)
    )
    want, actual = motion.approach, other.approach
    np.testing.assert_allclose(other_by_value, by_value, rtol=0, atol=1e-8 * np.abs(by_value).max())
    assert want is not None
    assert actual is not None
    assert actual.depth == pytest.approx(want.depth, rel=1e-9)
    assert actual.acceleration == pytest.approx(want.acceleration, rel=1e-9)
    for name in ("slope", "time_slope"):
        slope = getattr(want, name)
        np.testing.assert_allclose(getattr(actual, name), slope, rtol=1e-5, atol=1e-7 * np.abs(slope).max())
