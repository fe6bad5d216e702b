"""Regions met so far, packed for the kernel: one slot each, arrays that double when full.

The regions of the last few systems are kept, so that running a driveline again (another start, another length, another
algorithm to compare) builds nothing twice. Threads may share them: building is behind a lock, and arrays a kernel holds
are only ever added to or replaced.
"""

from __future__ import annotations

from collections import OrderedDict
from hashlib import sha256
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from gearrattle.kernels.packed import LONGEST, Inputs, Regions
from gearrattle.system.flow import Flow, Pieces, flow_of, split_cycles
from gearrattle.system.piecewise import PiecewiseSystem
from gearrattle.system.region import DEEPEST, Region, build_region, strips

Array = NDArray[np.float64]


def packed_inputs(flow: Flow) -> Inputs:
    """Oscillators of the flow, with their rotation over every level's step."""
    high, low = split_cycles(flow.system.inputs.cycles)
    steps = LONGEST * 0.5 ** np.arange(DEEPEST + 1)
    angle = 2 * np.pi * np.remainder(np.multiply.outer(steps, flow.system.inputs.cycles), 1.0)
    return Inputs(high, low, flow.scaling.inputs, steps, np.cos(angle), np.sin(angle))


class Slots:
    """The regions a run has visited; ``packed`` is what the kernel sees."""

    def __init__(self, flow: Flow) -> None:
        self.flow = flow
        self._lock = Lock()
        self.regions: list[Region] = []
        self._index: dict[Pieces, int] = {}
        clearances, width = len(flow.system.clearances), flow.width
        carried = len(flow.coordinates.references) + clearances
        made = -(-(flow.states + carried) // 4)
        self._watched = -(-3 * clearances // 4)
        probes = self._watched + -(-2 * width // 4)
        self._arrays: dict[str, NDArray[np.generic]] = {
            "first_table": np.zeros(0, np.int64),
            "fine": np.zeros(0, np.int64),
            "tables": np.zeros((0, made, width, 4)),
            "generator": np.zeros((0, made, width, 4)),
            "probe": np.zeros((0, probes, width, 4)),
            "bound_rows": np.zeros(0, np.int64),
            "weights": np.zeros((0, clearances, width)),
            "constant": np.zeros((0, clearances)),
            "lower": np.zeros((0, clearances)),
            "upper": np.zeros((0, clearances)),
            "neighbour": np.zeros((0, clearances, 2), np.int64),
        }
        self._tables_used = 0
        self.strips = (made, probes)

    @property
    def packed(self) -> Regions:
        """The arrays for the kernel; ask again after every ``slot_of``."""
        return Regions(**self._arrays)

    def slot_of(self, pieces: Pieces) -> int:
        """Slot of a region, building it at its first visit."""
        with self._lock:
            if pieces not in self._index:
                self._index[pieces] = self._add(build_region(self.flow, pieces))
            return self._index[pieces]

    def beyond(self, slot: int, clearance: int, upward: int) -> int:
        """Slot of the region across a corner; remembered as the neighbour."""
        k = self.flow.system.clearances[clearance]
        pieces = list(self.regions[slot].pieces)
        pieces[k] += 1 if upward else -1
        target = self.slot_of(tuple(pieces))
        self._arrays["neighbour"][slot, clearance, upward] = target
        self._arrays["neighbour"][target, clearance, 1 - upward] = slot
        return target

    def _room(self, name: str, needed: int) -> None:
        array = self._arrays[name]
        if array.shape[0] < needed:
            larger = np.zeros((max(needed, 2 * array.shape[0], 8), *array.shape[1:]), array.dtype)
            larger[: array.shape[0]] = array
            self._arrays[name] = larger

    def _add(self, region: Region) -> int:
        slot = len(self.regions)
        self.regions.append(region)
        for name in self._arrays:
            if name != "tables":
                self._room(name, slot + 1)
        count = region.tables.shape[0]
        self._room("tables", self._tables_used + count)
        a = self._arrays
        for level, table in enumerate(region.tables):
            a["tables"][self._tables_used + level] = strips(table)
        a["first_table"][slot], a["fine"][slot] = self._tables_used, region.fine
        self._tables_used += count
        a["generator"][slot] = strips(region.generator)
        rows = region.bound.rows
        a["bound_rows"][slot] = len(rows)
        a["probe"][slot, : self._watched] = strips(np.vstack([region.deflection, region.rate, region.curvature]))
        bounds = strips(np.stack([rows.real, rows.imag], axis=1).reshape(-1, self.flow.width))
        a["probe"][slot, self._watched : self._watched + len(bounds)] = bounds
        a["weights"][slot, :, : len(rows)] = region.bound.weights
        a["constant"][slot] = region.bound.constant
        a["lower"][slot], a["upper"][slot] = region.lower, region.upper
        a["neighbour"][slot] = -1
        return slot


_KEPT: OrderedDict[bytes, Slots] = OrderedDict()
_KEPT_LOCK = Lock()
_MOST_KEPT = 4


def slots_of(system: PiecewiseSystem) -> Slots:
    """The slots of a system, those of an earlier run if there was one."""
    key = _fingerprint(system)
    with _KEPT_LOCK:
        if key not in _KEPT:
            _KEPT[key] = Slots(flow_of(system))
        _KEPT.move_to_end(key)
        while len(_KEPT) > _MOST_KEPT:
            _KEPT.popitem(last=False)
        return _KEPT[key]


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
