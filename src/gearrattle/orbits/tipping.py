"""The smallest pulse of torque that tips a stable motion over into another one, at several instants of the period.

An impulse I on an inertia J changes its speed by I / J at once. The effect of a small one dies out. The smallest one
that does not die out leads to the border of the basin; along the border the motion goes to an unstable one, the saddle.

Pulses are made larger step by step until the motion no longer comes back; the border is then found by bisection. Where
the basin has several borders along the way, the first one that the steps meet is found.

Takes a periodic motion of a model; gives a table.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import free_names
from gearrattle.engine.periodic.period_map import Pass, PeriodMap, State
from gearrattle.engine.periodic.shooting import multipliers_of
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean, shown

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

_GROWTH = 1.25  # of pulses, from one to the next
_SMALLEST, _LARGEST = 1e-3, 1e2  # changes of speed; 1 is as much as the largest corner, in balanced coordinates
_HALVINGS = 24
_CHUNK = 8  # passes between two checks whether the motion has come back
_BACK = 1e-4  # of the largest corner: a motion nearer than this has come back
_MOST_PASSES = 5000
_SAMPLES = 1024  # at least, in a period of the motion


def tipping_table(model: Model, period_map: PeriodMap, motion: Pass, on: str, instants: int) -> pd.DataFrame:
    """Return the smallest pulses that tip a stable, isolated motion over; see ``Orbit.tipping``."""
    import pandas as pd

    names = free_names(model)
    if on not in names:
        rule = f"there is no such inertia that is free; there are {', '.join(names)}"
        raise ModelError(Problem("on", shown(on), rule, did_you_mean(on, names)))
    if period_map.system.clock is not None:
        rule = "pulses are not known where the stiffness of a mesh alternates"
        raise ModelError(Problem("model", model.name, rule))
    passes = _passes_until_back(motion)
    samples = instants * -(-_SAMPLES // instants)
    march = period_map.marched(motion.start, samples_per_cycle=samples)
    rows = []
    for k in range(instants):
        row, share = k * period_map.cycles * (samples // instants), k / instants
        start = motion.start if k == 0 else period_map.sampled(march, row)
        system = period_map.system
        later = replace(system, inputs=system.inputs.later(share * period_map.cycles))
        ahead = PeriodMap(later, period_map.cycles)
        border = _Border(ahead, start, names.index(on), passes)
        rows.append((share, share * period_map.length, *(border.smallest(sign) for sign in (1.0, -1.0))))
    return pd.DataFrame(rows, columns=["share", "time", "forward", "backward"])


def _passes_until_back(motion: Pass) -> int:
    """After how many passes the largest pulse has died out, where the motion is about linear.

    Raises
    ------
    ModelError
        too many: what has not come back by then could not be told from what never does.
    """
    largest = float(np.abs(multipliers_of(motion.gradient)[0]))
    passes = 2.0 * np.log(_LARGEST / _BACK) / -np.log(min(largest, 1.0 - 1e-12)) if largest > 0.0 else 1.0
    if passes > _MOST_PASSES:
        rule = f"dies out too slowly for pulses: its largest multiplier has the modulus {largest:.6g}"
        raise ModelError(Problem("orbit", f"{motion.cycles} T", rule, "give the driveline more damping"))
    return max(4 * _CHUNK, int(passes))


class _Border:
    """The border of a motion's basin along pulses on one inertia at one instant."""

    def __init__(self, period_map: PeriodMap, start: State, inertia: int, passes: int) -> None:
        self._map, self._state, self._passes = period_map, start, passes
        self._moment = float(period_map.system.inertia[inertia])
        self._at = len(period_map.flow.coordinates.elements) + inertia
        self._unit = period_map.size / period_map.scale[self._at]

    def smallest(self, sign: float) -> float:
        """Return the smallest impulse of a sign (1 or -1) that tips the motion over [N m s]; NaN where none does."""
        speed, before = _SMALLEST, 0.0
        while self._comes_back(sign * speed):
            before, speed = speed, _GROWTH * speed
            if speed > _LARGEST:
                return float("nan")
        for _ in range(_HALVINGS):
            middle = 0.5 * (before + speed)
            if self._comes_back(sign * middle):
                before = middle
            else:
                speed = middle
        return float(sign * speed * self._unit * self._moment)

    def _comes_back(self, speed: float) -> bool:
        """Whether the motion comes back after a pulse; ``speed`` is the change of speed in units of ``_unit``."""
        y = self._state.y.copy()
        y[self._at] += speed * self._unit
        state = State(y, self._state.auxiliary_pieces)
        for _ in range(-(-self._passes // _CHUNK)):
            try:
                state = self._map.later(state, _CHUNK)
            except ConvergenceError:
                return False
            if np.linalg.norm((state.y - self._state.y) * self._map.scale) < _BACK * self._map.size:
                return True
        return False
