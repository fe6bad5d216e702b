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
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import fields
from functools import partial
from hashlib import sha256
from threading import Lock, Thread, current_thread, main_thread
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.kernels.march_arrays import DEEPEST, INTERVAL, TICKS, Inputs, Instants, Regions, step_of
from gearrattle.engine.system.flow import Flow, Pieces, flow_of, split_cycles
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.region_store import Capacity, Store, strips_for
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

T = TypeVar("T")

_QUICK = 100  # states; a region of as many is built in a tenth of a second
MOST_BYTES = 1 << 30  # of arrays, which double when they are full: slots that would pass it take no more regions


@kept
def packed_inputs(flow: Flow) -> Inputs:
    """Oscillators of the flow, with their rotation over every level's step."""
    # rotation of the oscillators over every level's step
    high, low = split_cycles(flow.system.inputs.cycles)
    steps = np.array([step_of(level) for level in range(DEEPEST + 1)])
    angle = 2 * np.pi * np.remainder(np.multiply.outer(steps, flow.system.inputs.cycles), 1.0)
    # knots of the signals, and their chains padded for vectors
    whole = np.floor(flow.knots[:-1])
    signals = flow.system.signals
    pace, links = (0.0, 1) if signals is None else (signals.pace(flow.system.inputs.period), signals.degree + 1)
    intervals, entries = flow.chains.shape
    chains = np.zeros((intervals, entries // links, links + 4 * strips_for(links)))
    chains[..., :links] = flow.chains.reshape(intervals, -1, links) if entries else 0.0
    return Inputs(
        cycles_high=high,
        cycles_low=low,
        frequency=flow.frequency,
        scale=flow.scaling.inputs,
        steps=steps,
        knot_cycle=whole,
        knot_fraction=flow.knots[:-1] - whole,
        chains=chains,
        fourth=flow.fourth_of_chains,
        pace=pace,
        links=links,
        turn_cosine=np.cos(angle),
        turn_sine=np.sin(angle),
    )


def packed_instants(flow: Flow, counts: NDArray[np.int64], end: int) -> Instants | None:
    """The instants ahead, up to the end of so many periods, for a march with such counts.

    None for a driveline without signals and clocks: the march is then compiled without them.
    """
    if flow.system.clock is None and flow.system.signals is None:
        return None
    knots = flow.knots[counts[INTERVAL] + 1 : -1]
    knots = knots[: np.searchsorted(knots, end, side="right")]
    whole = np.floor(knots)
    instants: tuple[NDArray[Any], ...] = (whole, knots - whole, np.full(len(knots), -1))
    clock = flow.system.clock
    first = len(flow.system.clearances)
    if clock is not None:
        cycle, fraction, auxiliary = clock.ticks(int(counts[TICKS]), end, flow.system.inputs.period)
        ticks = cycle, fraction, auxiliary + first
        instants = tuple(map(np.concatenate, zip(instants, ticks, strict=True)))
    order = np.lexsort((instants[1], instants[0]))
    cycle, fraction, watch = (column[order] for column in instants)
    return Instants(np.append(cycle, np.inf), np.append(fraction, 0.0), np.append(watch, -1).astype(np.int64))


class Slots:
    """The regions a run has visited; ``packed`` holds the arrays of the kernels."""

    def __init__(self, flow: Flow, shelf: Shelf, capacity: Capacity | None = None) -> None:
        self.flow = flow
        self._shelf = shelf
        self._lock = Lock()
        self._index: dict[Pieces, int] = {}
        self.store = Store(flow, capacity)
        self.size = self.store.size

    @property
    def packed(self) -> Regions:
        """The arrays for the kernel; ask again after every ``slot_of``."""
        return self.store.packed

    @property
    def pieces(self) -> list[Pieces]:
        """The pieces of every slot's region."""
        return self.store.pieces

    def slot_of(self, pieces: Pieces) -> int:
        """Slot of a region, building it at its first visit."""
        with self._lock:
            if pieces in self._index:
                return self._index[pieces]
        return _interruptible(self.flow, partial(self._add, pieces))

    def _add(self, pieces: Pieces) -> int:
        with self._lock:
            if pieces not in self._index:
                try:
                    self._index[pieces] = self.store.add(pieces)
                except FloatingPointError as error:
                    remedy = "check units, and values that are far larger or smaller than the others"
                    raise ConvergenceError(str(error), remedy=remedy) from None
            return self._index[pieces]

    def beyond(self, slot: int, clearance: int, upward: int) -> tuple[Slots, int]:
        """The slots to go on with, and in them that of the region across a corner; remembered as the neighbour."""
        pieces = self.flow.system.beyond(self.pieces[slot], clearance, upward)
        if pieces not in self._index and self.store.is_full(MOST_BYTES):
            fresh = self.renewed()
            return fresh, fresh.slot_of(pieces)
        target = self.slot_of(pieces)
        self.store.join(slot, clearance, upward, target)
        return self, target

    def renewed(self) -> Slots:
        """The system's present slots; if these are they, empty ones take their place."""
        return self._shelf.renewed(self)


class Shelf:
    """Holds a system's present slots."""

    def __init__(self, flow: Flow) -> None:
        self._lock = Lock()
        self.slots = Slots(flow, self)

    def renewed(self, full: Slots) -> Slots:
        """The present slots; empty ones if those given are the present ones."""
        with self._lock:
            if self.slots is full:
                self.slots = Slots(full.flow, self, full.store.capacity())
            return self.slots


def _interruptible(flow: Flow, work: Callable[[], T]) -> T:
    """Do some work on a driveline; for a large one in a thread, so that the main one can listen to Ctrl-C.

    LAPACK cannot be stopped: after Ctrl-C the work goes on to its end, and is kept.
    """
    if flow.states <= _QUICK or current_thread() is not main_thread():
        return work()
    done: Future[T] = Future()

    def body() -> None:
        try:
            done.set_result(work())
        except BaseException as error:
            done.set_exception(error)

    Thread(target=body, daemon=True).start()
    return done.result()


_KEPT: OrderedDict[bytes, Shelf] = OrderedDict()
_KEPT_LOCK = Lock()
_MOST_KEPT = 4


def slots_of(system: PiecewiseSystem) -> Slots:
    """The slots of a system, those of an earlier run if there was one."""
    key = _fingerprint(system)
    with _KEPT_LOCK:
        if key not in _KEPT:
            flow = flow_of(system)
            _KEPT[key] = _interruptible(flow, partial(Shelf, flow))
        _KEPT.move_to_end(key)
        while len(_KEPT) > _MOST_KEPT or (len(_KEPT) > 1 and _bytes_kept() > MOST_BYTES):
            _KEPT.popitem(last=False)
        return _KEPT[key].slots


def _bytes_kept() -> int:
    """Memory that the kept regions of all systems take."""
    return sum(shelf.slots.store.bytes for shelf in _KEPT.values())


@kept
def _fingerprint(system: PiecewiseSystem) -> bytes:
    """A digest of every number in the system."""
    optional = [part for part in (system.signals, system.clock) if part is not None]
    parts: tuple[Any, ...] = (system.inputs, *system.laws, *system.auxiliaries, *optional)
    arrays = [system.inertia, system.drag, system.rows]
    arrays += [np.asarray(getattr(part, field.name)) for part in parts for field in fields(part) if field.compare]
    digest = sha256()
    for array in arrays:
        digest.update(repr(array.shape).encode() + np.ascontiguousarray(array).tobytes())
    return digest.digest()
