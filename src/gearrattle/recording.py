"""A recording: named channels over one time axis, measured on a rig or taken from a simulated motion.

Metrics, spectra and validation ask for a *quantity* of a *subject*, such as the velocity of the flywheel, and need not
know its source. The quantities, in SI:

    angle [rad], velocity [rad/s], acceleration [rad/s^2]       of an inertia
    deflection [rad or m], force [N m or N], torque [N m]       of an element; torque also on an inertia
    surface acceleration [m/s^2], sound pressure [Pa]           of a place outside the driveline
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
"""What a channel may hold."""

_UNEVEN = 1e-6  # of a sample interval: steps that differ by more are no uniform sampling, unless times are rounded
_COARSEST = 0.05  # of a sample interval: a last digit worth more says too little about the sampling
_MOST_DECIMALS = 22
_PIECE = 250_000  # times that are looked at together: what is made of them is small against a long record


@dataclass(frozen=True, eq=False)
class Channel:
    """One signal.

    Attributes
    ----------
    name
        what it is called; unique in its recording.
    quantity
        one of ``QUANTITIES``; empty where a file does not say it.
    subject
        the inertia, element or place it is about; empty where the recording does not say.
    unit
        SI unit of the values, "1" for pure numbers; the file's where the quantity is empty.
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
        where it came from, in words: a file's name, an algorithm.
    notes
        what the user must know about it.

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
        """Refuse two channels of one name."""
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
        """Sample interval [s]; None where the samples are not uniform, or fewer than two.

        Times are uniform if their steps are alike within 1e-6, or if they are off a uniform grid by no more than the
        rounding of the last digit that they are written with, which may be a twentieth of the interval at most.
        """
        if self.time.size < 2:
            return None
        mean = float(self.time[-1] - self.time[0]) / (self.time.size - 1)
        return mean if are_even(self.time, mean) or _is_rounded(self.time, mean) else None

    def __getitem__(self, name: str) -> Channel:
        """Return the channel of a name."""
        known = self._known(name)
        return next(channel for channel in self.channels if channel.name == known)

    def find(self, quantity: str, subject: str = "") -> Channel | None:
        """Return the first channel of a quantity and, unless that is empty, of a subject; None if there is none."""
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
        """Return a name that is there, or refuse."""
        if name in self.names:
            return name
        remedy = f"the channels are {', '.join(self.names)}"
        raise ModelError(Problem(self.source, name, "is no channel of the recording", remedy))


def are_even(time: Array, interval: float) -> bool:
    """Tell whether the steps of times [s] are alike: each is the interval, within 1e-6 of it."""
    return all(
        bool(np.all(np.abs(np.diff(time[begin : begin + _PIECE + 1]) - interval) <= _UNEVEN * interval))
        for begin in range(0, time.size - 1, _PIECE)
    )


def _is_rounded(time: Array, interval: float) -> bool:
    """Tell whether times are those of a uniform grid, each rounded to the last digit that it is written with.

    With the grid through the first and the last time, t_k is off by at most q_k/2 + (1 - s) q_0/2 + s q_n/2: a unit of
    the last digit is worth q, and s = (t_k - t_0) / (t_n - t_0).
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
    """What a unit of the last digit of every time is worth [s], at most.

    The fewest decimals that write all times of a decade bound it. A column has as many decimals everywhere, or as many
    digits, so that a decade has one decimal less than the one below: neighbouring decades bound each other.
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
        """Return the decades of numbers above zero; zero has that of the smallest."""
        return np.floor(np.log10(np.maximum(size, self._smallest))).astype(np.int64)

    def of(self, time: Array) -> Array:
        """Return it for some of the times."""
        at = np.searchsorted(self._known, self._decades(np.abs(time)))
        return np.asarray(self._worth[at], dtype=np.float64)


def _decimals(numbers: Array, least: int) -> int:
    """The fewest decimals, from a number of them on, that write numbers up to the rounding of a double."""
    for decimals in range(least, _MOST_DECIMALS):
        scaled = numbers * 10.0**decimals
        if np.all(np.abs(scaled - np.rint(scaled)) <= 4.0 * np.finfo(np.float64).eps * scaled):
            return decimals
    return _MOST_DECIMALS
