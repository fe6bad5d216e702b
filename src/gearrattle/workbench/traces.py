"""Histories of a saved run, thinned so that no extreme and no impact is lost.

A run of 1e7 samples is drawn on about 1e3 columns of a screen. For every block of 64 samples of every channel, the
lowest and the highest sample are written once to an index next to the run (``write_index``): (blocks, 2) positions and
values. A window with few samples is read from the run itself, a wide window from the index; ``thin`` selects samples
from either. The extremes of a bucket of samples are among the extremes of its blocks, so no extreme is lost.

Impacts are drawn as separate marks at their exact times: for every bucket of time the hardest impact, with the number
of impacts.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import opened_hdf5
from gearrattle.recording import Recording
from gearrattle.report.plots.thinning import thin
from gearrattle.signals import by_parts, find_impacts
from gearrattle.trajectory import Array, IntArray

if TYPE_CHECKING:
    from gearrattle.results import Run

BLOCK = 64
"""Samples per block, whose extremes are one entry of the index."""
LONG = 200_000
"""Number of samples above which a run has an index, and a window is read from the index."""
_ROWS = 4096 * BLOCK  # samples that are processed together while an index is made
_AXES = ("inertia", "clearance", "element", "auxiliary", "motion")
_IMPACTS = "impacts.npz"
_OF_IMPACTS = ("time", "clearance", "velocity", "energy")


@dataclass(frozen=True)
class Trace:
    """A channel: its name ``QUANTITY.SUBJECT``, the parts of it, and the unit."""

    name: str
    quantity: str
    subject: str
    unit: str


@dataclass(frozen=True)
class Marks:
    """Impacts of a window, the hardest of every bucket of time.

    Attributes
    ----------
    time
        (I,) [s].
    clearance
        (I,) index into the names of the clearances.
    velocity
        (I,) signed approach velocity [rad/s or m/s].
    energy
        (I,) m_eff v^2 / 2 [J]; NaN if no end is free.
    count
        (I,) how many impacts of its clearance and bucket the mark stands for.
    """

    time: Array
    clearance: IntArray
    velocity: Array
    energy: Array
    count: IntArray


class Source:
    """Samples of some channels over one uniform grid of time; a derived class reads them.

    Attributes
    ----------
    start, step, count
        first instant [s], interval [s], number of samples.
    period, discard
        of a run: its period [s], and how many of them are not judged.
    """

    start: float
    step: float
    count: int
    period: float | None = None
    discard: int = 0

    def channels(self) -> list[Trace]:
        """Return the channels."""
        raise NotImplementedError

    def read(self, name: str, low: int, high: int) -> Array:
        """Return samples low to high of a channel."""
        raise NotImplementedError

    def extremes(self, name: str) -> tuple[IntArray, Array] | None:
        """Return positions and values (blocks, 2) of the extremes of every block; None without an index."""
        del name
        return None

    def times(self, where: IntArray) -> Array:
        """Return the instants of samples."""
        return np.asarray(self.start + self.step * where, dtype=np.float64)

    def window(self, begin: float, end: float) -> tuple[int, int]:
        """Return the samples that draw a window of time: those in it, and one more at either side."""
        low = np.floor((begin - self.start) / self.step)
        high = np.ceil((end - self.start) / self.step) + 1
        return int(np.clip(low, 0, self.count - 1)), int(np.clip(high, 1, self.count))

    def trace(self, name: str, begin: float, end: float, points: int) -> tuple[Array, Array]:
        """Return times and values of at most ``points`` samples, 16 or more, that draw the same picture of a channel in
        a window of time [s].
        """
        low, high = self.window(begin, end)
        where, values = self._candidates(name, low, high)
        chosen = thin(values, points)
        return self.times(where[chosen]), values[chosen]

    def _candidates(self, name: str, low: int, high: int) -> tuple[IntArray, Array]:
        """Return all samples of a window, or those at its edges and the extremes of every block between."""
        index = self.extremes(name) if high - low > LONG else None
        if index is None:
            return np.arange(low, high), self.read(name, low, high)
        first = -(-low // BLOCK)
        last = high // BLOCK
        positions = index[0][first:last].ravel()
        values = index[1][first:last].ravel()
        kept = np.append(True, np.diff(positions) > 0)  # of a constant block both extremes are one sample
        head = np.arange(low, first * BLOCK)
        tail = np.arange(last * BLOCK, high)
        where = np.concatenate([head, positions[kept], tail])
        ends = self.read(name, low, first * BLOCK), self.read(name, last * BLOCK, high)
        return where, np.concatenate([ends[0], values[kept], ends[1]])


class RunFile(Source):
    """Histories of ``results.nc`` of a run, with its index."""

    def __init__(self, file: Path, index: Path | None = None) -> None:
        """Open a saved run (.nc), with the folder of its index if ``write_index`` made one."""
        import h5netcdf

        self.file = file
        self._index = index
        self._stored = h5netcdf.File(opened_hdf5(file, in_parts=True), "r")
        if not str(self._stored.attrs.get("format", "")).startswith("gearrattle run "):
            raise ModelError(Problem("result", file.name, "has no histories", "those of a run are drawn"))
        time = self._stored["time"]
        self.count = int(time.shape[0])
        self.start = float(time[0])
        self.step = (float(time[-1]) - self.start) / max(1, self.count - 1) or 1.0
        self.period = float(self._stored.attrs["period"])
        self.discard = int(self._stored.attrs["discard"])

    @cached_property
    def _columns(self) -> dict[str, tuple[Trace, int | None]]:
        made: dict[str, tuple[Trace, int | None]] = {}
        for quantity, variable in self._stored.variables.items():
            if variable.dimensions[:1] != ("time",) or quantity == "time":
                continue
            unit = str(variable.attrs.get("units", ""))
            if len(variable.dimensions) == 1:
                made[quantity] = Trace(quantity, quantity, "", unit), None
            elif variable.dimensions[1] in _AXES:
                labels = [_text(label) for label in self._stored[variable.dimensions[1]][...]]
                for column, label in enumerate(labels):
                    name = f"{quantity}.{label}"
                    made[name] = Trace(name, quantity, label, unit), column
        return made

    def channels(self) -> list[Trace]:
        return [trace for trace, _ in self._columns.values()]

    def read(self, name: str, low: int, high: int) -> Array:
        trace, column = self._known(name)
        part = slice(low, high)
        values = self._stored[trace.quantity][part if column is None else (part, column)]
        return np.asarray(values, dtype=np.float64)

    def blocks(self, quantity: str) -> Iterator[Array]:
        """Yield the samples of a variable, (N, columns), in stretches of whole blocks."""
        whole = self.count // BLOCK * BLOCK
        for low in range(0, whole, _ROWS):
            part = np.asarray(self._stored[quantity][low : min(low + _ROWS, whole)], dtype=np.float64)
            yield part.reshape(part.shape[0], -1)

    def extremes(self, name: str) -> tuple[IntArray, Array] | None:
        trace, column = self._known(name)
        if self._index is None or not (self._index / f"{trace.quantity}.values.npy").is_file():
            return None
        positions, values = self._extremes(trace.quantity)
        return positions[column or 0], values[column or 0]

    def _extremes(self, quantity: str) -> tuple[IntArray, Array]:
        if self._index is None:
            raise FileNotFoundError(quantity)
        positions, values = (
            np.load(self._index / f"{quantity}.{part}.npy", mmap_mode="r") for part in ("positions", "values")
        )
        return positions, values

    def _known(self, name: str) -> tuple[Trace, int | None]:
        if name not in self._columns:
            raise _unknown(name, self._columns)
        return self._columns[name]


class InMemory(Source):
    """Channels that are in memory: of a run, or of a recording, whose samples may be uneven."""

    def __init__(self, time: Array, values: Mapping[str, tuple[Trace, Array]]) -> None:
        """Hold channels (N,) over ascending times (N,) [s], by name."""
        self._time = time
        self._values = values
        self.count = time.size
        self.start = float(time[0])
        self.step = (float(time[-1]) - self.start) / max(1, time.size - 1) or 1.0

    @classmethod
    def of_recording(cls, recording: Recording) -> InMemory:
        """Return the channels of a recording."""
        channels = recording.channels
        named = {c.name: (Trace(c.name, c.quantity, c.subject, c.unit), c.values) for c in channels}
        return cls(recording.time, named)

    @classmethod
    def of_run(cls, run: Run) -> InMemory:
        """Return the channels of a run."""
        named: dict[str, tuple[Trace, Array]] = {}
        for quantity, variable in run.data.data_vars.items():
            unit = str(variable.attrs.get("units", ""))
            columns = variable.values.reshape(variable.shape[0], -1).T
            axis = variable.dims[1:]
            labels = [f"{label}" for label in run.data[axis[0]].values] if axis else [""]
            for label, column in zip(labels, columns, strict=True):
                name = f"{quantity}.{label}" if label else f"{quantity}"
                named[name] = Trace(name, f"{quantity}", label, unit), column
        made = cls(run.trajectory.time, named)
        made.period = run.trajectory.layout.period
        made.discard = run.trajectory.discard
        return made

    def channels(self) -> list[Trace]:
        return [trace for trace, _ in self._values.values()]

    def read(self, name: str, low: int, high: int) -> Array:
        if name not in self._values:
            raise _unknown(name, self._values)
        return np.asarray(self._values[name][1][low:high], dtype=np.float64)

    def times(self, where: IntArray) -> Array:
        return self._time[where]

    def window(self, begin: float, end: float) -> tuple[int, int]:
        low, high = np.searchsorted(self._time, [begin, end])
        return max(0, int(low) - 1), min(self.count, int(high) + 1)


def _unknown(name: str, known: Iterable[str]) -> ModelError:
    return ModelError(Problem("channel", name[:60], "is no channel", f"the channels are {', '.join(known)}"))


def _text(label: Any) -> str:
    return label.decode("utf-8") if isinstance(label, bytes) else str(label)


def write_index(source: RunFile, folder: Path) -> None:
    """Write the extremes of every block of every channel of a long run into an existing folder."""
    if source.count <= LONG:
        return
    for quantity in dict.fromkeys(trace.quantity for trace in source.channels()):
        places = []
        extremes = []
        for number, part in enumerate(source.blocks(quantity)):
            blocks = part.T.reshape(part.shape[1], -1, BLOCK)
            inside = np.sort(np.stack([blocks.argmin(axis=2), blocks.argmax(axis=2)], axis=2), axis=2)
            extremes.append(np.take_along_axis(blocks, inside, axis=2))
            begin = number * _ROWS + BLOCK * np.arange(blocks.shape[1])
            places.append(inside + begin[:, None])
        np.save(folder / f"{quantity}.positions.npy", np.concatenate(places, axis=1))
        np.save(folder / f"{quantity}.values.npy", np.concatenate(extremes, axis=1))


@dataclass(frozen=True)
class Hits:
    """Impacts of a run, arrays (I,) as of ``Marks``, ascending in time; ``clearances`` are names and units of approach
    speed.
    """

    clearances: list[dict[str, str]]
    time: Array
    clearance: IntArray
    velocity: Array
    energy: Array

    @classmethod
    def of_run(cls, run: Run) -> Hits:
        """Return the impacts of a run."""
        trajectory = by_parts(run.trajectory)
        impacts = find_impacts(trajectory)
        layout = trajectory.layout
        units = ["m/s" if layout.is_mesh[element] else "rad/s" for element in layout.clearance]
        if run.model.units != "SI":
            units = ["1"] * len(units)
        named = [{"name": name, "unit": unit} for name, unit in zip(layout.clearance_names, units, strict=True)]
        energy = np.where(np.isfinite(impacts.mass), impacts.energy, np.nan)
        return cls(named, impacts.time, impacts.clearance, impacts.velocity, energy)

    @classmethod
    def read(cls, folder: Path) -> Hits:
        """Read what ``write`` wrote into a folder."""
        with np.load(folder / _IMPACTS, allow_pickle=False) as stored:
            named = json.loads(stored["names"].tobytes().decode("utf-8"))
            return cls(named, **{name: stored[name] for name in _OF_IMPACTS})

    def write(self, folder: Path) -> None:
        """Write them into an existing folder."""
        names = np.frombuffer(json.dumps(self.clearances).encode("utf-8"), np.uint8)
        np.savez(folder / _IMPACTS, names=names, **{name: getattr(self, name) for name in _OF_IMPACTS})

    def within(self, begin: float, end: float, at_most: int) -> Marks:
        """Return the impacts of a closed window of time [s], of each clearance so many at most: then the hardest of
        every bucket of time.
        """
        rows = [self._of(own, (begin, end), at_most) for own in self._rows]
        chosen = np.concatenate([row for row, _ in rows]) if rows else np.zeros(0, np.int64)
        counts = np.concatenate([count for _, count in rows]) if rows else np.zeros(0, np.int64)
        order = np.argsort(chosen, kind="stable")
        at = chosen[order]
        count = counts[order]
        return Marks(self.time[at], self.clearance[at], self.velocity[at], self.energy[at], count)

    @cached_property
    def _rows(self) -> list[IntArray]:
        """Rows of every clearance."""
        return [np.flatnonzero(self.clearance == k) for k in range(len(self.clearances))]

    def _of(self, own: IntArray, window: tuple[float, float], at_most: int) -> tuple[IntArray, IntArray]:
        """Return rows of one clearance that are drawn, and how many each stands for."""
        first, last = np.searchsorted(self.time[own], [window[0], np.nextafter(window[1], np.inf)])
        rows = own[first:last]
        if rows.size <= at_most:
            return rows, np.ones(rows.size, np.int64)
        share = (self.time[rows] - window[0]) / (window[1] - window[0])
        bucket = np.minimum((share * at_most).astype(np.int64), at_most - 1)
        begins = np.flatnonzero(np.append(True, np.diff(bucket) > 0))
        count = np.diff(np.append(begins, rows.size))
        speed = np.abs(self.velocity[rows])
        is_hardest = speed == np.repeat(np.maximum.reduceat(speed, begins), count)
        hardest = np.flatnonzero(is_hardest)
        return rows[hardest[np.unique(bucket[hardest], return_index=True)[1]]], count


def described(source: Source, hits: Hits | None = None) -> dict[str, Any]:
    """Return the channels, the window of all, the period and the clearances with impacts, in JSON types."""
    clearances = [] if hits is None else hits.clearances
    is_mesh = {clearance["name"]: clearance["unit"] == "m/s" for clearance in clearances}
    channels = [
        {"name": trace.name, "quantity": trace.quantity, "label": trace.subject, "unit": _one_unit(trace, is_mesh)}
        for trace in source.channels()
    ]
    return {
        "channels": channels,
        "begin": source.start,
        "end": source.start + source.step * (source.count - 1),
        "samples": source.count,
        "period": source.period,
        "discard": source.discard,
        "clearances": clearances,
    }


def _one_unit(trace: Trace, is_mesh: Mapping[str, bool]) -> str:
    """Return the unit of a channel; of ``"rad, or m for a mesh"`` that which holds for it."""
    angular, _, linear = trace.unit.removesuffix(" for a mesh").partition(", or ")
    return linear if linear and is_mesh.get(trace.subject) else angular if linear and is_mesh else trace.unit


def packed(parts: Sequence[tuple[Array | IntArray, ...]]) -> bytes:
    """Return arrays as little-endian float64: how many parts, the length of each, then the arrays of each."""
    header = np.array([len(parts), *(part[0].size for part in parts)], dtype="<f8")
    arrays = [np.asarray(array, dtype="<f8") for part in parts for array in part]
    return np.concatenate([header, *arrays]).tobytes()
