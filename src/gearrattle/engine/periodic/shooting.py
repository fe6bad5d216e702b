"""Shooting: the state that the period map takes to itself, by Newton's method.

    (I - M) d = P(y) - y,      M = dP/dy exact,

solved by singular values. Where I - M is singular the motion is one of a family: a free train without drag may have any
speed, a slider that never slips any offset, a body that floats in its gap any place. Then d is the shortest step, so
the motion found lies near the start; the directions of the family are given with it.

Takes a PeriodMap and a state; gives an Orbit.

R. Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., Springer 2010, chapter 7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.period_map import Pass, PeriodMap, State
from gearrattle.errors import ConvergenceError
from gearrattle.wording import counted

Array = NDArray[np.float64]

TOLERANCE = 1e-12
"""Largest residual of an orbit, in units of the largest corner or of the state, whichever is larger."""
_ROUNDING = 1e-10  # largest residual accepted where a sensitive motion magnifies rounding
FREE, FREE_OF_LARGEST = 1e-9, 1e-13
"""A singular value of I - M below the first, and this share of the largest, is zero."""
_MOST_PASSES = 60  # of one attempt
_SETTLING = 8  # passes, the first time
_HALVINGS = 6


@dataclass(frozen=True)
class Orbit:
    """A motion that repeats after n periods.

    Attributes
    ----------
    motion
        over n periods.
    residual
        |P(y) - y|, in units of the largest corner or of the state.
    free
        (N, F) directions in which neighbouring motions repeat as well [SI]; F = 0 for an isolated motion.
    passes
        how many times the period map was applied.
    """

    motion: Pass
    residual: float
    free: Array
    passes: int

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """(N,) Floquet multipliers, the largest first: the eigenvalues of the gradient."""
        return multipliers_of(self.motion.gradient)


def multipliers_of(gradient: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues of a gradient (N, N), the largest modulus first."""
    return sorted_by_modulus(np.linalg.eigvals(gradient))


def sorted_by_modulus(eigenvalues: NDArray[np.generic]) -> NDArray[np.complex128]:
    """Return eigenvalues, the largest modulus first; of a pair the one with the positive imaginary part first."""
    values = eigenvalues.astype(np.complex128)
    return np.asarray(values[np.lexsort((-values.imag, -np.round(np.abs(values), 12)))])


def shoot(period_map: PeriodMap, state: State, *, tolerance: float = TOLERANCE, settle: int = 0) -> Orbit:
    """Find the periodic motion that Newton's method leads to from a state.

    Because of corners Newton's method may stop short, or go round in circles. Then the motion is followed for some
    passes, and Newton's method begins again from there.

    Parameters
    ----------
    period_map
        over the n periods after which the motion is to repeat.
    state
        from which the search starts.
    tolerance
        of the residual.
    settle
        how often Newton's method may begin again, each time after twice as many passes; a motion found then is most
        likely stable.

    Raises
    ------
    ConvergenceError
        none was found from there.
    """
    motion, residual, passes = _newton(period_map, period_map(state), tolerance)
    for attempt in range(settle):
        if residual <= _ROUNDING:
            break
        motion = period_map(period_map.later(motion.end, _SETTLING << attempt))
        motion, residual, taken = _newton(period_map, motion, tolerance)
        passes += taken + (_SETTLING << attempt)
    if not residual <= _ROUNDING:
        message = f"no motion that repeats after {counted(period_map.cycles, 'period')} was found from this start"
        remedy = "another start, for example the end of a simulation"
        raise ConvergenceError(f"{message} (residual {residual:.2g})", remedy=remedy)
    return Orbit(motion, residual, newton_step(period_map, motion)[1], passes)


def _newton(period_map: PeriodMap, motion: Pass, tolerance: float) -> tuple[Pass, float, int]:
    """Newton's method until the residual is small or does not fall: the motion, its residual, the passes used."""
    residual, passes = _residual(period_map, motion), 1
    while residual > tolerance and passes < _MOST_PASSES:
        trial, taken, tried = _shortened(period_map, motion, residual, newton_step(period_map, motion)[0])
        passes += tried
        if trial is None:
            break
        motion, residual = trial, taken
    return motion, residual, passes


def _residual(period_map: PeriodMap, motion: Pass) -> float:
    size = max(period_map.size, float(np.linalg.norm(motion.start.y * period_map.scale)))
    return float(np.linalg.norm(motion.gap * period_map.scale)) / size


def newton_step(period_map: PeriodMap, motion: Pass) -> tuple[Array, Array]:
    """Return the shortest d with (I - M) d = P(y) - y, and (N, F) the free directions [SI]."""
    scale = period_map.scale
    left, values, right = np.linalg.svd(np.eye(len(scale)) - scale[:, None] * motion.gradient / scale)
    regular = values > FREE + FREE_OF_LARGEST * values[0]
    weights = np.divide(left.T @ (motion.gap * scale), values, out=np.zeros_like(values), where=regular)
    return right.T @ weights / scale, right[~regular].T / scale[:, None]


def _shortened(period_map: PeriodMap, motion: Pass, residual: float, step: Array) -> tuple[Pass | None, float, int]:
    """The motion after a step, half of it, a quarter, ...: the first with a smaller residual, or None.

    Also returns its residual, and how many steps were tried.
    """
    for halvings in range(_HALVINGS + 1):
        state = State(motion.start.y + 0.5**halvings * step, motion.end.auxiliary_pieces)
        try:
            trial = period_map(state)
        except ConvergenceError:
            continue
        taken = _residual(period_map, trial)
        if taken < residual:
            return trial, taken, halvings + 1
    return None, residual, _HALVINGS + 1
