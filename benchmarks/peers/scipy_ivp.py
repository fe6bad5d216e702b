"""SciPy's solve_ivp, stopped at every corner and restarted behind it.

Strong setting: the right-hand side compiled, its Jacobian (constant in a region) given, two terminal events an element
that watch the region's own corners for the way out only, so that standing on a corner after a restart is no event. A
first step that touches the corner and is back at its end is seen as an event at its start, and the restart would stall:
then the first step is cut.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.peers.base import Outcome, Peer, Prepared, tolerances
from benchmarks.peers.plant import Plant
from benchmarks.peers.smooth import SIZE, Regions, derivative, jacobian

SHORTEST = 1e-9
"""Shortest first step tried behind a corner."""


def _watch(flat: Any, element: int, step: int) -> Callable[[float, Any], float]:
    """Return the event of an element leaving its region upwards (1) or downwards (-1)."""
    bound = 5 * element + (4 if step > 0 else 3)

    def distance(_time: float, y: Any) -> float:
        return y[element] - flat[bound]

    distance.terminal = True  # type: ignore[attr-defined]
    distance.direction = step  # type: ignore[attr-defined]
    return distance


def build(plant: Plant, method: str, tolerance: float) -> Prepared:
    """Make a case ready."""
    from scipy.integrate import solve_ivp

    regions = Regions(plant)
    flat, matrix = regions.flat, np.empty((SIZE, SIZE))
    ways = [(k, step) for k in plant.clearances for step in (-1, 1)]
    events = [_watch(flat, k, step) for k, step in ways]

    def field(time: float, y: Any) -> Any:
        return derivative(time, y, flat)

    def run(cycles: float) -> Outcome:
        regions.reset()
        first = None
        time = 0.0
        end = 2.0 * np.pi * cycles
        y = plant.start.copy()
        while True:
            more = {}
            if method == "Radau":
                jacobian(matrix, flat)
                more["jac"] = matrix
            piece = solve_ivp(
                field, (time, end), y, method, events=events, rtol=tolerance, atol=tolerance, first_step=first, **more
            )
            if piece.status < 0:
                raise ArithmeticError(piece.message)
            if piece.t[-1] == time:
                first = 1e-3 if first is None else first / 10
                if first < SHORTEST:
                    raise ArithmeticError(f"stalls on a corner at {time}")
                continue
            first = None
            time = piece.t[-1]
            y = piece.y[:, -1]
            if piece.status == 0:
                return Outcome(y[list(plant.clearances)], regions.crossings)
            for (k, step), times in zip(ways, piece.t_events, strict=True):
                if times.size:
                    regions.cross(k, step)

    return Prepared(run)


DOP853 = Peer(
    "SciPy DOP853",
    "scipy",
    "explicit, order 8; terminal events, restarted",
    tolerances(6, 8, 9, 10, 11, 12, 13, method="DOP853"),
    build,
)
RADAU = Peer(
    "SciPy Radau",
    "scipy",
    "implicit, order 5, Jacobian given; terminal events, restarted",
    tolerances(6, 8, 10, 12, method="Radau"),
    build,
)
