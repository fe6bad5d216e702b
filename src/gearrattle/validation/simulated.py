"""A run as a recording, without the way through a file; names are those of its CSV and of ``gr.read`` of its file.

Takes a Run; gives a Recording.
"""

from __future__ import annotations

from gearrattle.recording import Channel, Recording
from gearrattle.results import Run

_OF_INERTIAS = {"angle": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}


def recorded(run: Run) -> Recording:
    """Return every motion, deflection, force and torque of a run at the samples of its output grid."""
    t, channels = run.trajectory, []
    plain = run.model.units == "dimensionless"
    for quantity, unit in _OF_INERTIAS.items():
        for i, name in enumerate(t.layout.inertia_names):
            values = getattr(t, quantity)[:, i]
            channels.append(Channel(f"{quantity}.{name}", quantity, name, "1" if plain else unit, values))
    for quantity, units in (("deflection", ("rad", "m")), ("force", ("N*m", "N"))):
        for k, name in enumerate(t.layout.clearance_names):
            unit = "1" if plain else units[int(t.layout.is_mesh[t.layout.clearance[k]])]
            channels.append(Channel(f"{quantity}.{name}", quantity, name, unit, getattr(t, quantity)[:, k]))
    for k, name in enumerate(t.layout.element_names):
        unit = "1" if plain else "N*m"
        channels.append(Channel(f"element_torque.{name}", "torque", name, unit, t.element_torque[:, k]))
    return Recording(t.time, tuple(channels), f"{run.model.name}, {t.cost.algorithm}", tuple(t.notes))
