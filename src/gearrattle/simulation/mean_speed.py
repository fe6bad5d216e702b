"""Drift of the mean speed of freely turning bodies over the judged part of a run.

Their velocities are fluctuations about that speed, and their mean is zero if the motion repeats. A mean that is not
zero shifts torque orders against the motion; above a thousandth of the fluctuation it gets a note.
"""

from __future__ import annotations

import numpy as np

from gearrattle.assembly import free_names
from gearrattle.engine.system.free_trains import trains
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.rigid_motion import is_accelerated
from gearrattle.model import Model
from gearrattle.trajectory import Trajectory
from gearrattle.wording import measured

NEGLIGIBLE = 1e-3
"""Part of a body's fluctuation of speed up to which its mean is not mentioned."""
_ROUNDING = 1e-9  # of the speed of the file
_NOTHING = 1e-300  # below every fluctuation that is one


def mean_speed_notes(model: Model, system: PiecewiseSystem, trajectory: Trajectory) -> tuple[str, ...]:
    """Note the freely turning body whose mean speed is farthest off, by how much and why; none where all keep it."""
    settings = model.simulation
    assert settings.discard is not None and settings.samples_per_cycle is not None  # noqa: PT018 - settled
    bodies = np.concatenate([np.zeros(0, np.int64), *(train.bodies for train in trains(system))])
    if system.signals is not None or bodies.size == 0:
        return ()
    # the mean is exact from the angles, the fluctuation is that of the samples
    first = settings.discard * settings.samples_per_cycle
    angle = trajectory.angle[first:, bodies]
    velocity = trajectory.velocity[first:, bodies]
    mean = (angle[-1] - angle[0]) / (trajectory.time[-1] - trajectory.time[first])
    fluctuation = np.maximum(velocity.max(axis=0) - mean, mean - velocity.min(axis=0))
    is_off = (np.abs(mean) > NEGLIGIBLE * fluctuation) & (np.abs(mean) > _ROUNDING * model.excitation.omega)
    if not is_off.any():
        return ()
    share = np.abs(mean) / np.maximum(fluctuation, _NOTHING)
    worst = int(np.argmax(np.where(is_off, share, 0.0)))
    name = free_names(model)[bodies[worst]]
    value = measured(abs(float(mean[worst])), "rad/s" if model.units == "SI" else "", 3)
    side = "above" if mean[worst] > 0.0 else "below"
    size = f"{share[worst]:.2g} of its fluctuation" if fluctuation[worst] > 0.0 else "it does not fluctuate"
    why = _reason(model, system, int(bodies[worst]))
    return (f"over the judged part the mean speed of {name} lies {value} {side} that of the file ({size}): {why}.",)


def _reason(model: Model, system: PiecewiseSystem, body: int) -> str:
    """Say why the mean speed of a body is off."""
    start = model.simulation.initial
    if start in ("steady", "static") and is_accelerated(system)[body]:
        return "its mean torques do not balance"
    if start != "steady":
        return 'the run did not begin with initial = "steady"'
    return "its motion has not settled, or does not repeat"
