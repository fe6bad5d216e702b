"""One motion over whole periods, its gradient and its slope over a parameter (``kernels.whole_periods``), compiled.

For drivelines with laws and harmonics alone. Motions that the loop cannot follow, such as a start on a corner, are left
to general code.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import march_arrays, variants_march
from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.turning_point_depths import COLUMNS, MOST_TURNS
from gearrattle.engine.kernels.variant_arrays import Coefficients, without_rings
from gearrattle.engine.kernels.variants_march import AS_GIVEN
from gearrattle.engine.kernels.whole_periods import ALONG_CHANGE, ALONG_ROW, NEIGHBOURS, NO_TURNS, Map, differentiate
from gearrattle.engine.periodic.compiled_course import reaches, room_for_touch, turns_of
from gearrattle.engine.periodic.motion import Along, Touch, Turns
from gearrattle.engine.solvers.variants import Batch, Pattern
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]

NOWHERE = Touch(-1, 0, np.nan)


class PeriodBatch(Batch):
    """The loop for one motion, used many times: buffers and compiled code are made once.

    numbers: of three variants; only their shapes are used.
    """

    def __init__(self, system: PiecewiseSystem, cycles: int, numbers: Coefficients) -> None:
        variants = len(numbers.inertia)
        pieces = [system.laws[k].pieces for k in system.clearances]
        counts = np.zeros((2, len(pieces)), np.int64)
        judged = without_rings(np.cumsum([0, *pieces]), counts[0], np.zeros(sum(pieces), np.int64), counts[1])
        start = np.zeros((2, variants, system.size))
        window = np.zeros((variants, 3))
        pattern = Pattern(system, AS_GIVEN, cycles, judged)
        frame = pattern.frame()
        states = len(frame.elements) + system.size
        out = Map(
            end=np.zeros(states),
            turned=np.zeros(len(frame.references)),
            gradient=np.zeros((states, states)),
            slope=np.zeros(states),
            corner=np.full(2, -1, np.int64),
            touched=room_for_touch(states, NOWHERE),
            row=np.zeros(states + 1),
            turns=np.zeros((MOST_TURNS, COLUMNS)),
            turning=np.full(1, NO_TURNS),
            delay=np.zeros(MOST_TURNS),
            outside=np.full((2, len(pieces)), -1),
            reach=reaches(system),
        )
        super().__init__(pattern, numbers, (start[0], start[1]), window, (vectorised(differentiate), out))

    def follow(
        self,
        numbers: Coefficients,
        angle: Array,
        velocity: Array,
        touch: Touch | None = None,
        turns_along: Array | Along | None = None,
    ) -> bool:
        """Follow a motion to its end, which is written to ``out``; return whether it was followed.

        angle, velocity: (n,) at the start [rad, rad/s].
        touch: a corner and an instant, of which ``out.touched`` is written.
        """
        self.out.corner[:] = (-1, 0) if touch is None else (touch.watch, touch.upward)
        self.out.touched.number[:] = np.nan if touch is None else touch.time, np.nan, np.nan
        self.out.turning[0] = NO_TURNS
        if isinstance(turns_along, Along):
            self.out.turning[0] = ALONG_CHANGE
            self.out.outside[:] = turns_along.outside
            self.out.row[:] = np.append(turns_along.state, turns_along.parameter)
        elif turns_along is not None:
            self.out.turning[0] = ALONG_ROW
            self.out.row[:] = turns_along
        self.cases = self.cases._replace(numbers=numbers)
        self.cases.angle[-1] = angle
        self.cases.velocity[-1] = velocity
        self.cursor[:] = 0
        self.cursor[variants_march.AT] = NEIGHBOURS
        self.outcome[:] = 0
        while self.go_on():
            pass
        return bool(self.is_followed[-1])

    def passages(self) -> Passages:
        """Return the crossings of the motion."""
        count = int(self.march.counts[march_arrays.EVENTS])
        log = self.log
        period = float(self.cases.numbers.period[-1, 0])
        watch = log.clearance[:count].copy()
        velocity = log.rate[:count] * self.buffers.scales.corner[watch] / period
        time = (log.cycle[:count] + log.fraction[:count]) * period
        return Passages(time, watch, log.upward[:count].copy(), velocity, np.zeros((count, 0)))

    def turns(self) -> Turns | None:
        """Return the turning points, if they were requested and their slopes have a unique direction."""
        count = int(self.out.turning[0])
        crossings = int(self.march.counts[march_arrays.EVENTS])
        known = crossings <= len(self.out.delay)
        return turns_of(self.out.turns, count, self.out.delay[:crossings].copy()) if known else None
