"""Trains of n inertias with n / 2 clearances that rattle everywhere, the same for every n but for their length.

Period 1. Every link has contact rates of some 100 rad/s, every second one a gap that its neighbours cross several times
a period. Each inertia carries a small drag and its own share of the load: a torque of order 1 or 2, its phase by its
number (golden angle), so that a longer train is more of the same and not the same excitation spread thinner.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.solvers import Task
from gearrattle.engine.system.law import PiecewiseLaw, Stage, staged
from gearrattle.engine.system.piecewise import Harmonics, PiecewiseSystem

SHAPES = ("chain", "tree")
SIZES = (4, 8, 16, 32, 64, 128)
CONTACT = 2500.0
GAP = 1e-3
LOAD = 0.4
GOLDEN = np.pi * (3.0 - 5.0**0.5)


def links(shape: str, n: int) -> list[tuple[int, int]]:
    """Pairs of inertias joined: neighbours in a row, or parent and child in a binary tree."""
    return [(i - 1 if shape == "chain" else (i - 1) // 2, i) for i in range(1, n)]


def law(gap: bool) -> PiecewiseLaw:
    """A link: linear, or free of force in a gap."""
    contact = Stage(CONTACT, 0.5, None)
    side = [Stage(0.0, 0.05, GAP), contact] if gap else [contact]
    return staged(side, side)


def train(shape: str, n: int) -> PiecewiseSystem:
    """A train of a shape with n inertias."""
    pairs, number = links(shape, n), np.arange(n)
    rows = np.zeros((n - 1, n))
    for k, (a, b) in enumerate(pairs):
        rows[k, a], rows[k, b] = 1.0, -1.0
    torque = np.zeros((2, n, 2))
    order = number % 2
    torque[:, number, order] = LOAD * np.array([np.sin(GOLDEN * number), np.cos(GOLDEN * number)])
    none = np.zeros((n - 1, 2))
    inputs = Harmonics(1.0, np.array([1.0, 2.0]), np.zeros(n), torque[0], torque[1], none, none)
    inertia = 1.0 + 0.3 * np.sin(1.0 + number)
    laws = tuple(law(k % 2 == 0) for k in range(n - 1))
    return PiecewiseSystem(inertia, np.full(n, 0.5), rows, laws, inputs)


def task(shape: str, n: int, cycles: int, *, samples: int = 16, audit: bool = False) -> Task:
    """A run from rest."""
    return Task(train(shape, n), np.zeros(n), np.zeros(n), cycles, samples, None, None, audit)
