"""Multiple shooting: a motion of n periods as n motions of one period each, joined by Newton's method.

Over n periods a small disturbance may grow a million times, as in chaos; then no state at the start is accurate enough
for the end. Over one period it grows little. So the states at the start of every period are unknown together,

    P(y_1) - y_2 = 0,   P(y_2) - y_3 = 0,   ...   P(y_n) - y_1 = 0.

Takes a PeriodMap and a state; gives a Pass.

H. B. Keller, Numerical Methods for Two-Point Boundary-Value Problems, Blaisdell 1968, section 2.4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.equations import shortest_solution
from gearrattle.engine.periodic.period_map import Pass, PeriodMap, State
from gearrattle.engine.system.passages import Passages
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

LARGEST_SYSTEM = 1024
"""Unknowns, n N, up to which multiple shooting is used: its equations are solved by singular values."""
_MOST_STEPS = 40
_HALVINGS = 8


def shoot_in_parts(period_map: PeriodMap, state: State, tolerance: float) -> tuple[Pass, float, int]:
    """Return the motion near a state, its residual over the size of the state, and how many passes were used.

    Parameters
    ----------
    period_map
        over n periods.
    state
        at the start.
    tolerance
        of the residual.

    Raises
    ------
    ConvergenceError
        the motion could not be followed.
    """
    once = PeriodMap(period_map.system, 1)
    parts = [once(state)]
    for _ in range(period_map.cycles - 1):
        parts.append(once(parts[-1].end))
    residual, passes = _residual(once, parts), 1
    while residual > tolerance and passes < _MOST_STEPS:
        shortened, tried = _shortened(once, parts, residual)
        passes += tried
        if shortened is None:
            break
        parts = shortened
        residual = _residual(once, parts)
    return joined(parts), residual, passes


def joined(parts: list[Pass]) -> Pass:
    """Return motions that follow one another as one."""
    gradient, length = np.eye(len(parts[0].gradient)), parts[0].cycles * parts[0].period
    for part in parts:
        gradient = part.gradient @ gradient
    logs = [part.crossings for part in parts]
    crossings = Passages(
        np.concatenate([i * length + log.time for i, log in enumerate(logs)]),
        np.concatenate([log.watch for log in logs]),
        np.concatenate([log.upward for log in logs]),
        np.concatenate([log.velocity for log in logs]),
        np.concatenate([log.memory for log in logs]),
    )
    turned = np.sum([part.turned for part in parts], axis=0)
    cycles = sum(part.cycles for part in parts)
    return Pass(parts[0].start, parts[-1].end, gradient, turned, crossings, parts[0].period, cycles)


def _jumps(parts: list[Pass]) -> list[Array]:
    """From the end of every part to the start of the next [SI]; after the last comes the first."""
    return [part.end.y - following.start.y for part, following in zip(parts, [*parts[1:], parts[0]], strict=True)]


def _residual(once: PeriodMap, parts: list[Pass]) -> float:
    size = max([once.size, *(float(np.linalg.norm(part.start.y * once.scale)) for part in parts)])
    return max(float(np.linalg.norm(jump * once.scale)) for jump in _jumps(parts)) / size


def _shortened(once: PeriodMap, parts: list[Pass], residual: float) -> tuple[list[Pass] | None, int]:
    """The parts after Newton's step, half of it, a quarter, ...: the first with a smaller residual, or None.

    Also returns how many steps were tried.
    """
    changes = _newton_step(once, parts)
    for halvings in range(_HALVINGS + 1):
        share = 0.5**halvings
        pieces = [parts[-1].end.auxiliary_pieces, *(part.end.auxiliary_pieces for part in parts[:-1])]
        states = [
            State(part.start.y + share * change, piece)
            for part, change, piece in zip(parts, changes, pieces, strict=True)
        ]
        try:
            trial = [once(state) for state in states]
        except ConvergenceError:
            continue
        if _residual(once, trial) < residual:
            return trial, halvings + 1
    return None, _HALVINGS + 1


def _newton_step(once: PeriodMap, parts: list[Pass]) -> Array:
    """(n, N) changes of the states at the start of every part [SI]: M_i d_i - d_(i+1) = -(end_i - start_(i+1))."""
    count, size = len(parts), len(once.scale)
    matrix = np.zeros((count, size, count, size))
    for i, part in enumerate(parts):
        matrix[i, :, i] += once.scale[:, None] * part.gradient / once.scale
        matrix[i, :, (i + 1) % count] -= np.eye(size)
    right = -np.concatenate([jump * once.scale for jump in _jumps(parts)])
    change, _ = shortest_solution(matrix.reshape(count * size, count * size), right)
    return np.asarray(change.reshape(count, size) / once.scale)
