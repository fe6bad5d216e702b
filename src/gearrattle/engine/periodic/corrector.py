"""Newton's method for a motion of a branch, in a plane across it.

    F(w) = P(u; p) - u = 0,      normal . (w - w_predicted) = 0,      [dF/du, dF/dp] t = 0,  |t| = 1

w = (u, p / unit), u the balanced state at the start of a period over the size; t is the tangent of the branch.

Takes a Family and predictions; gives Points.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite, sqrt

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.equations import Bordered
from gearrattle.engine.periodic.family import Family
from gearrattle.engine.periodic.general_turns import idle_memories
from gearrattle.engine.periodic.period_map import Pass, State
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.touch import Touch
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_TOLERANCE = 1e-12  # of the residual, over the size of the state
_ROUNDING = 1e-14  # the same, for each unit of the gradient's norm
_ITERATIONS = 8
_LAST = 1.0  # times what rounding leaves: an expected residual below it is likely to be the last one


class Corrector:
    """Finds motions of a branch near predictions.

    Parameters
    ----------
    family
        the period map with its parameter.
    units
        scale (N,) and size of the states, as in a Point.

    Attributes
    ----------
    scale
        (N,) the part of w of a state is scale * state.
    """

    def __init__(self, family: Family, units: tuple[Array, float]) -> None:
        self._family, self._units = family, units
        self.scale = units[0] / units[1]
        self._balance: Array = self.scale[:, None] / self.scale
        self._to_units = np.append(self.scale, 1.0 / family.unit)

    def followed(
        self, w: Array, pieces: IntArray | None, touch: Touch | None = None, turns_along: Array | None = None
    ) -> tuple[Pass, Array]:
        """Return the motion from w (N + 1,), and its slope (N,) [SI]; for a row over w with its turning points."""
        state, parameter = State(w[:-1] / self.scale, pieces), float(w[-1] * self._family.unit)
        row = None if turns_along is None else turns_along * self._to_units
        return self._family.follow(state, parameter, touch, row)

    def matrix(self, motion: Pass, slope: Array) -> Array:
        """Return (N, N + 1) [dF/du, dF/dp] in the branch's units."""
        states = len(self.scale)
        matrix = np.empty((states, states + 1))
        np.multiply(self._balance, motion.gradient, out=matrix[:, :-1])
        matrix.flat[:: states + 2] -= 1.0
        matrix[:, -1] = self.scale * slope * self._family.unit
        return matrix

    def with_turns_along(self, motion: Pass, cosine: float, free: int) -> Pass:
        """Return a motion with the slopes of its turning points along the tangent, not where that is one of several.

        A memory that may be anything makes no other tangent.

        Parameters
        ----------
        motion
            with slopes along the change for a row.
        cosine
            product of the tangent and that row.
        free
            number of directions in which neighbouring motions repeat as well.
        """
        if motion.turns is None:
            return motion
        is_one = not free or free == len(idle_memories(motion, self._units[0], self._family.memories))
        return replace(motion, turns=motion.turns.scaled(cosine) if is_one else None)

    def residual(self, motion: Pass) -> Array:
        """Return (N,) F in the branch's units."""
        return np.asarray(self.scale * motion.gap)

    def least(self, w: Array, matrix: Array) -> float:
        """Return the norm of the residual below which it is rounding."""
        return _TOLERANCE * max(1.0, norm_of(w[:-1])) + _ROUNDING * norm_of(matrix.ravel())

    def point(
        self,
        predicted: Array,
        normal: Array,
        direction: Array,
        pieces: IntArray | None,
        *,
        slack: float = 0.0,
        touch: Touch | None = None,
        with_turns: bool = False,
    ) -> Point:
        """Return the motion in the plane through a prediction at right angles to ``normal``.

        Parameters
        ----------
        predicted, normal
            (N + 1,).
        direction
            (N + 1,) the tangent points to its side.
        pieces
            (C,) of the auxiliaries at the start; None: the state decides them.
        slack
            change of w at which the iteration may end; the motion is then the last one followed.
        touch
            a corner and an instant, for the depth of the motion.
        with_turns
            whether the turning points of the motion are wanted.

        Raises
        ------
        ConvergenceError
            Newton's method does not converge.
        """
        return self.point_and_iterations(
            predicted, normal, direction, pieces, slack=slack, touch=touch, with_turns=with_turns
        )[0]

    def point_and_iterations(
        self,
        predicted: Array,
        normal: Array,
        direction: Array,
        pieces: IntArray | None,
        *,
        is_near: bool = False,
        slack: float = 0.0,
        touch: Touch | None = None,
        with_turns: bool = False,
    ) -> tuple[Point, int]:
        """Return the motion and how many were followed; see ``point``.

        A prediction that is near is given up once the residual grows: then Newton's method goes round in circles
        between two patterns of crossings, and a shorter step costs less.
        """
        w, last, error, is_last = predicted.copy(), np.inf, np.inf, False
        for iteration in range(_ITERATIONS):
            parameter = float(w[-1] * self._family.unit)
            has_turns = with_turns and is_last
            motion, slope = self.followed(w, pieces, touch, direction if has_turns else None)
            matrix = self.matrix(motion, slope)
            residual = self.residual(motion)
            norm = norm_of(residual)
            plane = float(normal @ (w - predicted))
            least = self.least(w, matrix)
            is_lost = is_near and norm > last and norm > 100.0 * least
            if is_lost or not isfinite(norm) or not isfinite(least):
                break
            equations = Bordered(matrix, normal)
            change = equations.solution(np.append(-residual, -plane))
            is_settled = norm <= least or (norm <= 100.0 * least and norm > 0.5 * last)
            error = norm_of(change)
            if (is_settled or error <= slack) and abs(plane) < 1e-12:
                if with_turns and not has_turns:
                    motion, slope = self.followed(w, pieces, touch, direction)
                tangent, free, way = equations.null_vector(direction)
                motion = self.with_turns_along(motion, float(direction @ tangent), free)
                w = w + change if slack > 0.0 else w
                point = Point(parameter, motion, slope, *self._units, w, tangent, free, way, error, 0.0)
                return point, iteration + 1
            expected = norm**3 / last**2 if iteration else error**2  # residuals fall by their squares
            is_last = expected < _LAST * least
            w, last = w + change, norm
        raise ConvergenceError("Newton's method does not converge")


def norm_of(vector: Array) -> float:
    """Return the Euclidean norm of a vector."""
    return sqrt(float(vector @ vector))
