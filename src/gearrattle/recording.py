"""A recording: named channels over one time axis, measured on a rig or taken from a simulated motion.

Metrics, spectra and validation read a *quantity* of a *subject*, such as the velocity of the flywheel, in the same way
from both sources. The quantities, in SI:

    angle [rad], velocity [rad/s], acceleration [rad/s^2]       of an inertia
    deflection [rad or m], force [N m or N], torque [N m]       of an element; torque also on an inertia
    surface acceleration [m/s^2], sound pressure [Pa]           at a point outside the driveline
    speed [rad/s], shaft angle [rad], pulses [1]                of the reference shaft: mean rotation included
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

QUANTITIES = (
    "angle",
    "velocity",
    "acceleration",
    "deflection",
    "force",
    "torque",
    "surface acceleration",
    "sound pressure",
    "speed",
    "shaft angle",
    "pulses",
)
"""Quantities of a channel."""

_UNEVEN = 1e-6  # share of a sample interval: steps that differ by more are not uniform, unless times are rounded
_COARSEST = 0.05  # share of a sample interval: largest unit of the last digit that still shows uniform sampling
_MOST_DECIMALS = 22
_PIECE = 250_000  # times that are processed together, so that temporary arrays are small against a long record


@dataclass(frozen=True, eq=False)
class Channel:
    """One signal.

    Attributes
    ----------
    name
        name of the channel; unique in its recording.
    quantity
        one of ``QUANTITIES``; empty if the file does not state it.
    subject
        the inertia, element or point that was measured; empty if the recording does not state it.
    unit
        SI unit of the values, "1" for pure numbers; the unit in the file if the quantity is empty.
    values
        (N,).

    Examples
    --------
    >>> channel = gr.measured.Channel("n", "speed", "flywheel", "rad/s", np.array([83.8, 84.0, 83.7]))
    >>> channel.unit
    'rad/s'
    """

    name: str
    quantity: str
    subject: str
    unit: str
    values: Array


@dataclass(frozen=True, eq=False)
class Recording:
    """Channels over one time axis.

    Attributes
    ----------
    time
        (N,) strictly ascending [s].
    channels
        in the order of their source.
    source
        source of the recording in words: the name of a file, an algorithm.
    notes
        what the user must know about the recording.

    Raises
    ------
    ModelError
        two channels have one name.

    Examples
    --------
    >>> channel = gr.measured.Channel("n", "speed", "flywheel", "rad/s", np.array([83.8, 84.0, 83.7]))
    >>> record = gr.measured.Recording(np.array([0.0, 0.01, 0.02]), (channel,), "rig")
    >>> float(record["n"].values.max())
    84.0
    """

    time: Array
    channels: tuple[Channel, ...]
    source: str
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse two channels with the same name."""
        first: dict[str, int] = {}
        for number, name in enumerate(self.names):
            if (before := first.setdefault(name, number)) < number:
                rule = f"channels {before + 1} and {number + 1} have this name, so it does not tell which one is meant"
                raise ModelError(Problem(self.source, name, rule, "rename one of them"))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(channel.name for channel in self.channels)

    @property
    def interval(self) -> float | None:
        """Sample interval [s]; None if the samples are not uniform, or fewer than two.

        Times are uniform if all their steps agree within 1e-6 of the interval, or if they differ from a uniform grid by
        no more than the rounding of their last written digit. One unit of this digit may be at most 1/20 of the
        interval.
        """
        if self.time.size < 2:
            return None
        mean = float(self.time[-1] - self.time[0]) / (self.time.size - 1)
        return mean if are_even(self.time, mean) or _is_rounded(self.time, mean) else None

    def __getitem__(self, name: str) -> Channel:
        """Return a channel by its name."""
        known = self._known(name)
        return next(channel for channel in self.channels if channel.name == known)

    def find(self, quantity: str, subject: str = "") -> Channel | None:
        """Return the first channel with a quantity and, unless ``subject`` is empty, a subject; None if none has."""
        for channel in self.channels:
            if channel.quantity == quantity and subject in ("", channel.subject):
                return channel
        return None

    def to_dataset(self) -> xr.Dataset:
        """Return the channels as variables over time, with units, quantities and subjects as their attributes."""
        import xarray as xr

        variables = {
            c.name: ("time", c.values, {"units": c.unit, "quantity": c.quantity, "subject": c.subject})
            for c in self.channels
        }
        attributes = {"source": self.source, "notes": "\n".join(self.notes)}
        return xr.Dataset(variables, {"time": ("time", self.time, {"units": "s"})}, attributes)

    def with_(self, **changes: object) -> Recording:
        """Return a recording with some attributes changed.

        Examples
        --------
        >>> channel = gr.measured.Channel("n", "speed", "flywheel", "rad/s", np.array([83.8, 84.0, 83.7]))
        >>> record = gr.measured.Recording(np.array([0.0, 0.01, 0.02]), (channel,), "rig")
        >>> float(record.with_(time=record.time + 1.0).time[0])
        1.0
        """
        return replace(self, **changes)  # type: ignore[arg-type]

    def _known(self, name: str) -> str:
        """Return the name of a channel that exists; ModelError for another name."""
        if name in self.names:
            return name
        remedy = f"the channels are {', '.join(self.names)}"
        raise ModelError(Problem(self.source, name, "is no channel of the recording", remedy))


def are_even(time: Array, interval: float) -> bool:
    """Return whether all steps of times [s] equal the interval within 1e-6 of it."""
    return all(
        bool(np.all(np.abs(np.diff(time[begin : begin + _PIECE + 1]) - interval) <= _UNEVEN * interval))
        for begin in range(0, time.size - 1, _PIECE)
    )


def _is_rounded(time: Array, interval: float) -> bool:
    """Return whether times are a uniform grid, every time rounded to its last written digit.

    Let q be one unit of the last digit, and s = (t_k - t_0) / (t_n - t_0). From the grid through the first and the last
    time, t_k then differs by at most q_k/2 + (1 - s) q_0/2 + s q_n/2.
    """
    worth = _Digits(time)
    ends = worth.of(time[[0, -1]])
    begins, lasts = (unit if unit <= _COARSEST * interval else 0.0 for unit in ends)
    for first in range(0, time.size, _PIECE):
        part = time[first : first + _PIECE]
        unit = worth.of(part)
        unit = np.where(unit <= _COARSEST * interval, unit, 0.0)
        share = (part - time[0]) / (time[-1] - time[0])
        grid = time[0] + interval * np.arange(first, first + part.size)
        bound = 0.5 * (unit + (1.0 - share) * begins + share * lasts) + _UNEVEN * interval
        if not np.all(np.abs(part - grid) <= bound):
            return False
    return True


class _Digits:
    """Upper bound of one unit of the last written digit, for every time [s].

    In one decade, the bound follows from the fewest decimals that represent all its times. A column of a file has the
    same number of decimals in all decades, or the same number of digits; then every decade has one decimal less than
    the decade below. So the bounds of neighbouring decades limit each other.
    """

    def __init__(self, time: Array) -> None:
        parts = [slice(first, first + _PIECE) for first in range(0, time.size, _PIECE)]
        sizes = (np.abs(time[part]) for part in parts)
        self._smallest = min(float(size[size > 0.0].min(initial=1.0)) for size in sizes)
        decimals: dict[int, int] = {}
        for part in parts:
            size = np.abs(time[part])
            decades = self._decades(size)
            for decade in np.unique(decades).tolist():
                decimals[decade] = _decimals(size[decades == decade], decimals.get(decade, 0))
        self._known = np.array(sorted(decimals))
        worth = np.array([10.0 ** -decimals[decade] for decade in self._known.tolist()])
        worth = np.minimum.accumulate(worth[::-1])[::-1]
        step = 10.0**self._known
        self._worth = np.minimum.accumulate(worth / step) * step

    def _decades(self, size: Array) -> NDArray[np.int64]:
        """Return the decades of numbers; zero has the decade of the smallest number above zero."""
        return np.floor(np.log10(np.maximum(size, self._smallest))).astype(np.int64)

    def of(self, time: Array) -> Array:
        """Return the bound for some of the times."""
        at = np.searchsorted(self._known, self._decades(np.abs(time)))
        return np.asarray(self._worth[at], dtype=np.float64)


def _decimals(numbers: Array, least: int) -> int:
    """The fewest decimals, at least ``least``, that represent numbers up to the rounding of a double."""
    for decimals in range(least, _MOST_DECIMALS):
        scaled = numbers * 10.0**decimals
        if np.all(np.abs(scaled - np.rint(scaled)) <= 4.0 * np.finfo(np.float64).eps * scaled):
            return decimals
    return _MOST_DECIMALS
