"""Exact motions from nearby starts: differences for which no algorithm is to blame.

A motion that begins a thousandth of a half-gap away is as correct as the one asked for. Where its statistics differ,
rounding or a tolerance may cause the same difference. Twenty such motions and the exact one itself are the fewest with
which a correct motion is called different in fewer than 5 of 100 cases (``signals.ensembles``). The motion itself is
among them because it may be singular: it may rest where its neighbours still swing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from gearrattle.assembly import start_at
from gearrattle.comparison.motion_statistics import Portrait, portrait
from gearrattle.comparison.pointwise import deflection_scale
from gearrattle.model import Model
from gearrattle.simulation.simulate import simulate
from gearrattle.trajectory import Array, Layout, Trajectory

MANY = 21
AWAY = 1e-3  # half-gaps
_SEED = 1995


def nearby(motion: Trajectory, distance: float, direction: Array | None = None) -> dict[str, list[float]]:
    """Return a start from which some deflection differs by so many half-gaps.

    A clearance whose only corner is at 0 is measured by its largest deflection, and so is every element of a driveline
    without clearances. Where none of them ever moves the start is the motion's own.

    Parameters
    ----------
    direction
        (n,) how the angles move against each other; None: the inertia at the widest gap alone.
    """
    layout = motion.layout
    angle = motion.angle[0].copy()
    elements = layout.clearance if layout.clearance.size else np.arange(len(layout.element_names))
    size = deflection_scale(motion, motion.time.size)
    if not layout.clearance.size:
        size = np.max(np.abs(_deflections(layout, motion.angle)), axis=0)
    if direction is None:
        direction = np.zeros(angle.size)
        if elements.size:
            direction[_free_end(layout, int(elements[int(np.argmax(size))]))] = 1.0
    direction = np.where(np.isin(np.arange(angle.size), layout.prescribed), 0.0, direction)  # no start moves these
    moved = np.abs(_deflections(layout, direction)[elements])
    largest = np.max(np.divide(moved, size, out=np.zeros_like(moved), where=size > 0.0), initial=0.0)
    if largest > 0.0:
        angle += direction * distance / largest
    return start_at(motion, 0) | {"angle": angle.tolist()}


def _free_end(layout: Layout, element: int) -> int:
    """Return the last inertia of an element whose motion is not prescribed; of a bearing the one that it holds."""
    free = [i for i in np.flatnonzero(layout.rows[element]).tolist() if i not in layout.prescribed]
    return max([i for i in layout.between[element].tolist() if i in free] or free or [int(layout.between[element, 0])])


def _deflections(layout: Layout, angle: Array) -> Array:
    """(..., m) of every element from angles (..., n), without transmission error [rad or m]."""
    return np.asarray(angle @ layout.rows.T)


def exact_portraits(
    model: Model,
    motion: Trajectory,
    settings: Mapping[str, Any],
    start: float | None,
    *,
    budget: float = float("inf"),
    progress: Callable[[float], None] | None = None,
) -> tuple[Portrait, ...]:
    """Return ``MANY`` portraits: of the exact motion, and of others begun within a thousandth of a half-gap of it.

    Parameters
    ----------
    start
        statistics begin there [s]; None: with the steady part.
    budget
        longest time [s]; fewer portraits come back where it is used up.

    Raises
    ------
    ModelError
        too short for statistics.
    """
    begun = time.perf_counter()
    random = np.random.default_rng(_SEED)
    portraits: list[Portrait] = []
    shared = {**settings, "algorithm": "exact", "audit": False}
    for i in range(MANY):
        direction = np.asarray(random.standard_normal(motion.angle.shape[1]))
        away = nearby(motion, AWAY * random.random() if i else 0.0, direction)
        portraits.append(portrait(simulate(model, **{**shared, "initial": away}).trajectory, start))
        if progress is not None:
            progress((i + 1) / MANY)
        if time.perf_counter() - begun > budget:
            break
    return tuple(portraits)
