"""A driveline without excitation: its bodies and elements alone."""

from __future__ import annotations

import numpy as np

from gearrattle.assembly.drag_torques import viscous_drags
from gearrattle.assembly.elements import law_of, rows_of, system_inertia
from gearrattle.assembly.period import period_of
from gearrattle.assembly.prescribed_motion import columns_of, free_of
from gearrattle.assembly.sideways import beside_directions
from gearrattle.derived_values import kept
from gearrattle.engine.system.piecewise import Harmonics, PiecewiseSystem
from gearrattle.model import Model


@kept
def unloaded(model: Model) -> PiecewiseSystem:
    """The driveline without torques, drag torques, errors and friction; bodies with prescribed motion are held."""
    free = free_of(model)
    columns = columns_of(model)
    rows = rows_of(model)[:, columns]
    m, n = rows.shape
    none = np.zeros((n, 0)), np.zeros((n, 0)), np.zeros((m, 0)), np.zeros((m, 0))
    return PiecewiseSystem(
        inertia=system_inertia(model, free),
        drag=beside_directions(model, np.array(viscous_drags(model)))[columns],
        rows=rows,
        laws=tuple(law_of(element) for element in model.elements),
        inputs=Harmonics(period_of(model).period, np.zeros(0), np.zeros(n), *none),
    )
