"""Changes by the clock: auxiliaries that enter the piece above their own at times known beforehand.

So a mesh whose stiffness alternates with the number of tooth pairs in contact: its regions change by time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Clock:
    """When auxiliaries change."""

    time: Array  # (n,) ascending, later than 0, up to the period included if they repeat [s]
    auxiliary: IntArray  # (n,) which
    repeats: bool  # whether all comes again every period

    def ticks(self, first: int, end: int, period: float) -> tuple[Array, Array, IntArray]:
        """Ticks from number ``first`` on, up to the end of so many periods: whole periods, the rest, auxiliaries."""
        part = self.time / period
        count = len(part) * (end + 1) if self.repeats else len(part)
        number = np.arange(min(first, count), count)
        which = number % max(len(part), 1)
        whole = np.floor(part[which])
        cycle = whole + (number // max(len(part), 1) if self.repeats else 0)
        keep = cycle <= end
        return cycle[keep], (part[which] - whole)[keep], self.auxiliary[which][keep]
