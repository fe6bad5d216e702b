"""The steady linear response: against the exact solution of linear drivelines, and as a certificate."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.advice.steady_linear_check import excursions
from gearrattle.analysis.linear.response import steady_deflections, steady_extremes
from gearrattle.analysis.statics import named_equilibrium
from gearrattle.assembly import assemble
from tests.comparison.cases import case

LINEAR = """
schema = 1
[[inertia]]
name = "a"
J = 0.3
drag = 0.4
[[inertia]]
name = "b"
J = 0.02
drag = 0.01
[[inertia]]
name = "c"
J = 0.005
[[coupling]]
name = "shaft"
between = ["a", "b"]
stiffness = 900.0
damping = 0.9
[[mesh]]
name = "gears"
between = ["b", "c"]
radii = [0.06, 0.03]
stiffness = 4e5
damping = 300.0
transmission_error = [ { order = 3, amplitude = 1e-5, phase = 0.4 } ]
[excitation]
speed = 100.0
[[torque]]
on = "a"
harmonics = [ { order = 1, amplitude = 20.0, phase = 0.3 }, { order = ORDER, amplitude = 9.0 } ]
"""


def test_deflections_are_those_the_exact_solution_settles_to() -> None:
    model = gr.loads(LINEAR.replace("ORDER", "2.5"))
    system = assemble(model).system
    amplitudes = steady_deflections(system, *(np.array([law_of[0] for law_of in pieces]) for pieces in _laws(system)))
    run = gr.simulate(model, cycles=400, samples_per_cycle=64).trajectory
    last = run.time[-129:]
    settled = run.angle[-129:] @ system.rows.T
    omega = 2 * np.pi * system.inputs.cycles[system.inputs.cycles > 0] / system.inputs.period
    reported = np.real(np.exp(1j * np.outer(last, omega)) @ amplitudes.T)
    reported[:, 1] += 1e-5 * np.sin(3 * 100.0 * last + 0.4)
    rigid = settled - reported
    np.testing.assert_allclose(rigid - rigid.mean(axis=0), 0.0, atol=2e-9 * np.abs(reported).max())


def _laws(system):
    return [law.stiffness for law in system.laws], [law.damping for law in system.laws]


@pytest.mark.parametrize(("order", "most"), [("2", 1.003), ("2.7182818", 1.25)])
def test_extremes_bound_the_motion_and_hardly_more(order: str, most: float) -> None:
    system = assemble(gr.loads(LINEAR.replace("ORDER", order))).system
    amplitudes = steady_deflections(system, *(np.array([piece[0] for piece in pieces]) for pieces in _laws(system)))
    low, high = steady_extremes(system, amplitudes)
    orders = system.inputs.cycles[system.inputs.cycles > 0]
    turns = np.linspace(0.0, 40.0, 400_001)
    motion = np.real(np.exp(2j * np.pi * np.outer(turns, orders)) @ amplitudes.T)
    assert np.all(low <= motion.min(axis=0))
    assert np.all(high >= motion.max(axis=0))
    assert np.all(high <= most * motion.max(axis=0))
    assert np.all(low >= most * motion.min(axis=0))


def test_without_excitation_nothing_moves() -> None:
    model = gr.loads(LINEAR.replace("ORDER", "2").replace("20.0", "0.0").replace("9.0", "0.0").replace("1e-5", "0.0"))
    system = assemble(model).system
    amplitudes = steady_deflections(system, *(np.array([piece[0] for piece in pieces]) for pieces in _laws(system)))
    assert np.abs(np.concatenate(steady_extremes(system, amplitudes))).max() == 0.0


def test_a_response_inside_its_pieces_is_the_exact_motion() -> None:
    model = case("case3_loaded").with_({"torque.0.mean": 101.25, "inertia.output_gear.drag_torque": 97.2})
    actual, run = _excursions(model), gr.simulate(model, cycles=60, discard=50).trajectory
    assert actual.inside
    assert np.all(actual.used < 1.0)
    settled = run.deflection[-8 * run.samples_per_cycle :]
    assert len(run.events) == 0
    span = actual.high - actual.low
    np.testing.assert_array_less(np.abs(settled.max(axis=0) - actual.high), 5e-3 * span)
    np.testing.assert_array_less(np.abs(settled.min(axis=0) - actual.low), 5e-3 * span)


def test_a_response_that_reaches_a_corner_is_none() -> None:
    actual = _excursions(case("case3"))
    assert not actual.inside
    assert np.all(actual.used > 1.0)


def _excursions(model: gr.Model):
    driveline = assemble(model)
    return excursions(driveline.system, named_equilibrium(driveline)[1])
