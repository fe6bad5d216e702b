"""The angle of a shaft whose speed changes steadily, in turns, without losing digits.

    phi(t) = Omega_0 t + (Omega_1 - Omega_0) t^2 / (2 tau)                    for t <= tau
    phi(t) = (Omega_0 + Omega_1) tau / 2 + Omega_1 (t - tau)                  afterwards

After some seconds a tooth mesh has turned through tens of thousands of radians, and a double holds such an angle to
1e-11 only. Only its fraction of a turn matters, so n phi / (2 pi) is worked out in whole numbers, and the whole turns
fall away before anything is rounded.
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
_RATE = 220
_CLOCK = 90
_KEPT = 62
_MULTIPLE = 512


@dataclass(frozen=True)
class Ramp:
    """A speed that changes steadily, then stays."""

    # begin, end: speeds [rad/s]
    begin: float
    end: float
    over: float  # how long it changes [s]

    @property
    def rate(self) -> float:
        """Acceleration while it changes [rad/s^2]."""
        return (self.end - self.begin) / self.over

    def speed(self, time: Array) -> Array:
        """(t,) speeds at times (t,) [rad/s, s]."""
        share = np.minimum(np.asarray(time) / self.over, 1.0)
        return np.asarray(self.begin * (1.0 - share) + self.end * share)

    def time(self, speed: float) -> float:
        """When a speed within the ramp is reached [s]."""
        return self.over * (speed - self.begin) / (self.end - self.begin)

    def turns(self, orders: Sequence[float], time: Array) -> Array:
        """(H, t) fractions of a turn that ``orders`` times the angle have made at times (t,) [s].

        Rounded once, and of a multiple of the lowest order by less than 2^-55 besides.
        """
        ticks = [(top << _CLOCK) // bottom for top, bottom in map(float.as_integer_ratio, np.asarray(time).tolist())]
        out = np.empty((len(orders), len(ticks)))
        lowest = min((o for o in orders if o > 0.0), default=0.0)
        base = self._turned(lowest, ticks) if lowest else np.zeros(len(ticks), np.uint64)
        for h, order in enumerate(orders):
            times = Fraction(order) / Fraction(lowest) if lowest else Fraction(0)
            if times.denominator == 1 and times <= _MULTIPLE:
                turned = base * np.uint64(times)  # whole turns fall away by themselves
            else:
                turned = self._turned(order, ticks)
            out[h] = (turned >> np.uint64(64 - _KEPT)).astype(np.float64) / (1 << _KEPT)
        return out

    def _turned(self, order: float, ticks: Sequence[int]) -> NDArray[np.uint64]:
        """(t,) fractions of a turn in units of 2^-64."""
        over = _whole(Fraction(self.over), _CLOCK)
        cut = _RATE + 2 * _CLOCK
        mask = (1 << cut) - 1
        kept = cut - 64
        slope, bend, final, at_end = self._rates(order)
        turned = ((slope + bend * tick) * tick if tick <= over else final * tick + at_end for tick in ticks)
        return np.array([(word & mask) >> kept for word in turned], dtype=np.uint64)

    def _rates(self, order: float) -> tuple[int, int, int, int]:
        """Turns per tick and tick squared while the speed changes; per tick, and to begin with, afterwards."""
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
