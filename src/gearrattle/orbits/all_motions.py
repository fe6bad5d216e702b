"""All periodic motions of a model: settled from many starts, followed through folds, and counted.

Newton's method from a grid of starts misses motions: on piecewise-linear maps it goes round in circles. So

1. what repeats after a divisor of n repeats after n: the motions of all divisors are sought first, the least first, and
   kept,
2. states spread over the reach of the driveline are followed until they settle: this finds attracting motions; where
   the model's own motion never settles, those that it nearly repeats are sought,
3. Newton's method begins from all of them as well: this finds some motions that do not attract,
4. of a symmetric driveline the symmetric motions are sought by the half-period map, and every motion is kept with its
   mirror image,
5. every motion is followed over the speed, up and down, through folds and families: where its branch comes back to the
   speed of the model, it gives other motions. Those that a divisor gave, and mirror images, have been followed,
6. the fixed points of the n-period map are counted. If all motions end in a bounded set, none is one of a family and
   the map is continuous (no slider is released with its torque), the sum of the signs of det(I - M) over them is 1
   (Brouwer's degree): a sum that differs says that one is missing. Then Newton's method goes on from further starts,
   repelled by what is known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.motion import Pass
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.symmetry import half_period_map
from gearrattle.errors import Cancelled, ConvergenceError
from gearrattle.model import Model
from gearrattle.orbits.family_ends import followed_through_families
from gearrattle.orbits.known_motions import Known, deflated, orbits_of_returns, search, search_symmetric, starts_of
from gearrattle.orbits.motion_families import free_count, room_of
from gearrattle.orbits.orbit import Orbit, linear_state, settled_state
from gearrattle.orbits.progress import Progress, never_falling, stretch_of
from gearrattle.orbits.start_states import state_of
from gearrattle.orbits.value_family import family_of, is_compiled
from gearrattle.time_limits import TimeLimit, limited
from gearrattle.wording import counted

_SPAN = 0.6  # share of the speed: range to either side
_STEP = 0.05  # longest step, as arclength
_POINTS = 600  # most points of one branch
_ALL_POINTS = 6000  # most points of all branches
_STARTS = 32  # starts of the first searches
_FURTHER = 64  # starts of the deflated Newton method
_SETTLED = 0.3  # share of the work: the first searches
_DEFLATED = 0.2  # share of the work: the deflated Newton method


class OverSpeed:
    """Follows motions over the speed; counts all points, and the branches that were left before their ends."""

    def __init__(self, model: Model, cycles: int, at_point: Callable[[], None]) -> None:
        self._speed = model.excitation.omega
        self._at_point = at_point
        self._span = _SPAN * self._speed
        family = family_of(model, "excitation.speed", self._speed, cycles, self._span)
        self._curve = Continuation(family, longest=_STEP)
        self.points = 0
        self.left = 0

    @property
    def is_used_up(self) -> bool:
        """Whether the allowed points are used up."""
        return self.points >= _ALL_POINTS

    def met_again(self, motion: Pass) -> Iterator[Pass]:
        """Yield the further motions at the model's speed on the branch through a motion."""
        for upward in (True, False):
            if not self.is_used_up:
                yield from self._one_way(motion, upward)

    def _one_way(self, motion: Pass, upward: bool) -> Iterator[Pass]:
        """Yield the further motions on the part of the branch that begins in one direction of the speed."""
        speed = self._speed
        last = self.points + _POINTS
        try:
            before = self._curve.begin(motion.start, speed, upward=upward)
            for point, _ in followed_through_families(self._curve, before, (speed - self._span, speed + self._span)):
                if (before.parameter - speed) * (point.parameter - speed) < 0.0:
                    yield self._curve.at_parameter(before, point, speed).motion
                before = point
                self.points += 1
                self._at_point()
                if self.points >= last or self.is_used_up:
                    self.left += 1
                    return
        except ConvergenceError:
            self.left += 1


def every_orbit(
    model: Model,
    cycles: int,
    progress: Callable[[float], None] | None = None,
    limit: TimeLimit | None = None,
) -> list[Orbit]:
    """Return all motions that repeat after ``cycles`` periods, by ascending swing.

    ``cycles`` of an orbit is the least number of periods after which it repeats. The notes on every orbit say whether
    the count of fixed points shows a missing motion or cannot be made, and which branches did not reach their ends.
    """
    searches = _searched(model, cycles, never_falling(progress), limit)
    last = searches[-1]
    if not last.known.motions:
        message = f"no motion that repeats after {counted(cycles, 'period')} was found"
        raise ConvergenceError(message, remedy="another number of cycles, or a start near one")
    notes = last.notes(sum(work.left for work in searches))
    if last.is_stopped:
        notes = (*notes, "The search was stopped before its end: there may be further motions.")
    orbits = [last.orbit(i, notes) for i in range(len(last.known.motions))]
    return sorted(orbits, key=lambda orbit: float(np.ptp(orbit.run.trajectory.deflection, axis=0).max(initial=0.0)))


def _searched(model: Model, cycles: int, report: Progress, limit: TimeLimit | None) -> list[_Search]:
    """Return the searches for all divisors of a number of periods, that for the number itself last.

    With a limit they end where the time is over, or where the progress raises ``Cancelled``: the last one is stopped.
    """
    searches = list[_Search]()
    divisors = [n for n in range(1, cycles + 1) if cycles % n == 0]
    for i, n in enumerate(divisors):
        begin, end = (sum(divisors[:j]) / sum(divisors) for j in (i, i + 1))  # work grows with the periods
        work = _Search(model, n, stretch_of(report, begin, end))
        for earlier in searches:
            if n % earlier.known.period_map.cycles == 0:
                work.take(earlier)
        searches.append(work)
        try:
            with limited(limit or TimeLimit()):
                work.settle()
                work.follow_from(work.taken)
                work.deflate()
        except (Cancelled, KeyboardInterrupt):
            if limit is None:
                raise
            work.is_stopped = True
            break
    return searches


class _Search:
    """The search for motions of n periods."""

    def __init__(self, model: Model, cycles: int, progress: Progress) -> None:
        system = assemble(model).system
        self.known = Known(PeriodMap(system, cycles), mirror=half_period_map(system))
        self.taken = 0
        self.is_stopped = False
        self._model = model
        self._progress = progress
        self._over_speed = OverSpeed(model, cycles, lambda: progress(_SETTLED))

    @property
    def left(self) -> int:
        """Number of branches over the speed that were not followed to their ends."""
        return self._over_speed.left

    def take(self, earlier: _Search) -> None:
        """Keep the motions of a search for a divisor of the number of periods."""
        period_map = self.known.period_map
        for motion, *_ in earlier.known.motions:
            try:
                same = shooting.shoot(period_map, motion.start).motion
            except ConvergenceError:  # disturbances grow so much that rounding matters
                same = period_map(motion.start)
            self.known.add(same)
        self.taken = len(self.known.motions)

    def settle(self) -> None:
        """Search from the model's own start and from states spread over its reach."""
        known = self.known
        period_map = self.known.period_map
        states = [settled_state(self._model, period_map), *starts_of(period_map, _STARTS)]
        if period_map.cycles == 1:
            with suppress(ConvergenceError):
                states.append(linear_state(period_map, state_of(self._model, period_map, "static")))
        for i, state in enumerate(states):
            search(known, state)
            self._progress(_SETTLED * (i + 1) / len(states))
        if is_compiled(period_map.system):
            with suppress(ConvergenceError):  # the motion settles on another number of periods
                for orbit in orbits_of_returns(period_map, states[0]):
                    known.add(orbit.motion)
                    self._progress(_SETTLED)
        half = half_period_map(period_map.system, period_map.cycles)
        if half is not None:
            search_symmetric(known, half, states[1 : 1 + _STARTS])

    def follow_from(self, first: int) -> None:
        """Follow the motions from an index on over the speed; keep those of their branches at the model's speed."""
        period_map = self.known.period_map
        # motions added in the loop lie on the branches of these, and need not be followed
        motions = [known.motion for known in self.known.motions[first:] if not known.is_image]
        for i, motion in enumerate(motions):
            if not free_count(period_map, motion) or room_of(period_map, motion) is not None:
                for other in self._over_speed.met_again(motion):
                    self.known.add(other)
            self._progress(_SETTLED + (1.0 - _SETTLED - _DEFLATED) * (i + 1) / len(motions))

    def deflate(self) -> None:
        """Search by the deflated Newton method while the count of fixed points shows that a motion is missing."""
        known = self.known
        for i, state in enumerate(() if known.not_counted else starts_of(known.period_map, _FURTHER, seed=1)):
            if known.index() == 1:
                break
            count = len(known.motions)
            motion = deflated(known, state)
            if motion is not None and known.add(motion):
                self.follow_from(count)
            self._progress(1.0 - _DEFLATED * (1.0 - i / _FURTHER))
        self._progress(1.0)

    def notes(self, left: int) -> tuple[str, ...]:
        """Notes on the count of fixed points, and on the ``left`` branches of all searches."""
        notes = list[str]()
        if self.known.not_counted:
            notes.append(f"Whether all motions were found cannot be counted: {self.known.not_counted}.")
        elif (index := self.known.index()) != 1:
            notes.append(f"A motion is missing: the signs of det(I - M) add up to {index} instead of 1.")
        if self._over_speed.is_used_up:
            stopped = f"Branches over the speed were left after {counted(self._over_speed.points, 'point')}"
            notes.append(f"{stopped}; they may lead to further motions.")
        elif left:
            stopped = f"{counted(left, 'branch', 'branches')} over the speed could not be followed to the end"
            notes.append(f"{stopped}; there may be further motions.")
        return tuple(notes)

    def orbit(self, i: int, notes: tuple[str, ...]) -> Orbit:
        """Return a motion with the fewest periods after which it repeats."""
        model = self._model
        period_map = self.known.period_map
        motion, states, *_ = self.known.motions[i]
        cycles = len(states)
        if cycles == period_map.cycles:
            residual = shooting.residual_of(period_map, motion)
            return Orbit(model, cycles, motion, residual, free_count(period_map, motion), notes)
        orbit = shooting.shoot(PeriodMap(period_map.system, cycles), motion.start)
        return Orbit(model, cycles, orbit.motion, orbit.residual, orbit.free.shape[1], notes)
