"""Newton's method for a motion of a branch, in a plane across it.

    F(w) = P(u; p) - u = 0,      normal . (w - w_predicted) = 0,      [dF/du, dF/dp] t = 0,  |t| = 1

w = (u, p / unit), u the balanced state at the start of a period over the size; t is the tangent of the branch. Where a
disturbance grows much over the motion, the states at the starts of its parts (``families``) are unknown too: F has
equations for each of them, and the normal has zeros there.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from math import isfinite, sqrt

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.equations import Bordered
from gearrattle.engine.periodic.families import Family, PartedFamily
from gearrattle.engine.periodic.motion import Pass, State, Touch, idle_memories
from gearrattle.engine.periodic.point import Guess, Later, Point
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_TOLERANCE = 1e-12  # residual over the size of the state
_ROUNDING = 1e-14  # rounding of the residual over the size of the state and the norm of the gradient
_ITERATIONS = 8  # most iterations
_IN_PLANE = 1e-12  # distance of w from the plane that is rounding
_LARGE = 1e4  # growth of a disturbance above which motions are followed in parts
_LAST = 1.0  # factor on the rounding: an expected residual below it is likely to be the last one


class Corrector:
    """Computes motions of a branch from predictions.

    scale: (N,) u = scale * state.
    """

    def __init__(self, family: Family, units: tuple[Array, float]) -> None:
        self._family = family
        self._units = units
        self.scale = units[0] / units[1]
        self._balance: Array = self.scale[:, None] / self.scale
        self._to_units = np.append(self.scale, 1.0 / family.unit)

    @cached_property
    def _parts(self) -> PartedFamily:
        """The family that follows motions in parts."""
        return PartedFamily(self._family)

    def followed(
        self, guess: Guess, touch: Touch | None = None, turns_along: Array | None = None
    ) -> tuple[Pass, Array]:
        """Return the motion from a guess, and its slope (N,) [SI]; with a row over w, also its turning points."""
        parameter = float(guess.w[-1] * self._family.unit)
        state = State(guess.w[:-1] / self.scale, guess.pieces)
        if guess.later is None:
            row = None if turns_along is None else turns_along * self._to_units
            return self._family.follow(state, parameter, touch, row)
        motion, slope = self._parts.follow(state, guess.later / self.scale, parameter, touch)
        return (motion, slope) if turns_along is None else self.with_turns(guess, motion, slope, turns_along)

    def with_turns(self, guess: Guess, motion: Pass, slope: Array, turns_along: Array) -> tuple[Pass, Array]:
        """Return a motion that was followed from a guess with its turning points, and its slope; see ``followed``."""
        if guess.later is None:
            return self.followed(guess, None, turns_along)
        tangent, _, _ = Bordered(self.matrix(motion, slope), turns_along).null_vector(turns_along)
        parameter = float(guess.w[-1] * self._family.unit)
        along = float(turns_along @ tangent[: len(turns_along)])
        return replace(motion, turns=self._parts.turns(motion, parameter, self._changes(tangent / along))), slope

    def matrix(self, motion: Pass, slope: Array) -> Array:
        """Return (P, P + 1) [dF/du, dF/dp] in the branch's units, and behind them dF by the later states."""
        parts = motion.parts
        gradients = motion.gradient[None] if parts is None else parts.gradient
        slopes = slope[None] if parts is None else parts.slope
        count, states = slopes.shape
        matrix = np.zeros((count * states, count * states + 1))
        for i, (gradient, own_slope) in enumerate(zip(gradients, slopes, strict=True)):
            own = self._first(i)
            following = (i + 1) % count
            after = self._first(following)
            rows = matrix[following * states : (following + 1) * states]
            rows[:, own : own + states] = self._balance * gradient
            rows[:, states] = self.scale * own_slope * self._family.unit
            rows.flat[after :: matrix.shape[1] + 1] -= 1.0
        return matrix

    def _first(self, part: int) -> int:
        """Index of the state at the start of a part among the unknowns, in which p follows the first state."""
        return part * len(self.scale) + (1 if part else 0)

    def row(self, row: Array, part: int, motion: Pass) -> Array:
        """Return a row (N + 1,) over the state at the start of a part and p [1/SI] as a row over all P + 1 unknowns."""
        states = len(self.scale)
        own = np.asarray(row / self._to_units)
        if motion.parts is None:
            return own
        unknowns = np.zeros(motion.parts.start.size + 1)
        first = self._first(part)
        unknowns[first : first + states] = own[:-1]
        unknowns[states] = own[-1]
        return unknowns

    def residual(self, motion: Pass) -> Array:
        """Return (P,) F in the branch's units."""
        if motion.parts is None:
            return np.asarray(self.scale * motion.gap)
        gaps = np.roll(motion.parts.end, 1, axis=0) - motion.parts.start
        return np.asarray((self.scale * gaps).ravel())

    def least(self, guess: Guess, matrix: Array) -> float:
        """Return the norm of the residual below which it is rounding."""
        return _TOLERANCE * max(1.0, norm_of(guess.w[:-1])) + _ROUNDING * norm_of(matrix.ravel())

    def in_parts(self, guess: Guess, motion: Pass) -> Guess:
        """Return the guess from which a motion is followed, in parts if a disturbance grows much over it."""
        growth = norm_of((self._balance * motion.gradient).ravel())
        if guess.later is not None or self._family.parts == 1 or growth < _LARGE:
            return guess
        starts = self._parts.starts(motion.start, float(guess.w[-1] * self._family.unit))
        return guess._replace(later=self.scale * starts)

    def point_at(self, guess: Guess, motion: Pass, slope: Array, direction: Array, equations: Bordered) -> Point:
        """Return the point of the branch at a motion.

        motion, slope: from ``followed``, with slopes of the turning points along the change for ``direction``.
        direction: (N + 1,) the tangent has a positive product with it.
        equations: with the matrix of ``matrix``.
        """
        tangent, free, orientation = equations.null_vector(direction)
        own, behind = np.split(tangent, [len(direction)])
        motion = self._with_turns_along(motion, float(direction @ own), free)
        later = None if guess.later is None else Later(guess.later, behind.reshape(guess.later.shape))
        parameter = float(guess.w[-1] * self._family.unit)
        scale, size = self._units
        return Point(
            parameter=parameter,
            motion=motion,
            slope=slope,
            scale=scale,
            size=size,
            w=guess.w,
            tangent=own,
            free=free,
            orientation=orientation,
            later=later,
        )

    def _with_turns_along(self, motion: Pass, cosine: float, free: int) -> Pass:
        """A motion with the slopes of its turning points along the tangent; without turning points if it is not unique.

        A memory that is not coupled to the motion does not count as another tangent.
        """
        if motion.turns is None:
            return motion
        is_one = not free or free == len(idle_memories(motion, self._units[0], self._family.memories))
        return replace(motion, turns=motion.turns.scaled(cosine) if is_one else None)

    def _changes(self, change: Array) -> Array:
        """(m, N + 1) changes of the states at the starts of the parts [SI] and of p, from a change of all unknowns."""
        states = len(self.scale)
        own = change[: states + 1]
        behind = change[states + 1 :].reshape(-1, states)
        parameter = np.full((len(behind) + 1, 1), own[-1] * self._family.unit)
        return np.hstack([np.vstack([own[:-1], behind]) / self.scale, parameter])

    def point(
        self,
        predicted: Guess,
        normal: Array,
        direction: Array,
        *,
        is_near: bool = False,
        slack: float = 0.0,
        touch: Touch | None = None,
        with_turns: bool = False,
    ) -> Point:
        """Return the motion in the plane through a prediction at right angles to ``normal``.

        normal: (N + 1,).
        direction: (N + 1,) the tangent has a positive product with it.
        is_near: whether the iteration ends in an error once the residual grows: then it alternates between two patterns
            of crossings, and a shorter step takes less time.
        slack: change of w at which the iteration may end; the last motion is then returned.
        """
        guess = predicted
        last = np.inf
        error = np.inf
        is_last = False
        is_corrected = False
        for iteration in range(_ITERATIONS):
            has_turns = with_turns and is_last and guess.later is None
            motion, slope = self.followed(guess, touch, direction if has_turns else None)
            parted = self.in_parts(guess, motion)
            if parted is not guess:
                guess = parted
                last = np.inf
                is_last = False
                continue
            matrix = self.matrix(motion, slope)
            residual = self.residual(motion)
            norm = norm_of(residual)
            plane = float(normal @ (guess.w - predicted.w))
            least = self.least(guess, matrix)
            is_lost = is_near and norm > last and norm > 100.0 * least
            if is_lost or not isfinite(norm) or not isfinite(least):
                break
            equations = Bordered(matrix, normal)
            change = equations.solution(np.append(-residual, -plane))
            is_settled = norm <= least or (norm <= 100.0 * least and norm > 0.5 * last)
            error = norm_of(change)
            if (is_settled or error <= slack) and abs(plane) < _IN_PLANE * max(1.0, norm_of(guess.w)):
                if not is_corrected and not _sliders_repeat(motion):
                    guess = guess._replace(pieces=motion.end.auxiliary_pieces)
                    last = np.inf
                    is_last = False
                    is_corrected = True
                    continue
                if with_turns and not has_turns:
                    motion, slope = self.with_turns(guess, motion, slope, direction)
                point = self.point_at(guess, motion, slope, direction, equations)
                w = guess.w + change[: len(normal)] if slack > 0.0 else guess.w
                return replace(point, w=w, error=norm_of(change[: len(normal)]), iterations=iteration + 1)
            expected = norm**3 / last**2 if iteration and last > 0.0 else error**2  # residuals fall by their squares
            is_last = expected < _LAST * least
            guess = guess.moved(change)
            last = norm
        raise ConvergenceError("Newton's method does not converge")


def _sliders_repeat(motion: Pass) -> bool:
    """Whether sliders end a motion in the pieces in which they begin it.

    Along a branch a crossing may move from the end of the period to its start; then the pieces of the neighbour are
    wrong.
    """
    start = motion.start.auxiliary_pieces
    end = motion.end.auxiliary_pieces
    return start is None or end is None or np.array_equal(start, end)


def norm_of(vector: Array) -> float:
    """Return the Euclidean norm of a vector."""
    return sqrt(float(vector @ vector))
