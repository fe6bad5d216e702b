"""The angle of a shaft whose speed changes at a constant rate, in turns, without loss of digits.

    phi(t) = Omega_0 t + (Omega_1 - Omega_0) t^2 / (2 tau)                    for t <= tau
    phi(t) = (Omega_0 + Omega_1) tau / 2 + Omega_1 (t - tau)                  afterwards

After some seconds a tooth mesh has turned through tens of thousands of radians, and a double resolves such an angle to
1e-11 only. Only the fraction of a turn matters, so n phi / (2 pi) is computed in whole numbers of 2^-b turns, and the
whole turns are removed before anything is rounded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PER_RADIAN = Fraction(159154943091895335768883763372514362034459645740456448747667344058896797634, 10**75)
"""1 / (2 pi), 75 digits."""
_RATE = 220  # bits behind the binary point of a rate of turning
_CLOCK = 90  # bits behind the binary point of a time in seconds
_KEPT = 62  # bits of a fraction of a turn from which the double is rounded
_MULTIPLE = 512  # largest multiple of the lowest order that is not computed by itself: its error is 512 times 2^-64


@dataclass(frozen=True)
class Ramp:
    """A speed that changes at a constant rate, then stays constant."""

    begin: float  # speed at t = 0 [rad/s]
    end: float  # final speed [rad/s]
    over: float  # time in which the speed changes [s]

    @property
    def rate(self) -> float:
        """Acceleration while it changes [rad/s^2]."""
        return (self.end - self.begin) / self.over

    def speed(self, time: Array) -> Array:
        """(t,) speeds at times (t,) [rad/s, s]."""
        share = np.minimum(np.asarray(time) / self.over, 1.0)
        return np.asarray(self.begin * (1.0 - share) + self.end * share)

    def time(self, speed: float) -> float:
        """Time [s] at which a speed between begin and end is reached."""
        return self.over * (speed - self.begin) / (self.end - self.begin)

    def turns(self, orders: Sequence[float], time: Array) -> Array:
        """(H, t) fractions of a turn of ``orders`` times the angle at times (t,) [s].

        Every fraction is rounded once, to a double. Before that, a multiple of the lowest order has an error below
        2^-55 of a turn.
        """
        ticks = [(top << _CLOCK) // bottom for top, bottom in map(float.as_integer_ratio, np.asarray(time).tolist())]
        out = np.empty((len(orders), len(ticks)))
        lowest = min((o for o in orders if o > 0.0), default=0.0)
        base = self._turned(lowest, ticks) if lowest else np.zeros(len(ticks), np.uint64)
        for h, order in enumerate(orders):
            ratio = Fraction(order) / Fraction(lowest) if lowest else Fraction(0)
            if ratio.denominator == 1 and ratio <= _MULTIPLE:
                turned = base * np.uint64(ratio)  # whole turns overflow, and so are removed
            else:
                turned = self._turned(order, ticks)
            out[h] = (turned >> np.uint64(64 - _KEPT)).astype(np.float64) / (1 << _KEPT)
        return out

    def _turned(self, order: float, ticks: Sequence[int]) -> NDArray[np.uint64]:
        """(t,) fractions of a turn of ``order`` times the angle, in units of 2^-64."""
        over = _whole(Fraction(self.over), _CLOCK)
        cut = _RATE + 2 * _CLOCK
        mask = (1 << cut) - 1
        shift = cut - 64  # of a whole turn to 2^64
        slope, bend, final, intercept = self._rates(order)
        turned = ((slope + bend * tick) * tick if tick <= over else final * tick + intercept for tick in ticks)
        return np.array([(word & mask) >> shift for word in turned], dtype=np.uint64)

    def _rates(self, order: float) -> tuple[int, int, int, int]:
        """Coefficients of phi in turns: of t and t^2 while the speed changes; of t, and the constant, afterwards."""
        begin, end, over = (Fraction(x) for x in (self.begin, self.end, self.over))
        factor = Fraction(order) * PER_RADIAN
        return (
            _whole(factor * begin, _RATE + _CLOCK),
            _whole(factor * (end - begin) / (2 * over), _RATE),
            _whole(factor * end, _RATE + _CLOCK),
            _whole(factor * (begin - end) * over / 2, _RATE + 2 * _CLOCK),
        )


def _whole(value: Fraction, bits: int) -> int:
    """The value in units of 2^-bits."""
    return (value.numerator << bits) // value.denominator
