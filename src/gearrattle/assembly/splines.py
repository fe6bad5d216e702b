"""A record's points become a cubic spline: not-a-knot, so nothing is said about its ends that was not measured.

C. de Boor, A Practical Guide to Splines (1978), ch. IV: two polynomials meet with equal value, slope and curvature at
every point, and with equal third derivatives at the second and at the last but one.

Takes a ``Signal`` of a model; gives a channel that begins with the run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.channels import Channel
from gearrattle.model import Signal
from gearrattle.remember import kept

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Recorded:
    """A record as it is specified: its spline in its own time, or the integral of it, and a straight line beside it.

    Attributes
    ----------
    signal
        the record.
    is_rate
        whether the spline is the derivative of the input.
    offset
        added to the value at the start [SI].
    slope
        added to the first derivative [SI].
    """

    signal: Signal
    is_rate: bool = False
    offset: float = 0.0
    slope: float = 0.0

    @property
    def sizes(self) -> tuple[float, ...]:
        """Largest values: of a torque; of a motion's angle over the record, and of its speed."""
        spline, time = through(self.signal), self.signal.time
        largest = float(np.abs(self.signal.scale * self.signal.value).max())
        if self.is_rate:
            return (largest * float(time[-1] - time[0]), largest + abs(self.slope))
        rate = float(np.abs(self.signal.scale * spline(time, 1)).max())
        return (largest + abs(self.offset), rate + abs(self.slope))

    def at(self, time: Array, rest: Array | float = 0.0, derivative: int = 0) -> Array:
        """(t,) values, or a derivative, at times (t,) [s]."""
        spline, start = through(self.signal), self.signal.start
        time = time + rest
        if self.is_rate:
            value = spline.antiderivative()(start + time) - spline.antiderivative()(start) if not derivative else None
            value = spline(start + time, derivative - 1) if value is None else value
        else:
            value = spline(start + time, derivative)
        line = (self.offset + self.slope * time, self.slope, 0.0)[min(derivative, 2)]
        return np.asarray(self.signal.scale * value + line)

    def rounding(self, time: Array, derivative: int = 0) -> Array:  # noqa: ARG002
        """(t,) zeros: a record follows the time only."""
        return np.zeros(np.shape(time))


@kept
def through(signal: Signal) -> CubicSpline:
    """The spline through a record's points, before its scale, in the record's own time."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(signal.time, signal.value, bc_type="not-a-knot")


@kept
def spline(signal: Signal) -> Channel:
    """The signal over the time of the run: 0 is its ``start`` [s, SI]."""
    whole = Channel(signal.time, np.ascontiguousarray(through(signal).c[::-1].T) * signal.scale)
    return whole.between(signal.start, float(signal.time[-1]))


def mean(channel: Channel) -> float:
    """The mean over the whole channel [SI]."""
    total = channel.integral()
    length = float(channel.knots[-1] - channel.knots[0])
    return float(total.at(channel.knots[-1:])[0]) / length
