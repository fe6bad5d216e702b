"""Mesh stiffness that alternates: against matrix exponentials over every instant, in a model and along a sweep."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.system.auxiliary import alternation
from gearrattle.engine.system.clock import Clock
from gearrattle.engine.system.law import Stage, staged
from gearrattle.engine.system.piecewise import PiecewiseSystem
from tests.engine.solvers.tasks import finished, run, task
from tests.engine.system.drivelines import inputs

TOML = """
schema = 1
[[inertia]]
name = "pinion"
J = 2e-3
[[inertia]]
name = "wheel"
J = 3e-3
drag = 0.01
[[mesh]]
name = "gear"
between = ["pinion", "wheel"]
radii = [0.05, 0.05]
stiffness = 1e6
damping = 60.0
backlash = 1e-4
alternation = { order = 5, share = 0.4, fewer = 0.6, phase = "30 deg" }
[excitation]
speed = 60.0
[[torque]]
on = "pinion"
mean = 20.0
harmonics = [ { order = 1, amplitude = 8.0 } ]
[[torque]]
on = "wheel"
mean = -20.0
[simulation]
cycles = 4
discard = 1
samples_per_cycle = 16
"""


def one_inertia(part: float, times: list[float]) -> PiecewiseSystem:
    """Return an inertia under a constant torque whose spring to ground lacks a part now and then; period 1."""
    law = staged([Stage(400.0, 2.0, None)], [Stage(400.0, 2.0, None)])
    return PiecewiseSystem(
        np.ones(1),
        np.array([0.05]),
        np.ones((1, 1)),
        (law,),
        inputs(1, 1, mean=np.array([3.0])),
        (alternation(0, law, part, begins_lacking=False),),
        clock=Clock(np.array(times), np.zeros(len(times), dtype=np.int64), repeats=True),
    )


@pytest.mark.parametrize("part", [0.3, 1.0])
def test_matrix_exponentials_over_every_instant(part: float) -> None:
    times = [0.13, 0.41, 0.63, 1.0]
    motion = run(task(one_inertia(part, times), [0.1], [0.2], cycles=3, samples=7))
    y = np.array([0.1, 0.2, 1.0])
    now = 0.0
    lacks = 0.0
    for instant in [*np.add.outer(np.arange(3), times).ravel()]:
        matrix = np.array([[0.0, 1.0, 0.0], [-400.0 * (1.0 - part * lacks), -2.05, 3.0], [0.0, 0.0, 0.0]])
        y = expm(matrix * (instant - now)) @ y
        now = instant
        lacks = 1.0 - lacks
    assert motion.angle[-1, 0] == pytest.approx(y[0], rel=1e-12)
    assert motion.velocity[-1, 0] == pytest.approx(y[1], rel=1e-12)
    assert motion.energy is not None
    assert motion.energy.relative_residual <= 1e-12
    assert motion.auxiliaries is not None
    assert len(motion.auxiliaries.passages.time) in {11, 12}  # the last instant is the end


def test_chunks_go_on_with_the_clock() -> None:
    system = one_inertia(0.3, [0.2, 0.9])
    whole = run(task(system, [0.1], [0.0], cycles=5))
    march = ExactMarch(task(system, [0.1], [0.0], cycles=2))
    finished(march)
    march.extend(3)
    assert np.array_equal(finished(march).angle, whole.angle[2 * 16 :])


def rattling_pair(run_: gr.Run, turns: object, until: float) -> tuple[np.ndarray, int]:
    """Return the last deflection and its rate of the pair, restarted at every instant and corner; crossings."""
    system, t = assemble(run_.model).system, run_.trajectory
    law = system.laws[0]
    row = system.rows[0]
    j = system.inertia
    values = run_.model.meshes[0].alternation
    assert values is not None
    instants = sorted({until, *(x for n in range(400) for x in (turns(n), turns(n + values.share)) if 0.0 < x < until)})
    signals, inputs_ = system.signals, system.inputs
    y = np.concatenate([[row @ t.angle[0]], t.velocity[0]])
    now = 0.0
    crossings = 0
    for end in instants:
        while True:
            middle = 0.5 * (now + end)
            cycle = next(n for n in range(-1, 400) if turns(n + 1) > middle)
            full = middle < turns(cycle + values.share)
            k = law.stiffness[-1] * (1.0 if full else values.fewer)
            ahead = y[0] + 1e-9 * (row @ y[1:])
            side = 0.0 if abs(ahead) < law.corners[-1] else float(np.sign(ahead))

            def rate(time: float, y: np.ndarray, side: float = side, k: float = k) -> np.ndarray:
                force = k * (y[0] - side * law.corners[-1]) + law.damping[-1] * (row @ y[1:]) if side else 0.0
                torque = inputs_.mean + sum(
                    s * np.sin(2 * np.pi * p * time / inputs_.period)
                    for p, s in zip(inputs_.cycles, inputs_.torque_sine.T, strict=True)
                )
                if signals is not None:
                    torque = torque + signals.torque @ signals.at(np.array([time]))[0]
                return np.concatenate([[row @ y[1:]], (torque - system.drag * y[1:] - row * force) / j])

            def gap(_: float, y: np.ndarray, side: float = side) -> float:
                return law.corners[-1] - abs(y[0]) if side == 0.0 else side * y[0] - law.corners[-1]

            gap.terminal, gap.direction = True, -1.0  # type: ignore[attr-defined]
            actual = solve_ivp(rate, (now, end), y, method="DOP853", rtol=1e-12, atol=1e-15, events=gap, max_step=2e-4)
            y, now = actual.y[:, -1], float(actual.t[-1])
            if actual.status == 0:
                break
            crossings += 1
    return y, crossings


def test_a_model_whose_mesh_alternates() -> None:
    run_ = gr.simulate(gr.loads(TOML), cycles=1, discard=0)
    period = run_.trajectory.layout.period
    y, crossings = rattling_pair(run_, lambda n: (n - 30.0 / 360.0) * period / 5.0, period)
    assert len(run_.trajectory.events) == crossings
    np.testing.assert_allclose(run_.trajectory.velocity[-1], y[1:], rtol=0, atol=1e-8 * np.abs(y[1:]).max())
    names = list(run_.data.auxiliary.values)
    assert names == ["gear.pairs"]
    words = run_.data.slider.attrs["flag_meanings"].split(", ")
    share = np.mean(run_.data.slider.values == words.index("all pairs"))
    assert share == pytest.approx(0.4, abs=0.1)
    assert run_.cost.energy_residual is not None
    assert run_.cost.energy_residual <= 1e-12


def test_along_a_sweep_the_clock_follows_the_angle() -> None:
    swept = TOML.replace("speed = 60.0", "sweep = { from = 60.0, to = 90.0, over = 0.1 }")
    run_ = gr.simulate(gr.loads(swept), cycles=1, discard=0)
    until, rate = run_.trajectory.end, 300.0

    def turns(n: float) -> float:
        angle = (n - 30.0 / 360.0) * 2.0 * np.pi / 5.0
        if angle < 0.0:
            return -1.0
        return float((-60.0 + np.sqrt(3600.0 + 2.0 * rate * angle)) / rate)

    y, crossings = rattling_pair(run_, turns, until)
    assert len(run_.trajectory.events) == crossings
    np.testing.assert_allclose(run_.trajectory.velocity[-1], y[1:], rtol=0, atol=1e-7 * np.abs(y[1:]).max())


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("share = 0.4", "share = 1.4", "below 1"),
        ("fewer = 0.6", "fewer = 1.0", "below 1"),
        ("order = 5", "order = 0", "greater than zero"),
        ("damping = 60.0", 'damping = 60.0\ncontact_damping = "clipped"', "exclude each other"),
        ("share = 0.4", "shar = 0.4", "did you mean"),
    ],
)
def test_what_is_wrong_is_refused(old: str, new: str, match: str) -> None:
    with pytest.raises(gr.ModelError, match=match):
        gr.loads(TOML.replace(old, new))


def test_linear_tools_say_what_they_leave_out() -> None:
    model = gr.loads(TOML)
    plain = model.with_({"mesh.gear.alternation": None})
    assert np.array_equal(gr.modes(model).frequencies, gr.modes(plain).frequencies)
    assert any("all pairs" in note for note in gr.stiffness(model).notes)


def test_a_written_model_is_read_as_it_was() -> None:
    model = gr.loads(TOML)
    assert gr.loads(model.to_toml()) == model
    scaled = gr.nondimensionalize(model)
    assert scaled.model.meshes[0].alternation == model.meshes[0].alternation
