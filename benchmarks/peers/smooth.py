"""The right-hand side between corners and its Jacobian, compiled, for peers that take functions.

Everything a case consists of lies in one flat array, so that one compiled function serves all cases and can be handed
to a C library together with a pointer. The first 15 numbers are the rows of :attr:`Plant.region` in force: a crossing
rewrites five of them.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any

import numba
import numpy as np

from benchmarks.peers.plant import Plant

N = 4
M = 3
H = 6
"""Inertias, elements, harmonics of the paper's transmission."""
SIZE = M + N
LAW, GAIN, SHARE, DRAG, MEAN, ORDER, TORQUE, ERROR = (int(x) for x in np.cumsum([0, 5 * M, M * N, N * M, N, N, H, H]))
"""Where each part begins. The torques act on the first inertia, the transmission error on the last element."""
LENGTH = ERROR + H


def pack(plant: Plant) -> Any:
    """Return the flat array of a case in the regions of its start."""
    if np.any(plant.torque[1:]) or np.any(plant.error[:-1]):
        raise ValueError("torques on the flywheel and an error of the mesh are all that is foreseen here")
    flat = np.zeros(LENGTH)
    flat[LAW:GAIN] = np.concatenate([rows[r] for rows, r in zip(plant.region, plant.first, strict=True)])
    flat[GAIN:SHARE] = plant.gain.ravel()
    flat[SHARE:DRAG] = plant.share.ravel()
    flat[DRAG:MEAN], flat[MEAN:ORDER] = plant.drag, plant.mean
    count = plant.orders.size
    flat[ORDER : ORDER + count] = plant.orders
    flat[TORQUE : TORQUE + count] = plant.torque[0]
    flat[ERROR : ERROR + count] = plant.error[-1]
    return flat


@numba.njit(cache=True)
def slopes(tau, y, dy, p):  # type: ignore[no-untyped-def]
    """Write the derivative of y (7,) at tau to dy."""
    applied, error_rate = 0.0, 0.0
    for j in range(H):
        if p[TORQUE + j] != 0.0:
            applied += p[TORQUE + j] * sin(p[ORDER + j] * tau)
        if p[ERROR + j] != 0.0:
            error_rate += p[ERROR + j] * p[ORDER + j] * cos(p[ORDER + j] * tau)
    for i in range(N):
        dy[M + i] = p[MEAN + i] - p[DRAG + i] * y[M + i]
    dy[M] += applied
    for k in range(M):
        rate = 0.0
        for i in range(N):
            rate += p[GAIN + N * k + i] * y[M + i]
        if k == M - 1:
            rate -= error_rate
        dy[k] = rate
        force = p[LAW + 5 * k] * y[k] + p[LAW + 5 * k + 1] * rate + p[LAW + 5 * k + 2]
        for i in range(N):
            dy[M + i] -= p[SHARE + M * i + k] * force


@numba.njit(cache=True)
def derivative(tau, y, p):  # type: ignore[no-untyped-def]
    """Return the derivative of y in a new array."""
    dy = np.empty(SIZE)
    slopes(tau, y, dy, p)
    return dy


@numba.njit(cache=True)
def jacobian(out, p):  # type: ignore[no-untyped-def]
    """Write d(dy)/dy, constant in a region, to out (7, 7)."""
    out[:, :] = 0.0
    for i in range(N):
        out[M + i, M + i] = -p[DRAG + i]
        for k in range(M):
            out[k, M + i] = p[GAIN + N * k + i]
            out[M + i, k] -= p[SHARE + M * i + k] * p[LAW + 5 * k]
            for j in range(N):
                out[M + i, M + j] -= p[SHARE + M * i + k] * p[LAW + 5 * k + 1] * p[GAIN + N * k + j]


class Regions:
    """Which region every element is in, kept with the flat array."""

    def __init__(self, plant: Plant) -> None:
        self.plant, self.flat = plant, pack(plant)
        self.now = list(plant.first)
        self.crossings = 0

    def reset(self) -> None:
        """Go back to the start."""
        self.flat[:] = pack(self.plant)
        self.now[:] = self.plant.first
        self.crossings = 0

    def cross(self, element: int, step: int) -> None:
        """Enter the next region above (step 1) or below (-1)."""
        self.now[element] += step
        self.crossings += 1
        self.flat[5 * element : 5 * element + 5] = self.plant.region[element][self.now[element]]
