"""Mean deflections of a driveline whose clearances oscillate: the static equilibrium of the averaged laws.

Averaged over given oscillations x_k(t) the elastic laws are smooth: E[f_k(m_k + x_k)] grows from one slope to the next
as the mean m_k moves through a clearance. The means must carry the mean loads,

    minimise  sum_k E[U_k(b_k . y + x_k(t))] - g . y     over the mean deflections y,

the static equilibrium of the averaged laws, found by Newton's method: the sum is convex. With corners c_j and steps of
slope s_j, E[f] = k_0 E[delta] + f_0 + sum_j s_j E[max(delta - c_j, 0)] and E[f'] = k_0 + sum_j s_j P(delta > c_j).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.equilibrium import equilibrium
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]

_MOST_NEWTON = 60
_MOST_HALVINGS = 50


class Averages:
    """Mean deflections under given oscillations; each search begins where the last one ended.

    Runaway: an element of zero last slope cannot carry its load.
    """

    def __init__(self, system: PiecewiseSystem) -> None:
        self.system = system
        rest = equilibrium(system)
        self.elements = [k for k, law in enumerate(system.laws) if np.any(law.stiffness > 0) or np.any(law.offset != 0)]
        coordinates = relative_coordinates(system, self.elements)
        self.combination = coordinates.combination
        still = system.inputs.cycles <= 0.0
        mean = system.inputs.mean + system.inputs.torque_cosine[:, still].sum(axis=1)
        self.load = coordinates.angle_from_basis.T @ (mean - system.inertia * rest.acceleration)
        self.begin = rest.deflection[list(coordinates.elements)]
        laws = [system.laws[k] for k in self.elements]
        self.lowest = np.array([law.stiffness[0] for law in laws])
        self.offset = np.array([law.offset[0] for law in laws])
        self.largest = np.array([law.stiffness.max() for law in laws])
        self.cornered = [i for i, law in enumerate(laws) if law.corners.size]
        most = max((law.corners.size for law in laws), default=0)
        self.corners = np.full((len(self.cornered), most, 1), np.inf)
        self.steps = np.zeros((len(self.cornered), most))
        for row, i in enumerate(self.cornered):
            count = laws[i].corners.size
            self.corners[row, :count, 0] = laws[i].corners
            self.steps[row, :count] = np.diff(laws[i].stiffness)

    def means(self, oscillation: Array) -> Array:
        """Return (m,) mean deflections of all elements, about oscillations (m, S) of mean zero."""
        # begin with the means of the oscillation before
        load = self.load
        combination = self.combination
        y = self.begin
        waves = oscillation[self.elements]
        cornered = waves[self.cornered]
        # regularisation of the Newton matrix, and the scale of the residual
        stiffest = combination.T @ (self.largest[:, None] * combination)
        floor = 1e-9 * np.diag(np.diag(stiffest))
        swing = self.largest * np.abs(waves).max(axis=1, initial=0.0)
        size = np.abs(load).max(initial=0.0) + (np.abs(combination).T @ swing).max(initial=0.0)
        # Newton's method with a line search by halving
        residual, matrix = self._pull(y, cornered)
        for _ in range(_MOST_NEWTON):
            if np.abs(residual).max(initial=0.0) <= 1e-12 * size:
                break
            step = np.linalg.solve(matrix + floor, residual)
            low = 0.0
            high = 1.0
            share = 1.0
            before = abs(residual @ step)
            for _ in range(_MOST_HALVINGS):  # the sum is convex: its slope along the line changes sign once
                there = self._pull(y + share * step, cornered)
                now = float(there[0] @ step)
                if now >= -0.5 * before and (share == 1.0 or now <= 0.5 * before):
                    break
                low, high = (share, high) if now > 0.0 else (low, share)
                share = 0.5 * (low + high)
            else:
                there = self._pull(y + share * step, cornered)
            y = y + share * step
            residual, matrix = there
        # means in element order
        self.begin = y
        means = np.zeros(len(self.system.laws))
        means[self.elements] = combination @ y
        return means

    def _pull(self, y: Array, cornered: Array) -> tuple[Array, Array]:
        """Residual of the averaged laws against the loads, and its Jacobian; oscillations of elements with corners."""
        mean = self.combination @ y
        force = self.lowest * mean + self.offset
        slope = self.lowest.copy()
        over = (mean[self.cornered, None] + cornered)[:, None, :] - self.corners
        above = over > 0.0
        count = over.shape[2]
        force[self.cornered] += np.einsum("kj,kj->k", self.steps, np.where(above, over, 0.0).sum(axis=2) / count)
        slope[self.cornered] += np.einsum("kj,kj->k", self.steps, np.count_nonzero(above, axis=2) / count)
        return self.load - self.combination.T @ force, self.combination.T @ (slope[:, None] * self.combination)
