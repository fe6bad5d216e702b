"""A motion of a model that repeats, stable or not.

A motion of n periods T is a zero of P(y) - y, P the map of a state to the state n T later. ``exact`` gives P and its
gradient M (``engine.periodic``). The eigenvalues of M are the Floquet multipliers: a small disturbance is multiplied by
them every n T.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.motion import Pass, State
from gearrattle.engine.periodic.multipliers import multipliers_of, sorted_by_modulus
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.symmetry import half_period_map
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.value_kinds import Count
from gearrattle.orbits.gradients import orbit_gradients
from gearrattle.orbits.motion_families import Interval, intervals_of, off_edge, size_of, without_free
from gearrattle.orbits.start_states import initial_of, plan_of, state_of
from gearrattle.orbits.value_family import family_of_excitation
from gearrattle.quantities.criteria import criteria
from gearrattle.result import Result
from gearrattle.simulation.integrate import integrate

if TYPE_CHECKING:
    import pandas as pd

    from gearrattle.quantities.verdict import Verdict
    from gearrattle.results import Run

Array = NDArray[np.float64]
SAMPLES_PER_CYCLE = 512
SETTLING = 32  # periods followed before the first search
ATTEMPTS = 5
"""Searches from a settled motion, each after twice as long."""
_SMALLEST = 0.01  # of all harmonics, to begin with
_MOST_POINTS = 400
_STABLE = 1e-9  # a modulus that exceeds one by less than this is rounding
_LOST = 1e10  # growth of disturbances over a motion, from which rounding shows in its run
_MIRRORED = 1e-6  # of the size of the state: a motion that differs by less from its mirror image is symmetric
CYCLES = Count(1, 64)
"""Periods after which a motion may repeat."""


@dataclass(frozen=True)
class Orbit(Result):
    """A motion that repeats after ``cycles`` periods T.

    Attributes
    ----------
    model
        the driveline.
    cycles
        n, periods T after which the motion repeats.
    motion
        as the engine has it.
    residual
        distance between end and start of the motion, over the largest corner or the size of the state.
    free
        number of directions in which neighbouring motions repeat as well, the turning of free trains not counted; 0
        for an isolated motion.
    notes
        what the user must know about it.

    Examples
    --------
    >>> orbit = gr.periodic(gr.example("rattle_oscillator"))
    >>> orbit.cycles, orbit.stable, orbit.residual < 1e-12
    (1, True, True)
    >>> orbit.verdict.verdict, orbit.pattern
    ('quiet', ())
    """

    kind: ClassVar[str] = "periodic motion"
    model: Model = field(repr=False, compare=False)
    cycles: int
    motion: Pass = field(repr=False, compare=False)
    residual: float
    free: int = 0
    notes: tuple[str, ...] = ()

    @cached_property
    def period_map(self) -> PeriodMap:
        """The map that this motion is a fixed point of."""
        return PeriodMap(assemble(self.model).system, self.cycles)

    @property
    def period(self) -> float:
        """Time after which the motion repeats [s]."""
        return self.period_map.length

    @cached_property
    def state(self) -> dict[str, list[float]]:
        """Angles [rad] and velocities [rad/s] of all inertias at t = 0, as ``simulate`` takes them.

        With hysteresis they are not the whole state: a simulation begins with all sliders unloaded, off the motion.
        """
        return initial_of(self.model, self.period_map, self.motion.start)

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """Floquet multipliers, the largest modulus first; 1 for the turning of every free train as a whole."""
        turning = len(relative_coordinates(assemble(self.model).system).references)
        values = multipliers_of(self.motion.gradient)
        return sorted_by_modulus(np.concatenate([values, np.ones(turning)]))

    @cached_property
    def own_multipliers(self) -> NDArray[np.complex128]:
        """Multipliers, the largest modulus first, without those that are 1 exactly: what these shift stays shifted.

        Left out are one for the turning of every free train as a whole, and one for every free direction.
        """
        exactly_one = len(self.multipliers) - len(self.motion.gradient) + self.free
        nearest = np.argsort(np.abs(self.multipliers - 1.0), kind="stable")[:exactly_one]
        return np.asarray(np.delete(self.multipliers, nearest))

    @property
    def largest_modulus(self) -> float:
        """The largest modulus of the own multipliers; 0 if there is none."""
        return float(np.abs(self.own_multipliers).max(initial=0.0))

    @cached_property
    def half_period_multipliers(self) -> NDArray[np.complex128]:
        """Multipliers over half of the n T of a motion that then is its own mirror image; empty for any other motion.

        Their squares are the Floquet multipliers without those of free trains that turn as a whole. At 1 the motion
        folds; at -1 it loses its symmetry, and two motions leave that are mirror images of each other.
        """
        none = np.zeros(0, np.complex128)
        half_map = half_period_map(self.period_map.system, self.cycles)
        if half_map is None:
            return none
        half = half_map(self.motion.start)
        size = size_of(self.period_map, self.motion.start)
        is_mirrored = float(np.linalg.norm(half.gap * self.period_map.scale)) < _MIRRORED * size
        return multipliers_of(half.gradient) if is_mirrored else none

    @property
    def symmetric(self) -> bool:
        """Whether half of the n T later the motion is its own mirror image, all angles and torques reversed."""
        return self.half_period_multipliers.size > 0

    @cached_property
    def stable(self) -> bool:
        """Whether small disturbances die out, or at least do not grow."""
        return is_stable(multipliers_of(self.motion.gradient), self.free)

    @cached_property
    def family(self) -> tuple[Interval, ...]:
        """The free states of a motion that is one of a family, with their ranges; empty for an isolated motion.

        A slider that never slips, a body that floats in its gap and a train without drag each give an interval: inside
        it neighbouring motions repeat as well, with the same impacts.
        """
        return intervals_of(self.model, self.period_map, self.motion)

    def gradients(self, paths: Sequence[str] | None = None) -> pd.DataFrame:
        """Return how the response of the motion, and its multipliers, move with the numbers of the model.

        Parameters
        ----------
        paths
            of the numbers; None: of all that are not zero.

        Returns
        -------
        pandas.DataFrame
            response ("peak-to-peak deflection", "largest force", "multiplier modulus"), of (the clearance, or the
            number of the multiplier from 1, those of free directions left out), size [SI] of the response, path, value
            [SI] of the number, gradient (change for a unit of the number, good to about 1e-7 of the response, or to
            5e-4 where impacts exchange their order), per_10_percent (change for 10 % more of it); what moves a response
            most comes first. NaN where a number cannot be changed alone, where impacts come or go with it, or where the
            gradients on both sides of an exchange differ by more than 1e-3 of the response.

        Raises
        ------
        ModelError
            a motion that is one of a family, or a path that leads to no number, or to zero.

        Examples
        --------
        >>> orbit = gr.periodic(gr.example("rattle_oscillator"), start="linear")
        >>> table = orbit.gradients(["torque.0.harmonics.0.amplitude"])  # in contact it swings in proportion
        >>> round(float(table["per_10_percent"][0] / table["size"][0]), 6)
        0.1
        """
        if self.free:
            raise ModelError(Problem("orbit", repr(self), "gradients are of a motion that is isolated"))
        return orbit_gradients(self.model, self.period_map, self.motion, paths)

    @cached_property
    def run(self) -> Run:
        """The motion over its n T, no longer: a simulation would leave an unstable motion."""
        return sampled(self, SAMPLES_PER_CYCLE)

    @cached_property
    def verdict(self) -> Verdict:
        """The verdict of the criteria on the motion."""
        return criteria(self.run)

    @cached_property
    def pattern(self) -> tuple[tuple[str, str], ...]:
        """Its impacts in order: (clearance, "drive" or "coast")."""
        events = self.run.trajectory.events
        names = self.run.trajectory.layout.clearance_names
        outward = np.abs(events.to_region) > np.abs(events.from_region)
        return tuple(
            (names[k], "drive" if to > 0 else "coast")
            for k, to in zip(events.clearance[outward], events.to_region[outward], strict=True)
        )

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        return f"<Orbit of {self.model.name!r}: {self.cycles} T, {kind}, |multiplier| {self.largest_modulus:.4g}>"


def sampled(orbit: Orbit, samples_per_cycle: int) -> Run:
    """Return a motion over its n T with samples as close as they are asked for."""
    plan = plan_of(orbit.model, orbit.period_map, orbit.motion.start, samples_per_cycle)
    return plan.run(integrate(plan.task, plan.layout, "exact"))


def is_stable(multipliers: NDArray[np.complex128], free: int) -> bool:
    """Return whether no multiplier is larger than one, apart from as many nearest to 1 as there are free directions."""
    return bool(np.all(np.abs(without_free(multipliers, free)) <= 1.0 + _STABLE))


def settled_state(model: Model, period_map: PeriodMap) -> State:
    """Return the state that the model's own start has reached after 32 periods or a little more."""
    return period_map.later(state_of(model, period_map, None), -(-SETTLING // period_map.cycles))


def contact_state(period_map: PeriodMap, rest: State) -> State | None:
    """Return the start of the motion in which no corner is passed: that of the linear driveline which the rest is on.

    It is a linear function of the size of all harmonics, so two of small ones tell it.

    None where that motion passes a corner.
    """
    family = family_of_excitation(period_map.system, period_map.cycles)
    try:
        one, two = (shooting.shoot(family.map_at(size), rest).motion.start for size in (_SMALLEST, 2.0 * _SMALLEST))
        full = one.y + (two.y - one.y) * (1.0 - _SMALLEST) / _SMALLEST
        orbit = shooting.shoot(period_map, State(full, one.auxiliary_pieces))
    except ConvergenceError:
        return None
    passes = orbit.motion.crossings.watch < len(period_map.system.clearances)  # others: alternation, sliders
    return None if passes.any() else orbit.motion.start


def linear_state(period_map: PeriodMap, rest: State) -> State:
    """Return the start of the motion that grows out of the rest as all harmonics grow from zero to their full size.

    Raises ConvergenceError: it cannot be followed so far.
    """
    curve = Continuation(family_of_excitation(period_map.system, period_map.cycles))
    smallest = curve.family.map_at(_SMALLEST)
    last = curve.begin(shooting.shoot(smallest, rest, settle=ATTEMPTS).motion.start, _SMALLEST)
    with suppress(ConvergenceError):  # said of the share that it was followed to
        for point in islice(curve.follow(last, 0.0, 1.0), _MOST_POINTS):
            last = point
    if last.parameter != 1.0:
        message = f"the motion was followed to {100.0 * last.parameter:.3g} % of all harmonics, not to all of them"
        raise ConvergenceError(message, remedy="another start, for example the end of a simulation")
    return last.motion.start


def orbit_of(model: Model, period_map: PeriodMap, orbit: shooting.Orbit) -> Orbit:
    """Return an orbit of the engine with its model; a train without drag turns at no speed of its own.

    One that touches at the edge of a family by less than its residual tells is that in the middle of the family.
    """
    inside = off_edge(period_map, orbit.motion)
    still = _without_drift(period_map, orbit if inside is orbit.motion else shooting.shoot(period_map, inside.start))
    notes: tuple[str, ...] = ()
    if not is_stable(multipliers_of(still.motion.gradient), still.free.shape[1]):
        notes = ("The motion is unstable: a simulation leaves it.",)
    grown = float(np.abs(multipliers_of(still.motion.gradient)[0]))
    if grown > _LOST:
        notes += (f"Disturbances grow {grown:.1g} times over the motion: its run leaves it before the end.",)
    if still.free.shape[1]:
        words = "a part of the driveline may stand elsewhere, or turn at another speed"
        notes += (f"The motion is one of a family: {words}; its family (orbit.family) says what, and how far.",)
    return Orbit(model, period_map.cycles, still.motion, still.residual, still.free.shape[1], notes)


def _without_drift(period_map: PeriodMap, orbit: shooting.Orbit) -> shooting.Orbit:
    """The same motion, with trains without drag at an average speed of zero."""
    system = period_map.system
    motion = relative_coordinates(system).angle_from_reference
    is_free = (np.abs(motion.T) @ system.drag) == 0.0
    drift = np.where(is_free, orbit.motion.turned, 0.0) / period_map.length
    if not np.any(drift):
        return orbit
    deflections = len(period_map.flow.coordinates.elements)
    y = orbit.motion.start.y.copy()
    y[deflections : deflections + system.size] -= motion @ drift
    return shooting.shoot(period_map, State(y, orbit.motion.start.auxiliary_pieces))


@dataclass(frozen=True)
class PeriodicMotions(Result):
    """Motions of one driveline that repeat: what the command ``gearrattle periodic --every`` shows.

    Attributes
    ----------
    model
        the driveline.
    orbits
        the motions, those with the largest swings last.

    Examples
    --------
    >>> from gearrattle.orbits import PeriodicMotions
    >>> model = gr.example("rattle_oscillator")
    >>> PeriodicMotions(model, (gr.periodic(model),)).sentence
    '1 motion repeats: 1 stable, 0 unstable.'
    """

    kind: ClassVar[str] = "periodic motions"
    model: Model = field(repr=False, compare=False)
    orbits: tuple[Orbit, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user must know about them, once each."""
        return tuple(dict.fromkeys(note for orbit in self.orbits for note in orbit.notes))
