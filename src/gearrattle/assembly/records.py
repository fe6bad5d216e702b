"""Piecewise polynomials through the points of a record: a cubic spline, straight lines, or steps.

The spline is not-a-knot, which needs no assumption about slopes at its ends (C. de Boor, A Practical Guide to Splines,
1978, ch. IV): neighbouring polynomials have equal value, slope and curvature at every point, and equal third
derivatives at the second point and at the last but one. Through few points the spline can swing far beyond their
values; ``swings`` finds where.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.system.piecewise_channels import Channel
from gearrattle.model import Signal
from gearrattle.model.cylinder_pressure import periodic_spline

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

Array = NDArray[np.float64]
_ALLOWED = 0.05
"""Share of a record's span by which its spline may exceed the neighbouring points without a note."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A record as it is specified: its curve in its own time, or the integral of the curve, plus a straight line.

    Attributes
    ----------
    is_rate
        whether the curve is the derivative of the input.
    offset
        constant added to the values [SI].
    slope
        slope of the added straight line, from zero at t = 0 [SI].
    """

    signal: Signal
    is_rate: bool = False
    offset: float = 0.0
    slope: float = 0.0

    @property
    def sizes(self) -> tuple[float, ...]:
        """Largest values: of a torque; or of the angle of a motion over the record, and of its speed."""
        curve = curve_of(self.signal)
        time = self.signal.time
        largest = float(np.abs(self.signal.scale * self.signal.value).max())
        if self.is_rate:
            return (largest * float(time[-1] - time[0]), largest + abs(self.slope))
        rate = float(np.abs(self.signal.scale * curve(time, 1)).max())
        return (largest + abs(self.offset), rate + abs(self.slope))

    def at(self, time: Array, rest: Array | float = 0.0, derivative: int = 0) -> Array:
        """(t,) values, or a derivative, at times ``time + rest`` (t,) [s]."""
        curve = curve_of(self.signal)
        start = self.signal.start
        time = time + rest
        if self.is_rate:
            value = curve.antiderivative()(start + time) - curve.antiderivative()(start) if not derivative else None
            value = curve(start + time, derivative - 1) if value is None else value
        else:
            value = curve(start + time, derivative)
        line = (self.offset + self.slope * time, self.slope, 0.0)[min(derivative, 2)]
        return np.asarray(self.signal.scale * value + line)

    def rounding(self, time: Array, derivative: int = 0) -> Array:  # noqa: ARG002
        """(t,) zeros: a record depends on time only, so rounding of the angle has no effect."""
        return np.zeros(np.shape(time))


@kept
def curve_of(signal: Signal) -> PPoly:
    """The curve through a record's points, without its scale, in the record's own time; its last piece extends on."""
    from scipy.interpolate import CubicSpline, PPoly

    time = signal.time
    value = signal.value
    if signal.interpolation == "step":
        return PPoly(value[None], np.append(time, np.inf))
    if signal.interpolation == "linear":
        length = np.diff(time)
        proper = length > 0.0  # an interval of length zero is a jump
        slope = np.diff(value)[proper] / length[proper]
        knots = np.append(time[:-1][proper], time[-1])
        lines = np.stack([slope, value[:-1][proper]])
        if signal.is_held:
            lines = np.column_stack([lines, [0.0, value[-1]]])
            knots = np.append(knots, np.inf)
        return PPoly(lines, knots)
    return CubicSpline(time, value, bc_type="not-a-knot")


def channel_of(signal: Signal, end: float = 0.0) -> Channel:
    """The signal over the time of the run [s, SI], which is 0 at the ``start`` of the record.

    A held last value extends to the ``end`` of the run [s]; all other records end at their last point.
    """
    curve = curve_of(signal)
    last = float(signal.time[-1])
    if signal.is_held:
        last = max(last, signal.start + end)
    return Channel(curve.x, np.ascontiguousarray(curve.c[::-1].T) * signal.scale).between(signal.start, last)


def mean(signal: Signal) -> float:
    """The mean from the start of the run to the last point [SI]; the last value if all steps are before the start."""
    if signal.start >= signal.time[-1]:
        return float(signal.scale * signal.value[-1])
    total = channel_of(signal).integral()
    length = total.knots[-1]
    return float(total.at(np.array([length]))[0] / length)


class Swing(NamedTuple):
    """Largest swing of a spline above or below its two neighbouring points: its time in the record [s] (or crank angle
    [rad]), its value, and the value of the nearer neighbour [SI].
    """

    time: float
    value: float
    neighbour: float


@kept
def swings(signal: Signal) -> tuple[Swing, ...]:
    """Find the largest swings above and below the neighbouring points, if larger than 5 % of the record's span."""
    if signal.interpolation != "cubic":
        return ()
    curve = curve_of(signal) if signal.key == "time" else periodic_spline(signal)
    # extrema: zeros of the slope inside every piece; NaN for pieces without one
    cubic, square, slope, left = signal.scale * curve.c
    right = np.append(left[1:], signal.scale * curve(curve.x[-1]))
    length = np.diff(curve.x)
    with np.errstate(all="ignore"):
        root = np.sqrt(square**2 - 3.0 * cubic * slope)
        larger = -(square + np.copysign(root, square))
        since = np.stack([larger / (3.0 * cubic), slope / larger])
    since = np.where((since > 0.0) & (since < length), since, 0.0)
    value = ((cubic * since + square) * since + slope) * since + left
    # distance of the extrema above and below both neighbours
    low = np.minimum(left, right)
    high = np.maximum(left, right)
    most = _ALLOWED * float(high.max() - low.min())
    leaving = []
    for beyond, neighbour in ((value - high, high), (low - value, low)):
        i, j = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
        if beyond[i, j] > most:
            leaving.append(Swing(float(curve.x[j] + since[i, j]), float(value[i, j]), float(neighbour[j])))
    return tuple(leaving)
