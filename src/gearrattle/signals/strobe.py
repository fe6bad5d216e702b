"""Points of a motion seen once a period (a stroboscopic Poincare section): its period number, and which motion it is.

A driven motion seen at t = t_0 + k T is a sequence of points x_k. It repeats after n periods iff x_{k+n} = x_k, and a
settled motion is then described by n points, its *orbit*; the same motion begun some periods later is the same orbit,
its points rotated (F. C. Moon, Chaotic Vibrations, Wiley 1987, ch. 2). Computed points are never exactly equal, so:

* n is the smallest number for which, over the last half of the points, every x_{k+n} is within ``tolerance`` of x_k. A
  motion that still creeps, is quasi-periodic, chaotic or longer than the points can show has none;
* the distance of two orbits is the largest of their points' distances, in the best of the n ways to turn one of them.
  Orbits nearer than ``same`` to the first of their group are one group. The distance of groups is given (``room``):
  a threshold is reliable only if no distances lie near it.

Points are given in units of their own (half a clearance, say); distances are the largest of their components.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import lcm

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_LONGEST_TURN = 64  # orbits of different length are compared up to this common one


def period_number(points: Array, tolerance: float, most: int) -> int:
    """Return the smallest n <= most after which the last half of the points repeats; 0 if there is none.

    Parameters
    ----------
    points
        (K, q) once a period, scaled.
    most
        largest n looked for; n needs 2 n points in the last half.
    """
    half = points[len(points) // 2 :]
    if not np.all(np.isfinite(half)):
        return 0
    for n in range(1, min(most, len(half) // 2) + 1):
        if np.abs(half[n:] - half[:-n]).max() <= tolerance:
            return n
    return 0


def orbit_distances(orbits: Array, one: Array) -> Array:
    """Return (M,) distances of orbits (M, n, q) from one (n, q), each in the best of the n ways to turn it."""
    distances = np.full(len(orbits), np.inf)
    for turn in range(len(one)):
        distances = np.minimum(distances, np.abs(orbits - np.roll(one, turn, axis=0)).max(axis=(1, 2)))
    return distances


def apart(one: Array, other: Array) -> float:
    """Return the distance of two orbits (n, q) and (m, q), compared over their common period."""
    length = lcm(len(one), len(other))
    if length > _LONGEST_TURN:
        return float("inf")
    first, second = (np.tile(orbit, (length // len(orbit), 1)) for orbit in (one, other))
    return float(orbit_distances(first[None], second)[0])


@dataclass(frozen=True)
class Groups:
    """Orbits in groups.

    Attributes
    ----------
    label
        (M,) group of every orbit, the largest group first; -1 where there was none.
    first
        of every group, the index of the orbit that stands for it.
    within
        the largest distance of an orbit from the one that stands for its group.
    """

    label: IntArray
    first: tuple[int, ...]
    within: float


def grouped(orbits: Sequence[Array | None], same: float) -> Groups:
    """Group equal orbits, (n, q) each, scaled; None where a motion has none."""
    label = np.full(len(orbits), -1, dtype=np.int64)
    first: list[int] = []
    within = 0.0
    for n in sorted({len(orbit) for orbit in orbits if orbit is not None}):
        left = np.array([i for i, orbit in enumerate(orbits) if orbit is not None and len(orbit) == n])
        stack = np.array([orbits[i] for i in left])
        while left.size:
            distance = orbit_distances(stack, stack[0])
            near = distance <= same
            label[left[near]] = len(first)
            within = max(within, float(distance[near].max()))
            first.append(int(left[0]))
            left = left[~near]
            stack = stack[~near]
    order = np.argsort([-np.count_nonzero(label == g) for g in range(len(first))], kind="stable")
    rank = np.empty(len(first) + 1, dtype=np.int64)
    rank[order] = np.arange(len(first))
    rank[-1] = -1
    return Groups(rank[label], tuple(first[g] for g in order), within)


def room(standing: Sequence[Array], family: Sequence[int]) -> float:
    """Return the smallest distance of two orbits of different families; inf if there is one family alone.

    Parameters
    ----------
    standing
        (n, q) orbits, one for each group.
    family
        (G,) of every group.
    """
    pairs = (apart(a, b) for i, a in enumerate(standing) for j, b in enumerate(standing[:i]) if family[i] != family[j])
    return min(pairs, default=float("inf"))
