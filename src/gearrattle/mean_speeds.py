"""Mean speeds of the bodies of a driveline over that of one of them, from radii and arms.

Nothing deflects on the mean: an element between two bodies settles the speed of one by that of the other, element by
element from the reference body; where elements close a loop the shortest way counts. Elements of three bodies, and
gears on the ground, settle what is left, all of them together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SETTLED = 1e-9


class Kinematics(NamedTuple):
    """What settles mean speeds, of m elements on n bodies.

    Attributes
    ----------
    rows
        (m, n) deflections from angles [m or 1].
    between
        (m, 2) indices of the bodies an element lies between; -1 is ground.
    radii
        (m, 2) base radii [m]; 1, 1 of an element that is an angle.
    is_mesh
        (m,) whether it is a gear mesh.
    has_stiffness
        (m,) whether it has a slope anywhere; pure dampers settle only what nothing else does.
    """

    rows: Array
    between: NDArray[np.int64]
    radii: Array
    is_mesh: NDArray[np.bool_]
    has_stiffness: NDArray[np.bool_]


def mean_speed_ratios(kinematics: Kinematics, reference: int) -> Array:
    """Return (n,) every body's mean speed over that of a reference body; NaN where nothing settles it.

    A body of a set that a coupling ties to ground is at rest.
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
    """Go from known bodies through elements of two bodies."""
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
    """Solve rows @ ratios = 0 for the bodies that it settles."""
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
