"""The period map of a driveline with a parameter: the state n periods later, its gradient and slope.

A GeneralFamily makes a system for every parameter value, of any driveline; its slope is that of the motion's own
crossings (``course``). A CompiledFamily, for drivelines of laws and harmonics alone, makes columns of coefficients
instead and follows one motion in compiled code (``compiled``): the same bits in a small part of the time.

*Parts.* A motion may be followed in parts of equal length, each from a state of its own:

    P_i(y_i; p) - y_(i+1) = 0,   i = 1 ... m,   y_(m+1) = y_1

Where a disturbance grows a million times over a motion, Newton's method for its start alone (``newton``) needs a
prediction a million times as near. Over a part it grows little. See ``multiple_shooting``, the same for one driveline.

*Half a period.* The motions of a symmetric driveline may be followed over half of their length, and mirrored
(``symmetry``).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.variant_arrays import Coefficients, picked
from gearrattle.engine.periodic.compiled import PeriodBatch
from gearrattle.engine.periodic.compiled_course import Course, Setting, approach_of, is_alike, outside_of
from gearrattle.engine.periodic.motion import OF_TURNS, Along, Approach, Dips, Parts, Pass, State, Touch, Turns, joined
from gearrattle.engine.periodic.multiple_shooting import parts_of
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.symmetry import HalfPeriodMap, Mirror, is_symmetric
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.flow import Flow
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.plain_arrays import part_of, system_of
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_SHARE = 1e-5
_LEAST = 1e-3
"""Step of the central difference of coefficients: a share of the parameter, which counts as at least so many units."""

SystemOf = Callable[[float], PiecewiseSystem]
Shown = Callable[[float], str]
CoefficientsOf = Callable[[Array], tuple[Coefficients, NDArray[np.bool_]]]


IntArray = NDArray[np.int64]
_BESIDE = 1e-6  # of the parameter's unit: a driveline so near is of the same kind


class Family(ABC):
    """Base of all families; one that cannot follow a motion raises ConvergenceError."""

    scale: Array  # (N,) factors of states, for norms: balanced = scale * SI
    size: float  # norm of balanced states that counts as one: the largest corner
    cycles: int  # n, periods that a motion lasts
    unit: float  # scale of the parameter: a change by it counts as one
    parts: int = 1  # m, into which a motion is cut where disturbances grow much; 1: it is always followed as a whole
    clearances: int  # number of them: what crosses bounds counts from 0, clearances first
    memories: int  # number of them, the last entries of a state
    shown: Shown  # writes a parameter value with its unit, for messages

    def _be_like(self, other: Family) -> None:
        """Take what is alike in two families of one driveline, all but the parts."""
        self.scale = other.scale
        self.size = other.size
        self.cycles = other.cycles
        self.unit = other.unit
        self.clearances = other.clearances
        self.memories = other.memories
        self.shown = other.shown

    @abstractmethod
    def map_at(self, parameter: float) -> PeriodMap:
        """Return the map of one driveline."""

    def part(self, begin: float, length: float) -> Family:
        """Return the family of a part of the motion, begin and length in periods, where there are parts."""
        raise NotImplementedError

    def over(self, cycles: int) -> Family:
        """Return the family of the motions over another number of periods."""
        raise NotImplementedError

    @abstractmethod
    def follow(
        self, state: State, parameter: float, touch: Touch | None = None, turns_along: Array | Along | None = None
    ) -> tuple[Pass, Array]:
        """Follow a state.

        touch: a corner and an instant, for the approach in the Pass; None: none.
        turns_along: (N + 1,) a row over the state at the start and the parameter [1/SI]: the Pass is to hold its
        turning points, with slopes along the change by which the gap stays as it is and of which the product with the
        row is 1; of a part of a motion the change itself.
        Returns the motion over n periods, and (N,) d end / d parameter for a fixed state [SI].
        """


class GeneralFamily(Family):
    """The family of a driveline of any kind.

    first: a parameter value; its driveline sets the scales.
    repeats: whether its motions may repeat: those of a part of a period do not.
    """

    def __init__(
        self,
        system_of: SystemOf,
        first: float,
        cycles: int = 1,
        unit: float = 1.0,
        shown: Shown = "{:.9g}".format,
        *,
        repeats: bool = True,
    ) -> None:
        self._system_of = system_of
        self._first = first
        self.cycles = cycles
        self.unit = unit
        self.shown = shown
        self.repeats = repeats
        self._states: int | None = None
        period_map = self.map_at(first)
        self._states = period_map.scale.size
        self.scale = period_map.scale
        self.size = period_map.size
        self.parts = parts_of(period_map)
        self.clearances = len(period_map.system.clearances)
        self.memories = period_map.flow.memory.size

    def map_at(self, parameter: float) -> PeriodMap:
        """Return the map of one driveline.

        ConvergenceError: there is none, or its states are others: it has a slider more, or less.
        """
        period_map = PeriodMap(self._system_of(parameter), self.cycles, repeats=self.repeats)
        if self._states not in (None, period_map.scale.size):
            raise ConvergenceError(f"the driveline has other sliders at {self.shown(parameter)}")
        return period_map

    def part(self, begin: float, length: float) -> GeneralFamily:
        """Return the family of a part of the motion; see ``Family.part``."""

        def system_of(parameter: float) -> PiecewiseSystem:
            system = self._system_of(parameter)
            return replace(system, inputs=system.inputs.part(begin, length))

        return GeneralFamily(system_of, self._first, 1, self.unit, self.shown, repeats=False)

    def over(self, cycles: int) -> GeneralFamily:
        """Return the family of the motions over another number of periods."""
        return GeneralFamily(self._system_of, self._first, cycles, self.unit, self.shown)

    def follow(
        self, state: State, parameter: float, touch: Touch | None = None, turns_along: Array | Along | None = None
    ) -> tuple[Pass, Array]:
        """Follow a state; see ``Family.follow``."""
        period_map = self.map_at(parameter)
        motion = replace(period_map(state), start=state)
        neighbours = self._neighbours(parameter)
        alike = {side: one.flow for side, one in neighbours.items() if is_alike(one.flow, period_map.flow)}
        if not alike:  # the driveline is of another kind: a gap that has closed
            side, other = next(iter(neighbours.items()))
            return motion, (other.later(state).y - motion.end.y) / side
        course = Course(period_map, _setting(period_map.flow, alike), motion)
        slope = course.slope()
        approach = None
        turns = None
        if touch is not None and touch.watch < self.clearances:
            approach = course.approach(touch)
        if isinstance(turns_along, Along):
            turns = course.turns(turns_along)
        elif turns_along is not None:
            turns = course.turns_along(slope, turns_along)
        return replace(motion, approach=approach, turns=turns), slope

    def _neighbours(self, parameter: float) -> dict[float, PeriodMap]:
        """The maps of drivelines near one, by how far away they are; one of them, where there is none beyond it."""
        step = _step(parameter, self.unit)
        neighbours = dict[float, PeriodMap]()
        for side in (-step, step):
            with suppress(ConvergenceError):
                neighbours[side] = self.map_at(parameter + side)
        if not neighbours:
            raise ConvergenceError(f"there is no driveline on either side of {self.shown(parameter)}")
        return neighbours


def _setting(flow: Flow, alike: dict[float, Flow]) -> Setting:
    """A driveline with those near it that differ in numbers alone, by how far away they are."""
    sides = {0.0: flow, **alike} if len(alike) == 1 else alike
    low = min(sides)
    high = max(sides)
    return Setting(flow, sides[low], sides[high], high - low)


class CompiledFamily(Family):
    """The family of a driveline of laws and harmonics alone.

    general: the same family; follows what the loop leaves out.
    coefficients_of: gives, for (V,) parameter values, the coefficients with a leading axis V, and (V,) which of them
    have the structure of ``system``.
    """

    def __init__(self, general: GeneralFamily, system: PiecewiseSystem, coefficients_of: CoefficientsOf) -> None:
        self._general = general
        self._coefficients_of = coefficients_of
        self._be_like(general)
        self.parts = general.parts
        self._angle_from_basis = relative_coordinates(system).angle_from_basis
        self._batch: PeriodBatch | None = None
        self._system = system
        self._last: tuple[Array, tuple[Coefficients, NDArray[np.bool_]]] | None = None

    def map_at(self, parameter: float) -> PeriodMap:
        """Return the map of one driveline."""
        numbers, is_alike = self._coefficients_of(np.array([parameter]))
        if not is_alike.all():
            return self._general.map_at(parameter)
        system = system_of(self._system, picked(numbers, 0))
        return PeriodMap(system, self.cycles, repeats=self._general.repeats)

    def part(self, begin: float, length: float) -> CompiledFamily:
        """Return the family of a part of the motion; see ``Family.part``."""
        general = self._general.part(begin, length)
        inputs = self._system.inputs

        def coefficients_of(values: Array) -> tuple[Coefficients, NDArray[np.bool_]]:
            numbers, is_alike = self._coefficients_at(values)
            return part_of(numbers, inputs.cycles, begin, length), is_alike

        return CompiledFamily(general, replace(self._system, inputs=inputs.part(begin, length)), coefficients_of)

    def over(self, cycles: int) -> CompiledFamily:
        """Return the family of the motions over another number of periods."""
        return CompiledFamily(self._general.over(cycles), self._system, self._coefficients_of)

    def follow(
        self, state: State, parameter: float, touch: Touch | None = None, turns_along: Array | Along | None = None
    ) -> tuple[Pass, Array]:
        """Follow a state; see ``Family.follow``."""
        step = _step(parameter, self.unit)
        numbers, is_alike = self._coefficients_of(np.array([parameter - step, parameter + step, parameter]))
        if not is_alike.all():
            return self._general.follow(state, parameter, touch, turns_along)
        if self._batch is None:
            self._batch = PeriodBatch(self._system, self.cycles, numbers)
        first = self._angle_from_basis.shape[1]
        batch = self._batch
        along: Array | Along | None = None
        if isinstance(turns_along, Along):
            along = turns_along._replace(parameter=turns_along.parameter / step)
        elif turns_along is not None:
            along = turns_along * np.append(np.ones(len(state.y)), step)
        if not batch.follow(numbers, self._angle_from_basis @ state.y[:first], state.y[first:], touch, along):
            return self._general.follow(state, parameter, touch, turns_along)
        end, turned, gradient, slope = (part.copy() for part in batch.out[:4])
        period = float(numbers.period[-1, 0])
        approach = approach_of(batch.out.touched, period, step)
        passed = batch.passages(), period, self.cycles, approach, batch.turns()
        return Pass(state, State(end), gradient, turned, *passed), slope / step

    def _coefficients_at(self, values: Array) -> tuple[Coefficients, NDArray[np.bool_]]:
        """The coefficients; all parts of a motion ask for the same."""
        if self._last is None or not np.array_equal(self._last[0], values):
            self._last = values, self._coefficients_of(values)
        return self._last[1]


def _step(parameter: float, unit: float) -> float:
    """Half the distance of both neighbours of a parameter."""
    return _SHARE * min(unit, max(abs(parameter), _LEAST * unit))


class PartedFamily:
    """Follows motions of a family in its m parts."""

    def __init__(self, family: Family) -> None:
        self._cycles = family.cycles
        self._clearances = family.clearances
        self._length = family.cycles / family.parts
        self._parts = [family.part(i * self._length, self._length) for i in range(family.parts)]

    def starts(self, state: State, parameter: float) -> Array:
        """Return (m - 1, N) states at the start of the later parts of a motion [SI]."""
        states = [state]
        for part in self._parts[:-1]:
            states.append(part.map_at(parameter).later(states[-1]))
        return np.array([state.y for state in states[1:]])

    def follow(self, start: State, later: Array, parameter: float, touch: Touch | None = None) -> tuple[Pass, Array]:
        """Follow a motion in parts.

        later: (m - 1, N) states at the start of the later parts [SI].
        touch: a corner and an instant, for the approach in the Pass; None: none.
        Returns the motion over n periods, without turning points, and (N,) d end / d parameter for a fixed start [SI].
        """
        index, touch = self._within(touch)
        passes = list[Pass]()
        slopes = list[Array]()
        state = start
        for i, part in enumerate(self._parts):
            if i > 0:
                state = State(later[i - 1], passes[-1].end.auxiliary_pieces)
            motion, slope = part.follow(state, parameter, touch if i == index else None)
            passes.append(motion)
            slopes.append(slope)
        gradients = np.array([one.gradient for one in passes])
        whole_slope = np.zeros(len(slopes[0]))
        for gradient, slope in zip(gradients, slopes, strict=True):
            whole_slope = gradient @ whole_slope + slope
        starts = np.array([one.start.y for one in passes])
        ends = np.array([one.end.y for one in passes])
        parts = Parts(starts, ends, gradients, np.array(slopes))
        motion = joined(passes, passes[0].period / self._length, self._cycles)
        return replace(motion, approach=self._approach(passes[index].approach, index), parts=parts), whole_slope

    def turns(self, motion: Pass, parameter: float, changes: Array) -> Turns | None:
        """Return the turning points of a motion that was followed in parts; None where they are not known.

        changes: (m, N + 1) along which their slopes are: of the states at the start of the parts [SI], and of p.
        """
        assert motion.parts is not None
        pieces = motion.start.auxiliary_pieces
        turns = list[Turns]()
        for i, (part, start, change) in enumerate(zip(self._parts, motion.parts.start, changes, strict=True)):
            begins = _before(motion, i * self._length), _before(motion, (i + 1) * self._length)
            outside = outside_of(motion.crossings, begins, self._clearances)
            along = Along(change[:-1], float(change[-1]), outside)
            own, _ = part.follow(State(start, pieces), parameter, None, along)
            pieces = own.end.auxiliary_pieces
            if own.turns is None:
                return None
            turns.append(self._in_motion(own.turns, i))
        dips = Dips._make(map(np.concatenate, zip(*(one.dips for one in turns), strict=True)))
        columns = {name: np.concatenate([getattr(one, name) for one in turns]) for name in [*OF_TURNS, "delay"]}
        return Turns(**columns, dips=dips)

    def _within(self, touch: Touch | None) -> tuple[int, Touch | None]:
        """The part in which a touch lies, and the touch in it."""
        if touch is None:
            return 0, None
        time = touch.time / self._length
        index = int(np.floor(time)) % len(self._parts)
        return index, replace(touch, time=time - np.floor(time))

    def _approach(self, approach: Approach | None, index: int) -> Approach | None:
        """An approach of a part as one of the whole motion; what depends on the rest of the motion is not known."""
        if approach is None:
            return None
        time = self._length * (index + approach.time)
        return approach._replace(time=time, time_slope=self._length * approach.time_slope, part=index)

    def _in_motion(self, turns: Turns, index: int) -> Turns:
        """Turning points of a part as those of the whole motion."""
        length = self._length
        dips = turns.dips
        dips = dips._replace(
            time=length * (index + dips.time),
            time_slope=length * dips.time_slope,
            depth=dips.depth / length,
            slope=dips.slope / length,
        )
        return turns._replace(
            time=length * (index + turns.time),
            time_slope=length * turns.time_slope,
            dips=dips,
            delay=length * turns.delay,
        )


def _before(motion: Pass, time: float) -> int:
    """How many crossings of a motion lie before an instant [periods]."""
    return int(np.searchsorted(motion.crossings.time, time * motion.period))


class HalfPeriodFamily(Family):
    """The family of the half-period maps of symmetric drivelines. Its motions have no turning points."""

    def __init__(self, whole: Family) -> None:
        self._whole = whole
        self._half = whole.part(0.0, 0.5 * whole.cycles)
        self._mirror: Mirror | None = None
        self._be_like(whole)

    def map_at(self, parameter: float) -> HalfPeriodMap:
        """Return the half-period map of one driveline."""
        return HalfPeriodMap(self._whole.map_at(parameter).system, self.cycles)

    def follow(
        self, state: State, parameter: float, touch: Touch | None = None, turns_along: Array | Along | None = None
    ) -> tuple[Pass, Array]:
        """Follow a state over half of its periods, and mirror it; see ``Family.follow``.

        NotImplementedError: a touch is asked for.
        """
        if touch is not None:
            raise NotImplementedError
        del turns_along  # which are not sought
        motion, slope = self._half.follow(state, parameter)
        if self._mirror is None:
            self._mirror = self.map_at(parameter).mirror
        end = self._mirror.state(motion.end)
        gradient = self._mirror.rows(motion.gradient)
        return replace(motion, end=end, gradient=gradient, turned=-motion.turned), self._mirror.rows(slope)


def half_of(family: Family) -> Family:
    """Return the family of H."""
    return HalfPeriodFamily(family) if family.cycles % 2 == 1 else family.over(family.cycles // 2)


def are_symmetric(family: Family, parameter: float) -> bool:
    """Return whether drivelines are symmetric at a parameter and near it: not where a mean torque is zero."""
    if not is_symmetric(family.map_at(parameter).system):
        return False
    for side in (1.0, -1.0):
        with suppress(ConvergenceError):
            return is_symmetric(family.map_at(parameter + side * _BESIDE * family.unit).system)
    return True
