"""Which periodic motion a motion has settled in, and in which ones motions from many starts settle.

A settled motion is only near to the one that repeats. Newton's method from there gives the latter to rounding, and with
it its period, its multipliers and its verdict. It counts if it is stable and near to where the search began; how fast a
train turns as a whole, which drag alone decides, may differ.

``settled_motions`` draws states within the reach of a driveline (``search.starts_of``) and follows each until it
repeats. The trains turn as fast as in a given motion, which would else take thousands of periods to come back to. The
states are evenly spread, so the share that settles in a motion estimates the share of the reach that its basin has.
That no start settles in a further motion does not show that there is none.

Takes a Model and states; gives Orbits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.period_map import PeriodMap, State
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.orbits.orbit import Orbit, orbit_of
from gearrattle.orbits.search import starts_of, states_of_periods, without
from gearrattle.signals.shares import wilson
from gearrattle.signals.strobe import period_number

Array = NDArray[np.float64]

KINDS = {"quiet": "quiet", "single-sided": "single-sided rattle", "double-sided": "double-sided rattle"}
"""What a motion is, by its verdict."""
STARTS = 24
BLOCK, BLOCKS = 32, 5
"""Periods between two looks at whether a motion repeats, and after how many looks it counts as not settled."""
_LONGEST = 8  # periods after which a motion may repeat
_REPEATS = 1e-3  # of the size of the state: what repeats as well as this is searched for
_NEAR = 0.02  # of the size of the state: a motion that has settled is as near as this
_STILL = 1e-6  # of the largest part of a free direction: a deflection that moves by less stays


def motion_names(kinds: Sequence[tuple[str, int]], families: Sequence[bool] = ()) -> list[str]:
    """Return what motions are: "single-sided rattle, 2 T"; those that would have one name are numbered.

    Parameters
    ----------
    kinds
        of every motion its verdict, and after how many periods T it repeats.
    families
        of every motion whether it is one of a family; none of them by default.
    """
    is_family = [*families, *[False] * (len(kinds) - len(families))]
    plain = [
        f"{KINDS[verdict]}, {cycles} T{', a family' if family else ''}"
        for (verdict, cycles), family in zip(kinds, is_family, strict=True)
    ]
    total, so_far = Counter(plain), Counter[str]()
    names = []
    for name in plain:
        so_far[name] += 1
        names.append(f"{name} ({so_far[name]})" if total[name] > 1 else name)
    return names


class Attractor:
    """A stable periodic motion that states are compared with.

    Parameters
    ----------
    orbit
        the motion.
    """

    def __init__(self, orbit: Orbit) -> None:
        period_map = orbit.period_map
        self.orbit, self._scale, self._size = orbit, period_map.scale, period_map.size
        self._states = states_of_periods(period_map, orbit.motion)
        free = shooting.newton_step(period_map, orbit.motion)[1]
        self._kept = np.linalg.qr(np.hstack([free, turning(period_map)]) * self._scale[:, None])[0]

    def is_near(self, state: State, tolerance: float = _NEAR) -> bool:
        """Return whether a state is as near as ``tolerance``, in units of its size, at the start of some period.

        Free directions, and how fast trains turn as a whole, do not count.
        """
        y = state.y * self._scale
        size = max(self._size, float(np.linalg.norm(y)))
        return any(float(np.linalg.norm(without(y - other, self._kept))) < tolerance * size for other in self._states)

    @property
    def moves_deflections(self) -> bool:
        """Whether it is one of a family of motions that differ in their deflections: a body floats in its gap."""
        period_map = self.orbit.period_map
        free = shooting.newton_step(period_map, self.orbit.motion)[1] * self._scale[:, None]
        deflections = np.abs(free[: len(period_map.flow.coordinates.elements)])
        return bool(np.any(deflections > _STILL * np.abs(free).max(initial=0.0)))


def turning(period_map: PeriodMap) -> Array:
    """Return (N, R) changes of state in which a whole train turns faster."""
    motion = relative_coordinates(period_map.system).angle_from_reference
    first = len(period_map.flow.coordinates.elements)
    directions = np.zeros((len(period_map.scale), motion.shape[1]))
    directions[first : first + len(motion)] = motion
    return directions


def settled_orbit(model: Model, state: State, cycles: int) -> Orbit | None:
    """Return the stable motion in which a motion has settled, with the fewest periods after which it repeats.

    Parameters
    ----------
    model
        the driveline; its inputs repeat.
    state
        of the settled motion at the start of a period.
    cycles
        periods after which it about repeats.

    Returns
    -------
    Orbit or None
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
        return motion if motion.stable and Attractor(motion).is_near(state) else None
    except (ConvergenceError, np.linalg.LinAlgError):
        return None


@dataclass(frozen=True)
class Settled:
    """In which stable motions motions from many starts settle.

    Attributes
    ----------
    orbits
        the motions, the one that most starts settle in first.
    counts
        (A,) how many starts settle in each.
    starts
        how many there are.
    own
        index of the motion in which the given state settles; -1 if it does not settle.
    """

    orbits: tuple[Orbit, ...]
    counts: tuple[int, ...]
    starts: int
    own: int

    @property
    def unsettled(self) -> int:
        """How many starts had not settled when they were given up."""
        return self.starts - sum(self.counts)

    @property
    def names(self) -> list[str]:
        """What every motion is."""
        return motion_names([(orbit.verdict.verdict, orbit.cycles) for orbit in self.orbits])

    def interval(self, i: int) -> tuple[float, float]:
        """Return Wilson's 95 % interval of the share of the reach that the basin of a motion has."""
        low, high = wilson(self.counts[i], self.starts)
        return float(low), float(high)


def settled_motions(
    model: Model, state: State, starts: int = STARTS, progress: Callable[[float], None] | None = None
) -> Settled:
    """Return the motions in which a driveline settles from states within its reach.

    Parameters
    ----------
    model
        the driveline; its inputs repeat.
    state
        of a motion of its own at the start of a period: trains turn as fast as in that one.
    starts
        how many states are drawn besides.
    progress
        called with the finished share; what it raises ends the work.
    """
    search = _Search(model)
    own, counts = search.settled_in(state), Counter[int | None]()
    for i, start in enumerate(starts_of(search.map, starts), 1):
        counts[search.settled_in(search.turned_like(state, start))] += 1
        if progress is not None:
            progress(i / starts)
    known = list(range(len(search.attractors)))
    order = sorted(known, key=lambda i: -counts[i])
    orbits = tuple(search.attractors[i].orbit for i in order)
    return Settled(orbits, tuple(counts[i] for i in order), starts, -1 if own is None else order.index(own))


class _Search:
    """The motions met so far."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.map = PeriodMap(assemble(model).system, 1)
        self.attractors: list[Attractor] = []
        self._turning = np.linalg.qr(turning(self.map) * self.map.scale[:, None])[0]

    def turned_like(self, like: State, state: State) -> State:
        """A state whose trains turn as fast as in another one."""
        change = (like.y - state.y) * self.map.scale
        return State(state.y + (change - without(change, self._turning)) / self.map.scale, state.auxiliary_pieces)

    def settled_in(self, state: State) -> int | None:
        """The index of the motion that a state settles in; None if it does not settle, or to nothing that is known."""
        for _ in range(BLOCKS):
            try:
                march = self.map.marched(state, BLOCK)
            except ConvergenceError:
                return None
            rows = [self.map.sampled(march, row) for row in range(BLOCK // 2, BLOCK + 1)]
            state = rows[-1]
            cycles = self._period_number(rows)
            if cycles:
                return self._known(state, cycles)
        return None

    def _period_number(self, rows: Sequence[State]) -> int:
        """After how many periods states about repeat; 0 if they do not."""
        points = np.array([without(row.y * self.map.scale, self._turning) for row in rows])
        size = max(self.map.size, float(np.linalg.norm(points, axis=1).max()))
        return period_number(points / size, _REPEATS, _LONGEST)

    def _known(self, state: State, cycles: int) -> int | None:
        """The index of the motion that is near to a state, found by shooting if it is a new one."""
        near = next((i for i, attractor in enumerate(self.attractors) if attractor.is_near(state)), None)
        if near is not None:
            return near
        orbit = settled_orbit(self.model, state, cycles)
        if orbit is None:
            return None
        self.attractors.append(Attractor(orbit))
        return len(self.attractors) - 1
