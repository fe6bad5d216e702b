"""Regions met so far, packed for the kernel: one slot each, arrays that double when full.

The regions of the last few systems are kept, so that running a driveline again (another start, another length, another
algorithm to compare) builds nothing twice. Threads may share them: building is behind a lock, and arrays a kernel holds
are only ever added to or replaced.

Memory is bounded: a run that needs one region more than fits goes on with fresh, empty slots (``renewed``) and forgets
what it knew; a region that comes back is built again, to the same bits. Other runs keep the slots they hold as long as
they need no more.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace
from hashlib import sha256
from math import prod
from threading import Lock
from typing import Any

import numpy as np
from numpy.linalg import matrix_power
from numpy.typing import NDArray

from gearrattle.kernels.packed import BAND, LONGEST, ORDER, Inputs, Regions
from gearrattle.remember import remembered
from gearrattle.system.flow import Flow, Pieces, flow_of, split_cycles
from gearrattle.system.forced import oscillation
from gearrattle.system.piecewise import PiecewiseSystem
from gearrattle.system.region import DEEPEST, Region, build_region, strips

Array = NDArray[np.float64]

POWERS = 4  # of the generator, for the Taylor window
_LINE = 8  # numbers in a cache line
NOTHING = 1e-19  # of the largest: terms of a forced deflection below this are left out
MOST_BYTES = 256 << 20  # of arrays, which double when they are full: slots that would pass it take no more regions


def strips_for(rows: int) -> int:
    """How many strips of four hold some rows."""
    return -(-rows // 4)


def packed_inputs(flow: Flow) -> Inputs:
    """Oscillators of the flow, with their rotation over every level's step."""
    high, low = split_cycles(flow.system.inputs.cycles)
    steps = LONGEST * 0.5 ** np.arange(DEEPEST + 1)
    angle = 2 * np.pi * np.remainder(np.multiply.outer(steps, flow.system.inputs.cycles), 1.0)
    return Inputs(high, low, flow.frequency, flow.scaling.inputs, steps, np.cos(angle), np.sin(angle))


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

    @classmethod
    def of(cls, flow: Flow) -> Size:
        """Read them off a flow."""
        clearances = len(flow.system.clearances)
        carried = len(flow.coordinates.references) + clearances
        return cls(flow.states, flow.width - flow.states, carried, clearances)

    def made(self, width: int) -> int:
        """Strips of the rates of the carried quantities and of y."""
        return strips_for(self.carried) + strips_for(width)

    def shapes(self, width: int, modes: int = 0) -> dict[str, tuple[tuple[int, ...], type]]:
        """Shape, without any slots yet, and kind of every array of ``Regions`` for vectors y of a width."""
        u, k, order = self.inputs, self.clearances, strips_for(ORDER + 1)
        floats: dict[str, tuple[int, ...]] = {
            "tables": (0, self.made(width), width, 4),
            "powers": (0, self.made(width), width, 4),
            "particular": (0, self.made(self.states), u, 4),
            "drift": (0, 4 * strips_for(self.carried)),
            "probe": (0, strips_for(4 * k), width, 4),
            "calm": (0, strips_for(4 * k), width, 4),
            "bounds": (0, 2 * strips_for(modes), width, 4),
            "forced": (0, strips_for(4 * k), u, 4),
            "series": (0, order, width, 4),
            "forced_series": (0, order, u, 4),
            "weights": (0, strips_for(3 * k), modes, 4),
            "constant": (0, 4 * strips_for(3 * k)),
            "lower": (0, k),
            "upper": (0, k),
        }
        integers: dict[str, tuple[int, ...]] = {
            "width": (0,), "kept": (0, u), "first_table": (0,), "fine": (0,), "modes": (0,), "forced_strips": (0,),
            "piece": (0, k), "neighbour": (0, k, 2),
        }  # fmt: skip
        return {name: (shape, float) for name, shape in floats.items()} | {
            name: (shape, np.int64) for name, shape in integers.items()
        }


class Slots:
    """The regions a run has visited; ``packed`` is what the kernel sees."""

    def __init__(self, flow: Flow, shelf: Shelf) -> None:
        self.flow, self._shelf = flow, shelf
        self._lock = Lock()
        self.regions: list[Region] = []
        self._index: dict[Pieces, int] = {}
        self._tables_used = 0
        laws = [flow.system.laws[k] for k in flow.system.clearances]
        self._band = np.array([BAND if np.any(law.corners != 0.0) else 0.0 for law in laws])
        self.size = Size.of(flow)
        self._arrays = {name: aligned(shape, kind) for name, (shape, kind) in self.size.shapes(flow.states).items()}

    @property
    def packed(self) -> Regions:
        """The arrays for the kernel; ask again after every ``slot_of``."""
        return Regions(self.flow.states, band=self._band, **self._arrays)

    def slot_of(self, pieces: Pieces) -> int:
        """Slot of a region, building it at its first visit."""
        with self._lock:
            if pieces not in self._index:
                self._index[pieces] = self._add(build_region(self.flow, pieces))
            return self._index[pieces]

    def beyond(self, slot: int, clearance: int, upward: int) -> tuple[Slots, int]:
        """The slots to go on with, and in them that of the region across a corner; remembered as the neighbour."""
        k = self.flow.system.clearances[clearance]
        pieces = list(self.regions[slot].pieces)
        pieces[k] += 1 if upward else -1
        if self._is_full() and tuple(pieces) not in self._index:
            fresh = self.renewed()
            return fresh, fresh.slot_of(tuple(pieces))
        target = self.slot_of(tuple(pieces))
        self._arrays["neighbour"][slot, clearance, upward] = target
        self._arrays["neighbour"][target, clearance, 1 - upward] = slot
        return self, target

    def renewed(self) -> Slots:
        """The system's present slots; if these are they, empty ones take their place."""
        return self._shelf.renewed(self)

    def _is_full(self) -> bool:
        """Whether one more region like the last would make the arrays too large."""
        fits = len(self.regions) < len(self._arrays["drift"])
        fits &= self._tables_used + len(self.regions[-1].tables) <= len(self._arrays["tables"])
        return not fits and 2 * sum(array.nbytes for array in self._arrays.values()) > MOST_BYTES

    def _make_room(self, slots: int, tables: int, width: int, modes: int) -> None:
        """Let every array hold so many slots and tables, vectors y of a width, so many modes; doubling as needed."""
        needed = self.size.shapes(width, modes)
        for name, (shape, kind) in needed.items():
            array = self._arrays[name]
            rows = {"tables": tables, "powers": POWERS * slots, "series": slots * self.size.clearances,
                    "forced_series": slots * self.size.clearances}.get(name, slots)  # fmt: skip
            first = array.shape[0] if array.shape[0] >= rows else max(rows, 2 * array.shape[0])
            full = (first, *map(max, shape[1:], array.shape[1:]))
            if full != array.shape:
                larger = aligned(full, kind)
                larger[tuple(map(slice, array.shape))] = array
                self._arrays[name] = larger

    def _add(self, region: Region) -> int:
        slot, count, width = len(self.regions), len(region.tables), len(region.generator)
        rows, modes = region.bound.rows, len(region.bound.rows)
        self._make_room(slot + 1, self._tables_used + count, width, modes)
        self.regions.append(replace(region, tables=np.zeros((count, 0, 0))))  # the arrays have them
        a, k, carried = self._arrays, self.size.clearances, self.size.carried

        def fill(name: str, index: int, *groups: Array) -> None:
            packed = np.concatenate([strips(group) for group in groups])
            a[name][index, : packed.shape[0], : packed.shape[1]] = packed

        a["width"][slot], a["fine"][slot], a["modes"][slot] = width, region.fine, modes
        a["kept"][slot, : width - self.flow.states] = region.split.kept
        a["first_table"][slot] = self._tables_used
        for level, table in enumerate(region.tables):
            fill("tables", self._tables_used + level, table[width:], table[:width])
        self._tables_used += count
        for j, power in enumerate(region.powers(POWERS)):
            fill("powers", POWERS * slot + j, power[:carried], power[carried:])
        fill("particular", slot, region.carried_particular, region.split.particular)
        a["drift"][slot, :carried] = region.drift
        fours = [rows[i : i + 4] for i in range(0, modes, 4)]
        fill("probe", slot, np.vstack(list(region.watched)))
        fill("calm", slot, np.vstack(list(region.calm)))
        fill("bounds", slot, rows[:0].real, *(part for four in fours for part in (four.real, four.imag)))
        oscillators = oscillation(self.flow.frequency)
        fill("forced", slot, np.vstack([region.forced @ matrix_power(oscillators, j) for j in range(4)]))
        free, forced = region.series(oscillators)
        for i in range(k):
            fill("series", slot * k + i, free[i])
            fill("forced_series", slot * k + i, forced[i])
        turning = (np.abs(forced) * self.flow.input_size).max(axis=(0, 2), initial=0.0)
        a["forced_strips"][slot] = strips_for(
            1 + int(np.flatnonzero(turning > NOTHING * turning.max(initial=0.0)).max(initial=0))
        )
        fill("weights", slot, np.vstack(list(region.bound.weights)))
        a["constant"][slot, : 3 * k] = region.bound.constant.ravel()
        a["lower"][slot], a["upper"][slot] = region.lower, region.upper
        a["piece"][slot] = [region.pieces[i] for i in self.flow.system.clearances]
        a["neighbour"][slot] = -1
        return slot


class Shelf:
    """Holds a system's present slots."""

    def __init__(self, flow: Flow) -> None:
        self._lock = Lock()
        self.slots = Slots(flow, self)

    def renewed(self, full: Slots) -> Slots:
        """The present slots; empty ones if those given are the present ones."""
        with self._lock:
            if self.slots is full:
                self.slots = Slots(full.flow, self)
            return self.slots


_KEPT: OrderedDict[bytes, Shelf] = OrderedDict()
_KEPT_LOCK = Lock()
_MOST_KEPT = 4


def slots_of(system: PiecewiseSystem) -> Slots:
    """The slots of a system, those of an earlier run if there was one."""
    key = _fingerprint(system)
    with _KEPT_LOCK:
        if key not in _KEPT:
            _KEPT[key] = Shelf(flow_of(system))
        _KEPT.move_to_end(key)
        while len(_KEPT) > _MOST_KEPT:
            _KEPT.popitem(last=False)
        return _KEPT[key].slots


@remembered(8)
def _fingerprint(system: PiecewiseSystem) -> bytes:
    """A digest of every number in the system."""
    inputs = system.inputs
    arrays = [system.inertia, system.drag, system.rows, np.array(inputs.period), inputs.cycles, inputs.mean]
    arrays += [inputs.torque_sine, inputs.torque_cosine, inputs.error_sine, inputs.error_cosine]
    for law in system.laws:
        arrays += [law.corners, law.stiffness, law.damping, law.offset]
    digest = sha256()
    for array in arrays:
        digest.update(repr(array.shape).encode() + np.ascontiguousarray(array, dtype=np.float64).tobytes())
    return digest.digest()
