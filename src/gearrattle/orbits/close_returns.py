"""Periodic motions that an irregular motion nearly repeats.

An irregular motion comes near to unstable periodic motions again and again. So the motion is followed for many periods,
and Newton's method begins where it comes nearest to itself n periods later. Where that finds nothing, disturbances grow
much within a period: then the states at every eighth of a period are sought together (``engine.periodic.multiple``).

D. Auerbach, P. Cvitanovic, J.-P. Eckmann, G. Gunaratne, I. Procaccia, Phys. Rev. Lett. 58 (1987), 2387-2389.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.multiple import EIGHTHS
from gearrattle.engine.periodic.period_map import PeriodMap, State
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.attractors import turning
from gearrattle.signals.strobe import period_number
from gearrattle.wording import counted

Array = NDArray[np.float64]

_PERIODS = 2048  # in which returns are looked for
_FEW_PERIODS = 256  # in which a motion is to settle where no returns are looked for
_TRIES = ((0, 32), (EIGHTHS, 8))  # parts of a period, and periods of all motions that Newton's method begins with
_ONE_TRY = ((0, 1),)  # where the motion has settled: all returns lead to the same one
# periods over which the mean speed of a train is taken, and how often
_SETTLING = 128
_CORRECTIONS = 2
_REPEATS = 1e-3  # of the size of the state: what repeats as well as this has settled
_LONGEST = 64  # periods after which a motion may repeat


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
    n, states, y, repeats = period_map.cycles, *_followed(period_map, state, _PERIODS)
    nearest = np.argsort(np.linalg.norm(y[n:] - y[:-n], axis=1))
    for parts, most in _ONE_TRY if repeats else _TRIES:
        for row in nearest[: max(1, most // n)]:
            with suppress(ConvergenceError, np.linalg.LinAlgError):
                yield shooting.shoot(period_map, states[row], parts_of_period=parts)


def check_repeats_elsewhere(period_map: PeriodMap, state: State) -> None:
    """Follow a motion of which none that repeats was found, and say so if it settles in one of another number.

    Raises ConvergenceError: it settles in one that repeats after another number of periods.
    """
    _followed(period_map, state, _FEW_PERIODS)


def _followed(period_map: PeriodMap, state: State, periods: int) -> tuple[list[State], Array, int]:
    """The states of a motion at the start of every period, balanced too, and after how many it repeats; 0: unknown."""
    once = PeriodMap(period_map.system, 1)
    n = period_map.cycles
    march = once.marched(at_mean_speed(once, state), periods)
    states = [once.sampled(march, row) for row in range(periods + 1)]
    y = np.array([state.y for state in states]) * once.scale
    repeats = period_number(y / max(once.size, float(np.linalg.norm(y[-1]))), _REPEATS, _LONGEST)
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
        march = once.marched(state, _SETTLING)
        half = _SETTLING // 2
        turned = once.turned(march, -1) - once.turned(march, half)
        speed = turned / ((_SETTLING - half) * once.length)
        later = once.sampled(march, -1)
        state = State(later.y - directions @ speed, later.auxiliary_pieces)
    return state
