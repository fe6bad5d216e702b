"""A few perturbations carried along a motion: their growth, for drivelines whose whole gradient takes too much memory.

The gradient of a large driveline has hundreds of rows, and a factor for every crossing. The largest rate of growth, and
the time at which a perturbation has grown too large, follow from a few columns:

* the largest Lyapunov exponent from ``DIRECTIONS`` perturbations, made orthonormal again after every segment
  (G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn 1980, Meccanica 15, 9-20);
* growth from any earlier time on from ``SKETCHED`` sums of random perturbations, a fresh one added after every
  ``_APART`` segments. The expected square of such a sum's norm is the sum, over all beginnings, of the squares of the
  Frobenius norms of the gradient since then (M. F. Hutchinson 1990, Commun. Stat. Simul. 19, 433-450). It is no less
  than the largest of them, and no more than their number times that: the horizon comes out early rather than late.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.perturbation_series import Driveline, Intervals, Regions, Sparse, carry
from gearrattle.engine.system.flow import Flow, Pieces

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

DIRECTIONS = 4
SKETCHED = 8
_APART = 8  # segments of a period
RESOLVED = 1e20
"""Largest growth that is followed: doubles do not resolve more."""


class Gradient(ABC):
    """Results that follow from products of a flow's gradients over consecutive segments."""

    time: Array
    """(S + 1,) ends of the segments [s], the first 0."""
    scale: Array
    """(N,) balanced = scale * SI."""

    @abstractmethod
    def carried(self, segment: int, columns: Array) -> Array:
        """Return perturbations at the end of a segment from those at its start (N, P), scaled coordinates."""

    @abstractmethod
    def growth(self, least: float) -> tuple[float, float]:
        """Return the first time [s] of a growth ``least``, inf if none; and the growth at that time, or at the end."""

    def follow(self, progress: Callable[[float], None] | None = None) -> None:
        """Compute the long part of ``growth`` and ``largest_exponent``; an exception of ``progress`` ends it."""
        if progress is not None:
            progress(0.0)

    def since(self, begin: float = 0.0) -> Array:
        """(N, N) gradient from the first end of a segment at ``begin`` [s] or later on, balanced coordinates."""
        total = np.eye(len(self.scale))
        with np.errstate(over="ignore", invalid="ignore"):
            for segment in range(self._first(begin), len(self.time) - 1):
                total = self.carried(segment, total)
        return total

    def gradient(self) -> Array:
        """(N, N) d y(end) / d y(0), y = (basis deflections, velocities) [SI]; inf where it overflows."""
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(self.since() * self.scale[None, :] / self.scale[:, None])

    def exponents(self, begin: float = 0.0) -> Array:
        """(N,) Lyapunov exponents [1/s], largest first, averaged over [begin, end] (whole segments)."""
        first = self._first(begin)
        basis = np.eye(len(self.scale))
        total = np.zeros(len(self.scale))
        for segment in range(first, len(self.time) - 1):
            basis, triangle = np.linalg.qr(self.carried(segment, basis))
            total += _logarithms(triangle)
        return np.sort(total / (self.time[-1] - self.time[first]))[::-1]

    def largest_exponent(self, begin: float = 0.0) -> float:
        """Largest Lyapunov exponent over [begin, end] [1/s]."""
        return float(self.exponents(begin)[0])

    def horizon(self, growth: float) -> float:
        """First time [s] at which a perturbation begun at any earlier time has grown by ``growth``; inf if none has."""
        return self.growth(growth)[0]

    def _first(self, begin: float) -> int:
        return int(np.searchsorted(self.time, begin - 1e-12 * self.time[-1]))


@dataclass(frozen=True)
class Perturbed(Gradient):
    """The gradient of one motion's flow, whose factors are not stored."""

    time: Array  # (S + 1,) ends of the segments [s], the first 0
    scale: Array  # (N,) balanced = scale * SI
    plan: Driveline
    regions: Regions
    path: Intervals
    ends: IntArray  # (S + 1,) the interval of ``path`` with which each segment begins

    def carried(self, segment: int, columns: Array) -> Array:
        """Return perturbations at the end of a segment from those at its start (N, P), scaled coordinates."""
        elements = self.regions.stiffness.shape[1]
        y: Array = np.ascontiguousarray(columns, dtype=np.float64).copy()
        room = np.empty_like(y), np.empty_like(y), np.empty((elements, y.shape[1])), np.empty((1, y.shape[1]))
        first = self.ends[segment]
        last = self.ends[segment + 1]
        vectorised(carry)(self.plan, self.regions, self.path, first, last, y, *room)
        return y

    @cached_property
    def _followed(self) -> tuple[list[float], list[float]]:
        return [], []

    def follow(self, progress: Callable[[float], None] | None = None) -> None:
        """Carry a few perturbations to the end: (S,) logarithms of the largest one's growth, and sizes of sums."""
        logarithms, sizes = self._followed
        if logarithms:
            return
        # orthonormal perturbations, and random perturbations
        rng = np.random.default_rng(0)
        size = len(self.scale)
        segments = len(self.time) - 1
        count = min(DIRECTIONS, size)
        columns = np.hstack([np.linalg.qr(rng.normal(size=(size, count)))[0], _fresh(rng, size)])
        grown: list[float] = []
        for segment in range(segments):
            if progress is not None:
                progress(segment / segments)
            # growth over a segment, then orthonormalisation
            columns = self.carried(segment, columns)
            basis, triangle = np.linalg.qr(columns[:, :count])
            grown.append(float(_logarithms(triangle)[0]))
            # sums of random perturbations; a new one is added after some segments
            sums = columns[:, count:]
            if sums.size:
                sizes.append(float(np.linalg.norm(sums)))
                if sizes[-1] >= RESOLVED:
                    sums = sums[:, :0]
                elif (segment + 1) % _APART == 0:
                    sums = sums + _fresh(rng, size)
            columns = np.hstack([basis, sums])
        logarithms += grown

    def growth(self, least: float) -> tuple[float, float]:
        """The first time [s] of a growth ``least``, inf if none, and the growth, at most ``RESOLVED``."""
        self.follow()
        sizes = np.array(self._followed[1])
        passed = np.flatnonzero(sizes >= min(least, RESOLVED))
        if passed.size:
            return float(self.time[passed[0] + 1]), least
        return float("inf"), float(sizes[-1])

    def largest_exponent(self, begin: float = 0.0) -> float:
        """Largest Lyapunov exponent over [begin, end], of perturbations begun at the start [1/s]."""
        self.follow()
        first = self._first(begin)
        return sum(self._followed[0][first:]) / float(self.time[-1] - self.time[first])


def _logarithms(triangle: Array) -> Array:
    return np.asarray(np.log(np.maximum(np.abs(np.diagonal(triangle)), 1e-300)))


def _fresh(rng: np.random.Generator, size: int) -> Array:
    """Random perturbations: the expected square of a matrix's product with them is that of its Frobenius norm."""
    return np.asarray(rng.normal(size=(size, SKETCHED)) / np.sqrt(SKETCHED))


def driveline_of(flow: Flow) -> Driveline:
    """The rows of a flow, sparse, with the norm of the stiffest and most damped region there could be."""
    # rows of deflections, rates and accelerations, in the scales of the flow
    system = flow.system
    period = flow.system.inputs.period
    r = len(flow.coordinates.elements)
    n = flow.system.size
    deflection = flow.deflection[:, :r]
    rate = flow.rate[:, r : r + n]
    turning = period * flow.scaling.deflection[:, None] * flow.coordinates.basis / flow.scaling.velocity
    push = -period * (flow.scaling.velocity / system.inertia)[:, None] * system.rows.T
    drag = period * system.drag / system.inertia
    element = [system.auxiliaries[c].element for c in system.memories]
    # the largest stiffness and damping that any region has
    stiffness, damping = (
        np.array([getattr(law, name).max() for law in system.laws]) for name in ("stiffness", "damping")
    )
    for auxiliary in system.auxiliaries:
        stiffness[auxiliary.element] += auxiliary.stiffness.max()
        damping[auxiliary.element] += np.abs(auxiliary.damping).max()
    # norm of the rates of such a region
    matrix = np.zeros((r + n, r + n))
    matrix[:r, r:] = turning
    matrix[r:, :r] = push @ (stiffness[:, None] * deflection)
    matrix[r:, r:] = push @ (damping[:, None] * rate) - np.diag(drag)
    return Driveline(
        turning=_sparse(turning),
        deflection=_sparse(deflection),
        rate=_sparse(rate),
        push=_sparse(push),
        drag=drag,
        element=np.array(element, dtype=np.int64),
        norm=float(np.linalg.norm(matrix, 2)),
    )


def regions_of(flow: Flow, regions: list[Pieces]) -> Regions:
    """Stiffness, damping and memory of every element in some regions."""
    system = flow.system
    pieces = np.array(regions, dtype=np.int64)
    count = len(regions)
    laws = len(flow.system.laws)
    stiffness = np.empty((count, laws))
    damping = np.empty((count, laws))
    for k, law in enumerate(system.laws):
        stiffness[:, k] = law.stiffness[pieces[:, k]]
        damping[:, k] = law.damping[pieces[:, k]]
    for c, auxiliary in enumerate(system.auxiliaries):
        stiffness[:, auxiliary.element] += auxiliary.stiffness[pieces[:, laws + c]]
        damping[:, auxiliary.element] += auxiliary.damping[pieces[:, laws + c]]
    memory = np.empty((count, len(system.memories)))
    moves = np.empty((count, len(system.memories)))
    for s, c in enumerate(system.memories):
        auxiliary = system.auxiliaries[c]
        piece = pieces[:, laws + c]
        memory[:, s] = auxiliary.memory[piece] / flow.memory[s]
        moves[:, s] = auxiliary.moves[piece] * system.inputs.period * flow.memory[s]
    return Regions(stiffness, damping, memory, moves)


def _sparse(matrix: Array) -> Sparse:
    rows, columns = np.nonzero(matrix)
    start = np.searchsorted(rows, np.arange(len(matrix) + 1))
    return Sparse(start.astype(np.int64), columns.astype(np.int64), matrix[rows, columns])
