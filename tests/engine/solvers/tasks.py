"""Tasks the solver laws run on."""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels.variant_arrays import Crossings
from gearrattle.engine.solvers import SOLVERS, Marching, Motion, Task
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.outcome import Outcome
from tests.engine.system.drivelines import clearance, inputs, linear


def run(task: Task, name: str = "exact") -> Motion:
    """Return a solver's motion."""
    march = SOLVERS[name](task)
    while (outcome := march.advance()) is not Outcome.DONE:
        assert outcome is Outcome.SLICE_SPENT
    return march.motion()


def oscillator(
    law=None, *, drag: float = 0.0, force: float = 0.0, turns: float = 1.0, mean: float = 0.0
) -> PiecewiseSystem:
    """Return one inertia on an element to ground, driven by force sin(2 pi turns t), period 1."""
    arguments = {"cycles": np.array([turns]), "torque_sine": np.array([[force]])} if force else {}
    return PiecewiseSystem(
        np.ones(1),
        np.array([drag]),
        np.ones((1, 1)),
        (law or linear(4.0),),
        inputs(1, 1, mean=np.array([mean]), **arguments),
    )


def task(
    system: PiecewiseSystem,
    angle: list[float],
    velocity: list[float],
    *,
    cycles: int = 5,
    samples: int = 16,
    step: float | None = None,
    tolerance: float | None = None,
) -> Task:
    """Return a task from an initial state."""
    return Task(system, np.array(angle, float), np.array(velocity, float), cycles, samples, tolerance, step)


GAP = clearance(4.0, 0.0, 0.5)


def finished(march: Marching) -> Motion:
    """Return the motion of a run taken to its end."""
    while (outcome := march.advance()) is not Outcome.DONE:
        assert outcome is Outcome.SLICE_SPENT
    return march.motion()


def same_bits(one: Motion, other: Motion) -> None:
    """Assert that two motions are the same number for number."""
    for name in ("angle", "velocity", "acceleration", "deflection", "force", "piece", "final_force_integral"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for name in Crossings._fields:
        assert np.array_equal(getattr(one.crossings, name), getattr(other.crossings, name)), name
