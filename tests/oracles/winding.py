"""Slow and obvious: all fixed points of a continuous map of the plane, by how often a vector turns round every cell.

The vector P(y) - y turns once round a cell that holds a fixed point: with the sign of det(I - M), so -1 is a saddle.
Two fixed points of opposite signs in one cell stay hidden. The map is that of the oscillator with backlash,
x'' + 0.1 x' + f(x) = 0.1 + 0.05 W^2 cos(W t), by Runge-Kutta's method with many steps: good to some 1e-6, which
moves no fixed point out of its cell but by chance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEPS = 240  # a period


def acceleration(frequency: float, t: float, x: Array, v: Array) -> Array:
    spring = np.where(x > 1.0, x - 1.0, np.where(x < -1.0, x + 1.0, 0.0))
    return np.asarray(0.1 + 0.05 * frequency**2 * np.cos(frequency * t) - 0.1 * v - spring)


def mapped(frequency: float, x: Array, v: Array, cycles: int) -> tuple[Array, Array]:
    """Follow states over whole periods."""
    h = 2.0 * np.pi / frequency / STEPS
    for i in range(STEPS * cycles):
        t = i * h
        k1 = acceleration(frequency, t, x, v)
        k2 = acceleration(frequency, t + h / 2, x + h / 2 * v, v + h / 2 * k1)
        k3 = acceleration(frequency, t + h / 2, x + h / 2 * v + h * h / 4 * k1, v + h / 2 * k2)
        k4 = acceleration(frequency, t + h, x + h * v + h * h / 2 * k2, v + h * k3)
        x, v = x + h * v + h * h / 6 * (k1 + k2 + k3), v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return x, v


def turns(frequency: float, x: Array, v: Array, cycles: int) -> NDArray[np.int64]:
    """Return how often P(y) - y turns round every cell of a grid, (len(x) - 1, len(v) - 1)."""
    grid = np.meshgrid(x, v, indexing="ij")
    end = mapped(frequency, *grid, cycles)
    vector = end[0] - grid[0] + 1j * (end[1] - grid[1])
    round_cell = [vector[:-1, :-1], vector[1:, :-1], vector[1:, 1:], vector[:-1, 1:]]
    total = sum(np.angle(round_cell[(i + 1) % 4] / round_cell[i]) for i in range(4))
    return np.asarray(np.rint(total / (2.0 * np.pi)), dtype=np.int64)


def fixed_points(
    frequency: float, cycles: int = 1, reach: float = 4.0, cells: int = 320
) -> list[tuple[float, float, int]]:
    """Return (x, v, sign of det(I - M)) of the fixed points in a square."""
    squares = _turning(frequency, np.array([-reach, -reach]), 2.0 * reach, cells, cycles)
    for _ in range(2):  # on a coarse grid the neighbour of a cell may seem to hold what the cell holds
        finer = [_turning(frequency, corner - 1.5 * side, 4.0 * side, 40, cycles) for corner, side, _ in squares]
        squares = [square for some in finer for square in some]
    points: list[tuple[float, float, int]] = []
    for corner, side, sign in squares:
        x, v = (float(c + side / 2) for c in corner)
        if all(np.hypot(x - a, v - b) > 4.0 * side for a, b, _ in points):
            points.append((x, v, sign))
    return points


def _turning(frequency: float, low: Array, width: float, cells: int, cycles: int) -> list[tuple[Array, float, int]]:
    """The cells of a square round which the vector turns: corner, side, how often."""
    x, v = (np.linspace(c, c + width, cells + 1) for c in low)
    index = turns(frequency, x, v, cycles)
    return [(np.array([x[i], v[j]]), width / cells, int(index[i, j])) for i, j in np.argwhere(index != 0)]
