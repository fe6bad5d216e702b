"""The course of a motion with a perturbation (``kernels.perturbed_motion``) for drivelines of any kind.

A driveline with friction, clipped damping or alternating stiffness is described by its flow and the flows of its two
neighbours: derivatives by the parameter p are central differences of coefficients, not of motions.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import turning_point_depths
from gearrattle.engine.kernels.branch_direction import write_course_along
from gearrattle.engine.kernels.corner_approach import Touched, write_touch
from gearrattle.engine.kernels.perturbed_motion import Driven, Path, Trace, write_course
from gearrattle.engine.periodic.motion import OF_TURNS, Along, Approach, Dips, Pass, Touch, Turns
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Pair = tuple[Array, Array]

_SAME_TICK = 1e-9  # periods: largest difference of equal instants
_REACH = 0.25  # share of the smallest corner: turning points farther from a corner are omitted


class Setting:
    """A driveline and its derivatives by the parameter, in the scales of its flow.

    low, high: flows with a smaller and with a larger parameter; ``distance``: difference of both parameters.
    """

    def __init__(self, flow: Flow, low: Flow, high: Flow, distance: float) -> None:
        self.flow = flow
        self.sizes = sizes_of(flow)
        self._all = (flow, low, high)
        self._distance = distance

    def rates(self, pieces: Pieces) -> Pair:
        """Return (Z, Z) of z' = Z z in a region, and (N, Z) how the rows of states change with p."""
        generator, shift = self._pair(
            lambda flow: flow.generator(pieces) * self._ratio(flow) / self._ratio(flow)[:, None]
        )
        return generator, shift[: self.flow.states]

    def deflections(self) -> Pair:
        """Return (K, Z) rows of the deflections of the clearances, and their derivatives by p."""
        chosen = list(self.flow.system.clearances)
        return self._pair(lambda flow: flow.deflection[chosen] * self._ratio(flow))

    def corners(self, element: int) -> Pair:
        """Return lower and upper corners (2, pieces) of an element, and their derivatives by p."""
        return self._pair(lambda flow: np.stack([flow.system.laws[element].lower, flow.system.laws[element].upper]))

    def row(self, pieces: Pieces, watch: int) -> Pair:
        """Return the row (Z,) of a watched quantity in a region, and its derivative by p."""
        return self._pair(lambda flow: row_of(flow, pieces, watch) * self._ratio(flow))

    def bound(self, pieces: Pieces, watch: int, upward: int) -> Pair:
        """Return the bound of that quantity, infinite for a change by the clock, and its derivative by p."""
        return self._pair(lambda flow: np.array(bound_of(flow, pieces, watch, upward)))

    def known(self, pieces: Pieces) -> Pair:
        """Return (S,) known values of memories in a region, in scales of z, and their derivatives by p."""
        known = self.flow.known(pieces)
        _, shift = self._pair(lambda flow: flow.known(pieces) / flow.memory * self.flow.memory)
        return known, shift

    def tick_shift(self, auxiliary: int, time: float) -> float:
        """Return the derivative by p of the instant of a change by the clock [periods]."""
        ticks = []
        for flow in self._all:
            clock = flow.system.clock
            period = flow.system.inputs.period
            if clock is None:
                return 0.0
            ticks.append(clock.time[clock.auxiliary == auxiliary] / period)
        apart = np.abs(np.remainder(time - ticks[0] + 0.5, 1.0) - 0.5)
        if not apart.size or apart.min() > _SAME_TICK:
            return 0.0
        low, high = (tick[int(np.argmin(apart))] for tick in ticks[1:])
        moved = np.remainder(high - low + 0.5, 1.0) - 0.5  # an instant may move over the end of the period
        return float(moved / self._distance)

    def _ratio(self, flow: Flow) -> Array:
        """(Z,) entries of z in the scales of another flow over those in the scales of this one."""
        return sizes_of(flow) / self.sizes

    def _pair(self, of: Callable[[Flow], Array]) -> Pair:
        """A property of the driveline, and its derivative by p; zero for entries that are not finite."""
        own, low, high = (of(flow) for flow in self._all)
        change = np.subtract(high, low, out=np.zeros(own.shape), where=np.isfinite(own))
        return own, change / self._distance


def is_alike(flow: Flow, other: Flow) -> bool:
    """Return whether two drivelines have the same structure and differ in numbers only."""
    return _shape(flow) == _shape(other)


def _shape(flow: Flow) -> tuple[object, ...]:
    """The structure of a driveline: equal for drivelines that differ in numbers only."""
    system = flow.system
    pieces = tuple(law.pieces for law in system.laws)
    others = tuple((own.kind, own.element, len(own.lower)) for own in system.auxiliaries)
    ticks = None if system.clock is None else tuple(system.clock.auxiliary.tolist())
    return pieces, others, ticks, sizes_of(flow).size, system.clearances


def sizes_of(flow: Flow) -> Array:
    """Return (Z,) scales of the entries of z: z = scale * SI, inputs of size one."""
    parts = flow.scaling.deflection, flow.scaling.velocity, flow.memory, flow.input_size, flow.chain
    return np.concatenate(parts)


def row_of(flow: Flow, pieces: Pieces, watch: int) -> Array:
    """Return the row (Z,) of a watched quantity [its own unit]."""
    clearances = flow.system.clearances
    auxiliary = watch - len(clearances)
    if auxiliary < 0:
        return np.asarray(flow.deflection[clearances[watch]])
    own, piece, memory = list(flow.beside(pieces))[auxiliary]
    of_deflection, of_rate, of_memory = own.watched[piece]
    row = of_deflection * flow.deflection[own.element] + of_rate * flow.rate[own.element] + of_memory * memory
    return np.asarray(row)


def bound_of(flow: Flow, pieces: Pieces, watch: int, upward: int) -> float:
    """Return the bound; infinite if there is none, or for a change by the clock."""
    system = flow.system
    auxiliary = watch - len(system.clearances)
    if auxiliary < 0:
        element = system.clearances[watch]
        return system.laws[element].bounds(pieces[element])[1 if upward else 0]
    own = system.auxiliaries[auxiliary]
    piece = pieces[len(system.laws) + auxiliary]
    return float(own.upper[piece] if upward else own.lower[piece])


class Course:
    """A motion of a driveline and its crossings, along which perturbations are followed."""

    def __init__(self, period_map: PeriodMap, setting: Setting, motion: Pass) -> None:
        self._setting = setting
        self._motion = motion
        self._scale = setting.sizes[: setting.flow.states]
        pieces, y, crossings, _ = period_map.along(motion)
        self._z = np.concatenate([y, setting.flow.inputs_at(np.zeros(1), np.zeros(1))[0]])
        regions = [pieces]
        for watch, upward in zip(crossings.watch.tolist(), crossings.upward.tolist(), strict=True):
            regions.append(setting.flow.system.beyond(regions[-1], watch, upward))
        self._driven, slots = _driven(setting, regions)
        self._path = _path(setting, regions, slots, crossings, float(period_map.cycles))

    def slope(self) -> Array:
        """Return (N,) d end / d p [SI] of the motion with unchanged crossings.

        Near a touch, a difference of motions would compare a motion with the touch and one without.
        """
        trace = self._trace(rows=0)
        write_course(self._driven, self._path, self._z, np.append(np.zeros(self._scale.size), 1.0), trace)
        return np.asarray(trace.v[-1] / self._scale)

    def turns_along(self, slope: Array, row: Array) -> Turns | None:
        """Return the turning points, with slopes along the change that keeps end - start; None if it is not unique.

        slope: (N,) d end / d p [SI].
        row: (N + 1,) over the state at the start and p, whose product with the change is 1 [1/SI].
        """
        scale = self._scale
        columns = np.column_stack([scale[:, None] * self._motion.gradient / scale, scale * slope])
        memories = self._setting.flow.memory.size
        trace = self._trace(rows=turning_point_depths.MOST_TURNS)
        if not write_course_along(self._driven, self._path, self._z, columns, scale, row, memories, trace):
            return None
        return turns_of(trace.turns, int(trace.number[0]), trace.delay)

    def turns(self, along: Along) -> Turns | None:
        """Return the turning points near corners, with slopes along a change."""
        trace = self._trace(rows=turning_point_depths.MOST_TURNS)
        path = self._path._replace(outside=along.outside)
        change = np.append(along.state * self._scale, along.parameter)
        write_course(self._driven, path, self._z, change, trace)
        return turns_of(trace.turns, int(trace.number[0]), trace.delay)

    def approach(self, touch: Touch) -> Approach | None:
        """Return the extremum of a clearance near an instant; None without an extremum, or without a corner near it."""
        touched = room_for_touch(self._scale.size, touch)
        trace = self._trace(rows=0)
        corner = np.array([touch.watch, touch.upward])
        write_touch(self._driven, self._path, self._z, corner, self._scale, trace, touched)
        return approach_of(touched, self._motion.period)

    def _trace(self, rows: int) -> Trace:
        count = len(self._path.slot)
        states = self._scale.size
        return Trace(
            z=np.empty((count + 1, self._z.size)),
            v=np.empty((count + 1, states)),
            delay=np.empty(count - 1),
            jump=np.empty((count - 1, states)),
            reach=reaches(self._setting.flow.system),
            turns=np.zeros((rows, turning_point_depths.COLUMNS)),
            number=np.zeros(1, np.int64),
        )


def _driven(setting: Setting, regions: list[Pieces]) -> tuple[Driven, IntArray]:
    """The rates of a motion in all its regions, and the slot of every region."""
    slots = {pieces: slot for slot, pieces in enumerate(dict.fromkeys(regions))}
    generators, shifts = zip(*(setting.rates(pieces) for pieces in slots), strict=True)
    driven = Driven(np.array(generators), np.array(shifts), *setting.deflections())
    return driven, np.array([slots[pieces] for pieces in regions])


def _path(setting: Setting, regions: list[Pieces], slots: IntArray, crossings: Passages, end: float) -> Path:
    """The crossings of a motion that ends at ``end`` [periods]."""
    # corners of the pieces in every interval, and their derivatives by p
    flow = setting.flow
    count = len(regions)
    system = flow.system
    first = len(flow.system.laws)
    clearances = list(system.clearances)
    pieces = np.array(regions)[:, clearances].astype(np.int64)
    corners = np.empty((4, *pieces.shape))
    for k, element in enumerate(clearances):
        own, shift = setting.corners(element)
        corners[:2, :, k] = own[:, pieces[:, k]]
        corners[2:, :, k] = shift[:, pieces[:, k]]
    # watched quantities that cross, and whether only a law changes there
    rows = np.zeros((2, count - 1, setting.sizes.size))
    numbers = np.zeros((2, count - 1))
    time = np.concatenate([[0.0], crossings.time / system.inputs.period, [end]])
    is_law = np.zeros(count - 1, np.int64)
    for i, (watch, upward) in enumerate(zip(crossings.watch.tolist(), crossings.upward.tolist(), strict=True)):
        rows[:, i] = setting.row(regions[i], watch)
        bound, shift = setting.bound(regions[i], watch, upward)
        numbers[:, i] = (shift, np.nan)
        if not np.isfinite(bound):
            numbers[1, i] = setting.tick_shift(watch - len(clearances), float(time[i + 1]))
        is_law[i] = watch < len(clearances) and regions[i][first:] == regions[i + 1][first:]
    # known values of memories at the starts of intervals
    known, known_shift = (np.array(part) for part in zip(*map(setting.known, regions), strict=True))
    return Path(
        time=time,
        slot=slots,
        lower=corners[0],
        upper=corners[1],
        lower_shift=corners[2],
        upper_shift=corners[3],
        known=known,
        known_shift=known_shift,
        clearance=crossings.watch.astype(np.int64),
        upward=crossings.upward.astype(np.int64),
        row=rows[0],
        row_shift=rows[1],
        bound_shift=numbers[0],
        tick=numbers[1],
        is_law=is_law,
        outside=np.full((2, len(clearances)), -1),
    )


def outside_of(crossings: Passages, begins: tuple[int, int], clearances: int) -> IntArray:
    """Return (2, K) directions of the last crossings before a part of a periodic motion and of the first after, see
    Along.

    begins: number of crossings before the start and before the end of the part; 0 and 0 for the whole motion.
    """
    outside = np.empty((2, clearances), np.int64)
    turning_point_depths.write_outside(
        crossings.watch.astype(np.int64), crossings.upward.astype(np.int64), np.array(begins), outside
    )
    return outside


def reaches(system: PiecewiseSystem) -> Array:
    """Return (K,) distances from a corner up to which turning points are computed [SI]."""
    corners = [law.corners[law.corners != 0.0] for law in (system.laws[k] for k in system.clearances)]
    return _REACH * np.array([np.abs(own).min(initial=np.inf) for own in corners])


def turns_of(rows: Array, count: int, delay: Array) -> Turns | None:
    """Return turning points and dips from the rows of the compiled course; None if they are not known."""
    if count < 0:
        return None
    rows = rows[:count]
    is_turn = rows[:, turning_point_depths.UPWARD] < turning_point_depths.FALLING
    watch, upward = rows[:, : turning_point_depths.TIME].T.astype(np.int64)
    every = watch, upward, *rows[:, turning_point_depths.TIME :].T.copy()
    dips = Dips._make(part[~is_turn] for part in every)
    watch, upward, time, depth, slope, time_slope = (part[is_turn] for part in every[: len(OF_TURNS)])
    return Turns(watch, upward, time, depth, slope, time_slope, dips, delay)


def room_for_touch(states: int, touch: Touch) -> Touched:
    """Return the arrays to which the compiled course writes an approach."""
    number = np.array([touch.time, np.nan, np.nan])
    return Touched(number, np.full(states + 1, np.nan), np.full(states + 1, np.nan))


def approach_of(touched: Touched, period: float, step: float = 1.0) -> Approach | None:
    """Return the extremum that the compiled course has written, for a parameter in steps; None: no extremum."""
    time, depth, bend = touched.number.tolist()
    if not np.isfinite(depth):
        return None
    slope = touched.slope.copy()
    time_slope = touched.time_slope.copy()
    slope[-1] /= step
    time_slope[-1] /= step
    return Approach(depth, time, bend / period**2, slope, time_slope)
