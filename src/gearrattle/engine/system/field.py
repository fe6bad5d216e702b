"""The piecewise system as the plain arrays of ``kernels.vector_field``, for algorithms that step through corners."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.coordinates import RelativeCoordinates
from gearrattle.engine.system.piecewise import PiecewiseSystem

if TYPE_CHECKING:
    from gearrattle.engine.kernels.vector_field import Field


def field_of(system: PiecewiseSystem, coordinates: RelativeCoordinates) -> Field:
    """Pack the system; nothing is scaled or linearised."""
    from gearrattle.engine.kernels.vector_field import Field

    inputs, laws = system.inputs, system.laws
    return Field(
        inertia=system.inertia,
        drag=system.drag,
        rows=system.rows,
        basis=coordinates.basis,
        combination=coordinates.combination,
        references=np.array(coordinates.references, dtype=np.int64),
        first_piece=np.concatenate([[0], np.cumsum([law.pieces for law in laws])]).astype(np.int64),
        upper_corner=_joined([np.append(law.corners, np.inf) for law in laws]),
        stiffness=_joined([law.stiffness for law in laws]),
        damping=_joined([law.damping for law in laws]),
        offset=_joined([law.offset for law in laws]),
        mean=inputs.mean,
        torque_sine=inputs.torque_sine,
        torque_cosine=inputs.torque_cosine,
        error_sine=inputs.error_sine,
        error_cosine=inputs.error_cosine,
        cycles=inputs.cycles,
        period=inputs.period,
    )


def _joined(parts: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """All behind one another; nothing for a driveline without elements."""
    return np.concatenate([np.zeros(0), *parts])
