"""A record's points become a cubic spline: not-a-knot, so nothing is said about its ends that was not measured.

C. de Boor, A Practical Guide to Splines (1978), ch. IV: two polynomials meet with equal value, slope and curvature at
every point, and with equal third derivatives at the second and at the last but one.

Takes a ``Signal`` of a model; gives a channel that begins with the run.
"""

from __future__ import annotations

import numpy as np

from gearrattle.model import Signal
from gearrattle.remember import remembered
from gearrattle.system.channels import Channel


@remembered(8)
def spline(signal: Signal) -> Channel:
    """The signal over the time of the run: 0 is its ``start`` [s, SI]."""
    from scipy.interpolate import CubicSpline

    found = CubicSpline(signal.time, signal.value, bc_type="not-a-knot")
    whole = Channel(signal.time, np.ascontiguousarray(found.c[::-1].T) * signal.scale)
    return whole.between(signal.start, float(signal.time[-1]))


def mean(channel: Channel) -> float:
    """The mean over the whole channel [SI]."""
    total = channel.integral()
    length = float(channel.knots[-1] - channel.knots[0])
    return float(total.at(channel.knots[-1:])[0]) / length
