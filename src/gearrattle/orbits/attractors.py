"""Which periodic motion a motion has settled in, and in which ones motions from many starts settle.

A settled motion is only near to the one that repeats. Newton's method from there gives the latter to rounding, and with
it its period, its multipliers and its verdict. It counts if it is stable and near to where the search began; how fast a
train turns as a whole, which drag alone decides, may differ. What counts as near is measured by the swing of every part
of the state, and by the smallest clearance where it swings less: a soft part that is wound up far, or swings far, hides
nothing of the others.

``settled_motions`` draws states within the reach of a driveline (``known_motions.starts_of``) and follows each until it
repeats. The trains turn as fast as in a given motion, which would else take thousands of periods to come back to, and
parts without a clearance are wound up as in that one: all that begins far from there would come from one side. The
states are evenly spread, so the share that settles in a motion estimates the share of the reach that its basin has.
That no start settles in a further motion does not show that there is none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.orbits.known_motions import starts_of, states_of_periods, turning, without
from gearrattle.orbits.motion_families import free_space_of, without_free
from gearrattle.orbits.orbit import Orbit, orbit_of
from gearrattle.orbits.progress import never_falling
from gearrattle.orbits.settling_limits import BLOCK, BLOCKS, LONGEST, STARTS
from gearrattle.signals.strobe import period_number
from gearrattle.signals.wilson_interval import wilson

Array = NDArray[np.float64]
KINDS = {
    "quiet": "quiet",
    "touches": "touches",
    "single-sided": "single-sided rattle",
    "double-sided": "double-sided rattle",
}
"""What a motion is, by the headline of its verdict."""
NEAR_SLOWLY = 0.1
"""The same as ``_NEAR`` of a motion that settles slowly: Newton's method distinguishes it from others."""
_REPEATS = 1e-3  # of the units of a motion: what repeats as well as this is searched for
_ABOUT_REPEATS = 1e-2  # the same at the last look: a train with little drag settles slowly
_NEAR = 0.02  # of the units of a motion: one that has settled is as near as this
_SAME = 1e-4  # of the units of a motion: those that Newton's method gives are the same
_CHUNK = 8  # passes between two looks at whether a motion has settled
_DETOUR = 3.0  # times what is left of a distance that falls evenly: what is farther has left a motion
_SETTLING = 2.0  # times as long as small disturbances need, where the motion is about linear
_SAMPLES = 32  # of a period in which swings are taken
_STILL = 1e-6  # of the largest part of a free direction: a deflection that moves by less stays


def motion_names(kinds: Sequence[tuple[str, int]], families: Sequence[bool] = ()) -> list[str]:
    """Return what motions are: "single-sided rattle, 2 T"; those that would have one name are numbered."""
    is_family = [*families, *[False] * (len(kinds) - len(families))]
    plain = [
        f"{KINDS[verdict]}, {cycles} T{', a family' if family else ''}"
        for (verdict, cycles), family in zip(kinds, is_family, strict=True)
    ]
    total = Counter(plain)
    so_far = Counter[str]()
    names = []
    for name in plain:
        so_far[name] += 1
        names.append(f"{name} ({so_far[name]})" if total[name] > 1 else name)
    return names


class Attractor:
    """A periodic motion that states are compared with."""

    def __init__(self, orbit: Orbit) -> None:
        period_map = orbit.period_map
        self.orbit = orbit
        self._scale = period_map.scale
        self._states = states_of_periods(period_map, orbit.motion)
        self._units = units_of(period_map, orbit.motion.start)
        free = free_space_of(period_map, orbit.motion)
        self._kept = np.linalg.qr(np.hstack([free, turning(period_map)]) * self._scale[:, None])[0]

    def distance(self, state: State) -> float:
        """Return the largest difference of a state from the nearest at the start of a period, in units of the motion.

        Free directions, and how fast trains turn as a whole, do not count.
        """
        y = state.y * self._scale
        return min(float(np.abs(without(y - other, self._kept) / self._units).max()) for other in self._states)

    def is_near(self, state: State, tolerance: float = _NEAR) -> bool:
        """Return whether a state is as near as ``tolerance``."""
        return self.distance(state) < tolerance

    def attracts(self, state: State, passes: int) -> bool:
        """Return whether the motion from a state at the start of a period settles in this one without a detour.

        It is given up once it is farther away than what settles evenly in so many passes, times three. A motion that
        wanders between others first may settle in this one in the end, but rounding decides that.

        Raises ConvergenceError: it could not be followed.
        """
        begin = self.distance(state)
        for done in range(0, passes, _CHUNK):
            distance = self.distance(state)
            if distance < _SAME:
                return True
            if distance > _DETOUR * begin * _SAME ** (done / passes):
                return False
            state = self.orbit.period_map.later(state, _CHUNK)
        return self.is_near(state, _SAME)

    @property
    def moves_deflections(self) -> bool:
        """Whether it is one of a family of motions that differ in their deflections: a body floats in its gap."""
        period_map = self.orbit.period_map
        free = free_space_of(period_map, self.orbit.motion) * self._scale[:, None]
        deflections = np.abs(free[: len(period_map.flow.coordinates.elements)])
        return bool(np.any(deflections > _STILL * np.abs(free).max(initial=0.0)))


def passes_to_settle(multipliers: NDArray[np.complex128], free: int) -> int:
    """Return after how many passes of a stable motion others have settled in it."""
    others = np.abs(without_free(multipliers, free))
    largest = float(np.clip(others.max(initial=0.0), _SAME, 1.0 - 1e-12))
    return int(np.ceil(_SETTLING * np.log(_SAME) / np.log(largest))) + _CHUNK


def units_of(period_map: PeriodMap, state: State) -> Array:
    """Return by which (N,) distances from a motion are measured, one for each balanced coordinate.

    It is half the swing about the mean, which has no static part, and at least the smallest clearance: what swings less
    is as good as still.
    """
    march = period_map.marched(state, 1, _SAMPLES)
    y = march.samples.states[:, : period_map.flow.states]
    swings = 0.5 * np.ptp(y, axis=0)
    corners = []
    for i, k in enumerate(period_map.flow.coordinates.elements):
        law = period_map.system.laws[k]
        if law.corners.size:  # where all lie at zero, the deflection that keeps it in contact stands for them
            corner = float(np.abs(law.corners).max()) * period_map.scale[i]
            corners.append(corner or float(np.abs(y[:, i]).max()))
    least = min((corner for corner in corners if corner > 0.0), default=period_map.size)
    return np.asarray(np.maximum(swings, least))


def repeats_after(period_map: PeriodMap, states: Sequence[State], tolerance: float) -> int:
    """Return after how many periods states at their starts about repeat, at most ``LONGEST``; 0 if they do not.

    How fast trains turn as a whole does not count; the tolerance is in units of the motion.
    """
    turns = np.linalg.qr(turning(period_map) * period_map.scale[:, None])[0]
    points = np.array([without(state.y * period_map.scale, turns) for state in states])
    return period_number(points / units_of(period_map, states[-1]), tolerance, LONGEST)


def settled_orbit(model: Model, state: State, cycles: int) -> Orbit | None:
    """Return the stable motion in which a motion has settled, with the fewest periods after which it repeats.

    None where Newton's method leads to none that is near and stable.
    """
    system = assemble(model).system
    period_map = PeriodMap(system, cycles)
    try:
        orbit = shooting.shoot(period_map, state)
        fewest = len(states_of_periods(period_map, orbit.motion))
        if fewest < cycles:
            period_map = PeriodMap(system, fewest)
            orbit = shooting.shoot(period_map, orbit.motion.start)
        motion = orbit_of(model, period_map, orbit)
        return motion if motion.stable and Attractor(motion).is_near(state, NEAR_SLOWLY) else None
    except (ConvergenceError, np.linalg.LinAlgError):
        return None


@dataclass(frozen=True)
class Settled:
    """In which stable motions motions from many starts settle."""

    orbits: tuple[Orbit, ...]  # the motions, the one that most starts settle in first
    counts: tuple[int, ...]  # (A,) how many starts settle in each
    starts: int  # how many there are
    # index of the motion in which the given state settles; -1 if it does not settle, or was not followed so far
    own: int
    left_out: int = 0  # how many further starts were to be followed, had the periods allowed sufficed

    @property
    def unsettled(self) -> int:
        """How many starts had not settled when they were given up."""
        return self.starts - sum(self.counts)

    @cached_property
    def names(self) -> list[str]:
        """What every motion is."""
        kinds = [(orbit.verdict.headline, orbit.cycles) for orbit in self.orbits]
        return motion_names(kinds, [Attractor(orbit).moves_deflections for orbit in self.orbits])

    def interval(self, i: int) -> tuple[float, float]:
        """Return Wilson's 95 % interval of the share of the reach that the basin of a motion has."""
        low, high = wilson(self.counts[i], self.starts)
        return float(low), float(high)


def settled_motions(
    model: Model,
    state: State,
    starts: int = STARTS,
    progress: Callable[[float], None] | None = None,
    *,
    most_periods: float = np.inf,
    most_regions: float = np.inf,
) -> Settled:
    """Return the motions in which a driveline settles from states within its reach.

    At most so many periods are followed, and regions built beyond those of the first state's motion; the starts that
    these do not suffice for are left out.
    """
    search = _Search(model, most_periods, most_regions)
    report = never_falling(progress)
    counts = Counter[int | None]()
    own = None
    followed = 0
    try:
        own = search.settled_in(state)
        search.count_regions()
        wound_up = search.wound_up(state)
        for start in starts_of(search.map, starts):
            begun = search.turned_like(state, State(start.y + wound_up, start.auxiliary_pieces))
            counts[search.settled_in(begun)] += 1
            followed += 1
            report(followed / starts)
    except _Spent:
        pass
    known = list(range(len(search.attractors)))
    order = sorted(known, key=lambda i: -counts[i])
    orbits = tuple(search.attractors[i].orbit for i in order)
    index = -1 if own is None else order.index(own)
    return Settled(orbits, tuple(counts[i] for i in order), followed, index, starts - followed)


class _Spent(Exception):
    """The periods that may be followed are used up, or the regions that may be built."""


class _Search:
    """The motions met so far."""

    def __init__(self, model: Model, most_periods: float, most_regions: float) -> None:
        self.model = model
        self.left = most_periods
        self._most_regions = most_regions
        self._built = -np.inf
        self._regions = 0
        self.map = PeriodMap(assemble(model).system, 1)
        self.attractors: list[Attractor] = []
        self._turning = np.linalg.qr(turning(self.map) * self.map.scale[:, None])[0]

    def count_regions(self) -> None:
        """Count the regions that are built from now on."""
        self._built = 0
        self._regions = self.map.regions

    def wound_up(self, state: State) -> Array:
        """By how much (N,) parts without a clearance are wound up in the mean over a period, zero elsewhere [SI]."""
        march = self.map.marched(state, 1, _SAMPLES)
        mean = march.samples.states[:-1, : self.map.flow.states].mean(axis=0) / self.map.scale
        elements = self.map.flow.coordinates.elements
        is_linear = np.zeros(len(mean), dtype=np.bool_)
        is_linear[: len(elements)] = [self.map.system.laws[k].corners.size == 0 for k in elements]
        return np.where(is_linear, mean, 0.0)

    def turned_like(self, like: State, state: State) -> State:
        """A state whose trains turn as fast as in another one."""
        change = (like.y - state.y) * self.map.scale
        return State(state.y + (change - without(change, self._turning)) / self.map.scale, state.auxiliary_pieces)

    def settled_in(self, state: State) -> int | None:
        """The index of the motion that a state settles in; None if it does not settle, or to nothing that is known."""
        for block in range(1, BLOCKS + 1):
            if self.left < BLOCK or self._built > self._most_regions:
                raise _Spent
            self.left -= BLOCK
            try:
                march = self.map.marched(state, BLOCK)
            except ConvergenceError:
                return None
            # where memory is full, regions are built anew
            regions = self.map.regions
            self._built += regions - self._regions if regions >= self._regions else regions
            self._regions = regions
            rows = [self.map.sampled(march, row) for row in range(BLOCK // 2, BLOCK + 1)]
            state = rows[-1]
            cycles = repeats_after(self.map, rows, _REPEATS if block < BLOCKS else _ABOUT_REPEATS)
            if cycles:
                return self._known(state, cycles)
        return None

    def _known(self, state: State, cycles: int) -> int | None:
        """The index of the motion that is near to a state, found by shooting if it is a new one."""
        near, distance = self._nearest(state)
        if distance < _NEAR:
            return near
        orbit = settled_orbit(self.model, state, cycles)
        if orbit is None:
            return near if distance < NEAR_SLOWLY else None
        same, distance = self._nearest(orbit.motion.start)
        if distance < _SAME:
            return same
        self.attractors.append(Attractor(orbit))
        return len(self.attractors) - 1

    def _nearest(self, state: State) -> tuple[int, float]:
        """The index of the motion nearest to a state, and how far it is."""
        distances = [attractor.distance(state) for attractor in self.attractors]
        return int(np.argmin(distances)) if distances else -1, min(distances, default=np.inf)
