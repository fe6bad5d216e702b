"""The smallest pulse of torque that tips a stable motion over into another one, at several instants of the period.

An impulse I on an inertia J changes its speed by I / J at once. The effect of a small one dies out. The smallest one
that does not die out leads to the border of the basin; along the border the motion goes to an unstable one, the saddle.

Pulses are made larger step by step until the motion no longer comes back; the border is then found by bisection. Where
the basin has several borders along the way, the first one that the steps meet is found.

Takes an Orbit; gives a table.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, free_names
from gearrattle.engine.periodic.period_map import PeriodMap, State
from gearrattle.engine.system.piecewise import Harmonics, PiecewiseSystem
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model.table import did_you_mean, shown

if TYPE_CHECKING:
    import pandas as pd

    from gearrattle.orbits.orbit import Orbit

Array = NDArray[np.float64]

_GROWTH = 1.25  # of pulses, from one to the next
_SMALLEST, _LARGEST = 1e-3, 1e2  # changes of speed; 1 is as much as the largest corner, in balanced coordinates
_HALVINGS = 24
_CHUNK = 8  # passes between two checks whether the motion has come back
_MOST_CHUNKS = 60
_BACK = 1e-4  # of the largest corner: a motion nearer than this has come back


def tipping_table(orbit: Orbit, on: str, instants: int) -> pd.DataFrame:
    """Return the smallest pulses that tip a motion over; see ``Orbit.tipping``."""
    import pandas as pd

    names = free_names(orbit.model)
    if on not in names:
        rule = f"there is no such inertia that is free; there are {', '.join(names)}"
        raise ModelError(Problem("on", shown(on), rule, did_you_mean(on, names)))
    if not orbit.stable:
        raise ModelError(Problem("orbit", repr(orbit), "is not stable: it needs no pulse", "take a stable one"))
    system = assemble(orbit.model).system
    if system.clock is not None:
        rule = "pulses are not known where the stiffness of a mesh alternates"
        raise ModelError(Problem("model", orbit.model.name, rule))
    rows = []
    for k in range(instants):
        share = k / instants
        border = _Border(orbit, system, names.index(on), share)
        rows.append((share, share * orbit.period, *(border.smallest(sign) for sign in (1.0, -1.0))))
    return pd.DataFrame(rows, columns=["share", "time", "forward", "backward"])


class _Border:
    """The border of a motion's basin along pulses on one inertia at one instant."""

    def __init__(self, orbit: Orbit, system: PiecewiseSystem, inertia: int, share: float) -> None:
        self._map = PeriodMap(_later(system, share * orbit.cycles), orbit.cycles)
        self._state = _state_at(orbit, share)
        self._inertia, self._moment = inertia, float(system.inertia[inertia])
        self._at = len(self._map.flow.coordinates.elements) + inertia
        self._unit = self._map.size / self._map.scale[self._at]

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
        for _ in range(_MOST_CHUNKS):
            try:
                state = self._map.later(state, _CHUNK)
            except ConvergenceError:
                return False
            if np.linalg.norm((state.y - self._state.y) * self._map.scale) < _BACK * self._map.size:
                return True
        return False


def _later(system: PiecewiseSystem, periods: float) -> PiecewiseSystem:
    """The driveline with its inputs shifted ahead by a number of periods, whole or not."""
    inputs = system.inputs
    angle = 2.0 * np.pi * np.remainder(inputs.cycles * periods, 1.0)
    turned = {}
    for kind in ("torque", "error"):
        sine, cosine = getattr(inputs, f"{kind}_sine"), getattr(inputs, f"{kind}_cosine")
        turned[f"{kind}_sine"] = sine * np.cos(angle) - cosine * np.sin(angle)
        turned[f"{kind}_cosine"] = sine * np.sin(angle) + cosine * np.cos(angle)
    ahead: Harmonics = replace(inputs, **turned)
    return replace(system, inputs=ahead)


def _state_at(orbit: Orbit, share: float) -> State:
    """The state of a motion at a share of its n T."""
    if share == 0.0:
        return orbit.motion.start
    period_map = orbit.period_map
    samples = 1 << 10
    march = period_map.marched(orbit.motion.start, samples_per_cycle=samples)
    row, clearances = round(share * orbit.cycles * samples), len(period_map.system.clearances)
    states = march.samples.states[row, : period_map.flow.states] / period_map.scale
    return State(states, march.samples.pieces[row, clearances:].copy())
