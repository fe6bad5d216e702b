"""Static equilibrium under the mean loads, transmission errors at zero.

The elastic forces derive from a convex potential (slopes are never negative), so the equilibrium minimises

    U(x) = sum_k u_k(b_k . x) - g . x,      g = Qx^T (T_mean - J a),

over the deflections x, where a is the uniform acceleration of a train whose mean torques do not balance. The search
takes Newton directions for the present pieces, or a flat direction if they have no stiffness against a load, and an
exact line search through all corners. It ends, because the pieces are finitely many. A direction along which U has no
lower bound is a runaway: the last slope of some element is zero, and its load exceeds its largest force. Gaps without
load are put at their middle.
The search is compiled (``kernels.equilibrium_kernel``). For a small system, if numba is not imported yet, it runs as
plain Python with the same bits: it takes some milliseconds, importing numba half a second.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.kernels import equilibrium_kernel
from gearrattle.engine.kernels._jit import compact
from gearrattle.engine.kernels._late import plainly
from gearrattle.engine.kernels.variant_arrays import Statics
from gearrattle.engine.system.coordinates import RelativeCoordinates, relative_coordinates
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.plain_arrays import coefficients_of
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_SMALL = 12
"""Most elements with stiffness for which the search in plain Python is faster than importing numba."""


class Runaway(Exception):
    """No equilibrium: the elements named carry a load that their last stage cannot hold."""

    def __init__(self, elements: tuple[int, ...]) -> None:
        self.elements = elements
        super().__init__(f"elements {elements} run away")


@dataclass(frozen=True)
class PositionAtRest:
    """The position at rest."""

    angle: Array  # (n,) [rad]; the last inertia of every free train at zero
    deflection: Array  # (m,) w . angle
    pieces: tuple[int, ...]  # (m,) piece of every element's law
    acceleration: Array  # (n,) uniform acceleration of trains whose means do not balance [rad/s^2]
    middled: tuple[int, ...]  # elements whose free gap carries no load


@kept
def equilibrium(system: PiecewiseSystem) -> PositionAtRest:
    """Return the static equilibrium; Runaway if an element whose last slope is zero cannot carry its load."""
    # coordinates of the elements with stiffness
    elastic = elastic_elements(system)
    coordinates = relative_coordinates(system, elastic)
    numbers = coefficients_of(system)
    label = np.array([law.first_label for law in system.laws], dtype=np.int64)
    sought = statics_of(elastic, coordinates)
    # accelerations of trains that do not balance, and the minimum of U
    acceleration = np.empty(system.size)
    angle = np.empty(system.size)
    x = np.empty(len(coordinates.elements))
    travel = np.empty(len(elastic))
    with plainly() if len(elastic) <= _SMALL else nullcontext():
        compact(equilibrium_kernel.accelerate_rigidly)(numbers, sought.motion, acceleration)
        code = compact(equilibrium_kernel.rest)(numbers, label, sought, acceleration, x, travel)
    if code == equilibrium_kernel.RUNAWAY:
        raise Runaway(tuple(k for k, v in zip(elastic, travel, strict=True) if v != 0.0))
    if code == equilibrium_kernel.LOST:
        remedy = 'initial = "zero", or a state of your own'
        raise ConvergenceError("the static equilibrium was not found", remedy=remedy)
    # free gaps without load at their middle
    x, loose = _middle([system.laws[k] for k in elastic], coordinates, x)
    with plainly() if len(elastic) <= _SMALL else nullcontext():
        compact(equilibrium_kernel.angles_from_deflections)(sought, x, angle)
    # all deflections and pieces
    deflection = system.rows @ angle
    deflection[elastic] = coordinates.combination @ x
    pieces = tuple(law.piece_at(float(d)) for law, d in zip(system.laws, deflection, strict=True))
    return PositionAtRest(angle, deflection, pieces, acceleration, tuple(elastic[i] for i in loose))


def elastic_elements(system: PiecewiseSystem) -> list[int]:
    """The indices of the elements with stiffness."""
    return [k for k, law in enumerate(system.laws) if np.any(law.stiffness > 0) or np.any(law.offset != 0)]


def statics_of(elastic: list[int], coordinates: RelativeCoordinates) -> Statics:
    """The statics of a system for compiled code, with the coordinates of these elements."""
    return Statics(
        elastic=np.array(elastic, dtype=np.int64),
        at=np.array([elastic.index(k) for k in coordinates.elements], dtype=np.int64),
        combination=np.ascontiguousarray(coordinates.combination),
        angle_from_basis=np.ascontiguousarray(coordinates.angle_from_basis),
        motion=np.ascontiguousarray(coordinates.angle_from_reference),
    )


def _middle(laws: list[PiecewiseLaw], coordinates: RelativeCoordinates, x: Array) -> tuple[Array, list[int]]:
    """Move gaps without load to their middle, along directions without stiffness."""
    combination = coordinates.combination
    if x.size == 0:
        return x, []
    delta = combination @ x
    pieces = [law.piece_at(float(d)) for law, d in zip(laws, delta, strict=True)]
    slope = np.array([law.stiffness[p] for law, p in zip(laws, pieces, strict=True)])
    bounds = np.array([law.bounds(p) for law, p in zip(laws, pieces, strict=True)])
    gaps = [i for i in range(len(laws)) if slope[i] == 0.0 and np.all(np.isfinite(bounds[i]))]
    if not gaps:
        return x, []
    firm = combination[slope > 0.0]
    flat = np.eye(x.size) if firm.size == 0 else _null_space(firm)
    width = bounds[gaps, 1] - bounds[gaps, 0]
    away = (bounds[gaps].mean(axis=1) - delta[gaps]) / width
    shift = np.linalg.lstsq((combination[gaps] @ flat) / width[:, None], away, rcond=1e-10)[0]
    moved = x + flat @ shift
    loose = [i for i in gaps if np.any(np.abs(combination[i] @ flat) > 0.0)]
    return moved, loose


def _null_space(rows: Array) -> Array:
    """Columns spanning the null space of rows scaled to unit length."""
    unit = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    _, values, vectors = np.linalg.svd(unit)
    rank = int(np.sum(values > 1e-10))
    return np.asarray(vectors[rank:].T)
