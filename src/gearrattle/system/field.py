"""The piecewise system as the plain arrays of ``kernels.vector_field``, for algorithms that step through corners."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearrattle.system.coordinates import RelativeCoordinates
from gearrattle.system.piecewise import PiecewiseSystem

if TYPE_CHECKING:
    from gearrattle.kernels.vector_field import Field


def field_of(system: PiecewiseSystem, coordinates: RelativeCoordinates) -> Field:
    """Pack the system; nothing is scaled or linearised."""
    from gearrattle.kernels.vector_field import Field

    inputs, laws = system.inputs, system.laws
    return Field(
        inertia=system.inertia,
        drag=system.drag,
        rows=system.rows,
        basis=coordinates.basis,
        combination=coordinates.combination,
        references=np.array(coordinates.references, dtype=np.int64),
        first_piece=np.concatenate([[0], np.cumsum([law.pieces for law in laws])]).astype(np.int64),
        upper_corner=np.concatenate([np.append(law.corners, np.inf) for law in laws]),
        stiffness=np.concatenate([law.stiffness for law in laws]),
        damping=np.concatenate([law.damping for law in laws]),
        offset=np.concatenate([law.offset for law in laws]),
        mean=inputs.mean,
        torque_sine=inputs.torque_sine,
        torque_cosine=inputs.torque_cosine,
        error_sine=inputs.error_sine,
        error_cosine=inputs.error_cosine,
        cycles=inputs.cycles,
        period=inputs.period,
    )
