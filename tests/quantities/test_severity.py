"""How hard an impact is: closed forms of momentum, energy and exchanged momentum, and the rank that follows."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.quantities.verdict_parts import worst_first
from gearrattle.signals import find_impacts

GROUNDED = """
schema = 1
name = "One body in a gap to ground"
inertia = [{{ name = "body", J = 0.2, drag_torque = {load} }}]
{torque}

[excitation]
speed = 1.0

[[coupling]]
name = "stop"
between = ["body", "ground"]
stiffness = 5e5
damping = 40.0
clearance = 0.1

[simulation]
cycles = 1
discard = 0
initial = {{ angle = [{angle}], velocity = [{velocity}] }}
"""


def test_a_free_impact_on_ground_exchanges_its_closed_form() -> None:
    """m (1 + e) |v|, e = exp(-zeta psi / sqrt(1 - zeta^2)) over the half-swing psi = pi of the contact; no other force.

    The contact ends where the deflection returns to the corner, after half a damped period.
    """
    model = gr.loads(GROUNDED.format(load=0.0, torque="", angle=0.0, velocity=2.0))
    run = gr.simulate(model)
    first = find_impacts(run.trajectory)
    zeta = 40.0 / (2.0 * math.sqrt(5e5 * 0.2))
    restitution = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))
    assert first.velocity[0] == pytest.approx(2.0, rel=1e-12)
    assert first.exchanged[0] == pytest.approx(0.2 * 2.0 * (1.0 + restitution), rel=1e-10)
    assert first.exchanged[0] == pytest.approx(first.impulse[0], rel=1e-10)  # no static load
    (part,) = gr.criteria(run).parts
    assert part.max_impact_momentum == pytest.approx(0.4, rel=1e-12)
    assert part.max_impact_energy == pytest.approx(0.4, rel=1e-12)
    assert part.max_exchanged_momentum == pytest.approx(0.4 * (1.0 + restitution), rel=1e-10)


def test_under_a_constant_load_it_is_the_contact_impulse_less_the_load_times_the_contact() -> None:
    """F_0 is the load: ten bounces of a body that a constant torque presses on its stop."""
    text = GROUNDED.format(load=0.0, torque='torque = [{ on = "body", mean = 60.0 }]', angle=0.0, velocity=2.0)
    actual = find_impacts(gr.simulate(gr.loads(text)).trajectory)
    whole = ~actual.censored
    assert whole.sum() >= 10
    above = actual.impulse - 60.0 * actual.duration
    assert actual.exchanged[whole] == pytest.approx(above[whole], rel=1e-8)
    assert (actual.impulse[whole] > 1.2 * actual.exchanged[whole]).any()


PAIR = """
schema = 1
name = "A gear pair under a torque that alternates"
inertia = [{ name = "driver", J = 0.03 }, { name = "loose", J = 0.004, drag_torque = 1.5 }]
torque = [{ on = "driver", mean = 3.0, harmonics = [{ order = 2, amplitude = 40.0, phase = 0.3 }] }]

[excitation]
speed = 120.0

[[mesh]]
name = "gear"
between = ["driver", "loose"]
radii = [0.06, 0.03]
stiffness = 2e8
damping = 1500.0
backlash = 1e-4
transmission_error = [{ order = 7, amplitude = 4e-6 }]

[simulation]
cycles = 12
discard = 2
"""


def test_in_a_driven_mesh_it_is_the_force_above_the_quasi_static_load() -> None:
    """The integral of F - m_eff (w M^-1 Q - e'') over every contact, Q and e integrated in closed form."""
    run = gr.simulate(gr.loads(PAIR))
    actual = find_impacts(run.trajectory)
    mass = 1.0 / (0.06**2 / 0.03 + 0.03**2 / 0.004)
    assert actual.mass == pytest.approx(mass, rel=1e-14)

    def loaded(t: np.ndarray) -> np.ndarray:
        """m_eff (w M^-1 Q - e''), integrated from 0 to t."""
        rate, error = 2.0 * 120.0, 7.0 * 120.0
        torque = 3.0 * t - 40.0 / rate * np.cos(rate * t + 0.3)
        # the loose gear turns the other way: its drag presses delta open, + r_b T / J_b
        return mass * (0.06 / 0.03 * torque + 0.03 / 0.004 * 1.5 * t - 4e-6 * error * np.cos(error * t))

    whole = ~actual.censored
    above = actual.impulse - (loaded(actual.time + actual.duration) - loaded(actual.time))
    assert whole.sum() > 20
    scale = np.abs(actual.exchanged).max()
    assert np.abs(actual.exchanged - above)[whole].max() < 1e-8 * scale
    assert np.abs(actual.exchanged - actual.impulse)[whole].max() > 0.05 * scale


TWO_GEARS = """
schema = 1
name = "A gear held by its drag beside a gear that hammers"
inertia = [
  { name = "shaft", J = 1.0 },
  { name = "held", J = 5e-3, drag_torque = 8.8 },
  { name = "loose", J = 5e-3, drag_torque = 4.0 },
]
torque = [{ on = "shaft", mean = 12.8, harmonics = [{ order = 2, amplitude = 1800.0 }] }]

[[mesh]]
name = "held_mesh"
between = ["shaft", "held"]
radii = [0.05, 0.05]
stiffness = 1e8
damping = 2e3
backlash = 1e-4

[[mesh]]
name = "loose_mesh"
between = ["shaft", "loose"]
radii = [0.05, 0.05]
stiffness = 1e8
damping = 2e3
backlash = 1e-4

[excitation]
speed = 100.0

[simulation]
cycles = 40
discard = 20
"""


def test_a_gear_that_hammers_ranks_before_one_that_is_carried() -> None:
    """8.8 N m of drag carry a gear that touches down at 0.006 m/s: its contact impulse is the larger one."""
    verdict = gr.criteria(gr.simulate(gr.loads(TWO_GEARS)))
    hammering, carried = verdict.parts
    assert (hammering.name, carried.name) == ("loose_mesh", "held_mesh")
    assert carried.max_approach_speed < 0.01
    assert hammering.max_approach_speed > 0.05
    assert carried.max_contact_impulse > 2.0 * hammering.max_contact_impulse
    for quantity in ("max_impact_energy", "mean_impact_energy", "max_impact_momentum", "max_exchanged_momentum"):
        assert getattr(hammering, quantity) > 10.0 * getattr(carried, quantity)
    same_regime = [part for part in verdict.parts if part.regime == hammering.regime]
    assert list(worst_first(same_regime[::-1])) == sorted(same_regime, key=lambda part: -part.max_impact_energy)


def test_a_body_of_prescribed_motion_counts_as_immovable() -> None:
    """1/m_eff is the loose gear's share alone."""
    model = gr.load("examples/measured_flywheel.toml")
    run = gr.simulate(model, cycles=4, discard=1)
    layout = run.trajectory.layout
    (moved,) = layout.prescribed
    at_it = [k for k, ends in enumerate(layout.between.tolist()) if moved in ends]
    assert at_it
    from gearrattle.signals import reduced_inertia

    for element in at_it:
        other = next(body for body in layout.between[element].tolist() if body != moved)
        assert reduced_inertia(layout, element) == pytest.approx(float(layout.inertia[other]), rel=1e-15)
