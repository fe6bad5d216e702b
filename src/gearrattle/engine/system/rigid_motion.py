"""The periodic rigid response of free trains, with which a steady run begins.

A free train turns as one, q = Phi r, without deflecting any element that has a stiffness. Its momentum obeys

    Phi^T J q'' + Phi^T D q' = Phi^T T(t),

independent of the elements, whose forces do no work on Phi. Started with velocity zero under a sin(w t + phase), a
train of inertia J has the mean velocity a cos(phase) / (w J), which only drag reduces. So it starts with angle and
velocity of the periodic solution r_p of the same equation with q = Phi r, so that its mean velocity is zero:

    r_p(t) = Im sum_j (-w_j^2 Phi^T J Phi + i w_j Phi^T D Phi)^-1 Phi^T (S_j + i C_j) exp(i w_j t)

for T = sum_j S_j sin w_j t + C_j cos w_j t. Elements with damping and no stiffness add to D, and their errors to T.
A train whose means do not balance has no periodic motion: its response is zero. Means that leave less than a thousandth
of their sum of moduli count as balanced, for they are often rounded. The sum is compiled (``kernels.rigid_response``),
for one driveline and for many.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.kernels._jit import compact
from gearrattle.engine.kernels.rigid_response import mark_accelerated, respond_rigidly
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.equilibrium import PositionAtRest, elastic_elements, statics_of
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.plain_arrays import coefficients_of, frame_of

Array = NDArray[np.float64]


@kept
def is_accelerated(system: PiecewiseSystem) -> NDArray[np.bool_]:
    """Return (n,) whether a body belongs to a free train whose means do not balance."""
    motion = relative_coordinates(system, elastic_elements(system)).angle_from_reference
    marked = np.empty(motion.shape[1], dtype=np.bool_)
    compact(mark_accelerated)(
        np.ascontiguousarray(system.inputs.mean, dtype=float), np.ascontiguousarray(motion), marked
    )
    return np.asarray((motion[:, marked] != 0.0).any(axis=1))


def rigid_response(system: PiecewiseSystem, rest: PositionAtRest) -> tuple[Array, Array]:
    """Return (n,) angles and (n,) velocities at t = 0; zero where a train accelerates under the means."""
    elastic = elastic_elements(system)
    sought = statics_of(elastic, relative_coordinates(system, elastic))
    frame = frame_of(system, relative_coordinates(system))
    angle = np.empty(system.size)
    velocity = np.empty(system.size)
    compact(respond_rigidly)(coefficients_of(system), frame, sought, rest.angle, angle, velocity)
    return angle, velocity
