"""The recording of a run, made without a file; names are those of its CSV and of ``gr.read`` of its file."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.model import Model
from gearrattle.recording import Channel, Recording
from gearrattle.results import Run
from gearrattle.trajectory import Array, Layout

_OF_INERTIAS = {"angle": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}


def recorded(run: Run) -> Recording:
    """Return every motion, deflection, force and torque of a run at the samples of its output grid."""
    t = run.trajectory
    channels = _channels(t.layout, run.model.units, lambda quantity, index: getattr(t, quantity)[:, index])
    return Recording(t.time, channels, f"{run.model.name}, {t.cost.algorithm}", tuple(t.notes))


def to_be_recorded(model: Model) -> Recording:
    """Return the channels that a run of a model will have, at rest."""
    time = np.arange(2.0)
    channels = _channels(assemble(model).layout, model.units, lambda _quantity, _index: np.zeros(2))
    return Recording(time, channels, f"{model.name}, to be simulated")


def _channels(layout: Layout, units: str, values: Callable[[str, int], Array]) -> tuple[Channel, ...]:
    """Return the channels of a run."""
    channels = []
    plain = units == "dimensionless"
    for quantity, unit in _OF_INERTIAS.items():
        for i, name in enumerate(layout.inertia_names):
            channels.append(Channel(f"{quantity}.{name}", quantity, name, "1" if plain else unit, values(quantity, i)))
    for quantity, by_kind in (("deflection", ("rad", "m")), ("force", ("N*m", "N"))):
        for k, name in enumerate(layout.clearance_names):
            unit = "1" if plain else by_kind[int(layout.is_mesh[layout.clearance[k]])]
            channels.append(Channel(f"{quantity}.{name}", quantity, name, unit, values(quantity, k)))
    for k, name in enumerate(layout.element_names):
        unit = "1" if plain else "N*m"
        channels.append(Channel(f"element_torque.{name}", "torque", name, unit, values("element_torque", k)))
    return tuple(channels)
