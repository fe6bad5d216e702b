"""A driveline without excitation: its bodies and elements alone."""

from __future__ import annotations

import numpy as np

from gearrattle.assembly.drag_torques import viscous_drags
from gearrattle.assembly.elements import inertia_of, law_of, rows_of
from gearrattle.assembly.period import period_of
from gearrattle.assembly.prescribed_motion import free_of
from gearrattle.derived_values import kept
from gearrattle.engine.system.piecewise import Harmonics, PiecewiseSystem
from gearrattle.model import Model


@kept
def unloaded(model: Model) -> PiecewiseSystem:
    """The driveline without torques, drag torques, errors and friction; bodies with prescribed motion are held."""
    free = free_of(model)
    rows = rows_of(model)
    none = np.zeros((len(free), 0)), np.zeros((len(free), 0)), np.zeros((len(rows), 0)), np.zeros((len(rows), 0))
    return PiecewiseSystem(
        inertia=inertia_of(model)[free],
        drag=np.array(viscous_drags(model))[free],
        rows=rows[:, free],
        laws=tuple(law_of(element) for element in model.elements),
        inputs=Harmonics(period_of(model).period, np.zeros(0), np.zeros(len(free)), *none),
    )
