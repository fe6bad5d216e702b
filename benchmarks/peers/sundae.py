"""SUNDIALS CVODE by its Python binding, scikit-sundae: root-finding, restarted at every corner.

The binding takes Python functions only. Ours call compiled code at once, yet every call crosses from C to Python and
back; what CVODE does without that is in :mod:`benchmarks.peers.cvode`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.peers.base import Outcome, Peer, Prepared, tolerances
from benchmarks.peers.plant import Plant
from benchmarks.peers.smooth import Regions, jacobian, slopes


def build(plant: Plant, method: str, tolerance: float) -> Prepared:
    """Make a case ready."""
    from sksundae.cvode import CVODE

    regions = Regions(plant)
    flat = regions.flat
    ways = [(k, step) for k in plant.clearances for step in (-1, 1)]
    places = [(k, 5 * k + (4 if step > 0 else 3)) for k, step in ways]

    def field(time: float, y: Any, dy: Any) -> None:
        slopes(time, y, dy, flat)

    def matrix(_time: float, _y: Any, _dy: Any, out: Any) -> None:
        jacobian(out, flat)

    def distance(_time: float, y: Any, out: Any) -> None:
        for i, (k, bound) in enumerate(places):
            out[i] = y[k] - flat[bound]

    distance.terminal = [True] * len(ways)  # type: ignore[attr-defined]
    distance.direction = [step for _, step in ways]  # type: ignore[attr-defined]
    options = {"eventsfn": distance, "num_events": len(ways), "jacfn": matrix, "max_num_steps": 10**8}
    root_return = 2

    def run(cycles: float) -> Outcome:
        regions.reset()
        solver = CVODE(field, method=method, rtol=tolerance, atol=tolerance, **options)
        time = 0.0
        end = 2.0 * np.pi * cycles
        y = plant.start
        while True:
            solver.init_step(time, y)
            piece = solver.step(end, tstop=end)
            time, y = float(piece.t), piece.y.copy()
            if piece.status < 0:
                raise ArithmeticError(piece.message)
            if piece.status != root_return:
                return Outcome(y[list(plant.clearances)], regions.crossings)
            for (k, step), met in zip(ways, piece.i_events[-1], strict=True):  # it keeps all since the start
                if met == step:
                    regions.cross(k, step)

    return Prepared(run)


SUNDAE = Peer(
    "CVODE Adams, Python",
    "scikit-sundae",
    "by scikit-sundae, Python callbacks; roots, restarted",
    tolerances(6, 8, 10, 11, 12, 13, 14, 15, method="Adams"),
    build,
)
