"""Regions packed for the kernels, one slot each, in arrays that double when full.

Regions are built one by one in compiled code (``kernels.region_stages``).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.march_arrays import DEEPEST, ORDER, Regions
from gearrattle.engine.kernels.workspace import POWERS
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.region_arrays import RegionBuilder

Array = NDArray[np.float64]

_LINE = 8  # numbers in a cache line
_FIRST = 8  # regions that most runs visit at least
_TABLES = 16  # of a region, as they mostly are
_SMALL = 1_000_000  # bytes that these may take before any is visited


def strips_for(rows: int) -> int:
    """How many strips of four hold some rows."""
    return -(-rows // 4)


def aligned(shape: int | tuple[int, ...], kind: type = float) -> NDArray[Any]:
    """Zeros that begin on a cache line: strips of four then never straddle two."""
    count = prod(shape) if isinstance(shape, tuple) else shape
    raw: NDArray[Any] = np.zeros(count + _LINE, kind)
    begin = -raw.ctypes.data % (8 * _LINE) // 8
    return raw[begin : begin + count].reshape(shape)


@dataclass(frozen=True)
class Size:
    """The sizes of one system's arrays, see ``packed``; counts of rows, and of the strips of four that hold them."""

    states: int
    inputs: int
    carried: int
    clearances: int
    watched: int
    memories: int
    chain: int

    @property
    def longest(self) -> int:
        """Most entries y may have."""
        return self.states + self.inputs + self.chain

    @classmethod
    def of(cls, flow: Flow) -> Size:
        """The sizes of a flow."""
        clearances = len(flow.system.clearances)
        carried = len(flow.coordinates.references) + clearances
        sizes = flow.system.watched, flow.memory.size, flow.chain.size
        return cls(flow.states, flow.inputs, carried, clearances, *sizes)

    def made(self, width: int) -> int:
        """Strips of the rates of the carried quantities and of y."""
        return strips_for(self.carried) + strips_for(width)

    def shapes(self, width: int, modes: int = 0) -> dict[str, tuple[tuple[int, ...], type]]:
        """Shape, without any slots yet, and kind of every array of ``Regions`` for vectors y of a width."""
        # strips of four rows
        u = self.inputs
        k = self.watched
        order = strips_for(ORDER + 1)
        moved = self.made(max(self.states, width - self.chain))  # the marches move chains by themselves
        # numbers
        floats: dict[str, tuple[int, ...]] = {
            "tables": (0, moved, width, 4),
            "powers": (0, moved, width, 4),
            "particular": (0, self.made(self.states), u, 4),
            "drift": (0, 4 * strips_for(self.carried)),
            "probe": (0, k, width, 4),
            "calm": (0, k, width, 4),
            "bounds": (0, 2 * strips_for(modes), width, 4),
            "forced": (0, k, u, 4),
            "series": (0, order, width, 4),
            "forced_series": (0, order, u, 4),
            "weights": (0, strips_for(3 * k), modes, 4),
            "pushes": (0, strips_for(3 * k), self.chain, 4),
            "constant": (0, 4 * strips_for(3 * k)),
            "lower": (0, k),
            "upper": (0, k),
            "band": (0, k),
            "known": (0, self.memories),
        }
        # indices and counts
        integers: dict[str, tuple[int, ...]] = {
            "width": (0,),
            "kept": (0, u + self.chain),
            "first_table": (0,),
            "fine": (0,),
            "modes": (0,),
            "forced_strips": (0,),
            "piece": (0, k),
            "neighbour": (0, k, 2),
        }
        return {name: (shape, float) for name, shape in floats.items()} | {
            name: (shape, np.int64) for name, shape in integers.items()
        }


class Capacity(NamedTuple):
    """Capacity of the arrays: regions, tables, the longest y, rows of bounds."""

    slots: int
    tables: int
    width: int
    modes: int


class Store:
    """A driveline's regions in the order they were added; not safe for threads, see ``solvers.region_slots``."""

    def __init__(self, flow: Flow, capacity: Capacity | None = None) -> None:
        self.flow = flow
        self.size = Size.of(flow)
        self.pieces: list[Pieces] = []
        self.builder = RegionBuilder(flow)
        self._tables_used = 0
        self._last = 0
        self._arrays: dict[str, NDArray[Any]] = {}
        self._reserve(capacity or self._first_capacity())

    @property
    def packed(self) -> Regions:
        """The arrays for the kernels; ask again after every ``add``."""
        return Regions(self.flow.states, self.size.clearances, self.size.chain, **self._arrays)

    def fine(self, slot: int) -> int:
        """Level of a region's finest step."""
        return int(self._arrays["fine"][slot])

    def particular(self, slot: int) -> Array:
        """(N, U) a region's particular solution P."""
        strips = self._arrays["particular"][slot, strips_for(self.size.carried) :]
        return np.asarray(strips.transpose(0, 2, 1).reshape(-1, self.size.inputs)[: self.size.states])

    def add(self, pieces: Pieces) -> int:
        """Build a region into the next slot.

        FloatingPointError where its rates are not finite, or have no Schur form.
        """
        slot = len(self.pieces)
        builder = self.builder
        builder.work_out(pieces)
        capacity = Capacity(slot + 1, self._tables_used + builder.fine + 1, builder.width, builder.bounds)
        if not self._has(capacity):
            self._reserve(capacity)
        builder.pack(self.packed, slot, self._tables_used)
        self._arrays["known"][slot] = self.flow.known(pieces)
        self.pieces.append(pieces)
        self._last = builder.fine + 1
        self._tables_used += self._last
        return slot

    def _first_capacity(self) -> Capacity:
        """Capacity that most runs need, where it is small; else none before the first region is built."""
        capacity = Capacity(_FIRST, _FIRST * _TABLES, self.size.longest, self.size.states)
        shapes = self.size.shapes(capacity.width, capacity.modes)
        count = sum(rows * prod(shapes[name][0][1:]) for name, rows in self._rows(capacity).items())
        return capacity if 8 * count < _SMALL else Capacity(0, 0, self.size.states, 0)

    def _rows(self, capacity: Capacity) -> dict[str, int]:
        """Rows of every array."""
        watched = capacity.slots * self.size.watched
        other = {"tables": capacity.tables, "powers": POWERS * capacity.slots}
        other |= {"series": watched, "forced_series": watched}
        return {name: other.get(name, capacity.slots) for name in self.size.shapes(0)}

    @property
    def bytes(self) -> int:
        """Memory that the arrays take."""
        return sum(array.nbytes for array in self._arrays.values())

    def is_full(self, most: int) -> bool:
        """Whether one more region like the last would make the arrays larger than so many bytes."""
        fits = len(self.pieces) < len(self._arrays["drift"])
        fits &= self._tables_used + self._last <= len(self._arrays["tables"])
        return not fits and 2 * self.bytes > most

    def join(self, slot: int, clearance: int, upward: int, target: int) -> None:
        """Remember which slot lies beyond a corner, and which on this side of it, where the way back leads there."""
        self._arrays["neighbour"][slot, clearance, upward] = target
        if self.flow.system.beyond(self.pieces[target], clearance, 1 - upward) == self.pieces[slot]:
            self._arrays["neighbour"][target, clearance, 1 - upward] = slot

    def grow(self) -> None:
        """Make capacity for about twice as many regions."""
        now = self.capacity()
        self._reserve(now._replace(slots=2 * now.slots + 1, tables=2 * now.tables + DEEPEST + 1))

    def capacity(self) -> Capacity:
        """Capacity of the arrays, for a store that is likely to need as much."""
        a = self._arrays
        return Capacity(len(a["drift"]), len(a["tables"]), a["probe"].shape[2], a["weights"].shape[2])

    def _has(self, capacity: Capacity) -> bool:
        return all(needed <= held for needed, held in zip(capacity, self.capacity(), strict=True))

    def _reserve(self, capacity: Capacity) -> None:
        """Enlarge every array to this capacity, by doubling."""
        rows = self._rows(capacity)
        for name, (shape, kind) in self.size.shapes(capacity.width, capacity.modes).items():
            array = self._arrays.get(name, np.zeros((0, *shape[1:]), kind))
            first = array.shape[0] if array.shape[0] >= rows[name] else max(rows[name], 2 * array.shape[0])
            full = (first, *map(max, shape[1:], array.shape[1:]))
            if full != array.shape or name not in self._arrays:
                larger = aligned(full, kind)
                larger[tuple(map(slice, array.shape))] = array
                self._arrays[name] = larger
