"""A system's numbers as the compiled code has them: laws end to end, everything in plain arrays.

Takes a ``PiecewiseSystem``; gives ``kernels.variants.Coefficients`` and ``Frame``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.variants import Coefficients, Frame
from gearrattle.engine.system.coordinates import RelativeCoordinates
from gearrattle.engine.system.piecewise import PiecewiseSystem


def coefficients_of(system: PiecewiseSystem) -> Coefficients:
    """The numbers of one system."""
    inputs, laws = system.inputs, system.laws
    return Coefficients(
        inertia=_floats(system.inertia),
        drag=_floats(system.drag),
        stiffness=_joined([law.stiffness for law in laws]),
        damping=_joined([law.damping for law in laws]),
        offset=_joined([law.offset for law in laws]),
        corners=_joined([law.corners for law in laws]),
        mean=_floats(inputs.mean),
        torque_sine=_floats(inputs.torque_sine),
        torque_cosine=_floats(inputs.torque_cosine),
        error_sine=_floats(inputs.error_sine),
        error_cosine=_floats(inputs.error_cosine),
        period=np.array([inputs.period], dtype=float),
    )


def frame_of(system: PiecewiseSystem, coordinates: RelativeCoordinates) -> Frame:
    """What a system shares with its variants of the same structure."""
    laws = system.laws
    return Frame(
        rows=_floats(system.rows),
        first=_whole([0, *np.cumsum([law.pieces for law in laws])]),
        label=_whole([law.first_label for law in laws]),
        clearances=_whole(system.clearances),
        cycles=_floats(system.inputs.cycles),
        basis=_floats(coordinates.basis),
        combination=_floats(coordinates.combination),
        elements=_whole(coordinates.elements),
        references=_whole(coordinates.references),
    )


def _whole(numbers: Sequence[Any]) -> NDArray[np.int64]:
    return np.array(numbers, dtype=np.int64)


def _floats(array: Any) -> NDArray[np.float64]:
    return np.ascontiguousarray(array, dtype=float)


def _joined(arrays: Sequence[Any]) -> NDArray[np.float64]:
    return np.concatenate([np.zeros(0), *arrays])
