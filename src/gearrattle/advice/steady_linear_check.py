"""Steady linear response about rest, compared with the corners of every clearance.

While the response stays inside the pieces of the laws in which the driveline rests, it is an exact periodic motion of
the driveline, in which no clearance opens. Otherwise it predicts only roughly which corners are crossed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.analysis.linear.response import steady_deflections, steady_extremes
from gearrattle.engine.system.equilibrium import PositionAtRest
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.trajectory import Array


@dataclass(frozen=True)
class Excursions:
    """Excursion of every clearance in the steady linear response about rest.

    Attributes
    ----------
    low, high
        (K,) lowest and highest deflection [rad or m].
    floor, ceiling
        (K,) lower and upper corner of the piece of the law at rest [rad or m]; infinite without a corner.
    """

    low: Array
    high: Array
    floor: Array
    ceiling: Array

    @property
    def inside(self) -> bool:
        """Whether no corner is reached; then the response is an exact motion of the driveline."""
        return bool(np.all((self.low > self.floor) & (self.high < self.ceiling)))

    @property
    def used(self) -> Array:
        """(K,) amplitude of the oscillation over the distance from its middle to the nearer corner; >= 1: crossed."""
        middle = 0.5 * (self.low + self.high)
        room = np.maximum(np.minimum(self.ceiling - middle, middle - self.floor), np.finfo(float).tiny)
        with np.errstate(over="ignore"):  # infinite at rest on a corner
            return np.asarray(0.5 * (self.high - self.low) / room)


def excursions(system: PiecewiseSystem, rest: PositionAtRest) -> Excursions:
    """Return the steady linear response of every clearance, with the slopes of the laws at rest."""
    slope, damping = (
        np.array([getattr(law, name)[p] for law, p in zip(system.laws, rest.pieces, strict=True)])
        for name in ("stiffness", "damping")
    )
    low, high = steady_extremes(system, steady_deflections(system, slope, damping))
    mine = list(system.clearances)
    low = rest.deflection[mine] + low[mine]
    high = rest.deflection[mine] + high[mine]
    bounds = [np.concatenate([[-np.inf], system.laws[k].corners, [np.inf]]) for k in mine]
    floor = np.array([edges[rest.pieces[k]] for k, edges in zip(mine, bounds, strict=True)])
    ceiling = np.array([edges[rest.pieces[k] + 1] for k, edges in zip(mine, bounds, strict=True)])
    return Excursions(low, high, floor, ceiling)
