"""Relative coordinates: deflections that span the row space of W, with the rigid-body angles carried separately.

In a free train the absolute angles grow without bound while the deflections keep their size; integrating the angles
loses four to five digits. So the state is (x, v), where x = X q is a set of independent deflections, those of elements
with corners first, and v = q'. Then

    w_k . q = b_k . x,   B X = W,       x' = X v,       q = Qx x + Qr r,

where r are the angles of one reference inertia for each train whose rigid motion is free. No deflection is ever
computed from r.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]

_INDEPENDENT = 1e-9  # share of a row's length outside the span of other rows above which it is independent


@dataclass(frozen=True)
class RelativeCoordinates:
    """The chosen basis."""

    basis: Array  # (r, n) X, a selection of the rows of W
    elements: tuple[int, ...]  # (r,) the element of every row of X
    combination: Array  # (m, r) B: deflections of all elements from x
    references: tuple[int, ...]  # indices of the inertias whose absolute angle is carried separately
    # angle_from_basis, angle_from_reference: (n, r) Qx and (n, len(references)) Qr
    angle_from_basis: Array
    angle_from_reference: Array


def _independent_rows(candidates: Array, order: list[int]) -> list[int]:
    """Greedy choice of linearly independent rows in the order of preference (Gram-Schmidt, done twice)."""
    chosen: list[int] = []
    orthonormal = np.empty((min(candidates.shape), candidates.shape[1]))
    for index in order:
        if len(chosen) == len(orthonormal):
            break
        span = orthonormal[: len(chosen)]
        row = candidates[index] / np.linalg.norm(candidates[index])
        for _ in range(2):
            row = row - (span @ row) @ span
        length = float(np.linalg.norm(row))
        if length > _INDEPENDENT:
            orthonormal[len(chosen)] = row / length
            chosen.append(index)
    return chosen


def relative_coordinates(system: PiecewiseSystem, among: Sequence[int] | None = None) -> RelativeCoordinates:
    """Choose the basis: elements with corners first, then linear ones, each in element order.

    Variants of a driveline with the same W and the same elements with corners have the same coordinates.

    among: the elements to choose from; all by default. B then has one row for each of them.
    """
    candidates = tuple(range(len(system.laws)) if among is None else among)
    rows = np.ascontiguousarray(system.rows, dtype=float)
    return _coordinates(rows.tobytes(), rows.shape, candidates, system.clearances)


@lru_cache(16)
def _coordinates(
    data: bytes, shape: tuple[int, int], candidates: tuple[int, ...], clearances: tuple[int, ...]
) -> RelativeCoordinates:
    """The basis for W (m, n), given by its bytes."""
    rows = np.frombuffer(data).reshape(shape)[list(candidates)]
    size = shape[1]
    corners = set(clearances)
    chosen = _independent_rows(rows, sorted(range(len(rows)), key=lambda i: (candidates[i] not in corners, i)))
    basis = rows[chosen]
    unit = np.eye(size)
    stacked = np.vstack([basis, unit[::-1]])  # the reference of a free train is its last inertia
    independent = _independent_rows(stacked, list(range(len(stacked))))
    references = tuple(sorted(size - 1 - (i - len(chosen)) for i in independent[len(chosen) :]))
    inverse = np.linalg.inv(np.vstack([basis, unit[list(references)]]))
    inverse[np.abs(inverse) < 1e-15 * np.abs(inverse).max()] = 0.0
    to_basis = inverse[:, : len(chosen)]
    to_reference = inverse[:, len(chosen) :]
    combination = rows @ to_basis
    combination[chosen] = np.eye(len(chosen))
    combination[np.abs(combination) < 1e-14 * np.abs(combination).max(initial=0.0)] = 0.0
    elements = tuple(candidates[i] for i in chosen)
    return RelativeCoordinates(basis, elements, combination, references, to_basis, to_reference)
