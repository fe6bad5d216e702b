"""The period map of a driveline with a parameter: the state n periods later, its gradient and slope.

A GeneralFamily makes a system for every parameter value, of any driveline; its slope is that of the motion's own
crossings (``course``), its turning points are those of ``general_turns``. A CompiledFamily, for drivelines of laws and
harmonics alone, makes columns of coefficients instead and follows one motion in compiled code (``compiled``): the same
bits in a small part of the time.

Takes functions of the parameter, or of several values of it; gives Passes and slopes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.variants import Coefficients, picked
from gearrattle.engine.periodic.compiled import PeriodBatch
from gearrattle.engine.periodic.course import Neighbours, Setting, is_alike
from gearrattle.engine.periodic.general_turns import direction_of, exact_slope, turns_of, with_slopes
from gearrattle.engine.periodic.multiple import parts_of
from gearrattle.engine.periodic.period_map import Along, Pass, PeriodMap, State
from gearrattle.engine.periodic.touch import Touch, depth
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.flow import Flow
from gearrattle.engine.system.laid_out import part_of, system_of
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_SHARE, _LEAST = 1e-5, 1e-3
"""Step of the central difference of coefficients: a share of the parameter, which counts as at least so many units."""

SystemOf = Callable[[float], PiecewiseSystem]
Shown = Callable[[float], str]
CoefficientsOf = Callable[[Array], tuple[Coefficients, NDArray[np.bool_]]]


class Family(ABC):
    """Base of ``GeneralFamily`` and ``CompiledFamily``.

    Attributes
    ----------
    scale
        (N,) factors of states, for norms: balanced = scale * SI.
    size
        norm of balanced states that counts as one: the largest corner.
    cycles
        n, periods that a motion lasts.
    unit
        scale of the parameter: a change by it counts as one.
    parts
        m, into which a motion is cut where disturbances grow much; 1: it is always followed as a whole.
    clearances
        number of them: what crosses bounds counts from 0, clearances first.
    memories
        number of them, the last entries of a state.
    shown
        writes a parameter value with its unit, for messages.
    """

    scale: Array
    size: float
    cycles: int
    unit: float
    parts: int = 1
    clearances: int
    memories: int
    shown: Shown

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

        Parameters
        ----------
        state
            at the start.
        parameter
            of the driveline.
        touch
            a corner and an instant, for the approach in the Pass; None: none.
        turns_along
            (N + 1,) a row over the state at the start and the parameter [1/SI]: the Pass is to hold its turning points,
            with slopes along the change by which the gap stays as it is and of which the product with the row is 1; of
            a part of a motion the change itself.

        Returns
        -------
        tuple[Pass, Array]
            The motion over n periods, and (N,) d end / d parameter for a fixed state [SI].

        Raises
        ------
        ConvergenceError
            the motion could not be followed.
        """


class GeneralFamily(Family):
    """The family of a driveline of any kind.

    Parameters
    ----------
    system_of
        gives the driveline for a parameter value.
    first
        a parameter value; its driveline sets the scales.
    cycles
        n, periods that a motion lasts.
    unit
        scale of the parameter.
    shown
        writes a parameter value for messages.

    Attributes
    ----------
    repeats
        whether its motions may repeat: those of a part of a period do not.
    """

    repeats = True

    def __init__(
        self, system_of: SystemOf, first: float, cycles: int = 1, unit: float = 1.0, shown: Shown = "{:.9g}".format
    ) -> None:
        self._system_of, self._first, self.cycles, self.unit, self.shown = system_of, first, cycles, unit, shown
        self._states: int | None = None
        period_map = self.map_at(first)
        self._states = period_map.scale.size
        self.scale, self.size = period_map.scale, period_map.size
        self.parts = parts_of(period_map)
        self.clearances, self.memories = len(period_map.system.clearances), period_map.flow.memory.size

    def map_at(self, parameter: float) -> PeriodMap:
        """Return the map of one driveline.

        Raises
        ------
        ConvergenceError
            there is none, or its states are others: it has a slider more, or less.
        """
        period_map = self._any_map_at(parameter)
        if self._states not in (None, period_map.scale.size):
            raise ConvergenceError(f"the driveline has other sliders at {self.shown(parameter)}")
        return period_map

    def _any_map_at(self, parameter: float) -> PeriodMap:
        """The map of one driveline, whatever its states are."""
        return PeriodMap(self._system_of(parameter), self.cycles)

    def part(self, begin: float, length: float) -> GeneralFamily:
        """Return the family of a part of the motion; see ``Family.part``."""
        return _PartFamily(self, begin, length)

    def over(self, cycles: int) -> GeneralFamily:
        """Return the family of the motions over another number of periods."""
        return GeneralFamily(self._system_of, self._first, cycles, self.unit, self.shown)

    def follow(
        self, state: State, parameter: float, touch: Touch | None = None, turns_along: Array | Along | None = None
    ) -> tuple[Pass, Array]:
        """Follow a state; see ``Family.follow``."""
        period_map = self.map_at(parameter)
        motion, neighbours = replace(period_map(state), start=state), self._neighbours(parameter)
        alike = {side: one.flow for side, one in neighbours.items() if is_alike(one.flow, period_map.flow)}
        if not alike:  # the driveline is of another kind: a gap that has closed
            side, other = next(iter(neighbours.items()))
            return motion, (other.later(state).y - motion.end.y) / side
        setting = _setting(period_map.flow, alike)
        slope = exact_slope(period_map, setting, motion)
        if touch is not None and touch.watch < self.clearances:
            with suppress(ConvergenceError):
                beyond, located = depth(period_map, state, touch)
                motion = replace(motion, approach=with_slopes(period_map, setting, motion, located, beyond))
        if isinstance(turns_along, Along):
            motion = replace(motion, turns=turns_of(period_map, setting, motion, turns_along))
        elif turns_along is not None:
            counts = self.clearances, self.memories
            along = direction_of(motion, slope, turns_along, (self.scale, self.unit), counts)
            turns = None if along is None else turns_of(period_map, setting, motion, along)
            motion = replace(motion, turns=turns)
        return motion, slope

    def _neighbours(self, parameter: float) -> dict[float, PeriodMap]:
        """The maps of drivelines beside one, by how far away they are; one of them, where there is none beyond it."""
        step, neighbours = _step(parameter, self.unit), dict[float, PeriodMap]()
        for side in (-step, step):
            with suppress(ConvergenceError):
                neighbours[side] = self.map_at(parameter + side)
        if not neighbours:
            raise ConvergenceError(f"there is no driveline on either side of {self.shown(parameter)}")
        return neighbours


def _setting(flow: Flow, alike: dict[float, Flow]) -> Setting:
    """A driveline with those beside it that differ in numbers alone, by how far away they are."""
    sides = {0.0: flow, **alike} if len(alike) == 1 else alike
    low, high = min(sides), max(sides)
    return Setting(flow, Neighbours(sides[low], sides[high], high - low))


class _PartFamily(GeneralFamily):
    """The family of a part of a motion: its begin and length in periods."""

    repeats = False

    def __init__(self, whole: GeneralFamily, begin: float, length: float) -> None:
        self._part = begin, length
        super().__init__(whole._system_of, whole._first, 1, whole.unit, whole.shown)

    def _any_map_at(self, parameter: float) -> PeriodMap:
        """The map of one driveline, whatever its states are."""
        system = self._system_of(parameter)
        return PeriodMap(replace(system, inputs=system.inputs.part(*self._part)), repeats=False)


class CompiledFamily(Family):
    """The family of a driveline of laws and harmonics alone.

    Parameters
    ----------
    general
        the same family; follows what the loop leaves out.
    system
        one of the drivelines.
    coefficients_of
        gives, for (V,) parameter values, the coefficients with a leading axis V, and (V,) which of them have the
        structure of ``system``.
    """

    def __init__(self, general: GeneralFamily, system: PiecewiseSystem, coefficients_of: CoefficientsOf) -> None:
        self._general, self._coefficients_of = general, coefficients_of
        self.scale, self.size = general.scale, general.size
        self.cycles, self.unit, self.parts = general.cycles, general.unit, general.parts
        self.clearances, self.memories, self.shown = general.clearances, general.memories, general.shown
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
        general, inputs = self._general.part(begin, length), self._system.inputs

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
        deflection, velocity, batch = state.y[:first], state.y[first:], self._batch
        along: Array | Along | None = None
        if isinstance(turns_along, Along):
            along = turns_along._replace(parameter=turns_along.parameter / step)
        elif turns_along is not None:
            along = turns_along * np.append(np.ones(len(state.y)), step)
        if not batch.follow(numbers, self._angle_from_basis @ deflection, velocity, touch, along):
            return self._general.follow(state, parameter, touch, turns_along)
        end, turned, gradient, slope = (part.copy() for part in batch.out[:4])
        period = float(numbers.period[-1, 0])
        passed = batch.passages(), period, self.cycles, batch.approach(period, step), batch.turns()
        return Pass(state, State(end), gradient, turned, *passed), slope / step

    def _coefficients_at(self, values: Array) -> tuple[Coefficients, NDArray[np.bool_]]:
        """The coefficients; all parts of a motion ask for the same."""
        if self._last is None or not np.array_equal(self._last[0], values):
            self._last = values, self._coefficients_of(values)
        return self._last[1]


def _step(parameter: float, unit: float) -> float:
    """Half the distance of both neighbours of a parameter."""
    return _SHARE * min(unit, max(abs(parameter), _LEAST * unit))
