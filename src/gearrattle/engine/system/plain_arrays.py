"""The numbers of a system in plain arrays for compiled code, its laws end to end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.kernels.variant_arrays import Coefficients, Frame
from gearrattle.engine.system.auxiliary import Auxiliary
from gearrattle.engine.system.coordinates import RelativeCoordinates
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise import PiecewiseSystem, turned


@kept
def coefficients_of(system: PiecewiseSystem) -> Coefficients:
    """The numbers of one system."""
    inputs = system.inputs
    return Coefficients(
        inertia=_floats(system.inertia),
        drag=_floats(system.drag),
        mean=_floats(inputs.mean),
        torque_sine=_floats(inputs.torque_sine),
        torque_cosine=_floats(inputs.torque_cosine),
        error_sine=_floats(inputs.error_sine),
        error_cosine=_floats(inputs.error_cosine),
        period=np.array([inputs.period], dtype=float),
        laws=laws_of(system.laws),
    )


def system_of(pattern: PiecewiseSystem, numbers: Coefficients) -> PiecewiseSystem:
    """Return the system that has the structure of a pattern and other numbers: the inverse of ``coefficients_of``."""
    laws = []
    for law, first, last in zip(pattern.laws, numbers.laws.first[:-1], numbers.laws.first[1:], strict=True):
        own = slice(int(first), int(last))
        arrays = (numbers.laws.stiffness[own], numbers.laws.damping[own], numbers.laws.offset[own])
        laws.append(PiecewiseLaw(numbers.laws.lower[own][1:], *arrays, law.first_label))
    inputs = replace(
        pattern.inputs,
        period=float(numbers.period[0]),
        mean=numbers.mean,
        torque_sine=numbers.torque_sine,
        torque_cosine=numbers.torque_cosine,
        error_sine=numbers.error_sine,
        error_cosine=numbers.error_cosine,
    )
    return replace(pattern, inertia=numbers.inertia, drag=numbers.drag, laws=tuple(laws), inputs=inputs)


def part_of(numbers: Coefficients, cycles: NDArray[np.float64], begin: float, length: float) -> Coefficients:
    """Return numbers, with a leading axis or without, with the inputs of a part of a motion: see ``Harmonics.part``.

    cycles: (H,) oscillations per period.
    begin, length: of the part, in periods.
    """
    torque_sine, torque_cosine = turned(numbers.torque_sine, numbers.torque_cosine, cycles * begin)
    error_sine, error_cosine = turned(numbers.error_sine, numbers.error_cosine, cycles * begin)
    return numbers._replace(
        torque_sine=torque_sine,
        torque_cosine=torque_cosine,
        error_sine=error_sine,
        error_cosine=error_cosine,
        period=length * numbers.period,
    )


def laws_of(laws: Sequence[PiecewiseLaw | Auxiliary]) -> Laws:
    """Laws of elements or of auxiliaries, one after the other."""
    return Laws(
        first=_whole([0, *np.cumsum([law.pieces for law in laws])]),
        stiffness=_joined([law.stiffness for law in laws]),
        damping=_joined([law.damping for law in laws]),
        offset=_joined([law.offset for law in laws]),
        lower=_joined([law.lower for law in laws]),
        upper=_joined([law.upper for law in laws]),
    )


def frame_of(system: PiecewiseSystem, coordinates: RelativeCoordinates) -> Frame:
    """The structure that a system shares with its variants."""
    return Frame(
        rows=_floats(system.rows),
        label=_whole([law.first_label for law in system.laws]),
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
