"""Static equilibrium under the mean loads, transmission errors at zero.

The elastic forces derive from a convex potential (slopes are never negative), so the equilibrium minimises

    U(x) = sum_k u_k(b_k . x) - g . x,      g = Qx^T (T_mean - J a),

over the deflections x, where a is the uniform acceleration of a train whose means do not balance. Newton directions of
the present pieces, the flat direction where they have no stiffness against a load, and an exact search along each line
through all corners: finitely many pieces, so it ends. A direction along which U falls for ever is a runaway: some
element's last slope is zero and its load exceeds what it can carry. Free gaps without load are put at their middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ConvergenceError
from gearrattle.remember import remembered
from gearrattle.system.coordinates import RelativeCoordinates, relative_coordinates
from gearrattle.system.law import PiecewiseLaw
from gearrattle.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]

NEGLIGIBLE = 1e-12  # a load this small against the sum of all means, on the same shaft, counts as zero
_NO_STIFFNESS = 1e-13  # of the stiffest piece of every element
_MOST_SEARCHES = 2000
_ROUNDING = 64 * np.finfo(float).eps


class Runaway(Exception):
    """No equilibrium: the elements named carry a load that their last stage cannot hold."""

    def __init__(self, elements: tuple[int, ...]) -> None:
        self.elements = elements
        super().__init__(f"elements {elements} run away")


@dataclass(frozen=True)
class Equilibrium:
    """Where the system rests.

    Attributes:
        angle: (n,) [rad]; the last inertia of every free train at zero.
        deflection: (m,) w . angle.
        pieces: (m,) piece of every element's law.
        acceleration: (n,) uniform acceleration of trains whose means do not balance [rad/s^2].
        middled: elements whose free gap carries no load.
    """

    angle: Array
    deflection: Array
    pieces: tuple[int, ...]
    acceleration: Array
    middled: tuple[int, ...]


def rigid_acceleration(system: PiecewiseSystem, coordinates: RelativeCoordinates) -> Array:
    """(n,) acceleration of the trains that the mean torques do not balance; zero where they do."""
    motion = coordinates.angle_from_reference
    if motion.shape[1] == 0:
        return np.zeros(system.size)
    net = motion.T @ system.inputs.mean
    net = np.where(np.abs(net) <= NEGLIGIBLE * (np.abs(motion).T @ np.abs(system.inputs.mean)), 0.0, net)
    return np.asarray(motion @ np.linalg.solve(motion.T @ (system.inertia[:, None] * motion), net))


@remembered(8)
def equilibrium(system: PiecewiseSystem) -> Equilibrium:
    """Find the static equilibrium.

    Raises:
        Runaway: an element of zero last slope cannot carry its load.
    """
    elastic = [k for k, law in enumerate(system.laws) if np.any(law.stiffness > 0) or np.any(law.offset != 0)]
    coordinates = relative_coordinates(system, elastic)
    acceleration = rigid_acceleration(system, coordinates)
    laws = [system.laws[k] for k in elastic]
    net = system.inputs.mean - system.inertia * acceleration
    size = np.abs(coordinates.angle_from_basis).T @ np.abs(system.inputs.mean)
    x = _minimise(laws, coordinates, coordinates.angle_from_basis.T @ net, NEGLIGIBLE * size, elastic)
    x, loose = _middle(laws, coordinates, x)
    angle = coordinates.angle_from_basis @ x
    deflection = system.rows @ angle
    deflection[elastic] = coordinates.combination @ x
    pieces = tuple(law.piece_at(float(d)) for law, d in zip(system.laws, deflection, strict=True))
    return Equilibrium(angle, deflection, pieces, acceleration, tuple(elastic[i] for i in loose))


def _scale(laws: list[PiecewiseLaw], coordinates: RelativeCoordinates, elastic: list[int]) -> Array:
    """(r,) length scale of every basis deflection: one over the root of its stiffest slope."""
    at = [elastic.index(k) for k in coordinates.elements]
    return np.array([1.0 / np.sqrt(max(float(laws[i].stiffness.max()), 1e-300)) for i in at])


def _minimise(
    laws: list[PiecewiseLaw], coordinates: RelativeCoordinates, load: Array, negligible: Array, elastic: list[int]
) -> Array:
    """Minimiser x of U; ``load`` is g, entries of the residual below ``negligible`` count as zero."""
    combination = coordinates.combination
    x = np.zeros(combination.shape[1])
    if x.size == 0:
        return x
    scale = _scale(laws, coordinates, elastic)
    travel = np.zeros(len(laws))
    for _ in range(_MOST_SEARCHES):
        delta = combination @ x
        pieces = [_piece(law, float(d), float(t)) for law, d, t in zip(laws, delta, travel, strict=True)]
        slope = np.array([law.stiffness[p] for law, p in zip(laws, pieces, strict=True)])
        offset = np.array([law.offset[p] for law, p in zip(laws, pieces, strict=True)])
        residual = load - combination.T @ (slope * delta + offset)
        rounding = _ROUNDING * (np.abs(combination).T @ (np.abs(slope * delta) + np.abs(offset)))
        nothing = np.maximum(negligible, rounding)
        stiffness = (combination * scale).T @ (slope[:, None] * combination * scale)
        direction = scale * _direction(stiffness, residual * scale, nothing * scale)
        if np.all(np.abs(residual) <= nothing):
            polished = combination @ (x + direction)
            stays = all(law.piece_at(float(d)) == p for law, d, p in zip(laws, polished, pieces, strict=True))
            return x + direction if stays else x
        travel = combination @ direction
        x = x + _line_search(laws, delta, travel, float(load @ direction), elastic) * direction
    raise ConvergenceError("the static equilibrium was not found", remedy='initial = "zero", or a state of your own')


def _direction(stiffness: Array, residual: Array, negligible: Array) -> Array:
    """Flat direction if the residual loads one, else the Newton direction (minimum norm)."""
    values, vectors = np.linalg.eigh(stiffness)
    parts = vectors.T @ residual
    flat = values <= _NO_STIFFNESS
    loaded = vectors[:, flat] @ parts[flat]
    if np.any(np.abs(loaded) > negligible):
        return np.asarray(loaded)
    firm = ~flat
    return np.asarray(vectors[:, firm] @ (parts[firm] / values[firm]))


def _piece(law: PiecewiseLaw, delta: float, travel: float) -> int:
    """Piece at a deflection; exactly on a corner, the piece the motion heads for."""
    piece = law.piece_at(delta)
    on_corner = piece > 0 and delta == law.corners[piece - 1]
    return (
        piece - 1 if on_corner and (travel < 0 or (travel == 0 and law.inner(piece - 1, piece) == piece - 1)) else piece
    )


def _line_search(laws: list[PiecewiseLaw], delta: Array, travel: Array, power: float, elastic: list[int]) -> float:
    """Step s > 0 along the line at which U stops falling: U' is piecewise linear and never falls."""
    stops: list[float] = []
    for law, d, v in zip(laws, delta, travel, strict=True):
        if v != 0.0:
            stops += [float(s) for s in (law.corners - d) / v if s > 0.0]
    begin = 0.0
    for end in [*sorted(set(stops)), np.inf]:
        inside = begin + 0.5 * (end - begin) if np.isfinite(end) else begin + 1.0 + abs(begin)
        slope, force = 0.0, 0.0
        for law, d, v in zip(laws, delta, travel, strict=True):
            piece = law.piece_at(float(d + inside * v))
            slope += float(law.stiffness[piece]) * v * v
            force += (float(law.stiffness[piece]) * d + float(law.offset[piece])) * v
        if slope > 0.0:
            zero = (power - force) / slope
            if zero <= end:
                return max(begin, zero)
        elif power - force <= 1e-14 * abs(power):
            return begin if begin > 0.0 else float(min(end, 1.0))
        begin = end
    raise Runaway(tuple(k for k, v in zip(elastic, travel, strict=True) if v != 0.0))


def _middle(laws: list[PiecewiseLaw], coordinates: RelativeCoordinates, x: Array) -> tuple[Array, list[int]]:
    """Move unloaded free gaps to their middle, along the directions that meet no stiffness."""
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
