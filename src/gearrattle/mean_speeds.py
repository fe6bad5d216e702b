"""Ratios of the mean speed of every body to that of a reference body, from radii and arms.

The mean deflection rate of an element is zero. So an element between two bodies determines the mean speed of one body
from that of the other, step by step from the reference body; where elements form a loop, the path with the fewest
elements counts. The remaining speeds follow from elements of three bodies and gears on the ground, by one system of
linear equations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SETTLED = 1e-9


class Kinematics(NamedTuple):
    """The data that determine mean speeds, for m elements on n bodies.

    Attributes
    ----------
    rows
        (m, n) deflections from angles [m or 1].
    between
        (m, 2) indices of the two bodies of every element; -1 is ground.
    radii
        (m, 2) base radii [m]; 1, 1 for an element whose deflection is an angle.
    is_mesh
        (m,) whether the element is a gear mesh.
    has_stiffness
        (m,) whether the element has stiffness in any piece; pure dampers determine only the speeds that no other
        element determines.
    """

    rows: Array
    between: NDArray[np.int64]
    radii: Array
    is_mesh: NDArray[np.bool_]
    has_stiffness: NDArray[np.bool_]


def mean_speed_ratios(kinematics: Kinematics, reference: int) -> Array:
    """Return (n,) ratio of every body's mean speed to that of a reference body; NaN where no element determines it.

    A body of a planetary set that a coupling ties to ground is at rest.
    """
    count = kinematics.rows.shape[1]
    ratios = np.full(count, np.nan)
    ratios[reference] = 1.0
    arms = np.count_nonzero(kinematics.rows, axis=1)
    pairs = np.all(kinematics.between >= 0, axis=1) & (arms == 2)
    sets = kinematics.rows[kinematics.is_mesh & ~pairs]
    held = np.any(kinematics.rows[arms == 1] != 0.0, axis=0)
    ratios[held & np.any(sets != 0.0, axis=0) & np.isnan(ratios)] = 0.0
    for tying in (pairs & kinematics.has_stiffness, pairs):
        settled = 0
        while settled < np.count_nonzero(~np.isnan(ratios)):
            settled = int(np.count_nonzero(~np.isnan(ratios)))
            _along_pairs(kinematics, tying, ratios)
            _within_sets(sets, ratios)
    return ratios


def _along_pairs(kinematics: Kinematics, pairs: NDArray[np.bool_], ratios: Array) -> None:
    """Determine ratios from bodies with known ratios, through elements of two bodies."""
    between = kinematics.between
    radii = kinematics.radii
    reached = np.flatnonzero(~np.isnan(ratios)).tolist()
    for body in reached:
        for element in np.flatnonzero(pairs & (between == body).any(axis=1)).tolist():
            ends = between[element].tolist()
            here = ends.index(body)
            other = ends[1 - here]
            if np.isnan(ratios[other]):
                ratios[other] = ratios[body] * radii[element, here] / radii[element, 1 - here]
                reached.append(other)


def _within_sets(rows: Array, ratios: Array) -> None:
    """Solve rows @ ratios = 0 for the unknown ratios that have a unique solution."""
    unknown = np.flatnonzero(np.isnan(ratios) & np.any(rows != 0.0, axis=0))
    if not unknown.size:
        return
    known = np.flatnonzero(~np.isnan(ratios))
    matrix = rows[:, unknown]
    right = -rows[:, known] @ ratios[known]
    _, values, directions = np.linalg.svd(matrix)
    free = directions[np.count_nonzero(values > _SETTLED * values.max()) :]
    settled = np.all(np.abs(free) < _SETTLED, axis=0)
    ratios[unknown[settled]] = np.linalg.lstsq(matrix, right, rcond=None)[0][settled]
