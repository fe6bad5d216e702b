"""How a small perturbation grows along a motion: the flow's gradient, Lyapunov exponents, the predictability horizon.

Between crossings a perturbation of (x, v) moves by exp(A_r h). At a crossing of a displacement corner it is multiplied
by

    S = I - [0; J^-1 w] (c_after - c_before) [w^T, 0],

the saltation matrix with delta' divided out: valid at grazing too, and the identity where the damping does not jump.
So the gradient follows from the log of crossings alone. It is kept in segments of an eighth of a period, because over
many cycles of a chaotic motion the product overflows.

A perturbation is measured in the engine's balanced coordinates (roots of energies, ``scaling.py``). The *predictability
horizon* is the first time at which some perturbation, begun at any earlier time, has grown by ``GROWTH``: there
rounding errors of 1e-16 have become 1e-9, and the motion is predicted pointwise no longer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.kernels.packed import LONGEST, ORDER
from gearrattle.system.flow import Flow, Pieces
from gearrattle.system.region import Region, build_region

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

GROWTH = 1e7
_MOST_STARTS = 512  # segments a growth is followed from at once; beyond, neighbouring segments are joined


@dataclass(frozen=True)
class Variation:
    """The gradient of one motion's flow.

    Attributes:
        time: (S + 1,) ends of the segments [s], the first 0.
        segments: (S, N, N) gradient over each, balanced coordinates.
        scale: (N,) balanced = scale * SI.
    """

    time: Array
    segments: Array
    scale: Array

    def gradient(self) -> Array:
        """(N, N) d y(end) / d y(0), y = (basis deflections, velocities) [SI]; inf where it overflows."""
        total = np.eye(len(self.scale))
        with np.errstate(over="ignore", invalid="ignore"):
            for segment in self.segments:
                total = segment @ total
        return np.asarray(total * self.scale[None, :] / self.scale[:, None])

    def exponents(self, begin: float = 0.0) -> Array:
        """(N,) Lyapunov exponents [1/s], largest first, averaged over [begin, end] (whole segments)."""
        first = int(np.searchsorted(self.time, begin - 1e-12 * self.time[-1]))
        basis, total = np.eye(len(self.scale)), np.zeros(len(self.scale))
        for segment in self.segments[first:]:
            basis, triangle = np.linalg.qr(segment @ basis)
            total += np.log(np.maximum(np.abs(np.diagonal(triangle)), 1e-300))
        return np.sort(total / (self.time[-1] - self.time[first]))[::-1]

    def horizon(self, growth: float = GROWTH) -> float:
        """First time [s] at which a perturbation begun at any earlier time has grown by ``growth``; inf if none has.

        Growth is the Frobenius norm of the gradient between the two times.
        """
        time, segments = self.time, self.segments
        while len(segments) > 0:
            head = segments[:_MOST_STARTS]
            grown = np.zeros((0, *head.shape[1:]))
            for i, segment in enumerate(head):
                grown = segment @ np.concatenate([grown, np.eye(len(self.scale))[None]])
                if np.linalg.norm(grown, axis=(1, 2)).max() >= growth:
                    return float(time[i + 1])
            if len(segments) <= _MOST_STARTS:
                break
            pairs = len(segments) // 2
            joined = segments[1 : 2 * pairs : 2] @ segments[0 : 2 * pairs : 2]
            tail = segments[2 * pairs :]
            segments = np.concatenate([joined, tail])
            time = np.concatenate([time[0 : 2 * pairs + 1 : 2], time[2 * pairs + 1 :]])
        return float("inf")


def variation(
    flow: Flow, initial: Pieces, *, time: Array, clearance: IntArray, piece: IntArray, end: float
) -> Variation:
    """The gradient along a motion, from its log of crossings.

    Args:
        flow: the system.
        initial: piece of every element at the start.
        time, clearance, piece: (E,) crossing times [s], the clearance crossed, the piece entered.
        end: length of the motion [s].
    """
    period, n = flow.system.inputs.period, flow.states
    grid = np.arange(1, max(1, round(end / period / LONGEST)) + 1) * LONGEST
    at = np.concatenate([time / period, grid])
    order = np.argsort(at, kind="stable")
    durations = np.diff(np.concatenate([[0.0], at[order]]))
    index: dict[Pieces, int] = {}
    regions: list[Region] = []
    path, kicks = np.full((len(at), 3), -1, dtype=np.int64), np.zeros((len(at), n))
    push = _kicks(flow)
    pieces = list(initial)
    for i, which in enumerate(order):
        here = tuple(pieces)
        if here not in index:
            index[here] = len(regions)
            regions.append(build_region(flow, here))
        path[i] = index[here], -1, which >= len(time)
        if which < len(time):
            k = flow.system.clearances[clearance[which]]
            damping, entered = flow.system.laws[k].damping, int(piece[which])
            path[i, 1] = clearance[which]
            kicks[i] = -push[clearance[which]] * (damping[entered] - damping[pieces[k]])
            pieces[k] = entered
    rows = np.ascontiguousarray(flow.deflection[list(flow.system.clearances), :n])
    segments = np.zeros((len(grid), n, n))
    _run(regions, (path, durations, kicks, rows), segments)
    scale = np.concatenate([flow.scaling.deflection, flow.scaling.velocity])
    return Variation(np.concatenate([[0.0], grid * period]), segments, scale)


def _kicks(flow: Flow) -> Array:
    """(K, N) J^-1 w of every clearance, balanced: change of velocities for a unit of deflection and damping jump."""
    system, n = flow.system, flow.states
    out = np.zeros((len(system.clearances), n))
    rows = system.rows[list(system.clearances)]
    out[:, n - system.size :] = rows / system.inertia * flow.scaling.velocity
    return out


def _run(regions: Sequence[Region], path: tuple[IntArray, Array, Array, Array], segments: Array) -> None:
    """Pack the regions' homogeneous parts and let the kernel multiply."""
    from gearrattle.kernels._jit import vectorised
    from gearrattle.kernels.variation import gradient_segments

    n = segments.shape[1]
    levels = max(region.fine for region in regions) + 1
    tables = np.zeros((len(regions), levels, n, n))
    for i, region in enumerate(regions):
        tables[i, : region.fine + 1] = region.tables[:, :n, :n]
    generators = np.array([region.generator[:n, :n] for region in regions])
    steps = LONGEST * 0.5 ** np.arange(levels)
    fine = np.array([region.fine for region in regions], dtype=np.int64)
    vectorised(gradient_segments)(tables, generators, steps, fine, ORDER, *path, segments)
