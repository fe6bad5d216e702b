"""Periodic motions on which simulated motions settle: from one state, and from many starts.

A settled motion is only near to a periodic motion. From there Newton's method gives the periodic motion to rounding,
with its period, its multipliers and its verdict. It counts if it is stable and near to the state of the search's start.
The mean speed of a train, which only drag decides, may differ. Distances are measured in units of the motion, one for
each coordinate of the state: half the swing of that coordinate, at least the smallest clearance. So a soft part with a
large deflection does not hide differences of the other parts.

``settled_motions`` draws states within the reach of a driveline (``known_motions.starts_of``) and simulates from each
until the motion repeats. Two things are taken from a given motion: the mean speeds of the trains, which otherwise would
take thousands of periods to settle; and the mean deflections of parts without a clearance, because without them all
starts would lie on one side of the motion. The states are evenly spread, so the share of starts that settle on a motion
estimates the share of the reach that its basin takes. If no start settles on a further motion, such a motion may still
exist.
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
"""In units of a motion: the limit ``_NEAR`` for a motion that settles slowly, which Newton's method then confirms."""
_REPEATS = 1e-3  # in units of a motion: states that repeat to this start Newton's method
_ABOUT_REPEATS = 1e-2  # the same at the last check, because a train with little drag settles slowly
_NEAR = 0.02  # in units of a motion: a nearer state has settled on the motion
_SAME = 1e-4  # in units of a motion: nearer results of Newton's method are the same motion
_CHUNK = 8  # passes of the period map between two checks whether a motion has settled
_DETOUR = 3.0  # times the distance of a motion that settles at an even rate: a larger distance has left the motion
_SETTLING = 2.0  # ratio of the time allowed to the time in which small disturbances die out
_SAMPLES = 32  # samples in a period for the swings
_STILL = 1e-6  # share of the largest part of a free direction: smaller parts count as zero


def motion_names(kinds: Sequence[tuple[str, int]], families: Sequence[bool] = ()) -> list[str]:
    """Return names of motions, such as "single-sided rattle, 2 T"; equal names are numbered."""
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
    """A periodic motion with which states are compared."""

    def __init__(self, orbit: Orbit) -> None:
        period_map = orbit.period_map
        self.orbit = orbit
        self._scale = period_map.scale
        self._states = states_of_periods(period_map, orbit.motion)
        self._units = units_of(period_map, orbit.motion.start)
        free = free_space_of(period_map, orbit.motion)
        self._kept = np.linalg.qr(np.hstack([free, turning(period_map)]) * self._scale[:, None])[0]

    def distance(self, state: State) -> float:
        """Return the largest difference of a state from the nearest start of a period, in units of the motion.

        Differences along free directions and in the mean speeds of trains are left out.
        """
        y = state.y * self._scale
        return min(float(np.abs(without(y - other, self._kept) / self._units).max()) for other in self._states)

    def is_near(self, state: State, tolerance: float = _NEAR) -> bool:
        """Return whether the distance of a state is below a tolerance, in units of the motion."""
        return self.distance(state) < tolerance

    def attracts(self, state: State, passes: int) -> bool:
        """Return whether the motion from a state at the start of a period settles on this one without a detour.

        The distance must stay below ``_DETOUR`` times that of a motion which settles at an even rate in ``passes``
        passes. A motion that first wanders near other motions may settle on this one in the end, but rounding decides
        that.

        Raises ConvergenceError: the motion could not be simulated.
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
        """Whether the motion belongs to a family of motions with different deflections: a body floats in its gap."""
        period_map = self.orbit.period_map
        free = free_space_of(period_map, self.orbit.motion) * self._scale[:, None]
        deflections = np.abs(free[: len(period_map.flow.coordinates.elements)])
        return bool(np.any(deflections > _STILL * np.abs(free).max(initial=0.0)))


def passes_to_settle(multipliers: NDArray[np.complex128], free: int) -> int:
    """Return the number of passes of the period map after which nearby motions have settled on a stable motion."""
    others = np.abs(without_free(multipliers, free))
    largest = float(np.clip(others.max(initial=0.0), _SAME, 1.0 - 1e-12))
    return int(np.ceil(_SETTLING * np.log(_SAME) / np.log(largest))) + _CHUNK


def units_of(period_map: PeriodMap, state: State) -> Array:
    """Return the units of a motion (N,), one for each balanced coordinate.

    A unit is half the swing of the coordinate, without its static part, but at least the smallest clearance.
    """
    march = period_map.marched(state, 1, _SAMPLES)
    y = march.samples.states[:, : period_map.flow.states]
    swings = 0.5 * np.ptp(y, axis=0)
    corners = []
    for i, k in enumerate(period_map.flow.coordinates.elements):
        law = period_map.system.laws[k]
        if law.corners.size:  # if all corners are zero, the deflection in contact replaces them
            corner = float(np.abs(law.corners).max()) * period_map.scale[i]
            corners.append(corner or float(np.abs(y[:, i]).max()))
    least = min((corner for corner in corners if corner > 0.0), default=period_map.size)
    return np.asarray(np.maximum(swings, least))


def repeats_after(period_map: PeriodMap, states: Sequence[State], tolerance: float) -> int:
    """Return the number of periods, at most ``LONGEST``, after which states at starts of periods repeat; 0 if never.

    Differences in the mean speeds of trains are left out; the tolerance is in units of the motion.
    """
    turns = np.linalg.qr(turning(period_map) * period_map.scale[:, None])[0]
    points = np.array([without(state.y * period_map.scale, turns) for state in states])
    return period_number(points / units_of(period_map, states[-1]), tolerance, LONGEST)


def settled_orbit(model: Model, state: State, cycles: int) -> Orbit | None:
    """Return the stable periodic motion on which a motion has settled, with the fewest periods.

    None if Newton's method leads to no motion that is near and stable.
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
    """Stable motions on which motions from many starts settle."""

    orbits: tuple[Orbit, ...]  # A motions, by descending number of starts
    counts: tuple[int, ...]  # (A,) number of starts that settle on each motion
    starts: int  # number of starts that were simulated
    own: int  # index of the motion on which the given state settles; -1 if it does not settle, or was given up
    left_out: int = 0  # number of further starts for which the allowed periods did not suffice

    @property
    def unsettled(self) -> int:
        """Number of starts that had not settled when they were given up."""
        return self.starts - sum(self.counts)

    @cached_property
    def names(self) -> list[str]:
        """Name of every motion."""
        kinds = [(orbit.verdict.headline, orbit.cycles) for orbit in self.orbits]
        return motion_names(kinds, [Attractor(orbit).moves_deflections for orbit in self.orbits])

    def interval(self, i: int) -> tuple[float, float]:
        """Return Wilson's 95 % interval of the share of the reach that the basin of a motion takes."""
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
    """Return the motions on which a driveline settles from states within its reach.

    ``most_periods`` limits the periods of all simulations, ``most_regions`` the regions built after the first state's
    motion has settled. The starts for which these do not suffice are left out.
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
    """The allowed periods or regions are used up."""


class _Search:
    """A search for settled motions, and the motions known so far."""

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
        """(N,) mean deflections over a period of parts without a clearance; zero elsewhere [SI]."""
        march = self.map.marched(state, 1, _SAMPLES)
        mean = march.samples.states[:-1, : self.map.flow.states].mean(axis=0) / self.map.scale
        elements = self.map.flow.coordinates.elements
        is_linear = np.zeros(len(mean), dtype=np.bool_)
        is_linear[: len(elements)] = [self.map.system.laws[k].corners.size == 0 for k in elements]
        return np.where(is_linear, mean, 0.0)

    def turned_like(self, like: State, state: State) -> State:
        """A state with the mean speeds of the trains taken from another state."""
        change = (like.y - state.y) * self.map.scale
        return State(state.y + (change - without(change, self._turning)) / self.map.scale, state.auxiliary_pieces)

    def settled_in(self, state: State) -> int | None:
        """The index of the motion on which a state settles; None if it does not settle, or Newton's method fails."""
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
        """The index of the motion near a state; a new motion is located by Newton's method. None if that fails."""
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
        """The index of the motion nearest to a state, and the distance; -1 and infinity without motions."""
        distances = [attractor.distance(state) for attractor in self.attractors]
        return int(np.argmin(distances)) if distances else -1, min(distances, default=np.inf)
