"""A model without what is no harmonic of one speed: what linear tools and forecasts look at.

A sweep is taken at its first speed, a record as its mean. ``unsteady`` says so in words.

Takes a Model; gives a Model, and words.
"""

from __future__ import annotations

from typing import Any

from gearrattle.assembly.signals import mean_torque
from gearrattle.model import Model
from gearrattle.remember import remembered


def unsteady(model: Model) -> tuple[str, ...]:
    """What ``steady`` takes out, one phrase each; empty for a model under harmonics of one speed."""
    told = [f"the torque record on {torque.on} counts as its mean" for torque in model.torques if torque.signal]
    if model.excitation.sweep is not None:
        told.append("the sweep counts as its first speed")
    return tuple(told)


@remembered(8)
def steady(model: Model) -> Model:
    """The model at one speed under harmonics and means; itself if it is that already."""
    changes: dict[str, Any] = {}
    if model.excitation.sweep is not None:
        changes["excitation.speed"] = model.excitation.omega
    for index, torque in enumerate(model.torques):
        if torque.signal is not None:
            changes |= {f"torque.{index}.signal": None, f"torque.{index}.mean": mean_torque(torque)}
    return model.with_(changes) if changes else model
