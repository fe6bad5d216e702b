"""Inputs that are no harmonics: piecewise polynomials of time, such as splines through measured points and run-ups.

    T(t) += A p(t),    e(t) += B p(t),    p_c(t) = sum_j a_gcj (t - t_g)^j   for t_g <= t < t_(g+1)

Inside an interval p and its derivatives are states, p^(D + 1) = 0, so the exact engine moves under them exactly;
an interval's end is an instant known beforehand. Time is counted from the start of the run.

The states of a channel are q_j = T^j p^(j) / w^j, j = 0 ... D, with a pace w such that they are of comparable size;
then dq_j/ds = w q_(j+1) in periods s. They are called a *chain*.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import factorial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDED = 4.0
"""Largest difference of equal times, in roundings."""
INNER, INNER_WEIGHTS = (np.polynomial.legendre.leggauss(3) + np.array([[1.0], [0.0]])) * 0.5
"""Gauss-Legendre points of an interval, and their weights, as parts of it."""
_POINTS = 4  # points of an interval at which derivatives are evaluated to bound them
_SHORTEST = 1e-3  # least product of interval and pace in these bounds


class Specified(Protocol):
    """One input as it is specified."""

    @property
    def sizes(self) -> tuple[float, ...]:
        """Sizes by which errors of the value, and of as many derivatives as count, are measured [SI]."""
        ...

    def at(self, time: Array, rest: Array | float = 0.0, derivative: int = 0) -> Array:
        """(t,) values, or a derivative, at times (t,) [s]; ``rest`` is what rounding took from them."""
        ...

    def rounding(self, time: Array, derivative: int = 0) -> Array:
        """(t,) uncertainty of a value, or a derivative, that comes of other roundings than that of the time [SI]."""
        ...


@dataclass(frozen=True)
class Signals:
    """Piecewise polynomials; G intervals, C channels, degree D."""

    knots: Array  # (G + 1,) ascending times [s] from 0 to no less than the end of the run
    coefficients: Array  # (G, C, D + 1) a, of ascending powers of the time since its start [SI]
    torque: Array  # (n, C) A, torque on every inertia for a unit of every channel
    # (m, C) B, e of every element for a unit of every channel; its channels must be continuous, and so must be their
    # first derivatives
    error: Array
    specified: tuple[Specified, ...] = field(default=(), compare=False)  # (C,) what the polynomials stand for
    # (G, C, 3) the specified inputs at the points ``INNER`` of every interval, of channels with an error their first
    # derivatives; empty until the polynomials have been compared with them [SI]
    reference: Array = field(default_factory=lambda: np.zeros((0, 0, 3)), compare=False)

    @property
    def channels(self) -> int:
        """Number of channels C."""
        return int(self.coefficients.shape[1])

    @property
    def degree(self) -> int:
        """Degree D of the polynomials."""
        return int(self.coefficients.shape[2]) - 1

    def at(self, time: Array, derivative: int = 0) -> Array:
        """(t, C) value, or a derivative, of every channel at times (t,) [s]; at a jump the value after it."""
        interval = interval_of(np.asarray(time), self.knots)
        since = (np.asarray(time) - self.knots[interval])[:, None]
        out = np.zeros((len(interval), self.channels))
        for j in range(self.degree, derivative - 1, -1):
            falling = float(np.prod(np.arange(j - derivative + 1, j + 1)))
            out = out * since + falling * self.coefficients[interval, :, j]
        return out

    @property
    def chain(self) -> int:
        """Length of all chains together, C (D + 1)."""
        return self.channels * (self.degree + 1)

    def pace(self, period: float) -> float:
        """The pace w, a power of two: degree over the longest interval in periods, about."""
        turning = max(1.0, 0.25 * self.degree)
        return float(2.0 ** np.floor(np.log2(turning * period / float(np.diff(self.knots).max()))))

    def chains(self, period: float) -> Array:
        """(G, chain) the chains at the start of every interval, channel by channel [SI]."""
        order = np.arange(self.degree + 1)
        unit = (period / self.pace(period)) ** order * np.array([float(factorial(int(j))) for j in order])
        return np.asarray((self.coefficients * unit).reshape(len(self.coefficients), self.chain))

    def fourth(self, period: float) -> Array:
        """(G, chain) bounds on the moduli of the chains' fourth derivatives, per period^4, all through every interval.

        With s = w times an interval's length, r_j = s^j q_j have sup |r_j| <= max |r_j(x_i)| + d sup |r_(j+1)|; none of
        the interval is farther than a part d of it from one of the points x_i.
        """
        links = self.degree + 1
        order = 4
        pace = self.pace(period)
        bounds = np.zeros((len(self.coefficients), self.channels, links))
        if links > order:
            length = np.maximum(pace * np.diff(self.knots) / period, _SHORTEST)[:, None, None]
            units = length ** np.arange(links)
            values = (self.chains(period).reshape(bounds.shape) * units) @ _taylor(links, order)
            largest = np.abs(values.reshape(*bounds.shape[:2], _POINTS, links - order)).max(axis=2)
            for j in range(links - order - 2, -1, -1):
                largest[..., j] += largest[..., j + 1] / (2 * _POINTS)
            bounds[..., : links - order] = pace**order * largest / units[..., order:]
        return bounds.reshape(len(bounds), self.chain)


def interval_of(time: Array, knots: Array) -> NDArray[np.int64]:
    """(t,) indices of the intervals in which times lie; one within four roundings of a knot belongs behind it."""
    begun = np.searchsorted(knots - ROUNDED * np.spacing(knots), time, side="right") - 1
    return np.asarray(np.clip(begun, 0, len(knots) - 2))


def _taylor(links: int, order: int) -> Array:
    """(k, i j) r_(order + j) at the middle of every part i of an interval, as a sum of r_k at its start."""
    out = np.zeros((links, _POINTS, links - order))
    for i in range(_POINTS):
        for j in range(links - order):
            for k in range(order + j, links):
                out[k, i, j] = ((i + 0.5) / _POINTS) ** (k - order - j) / factorial(k - order - j)
    return out.reshape(links, -1)
