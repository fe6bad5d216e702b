"""Moments and extremes of signals, sums over the contacts in a log, time on each side of a gap.

All of it adds up over consecutive pieces of a motion, to rounding, so it can be gathered in chunks (``chunks``);
means are by the trapezoidal rule.

Takes samples and Trajectories; gives frozen sums to metrics.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals.impacts import find_impacts
from gearrattle.signals.levels import extremes_missed
from gearrattle.signals.regions import centre, region_shares
from gearrattle.signals.windows import steady
from gearrattle.trajectory import Array, Trajectory


@dataclass(frozen=True)
class Summary:
    """Mean, central moments and extremes of a signal.

    Attributes:
        mean: <x>.
        second, fourth: <(x - <x>)^2>, <(x - <x>)^4>.
        low, high: smallest and largest sample.
        miss: by how much low and high may be passed between two samples; 0 where they are exact.
        column: which of the gathered signals it is; -1 for one that was summarised whole.
    """

    mean: float
    second: float
    fourth: float
    low: float
    high: float
    miss: float = 0.0
    column: int = -1

    @property
    def peak(self) -> float:
        """max |x|."""
        return max(self.high, -self.low)

    @property
    def swing(self) -> float:
        """max x - min x."""
        return self.high - self.low

    @property
    def reach(self) -> float:
        """max |x - <x>|."""
        return max(self.high - self.mean, self.mean - self.low)

    @property
    def spread(self) -> float:
        """Standard deviation."""
        return math.sqrt(max(self.second, 0.0))

    @property
    def rms(self) -> float:
        """Root mean square, the mean included."""
        return math.sqrt(max(self.second, 0.0) + self.mean**2)


def summary_of(samples: Array) -> Summary:
    """Return the summary of samples (N + 1,)."""
    scale = samples.size - 1
    mean = float(np.trapezoid(samples)) / scale
    square = (samples - mean) ** 2
    second, fourth = (float(np.trapezoid(each)) / scale for each in (square, square**2))
    return Summary(
        mean, second, fourth, float(samples.min()), float(samples.max()), float(np.max(extremes_missed(samples)))
    )


@dataclass(frozen=True)
class Contacts:
    """What the contacts of one clearance that begin in the window add up to.

    Attributes:
        whole: how many begin and end.
        speeds: sum of |v| + |v'| [rad/s or m/s]; v' of one that does not end is 0.
        squares: sum of v^2 - v'^2 of those that end [the same squared].
        kept: sum of |v'| / |v| of those with v other than zero.
        moving: how many these are.
        time: of all contacts, the one cut short included [s].
        cut: whether the motion ends within one.
    """

    whole: int = 0
    speeds: float = 0.0
    squares: float = 0.0
    kept: float = 0.0
    moving: int = 0
    time: float = 0.0
    cut: bool = False

    def plus(self, other: Contacts) -> Contacts:
        """Return the sums of both; whether the last one is cut short the other says."""
        return Contacts(
            self.whole + other.whole, self.speeds + other.speeds, self.squares + other.squares, self.kept + other.kept,
            self.moving + other.moving, self.time + other.time, other.cut,
        )  # fmt: skip


def added(velocity: Array, departure: Array, duration: Array, censored: NDArray[np.bool_]) -> Contacts:
    """Return what contacts (I,) add up to."""
    whole = ~censored
    arrival, left = np.abs(velocity[whole]), np.abs(departure[whole])
    moving = arrival > 0.0
    speeds = float(np.sum(arrival + left)) + float(np.sum(np.abs(velocity[censored])))
    return Contacts(
        int(whole.sum()), speeds, float(np.sum(arrival**2 - left**2)),
        float(np.sum(left[moving] / arrival[moving])), int(moving.sum()), float(np.sum(duration)), bool(censored.any()),
    )  # fmt: skip


def contacts_of(motion: Trajectory, clearance: int) -> Contacts:
    """Return what the contacts of a clearance add up to over the steady part of a motion."""
    found = find_impacts(motion).of(clearance).within(steady(motion))
    return added(found.velocity, found.departure, found.duration, found.censored)


@dataclass(frozen=True)
class Sides:
    """Where a clearance spends its time, and how its impacts change flanks.

    Attributes:
        shares: of the time by region.
        single, double: impacts that follow a contact on the same flank, and on the other one.
    """

    shares: dict[int, float]
    single: int
    double: int


def sides_of(motion: Trajectory, clearance: int) -> Sides:
    """Return that of the steady part of a motion.

    The first impact of all follows the side the motion begins on; from within the gap it counts as single-sided.
    """
    window, found = steady(motion), find_impacts(motion).of(clearance)
    drive = found.drive
    before = flank_before(drive, int(motion.initial_region[clearance]), centre(motion.layout, clearance))
    inside = window.contains(found.time)
    same, other = int(np.sum(inside & (drive == before))), int(np.sum(inside & (drive != before)))
    return Sides(region_shares(motion, clearance, window), same, other)


def flank_before(drive: NDArray[np.bool_], begun: int, inner: frozenset[int]) -> NDArray[np.bool_]:
    """(I,) whether the contact before each impact was on the drive side.

    Args:
        drive: (I,) whether each impact is.
        begun: region before the first one.
        inner: regions of the centre.
    """
    first = drive[:1].tolist() if begun in inner else [begun > max(inner)]
    return np.array([*first, *drive[:-1].tolist()], dtype=np.bool_)[: drive.size]
