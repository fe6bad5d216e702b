"""The piecewise system as the arrays of ``kernels.equation_of_motion``, for algorithms that step through corners."""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels.equation_of_motion import Field
from gearrattle.engine.system.coordinates import RelativeCoordinates
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.plain_arrays import laws_of


def field_of(system: PiecewiseSystem, coordinates: RelativeCoordinates) -> Field:
    """Pack the system; nothing is scaled or linearised."""
    inputs = system.inputs
    return Field(
        inertia=system.inertia,
        drag=system.drag,
        rows=system.rows,
        basis=coordinates.basis,
        combination=coordinates.combination,
        references=np.array(coordinates.references, dtype=np.int64),
        mean=inputs.mean,
        torque_sine=inputs.torque_sine,
        torque_cosine=inputs.torque_cosine,
        error_sine=inputs.error_sine,
        error_cosine=inputs.error_cosine,
        cycles=inputs.cycles,
        laws=laws_of(system.laws),
        period=inputs.period,
    )
