"""A motion of a family followed in parts of equal length, each from a state of its own: multiple shooting on a branch.

    P_i(y_i; p) - y_(i+1) = 0,   i = 1 ... m,   y_(m+1) = y_1

Where a disturbance grows a million times over a motion, Newton's method for its start alone (``corrector``) needs a
prediction a million times as near. Over a part it grows little. See ``multiple``, the same for one driveline.

Takes a Family; gives Passes with ``Parts``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.family import Family
from gearrattle.engine.periodic.general_turns import outside_of
from gearrattle.engine.periodic.multiple import joined
from gearrattle.engine.periodic.period_map import Along, Approach, Dips, Parts, Pass, State, Turns
from gearrattle.engine.periodic.touch import Touch

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


class PartedFamily:
    """Follows motions of a family in its m parts.

    Parameters
    ----------
    family
        of whole motions.
    """

    def __init__(self, family: Family) -> None:
        self._cycles, self._clearances = family.cycles, family.clearances
        self._length = family.cycles / family.parts
        self._parts = [family.part(i * self._length, self._length) for i in range(family.parts)]

    def starts(self, state: State, parameter: float) -> Array:
        """Return (m - 1, N) states at the start of the later parts of a motion [SI].

        Raises
        ------
        ConvergenceError
            it could not be followed.
        """
        states = [state]
        for part in self._parts[:-1]:
            states.append(part.map_at(parameter).later(states[-1]))
        return np.array([state.y for state in states[1:]])

    def follow(self, start: State, later: Array, parameter: float, touch: Touch | None = None) -> tuple[Pass, Array]:
        """Follow a motion in parts.

        Parameters
        ----------
        start
            at the start.
        later
            (m - 1, N) states at the start of the later parts [SI].
        parameter
            of the driveline.
        touch
            a corner and an instant, for the approach in the Pass; None: none.

        Returns
        -------
        tuple[Pass, Array]
            The motion over n periods, without turning points, and (N,) d end / d parameter for a fixed start [SI].

        Raises
        ------
        ConvergenceError
            the motion could not be followed.
        """
        index, touch = self._within(touch)
        passes, slopes, state = list[Pass](), list[Array](), start
        for i, part in enumerate(self._parts):
            if i > 0:
                state = State(later[i - 1], passes[-1].end.auxiliary_pieces)
            motion, slope = part.follow(state, parameter, touch if i == index else None)
            passes.append(motion)
            slopes.append(slope)
        gradients = np.array([one.gradient for one in passes])
        whole_slope = np.zeros(len(slopes[0]))
        for gradient, slope in zip(gradients, slopes, strict=True):
            whole_slope = gradient @ whole_slope + slope
        starts, ends = np.array([one.start.y for one in passes]), np.array([one.end.y for one in passes])
        parts = Parts(starts, ends, gradients, np.array(slopes))
        motion = joined(passes, passes[0].period / self._length, self._cycles)
        return replace(motion, approach=self._approach(passes[index].approach, index), parts=parts), whole_slope

    def turns(self, motion: Pass, parameter: float, changes: Array) -> Turns | None:
        """Return the turning points of a motion that was followed in parts; None where they are not known.

        Parameters
        ----------
        motion
            with its parts.
        parameter
            of the driveline.
        changes
            (m, N + 1) along which their slopes are: of the states at the start of the parts [SI], and of p.

        Raises
        ------
        ConvergenceError
            the motion could not be followed.
        """
        assert motion.parts is not None
        pieces, turns = motion.start.auxiliary_pieces, list[Turns]()
        for i, (part, start, change) in enumerate(zip(self._parts, motion.parts.start, changes, strict=True)):
            begins = _before(motion, i * self._length), _before(motion, (i + 1) * self._length)
            outside = outside_of(motion.crossings, begins, self._clearances)
            along = Along(change[:-1], float(change[-1]), outside)
            own, _ = part.follow(State(start, pieces), parameter, None, along)
            pieces = own.end.auxiliary_pieces
            if own.turns is None:
                return None
            turns.append(self._in_motion(own.turns, i))
        dips = Dips._make(np.concatenate(columns) for columns in zip(*(one.dips for one in turns), strict=True))
        columns = {
            name: np.concatenate([getattr(one, name) for one in turns]) for name in Turns._fields if name != "dips"
        }
        return Turns(**columns, dips=dips)

    def _within(self, touch: Touch | None) -> tuple[int, Touch | None]:
        """The part in which a touch lies, and the touch in it."""
        if touch is None:
            return 0, None
        time = touch.time / self._length
        index = int(np.floor(time)) % len(self._parts)
        return index, replace(touch, time=time - np.floor(time))

    def _approach(self, approach: Approach | None, index: int) -> Approach | None:
        """An approach of a part as one of the whole motion; what depends on the rest of the motion is not known."""
        if approach is None:
            return None
        time_slope = None if approach.time_slope is None else self._length * approach.time_slope
        time = self._length * (index + approach.time)
        return approach._replace(time=time, time_slope=time_slope, gain=np.nan, rate=np.nan, part=index)

    def _in_motion(self, turns: Turns, index: int) -> Turns:
        """Turning points of a part as those of the whole motion."""
        length, dips = self._length, turns.dips
        dips = dips._replace(
            time=length * (index + dips.time),
            time_slope=length * dips.time_slope,
            depth=dips.depth / length,
            slope=dips.slope / length,
        )
        return turns._replace(
            time=length * (index + turns.time),
            time_slope=length * turns.time_slope,
            dips=dips,
            delay=length * turns.delay,
        )


def _before(motion: Pass, time: float) -> int:
    """How many crossings of a motion lie before an instant [periods]."""
    return int(np.searchsorted(motion.crossings.time, time * motion.period))
