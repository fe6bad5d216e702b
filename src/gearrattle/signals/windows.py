"""Windows of a motion that are judged: whole periods, in samples and in exact time.

Two windows are in use. The *steady part* is [discard T, end]: what is left once the start-up has been discarded.
The *last cycles* are the final N periods of it, N = 8 for transmissibility and peak-to-peak values after the paper's
"span of eight cycles" (Padmanabhan et al. 1995, sec. 8); where fewer remain, all of them are taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.trajectory import Array, Trajectory
from gearrattle.wording import counted


@dataclass(frozen=True)
class Window:
    """A span of whole periods.

    Attributes
    ----------
    start, end
        times of its bounds, both included [s].
    cycles
        its length in periods T, at least 1.
    """

    start: float
    end: float
    first: int
    last: int
    cycles: int

    @property
    def duration(self) -> float:
        """Return end - start [s]."""
        return self.end - self.start

    def closed(self, signal: Array) -> Array:
        """Return the samples from start to end, both included: for integrals by the trapezoidal rule.

        Parameters
        ----------
        signal
            (Nt, ...) sampled on the trajectory's grid.
        """
        return signal[self.first : self.last + 1]

    def periodic(self, signal: Array) -> Array:
        """Return the samples from start to just before end: each phase of a period once, for Fourier sums.

        Parameters
        ----------
        signal
            (Nt, ...) sampled on the trajectory's grid.
        """
        return signal[self.first : self.last]

    def contains(self, time: Array) -> NDArray[np.bool_]:
        """Return the mask of the times [s] in the window, its bounds included."""
        return np.asarray((time >= self.start) & (time <= self.end), dtype=np.bool_)


def _tail(trajectory: Trajectory, cycles: int) -> Window:
    per_cycle = trajectory.samples_per_cycle
    last = trajectory.time.size - 1
    first = last - cycles * per_cycle
    after = trajectory.first_cycle + trajectory.cycles
    period = trajectory.layout.period
    # a crossing at the very end counts
    start = (after - cycles) * period
    end = max(trajectory.end, after * period)
    return Window(start=start, end=end, first=first, last=last, cycles=int(cycles))


def steady(trajectory: Trajectory) -> Window:
    """Return the steady part [discard T, end].

    Raises
    ------
    ModelError
        if nothing remains after the discarded cycles, or if the samples are not the stated whole cycles.
    """
    # cycles that are left to be judged
    remaining = trajectory.cycles - trajectory.discard
    if remaining < 1:
        raise ModelError(
            Problem(
                place="discard",
                value=f"{trajectory.discard} of {counted(trajectory.cycles, 'cycle')}",
                rule="at least one cycle must remain to be judged",
                remedy="simulate more cycles or discard fewer",
            )
        )
    # samples of whole periods
    expected = trajectory.cycles * trajectory.samples_per_cycle + 1
    if trajectory.time.size != expected:
        raise ModelError(
            Problem(
                place="trajectory.time",
                value=f"{counted(trajectory.time.size, 'sample')}",
                rule=f"{counted(trajectory.cycles, 'cycle')} of {trajectory.samples_per_cycle} samples and the end "
                f"make {expected}",
                remedy="judge a motion of whole periods",
            )
        )
    return _tail(trajectory, remaining)


def last_cycles(trajectory: Trajectory, count: int) -> Window:
    """Return the last ``count`` periods of the steady part, or all of it where it is shorter.

    Raises
    ------
    ModelError
        as ``steady``.
    """
    return _tail(trajectory, min(count, steady(trajectory).cycles))
