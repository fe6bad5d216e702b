"""Motions over whole periods of many variants of a driveline, in one compiled loop (``kernels.periods``).

For drivelines of laws and harmonics alone. What the loop cannot do, such as a start on a corner, it leaves out.

Takes a system as the pattern and ``Coefficients`` of V variants with a start each; gives Maps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import packed
from gearrattle.engine.kernels.periods import REACHED, Maps, map_many
from gearrattle.engine.kernels.variants import Coefficients, Judged
from gearrattle.engine.solvers.many import Batch, Pattern
from gearrattle.engine.system.passages import Passages
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]


class PeriodBatch(Batch):
    """The loop for V variants, used many times: buffers and compiled code are made once.

    Parameters
    ----------
    system
        one of the drivelines.
    cycles
        how many periods a motion lasts.
    numbers
        of V variants; only their shapes matter here.
    """

    def __init__(self, system: PiecewiseSystem, cycles: int, numbers: Coefficients) -> None:
        variants, pieces = len(numbers.inertia), [system.laws[k].pieces for k in system.clearances]
        counts = np.zeros((2, len(pieces)), np.int64)
        judged = Judged(np.cumsum([0, *pieces]), counts[0], np.zeros(sum(pieces), np.int64), counts[1])
        start, window = np.zeros((2, variants, system.size)), np.zeros((variants, 3))
        super().__init__(Pattern(system, False, cycles, judged), numbers, (start[0], start[1]), window)
        frame = self.cases.frame
        states, clearances = len(frame.elements) + system.size, len(frame.clearances)
        self.out = Maps(
            np.zeros(variants, np.int64),
            np.zeros((variants, states)),
            np.zeros((variants, len(frame.references))),
            np.zeros((variants, states, states)),
            np.zeros(variants, np.int64),
            np.zeros((variants, clearances), np.int64),
        )
        self._loop = map_many

    def follow(
        self, numbers: Coefficients, angle: Array, velocity: Array, has_gradient: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Follow V motions to their ends, which ``out`` then holds.

        Parameters
        ----------
        numbers
            of the V variants.
        angle, velocity
            (V, n) at the start [rad, rad/s].
        has_gradient
            (V,) whether the gradient is wanted.

        Returns
        -------
        NDArray[np.bool_]
            (V,) which of them were followed.
        """
        self.cases = self.cases._replace(numbers=numbers)
        self.cases.angle[:], self.cases.velocity[:] = angle, velocity
        self.out.has_gradient[:] = has_gradient
        self.cursor[:] = 0
        self.outcome[:] = 0
        while self.go_on():
            pass
        return np.asarray(self.outcome == REACHED)

    def passages(self) -> Passages:
        """Return the crossings of the last variant."""
        count, log = int(self.march.counts[packed.EVENTS]), self.log
        period = float(self.cases.numbers.period[-1, 0])
        watch = log.clearance[:count].copy()
        velocity = log.rate[:count] * self._corner_scale()[watch] / period
        time = (log.cycle[:count] + log.fraction[:count]) * period
        return Passages(time, watch, log.upward[:count].copy(), velocity, np.zeros((count, 0)))

    def _corner_scale(self) -> Array:
        """(K,) of the variant that was laid out last."""
        return np.asarray(self.store.builder.workspace.common.corner_scale)
