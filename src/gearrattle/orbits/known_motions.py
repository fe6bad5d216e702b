"""Periodic motions of one driveline that are known, and the searches for others.

Of a symmetric driveline every motion has a mirror image: half a period later, all angles and torques reversed, it is a
motion as well, after whatever number of periods it repeats. That is kept with it.

States spread over the reach of the driveline are followed until they settle. Newton's method begins from the settled
states and from the first ones. With deflation it is repelled by the known motions.

An irregular motion comes near to unstable periodic motions again and again: close returns. So the motion is followed
for many periods, and Newton's method begins where it comes nearest to itself n periods later. Where that finds nothing,
disturbances grow much within a period: then the states at every eighth of a period are sought together
(``engine.periodic.multiple_shooting``).

P. E. Farrell, A. Birkisson, S. W. Funke, SIAM J. Sci. Comput. 37 (2015), A2026-A2045, for the deflation.
D. Auerbach, P. Cvitanovic, J.-P. Eckmann, G. Gunaratne, I. Procaccia, Phys. Rev. Lett. 58 (1987), 2387-2389, for close
returns.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.events.slider_release import lets_go
from gearrattle.engine.periodic.motion import Pass, State
from gearrattle.engine.periodic.multiple_shooting import EIGHTHS
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.symmetry import HalfPeriodMap
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.motion_families import free_space_of, off_edge, size_of, within_family
from gearrattle.signals.strobe import period_number
from gearrattle.wording import counted

Array = NDArray[np.float64]

_SETTLING = 48  # periods
_REACH = 4.0  # of the largest corner
_SAME = 1e-6  # of the size of the state: motions nearer than this are the same
_NEAR = 1e-3  # of the largest corner: a gap from which plain Newton's method goes on
_DEFLATED = 40  # steps of Newton's method from each start
_PERIODS = 2048  # in which returns are looked for
_FEW_PERIODS = 256  # in which a motion is to settle where no returns are looked for
_TRIES = ((0, 32), (EIGHTHS, 8))  # parts of a period, and periods of all motions that Newton's method begins with
_ONE_TRY = ((0, 1),)  # where the motion has settled: all returns lead to the same one
_MEAN_OVER = 128  # periods over which the mean speed of a train is taken
_CORRECTIONS = 2  # how often
_RETURNS = 1e-3  # of the size of the state: what repeats as well as this has settled
_LONGEST = 64  # periods after which a motion may repeat


class KnownMotion(NamedTuple):
    """A motion that is known, and by what others differ from it."""

    motion: Pass
    states: list[Array]  # (N,) at the start of every period, in balanced coordinates
    free: Array  # (N, F) directions in which neighbours repeat as well, balanced, orthonormal: these count as the same
    is_image: bool  # whether it was kept as the mirror image of another one


@dataclass
class Known:
    """Motions that repeat after n periods, no two of them the same except for a shift by whole periods."""

    period_map: PeriodMap  # of the driveline, over n periods
    motions: list[KnownMotion] = field(default_factory=list)
    # over half of one period, for a symmetric driveline of which mirror images are kept too; else None
    mirror: HalfPeriodMap | None = None

    def add(self, motion: Pass) -> bool:
        """Keep a motion, or the family at whose edge it lies, and its mirror image; False if it is known."""
        if not self._keep(motion):
            return False
        if self.mirror is not None:
            with suppress(ConvergenceError, np.linalg.LinAlgError):
                image = self.mirror.later(self.motions[-1].motion.start)
                self._keep(shooting.shoot(self.period_map, image).motion, is_image=True)
        return True

    def _keep(self, motion: Pass, *, is_image: bool = False) -> bool:
        """Keep a motion, or the family at whose edge it lies; False if it is known."""
        inside = within_family(self.period_map, motion)
        if self.holds(inside.start):
            return False
        motion = motion if inside is motion else off_edge(self.period_map, motion)
        directions = free_space_of(self.period_map, motion) * self.period_map.scale[:, None]
        states = states_of_periods(self.period_map, motion)
        self.motions.append(KnownMotion(motion, states, np.linalg.qr(directions)[0], is_image))
        return True

    def holds(self, state: State) -> bool:
        """Return whether a state is that of a known motion at the start of one of its periods."""
        start = state.y * self.period_map.scale
        size = size_of(self.period_map, state)
        return any(
            bool(np.linalg.norm(without(start - other, known.free)) < _SAME * size)
            for known in self.motions
            for other in known.states
        )

    @property
    def not_counted(self) -> str:
        """Why the sum of the signs need not be 1; empty where it is 1 if no motion is missing."""
        if lets_go(self.period_map.system):
            return "a slider may be let go with its torque"
        return "a motion is one of a family" if any(known.free.shape[1] for known in self.motions) else ""

    def index(self) -> int:
        """Return the sum of the signs of det(I - M) over all fixed points."""
        total = 0
        for motion, states, *_ in self.motions:
            sign = np.sign(np.linalg.det(np.eye(len(motion.gap)) - motion.gradient))
            total += int(sign) * len(states)
        return total


def without(change: Array, free: Array) -> Array:
    """Return the part of a change (N,) at right angles to free directions (N, F), which are orthonormal."""
    return np.asarray(change - free @ (free.T @ change))


def states_of_periods(period_map: PeriodMap, motion: Pass) -> list[Array]:
    """Return the (N,) balanced states of a motion at the start of every period.

    Where the motion repeats sooner than after all periods of the map, each state is given once.
    """
    once = PeriodMap(period_map.system, 1)
    scale = period_map.scale
    states = [motion.start.y * scale]
    state = motion.start
    for _ in range(period_map.cycles - 1):
        state = once.later(state)
        y = state.y * scale
        if np.linalg.norm(y - states[0]) < _SAME * max(period_map.size, float(np.linalg.norm(y))):
            break
        states.append(y)
    return states


def starts_of(period_map: PeriodMap, count: int, seed: int = 0) -> Iterator[State]:
    """Yield states spread over the reach of a driveline: up to 4 times the largest corner in balanced coordinates."""
    from scipy.stats import qmc

    scale = period_map.scale
    points = qmc.Halton(len(scale), seed=seed).random(count)
    for point in points:
        y = _REACH * period_map.size * (2.0 * point - 1.0)
        memories = period_map.flow.memory.size
        y[len(y) - memories :] = 0.0
        yield State(y / scale)


def search(known: Known, state: State) -> None:
    """Search for a motion from where a state settles, and from the state itself; keep what is found."""
    period_map = known.period_map
    with suppress(ConvergenceError, np.linalg.LinAlgError):
        later = period_map.later(state, -(-_SETTLING // period_map.cycles))
        known.add(shooting.shoot(period_map, later, settle=1).motion)
    with suppress(ConvergenceError, np.linalg.LinAlgError):
        known.add(shooting.shoot(period_map, state).motion)


def search_symmetric(known: Known, half: HalfPeriodMap, states: Iterable[State]) -> None:
    """Search for symmetric motions from some states; keep them."""
    for state in states:
        with suppress(ConvergenceError, np.linalg.LinAlgError):
            known.add(shooting.shoot(known.period_map, shooting.shoot(half, state).motion.start).motion)


def deflated(known: Known, state: State) -> Pass | None:
    """Return the motion that the deflated Newton method finds from a state; None if it finds none."""
    period_map = known.period_map
    scale = period_map.scale
    size = period_map.size
    try:
        motion = period_map(state)
        for _ in range(_DEFLATED):
            step = shooting.newton_step(period_map, motion)[0] * scale
            slope = 0.0
            y = motion.start.y * scale
            for other in (state for one in known.motions for state in one.states):
                away = (y - other) / size
                distance = float(away @ away)
                slope += -2.0 * float(away @ step) / size / (distance * (1.0 + distance))
            factor = 1.0 / (1.0 - slope) if abs(1.0 - slope) > 1e-3 else 1.0
            longest = _REACH * size / max(float(np.linalg.norm(step)), 1e-300)
            change = np.clip(factor, -longest, longest) * step
            motion = period_map(State((y + change) / scale, motion.end.auxiliary_pieces))
            if np.linalg.norm(motion.gap * scale) < _NEAR * size:
                return shooting.shoot(period_map, motion.start).motion
    except (ConvergenceError, np.linalg.LinAlgError):
        return None
    return None


def turning(period_map: PeriodMap) -> Array:
    """Return (N, R) changes of state in which a whole train turns faster."""
    motion = relative_coordinates(period_map.system).angle_from_reference
    first = len(period_map.flow.coordinates.elements)
    directions = np.zeros((len(period_map.scale), motion.shape[1]))
    directions[first : first + len(motion)] = motion
    return directions


def orbit_of_returns(period_map: PeriodMap, state: State) -> shooting.Orbit:
    """Return a periodic motion that the motion from a state nearly repeats.

    Raises ConvergenceError: none was found; the message says after how many periods the motion itself repeats, if
    it does.
    """
    n = period_map.cycles
    orbit = next(orbits_of_returns(period_map, state), None)
    if orbit is None:
        message = f"{_none(n)}: the motion does not repeat within {_PERIODS} periods"
        number = "more cycles" if n == 1 else "another number of cycles"
        raise ConvergenceError(message, remedy=f"another start, another load or {number}; it may be irregular")
    return orbit


def orbits_of_returns(period_map: PeriodMap, state: State) -> Iterator[shooting.Orbit]:
    """Yield periodic motions that the motion from a state nearly repeats, some of them twice; as ``orbit_of_returns``.

    Raises ConvergenceError: the motion settles in one that repeats after another number of periods.
    """
    n = period_map.cycles
    states, y, repeats = _returns(period_map, state, _PERIODS)
    nearest = np.argsort(np.linalg.norm(y[n:] - y[:-n], axis=1))
    for parts, most in _ONE_TRY if repeats else _TRIES:
        for row in nearest[: max(1, most // n)]:
            with suppress(ConvergenceError, np.linalg.LinAlgError):
                yield shooting.shoot(period_map, states[row], parts_of_period=parts)


def check_repeats_elsewhere(period_map: PeriodMap, state: State) -> None:
    """Follow a motion where none was found that repeats; say so if it settles in one of another number of periods.

    Raises ConvergenceError: it settles in one that repeats after another number of periods.
    """
    _returns(period_map, state, _FEW_PERIODS)


def _returns(period_map: PeriodMap, state: State, periods: int) -> tuple[list[State], Array, int]:
    """The states of a motion at the start of every period, balanced too, and after how many it repeats; 0: unknown."""
    once = PeriodMap(period_map.system, 1)
    n = period_map.cycles
    march = once.marched(at_mean_speed(once, state), periods)
    states = [once.sampled(march, row) for row in range(periods + 1)]
    y = np.array([state.y for state in states]) * once.scale
    repeats = period_number(y / max(once.size, float(np.linalg.norm(y[-1]))), _RETURNS, _LONGEST)
    if repeats and n % repeats:
        message = f"{_none(n)}: the motion settles in one that repeats after {counted(repeats, 'period')}"
        raise ConvergenceError(message, remedy=f"cycles={repeats}, or another start")
    return states, y, repeats


def _none(cycles: int) -> str:
    return f"no motion that repeats after {counted(cycles, 'period')} was found from this start"


def at_mean_speed(once: PeriodMap, state: State) -> State:
    """Return a later state of which all trains turn as fast as they do in the mean over long.

    With little drag, a train comes to its mean speed after thousands of periods only; it changes little else.
    """
    directions = turning(once)
    for _ in range(_CORRECTIONS):
        march = once.marched(state, _MEAN_OVER)
        half = _MEAN_OVER // 2
        turned = once.turned(march, -1) - once.turned(march, half)
        speed = turned / ((_MEAN_OVER - half) * once.length)
        later = once.sampled(march, -1)
        state = State(later.y - directions @ speed, later.auxiliary_pieces)
    return state
