"""Changes by the clock: auxiliaries that enter their next piece at instants known beforehand.

Example: a mesh whose stiffness alternates with the number of tooth pairs in contact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Clock:
    """The instants at which auxiliaries change their piece."""

    time: Array  # (n,) ascending, later than 0, up to the period included if they repeat [s]
    auxiliary: IntArray  # (n,) index of the auxiliary
    repeats: bool  # whether the instants repeat every period

    def ticks(self, first: int, end: int, period: float) -> tuple[Array, Array, IntArray]:
        """Ticks from number ``first`` on, up to ``end`` periods: whole periods, fractions of a period, auxiliaries."""
        part = self.time / period
        count = len(part) * (end + 1) if self.repeats else len(part)
        number = np.arange(min(first, count), count)
        which = number % max(len(part), 1)
        whole = np.floor(part[which])
        cycle = whole + (number // max(len(part), 1) if self.repeats else 0)
        keep = cycle <= end
        return cycle[keep], (part[which] - whole)[keep], self.auxiliary[which][keep]
