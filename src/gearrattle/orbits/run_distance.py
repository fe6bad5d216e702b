"""Deflections of motions along a branch at the instants of a run: how far the run is from them.

Both are compared part by part of a period, at the same phases of the inputs. A motion that repeats after n periods may
be shifted by a whole number of them. The mean over a part does not count: motions of a family differ in it.

Between the motions that are known deflections are linear in the value. Where that decides something, motions in between
are added (``refine``), so that it does not depend on how many points the branch has.

Takes motions of a Branch and deflections of a run; gives distances.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.point import Point
from gearrattle.orbits.branch_members import Followed
from gearrattle.orbits.curve import Curve
from gearrattle.orbits.orbit import sampled
from gearrattle.orbits.stability import halfway

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_FINE = 2e-4  # of the swing: the mean of two motions is as near to the one between
_NO_WIDTH = 1e-9  # of a value: no motion is added between two that are nearer


class Grid(NamedTuple):
    """Instants of a period: its parts, and how many instants every part has."""

    parts: int
    instants: int


class Course:
    """Motions along a branch over values that only grow; beyond its ends those of the ends.

    Parameters
    ----------
    branch
        that has them.
    curve
        the one of its branches that they are of; n is its periods T.
    value
        (N,) growing [SI].
    points
        N motions.
    grid
        instants at which deflections are compared.
    """

    def __init__(self, branch: Followed, curve: Curve, value: Array, points: Sequence[Point], grid: Grid) -> None:
        self.value = value
        self._branch, self._curve, self._points, self._grid = branch, curve, list(points), grid
        self._known = list[Array | None]([None] * len(self._points))
        self._is_fine = [bool(width <= _NO_WIDTH * abs(value[-1])) for width in np.diff(value)]

    def reaches(self, value: Array) -> NDArray[np.bool_]:
        """Whether there are motions at values."""
        return np.asarray((self.value[0] <= value) & (value <= self.value[-1]))

    def off(self, deflection: Array, value: Array, part: IntArray, scale: Array) -> Array:
        """Return the (B,) squared distances of parts of a run.

        Parameters
        ----------
        deflection
            (B, M, K) of the run at M instants of every part [rad or m].
        value
            (B,) in every part [SI].
        part
            (B,) which part of a period each is.
        scale
            (K,) by which deflections of the clearances are measured [rad or m].
        """
        difference = (deflection[:, None] - self.at(value, part)) / scale
        difference -= difference.mean(axis=2, keepdims=True)
        squares: Array = np.mean(difference**2, axis=2).sum(axis=-1).min(axis=1)
        return squares

    def at(self, value: Array, part: IntArray) -> Array:
        """Return (B, n, M, K) deflections at B values in parts of each of the n periods."""
        k = np.clip(np.searchsorted(self.value, value) - 1, 0, max(len(self.value) - 2, 0))
        then = np.minimum(k + 1, len(self.value) - 1)
        width = self.value[then] - self.value[k]
        share = np.clip((value - self.value[k]) / np.where(width > 0.0, width, 1.0), 0.0, 1.0)
        needed = np.unique(np.concatenate([k[share < 1.0], then[share > 0.0]]))
        motions = np.stack([self._motion(int(i)) for i in needed])
        last = len(needed) - 1  # a motion that is not needed has no share: another one may stand for it
        before, after = (motions[np.minimum(np.searchsorted(needed, i), last), :, part] for i in (k, then))
        weight = share[:, None, None, None]
        return np.asarray((1.0 - weight) * before + weight * after)

    def refine(self, value: Array) -> bool:
        """Add motions around values, where the mean of two is not near to the one between; return whether it did."""
        around = np.unique(np.searchsorted(self.value, value) - 1)
        coarse = [k for k in around.tolist() if 0 <= k < len(self._is_fine) and not self._is_fine[k]]
        for k in coarse[::-1]:
            self._is_fine[k] = True
            between = halfway(self._branch.follower(self._curve), *sorted(self._points[k : k + 2], key=_length))
            if between is None or not self.value[k] < between.parameter < self.value[k + 1]:
                continue
            self.value = np.insert(self.value, k + 1, between.parameter)
            self._points.insert(k + 1, between)
            self._known.insert(k + 1, None)
            before, own, after = (self._motion(i) for i in (k, k + 1, k + 2))
            share = (self.value[k + 1] - self.value[k]) / (self.value[k + 2] - self.value[k])
            off = np.abs(before + share * (after - before) - own).max()
            self._is_fine[k : k + 1] = [bool(off <= _FINE * np.ptp(own, axis=(0, 1, 2)).max())] * 2
        return bool(coarse)

    def _motion(self, i: int) -> Array:
        """(n, P, M, K) deflections of a motion in the parts of its periods."""
        known = self._known[i]
        if known is None:
            orbit = self._branch.orbit_at(self._points[i], self._curve.cycles)
            deflection = sampled(orbit, self._grid.parts * self._grid.instants).trajectory.deflection[:-1]
            known = deflection.reshape(self._curve.cycles, *self._grid, deflection.shape[-1])
            self._known[i] = known
        return known


def _length(point: Point) -> float:
    return point.length
