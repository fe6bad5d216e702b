"""The smallest pulse of torque that tips a stable motion over into another one, over the instants of the period.

An impulse I on an inertia J changes its speed by I / J at once. The effect of a small one dies out. The smallest one
that does not die out leads to the border of the basin; along the border the motion goes to an unstable one, the saddle.

Pulses are made larger step by step until the motion no longer comes back; the border is then found by bisection. Where
the basin has several borders along the way, the first one that the steps meet is found. The instant at which the
smallest pulse is smallest is sought around the best of evenly spaced instants (scipy.optimize.minimize_scalar).

Takes a periodic motion of a model; gives a table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from gearrattle.assembly import assemble, free_names
from gearrattle.engine.periodic.period_map import Pass, PeriodMap, State
from gearrattle.engine.periodic.shooting import multipliers_of
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean, shown
from gearrattle.orbits.progress import Progress
from gearrattle.wording import listed

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

_GROWTH = 1.25  # of pulses, from one to the next
_SMALLEST, _LARGEST = 1e-3, 1e2  # changes of speed; 1 is as much as the largest corner, in balanced coordinates
_HALVINGS = 24
_CHUNK = 8  # passes between two checks whether the motion has come back
_BACK = 1e-4  # of the largest corner: a motion nearer than this has come back
_MOST_PASSES = 5000
_SAMPLES = 1024  # at least, of a motion: instants between which the best one is sought
_MOST_INSTANTS = 40  # that are tried for the best one
_SIGNS = (1.0, -1.0)


def check_pulses(model: Model, on: str) -> None:
    """Refuse pulses on what is no free inertia of a model, and on a model for which they are not known.

    Raises
    ------
    ModelError
        no such inertia, or stiffness that alternates by the clock.
    """
    names = free_names(model)
    if on not in names:
        rule = f"must be a free inertia: {listed(names, 'or')}"
        raise ModelError(Problem("on", shown(on), rule, did_you_mean(on, names)))
    if assemble(model).system.clock is not None:
        rule = "pulses are not known where the stiffness of a mesh alternates"
        raise ModelError(Problem("model", model.name, rule))


def tipping_table(
    period_map: PeriodMap,
    motion: Pass,
    inertia: int,
    *,
    instants: int,
    best: bool,
    progress: Progress | None,
) -> pd.DataFrame:
    """Return the smallest pulses that tip a stable, isolated motion over; see ``Orbit.tipping``.

    Parameters
    ----------
    period_map
        that the motion is a fixed point of.
    motion
        the motion.
    inertia
        on which the pulses act, by its number among the free ones.
    instants, best
        see ``Orbit.tipping``.
    progress
        called with the finished share; an exception from it ends the work.
    """
    import pandas as pd

    count = len(_SIGNS) * (instants + (1 + _MOST_INSTANTS if best else 0))
    borders = _Borders(period_map, motion, inertia, -(-_SAMPLES // instants) * instants, _Count(count, progress))
    spacing = borders.samples // instants
    samples = {spacing * k for k in range(instants)}
    if best:
        samples |= {borders.best(sign, sorted(samples), spacing) for sign in _SIGNS}
    rows = []
    for sample in sorted(samples):
        share = sample / borders.samples
        rows.append((share, share * period_map.length, *(borders.smallest(sample, sign) for sign in _SIGNS)))
    if progress is not None:
        progress(1.0)
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


class _Count:
    """Counts borders, of at most so many, and says what share of them is known."""

    def __init__(self, most: int, progress: Progress | None) -> None:
        self._most, self._known, self._progress = most, 0, progress

    def one_more(self) -> None:
        """Take note of one more."""
        self._known += 1
        if self._progress is not None:
            self._progress(min(1.0, self._known / self._most))


class _Borders:
    """The border of a motion's basin along pulses on one inertia, at every sample of the motion."""

    def __init__(self, period_map: PeriodMap, motion: Pass, inertia: int, samples: int, count: _Count) -> None:
        self.samples, self._count = samples, count
        self._map, self._motion, self._inertia = period_map, motion, inertia
        self._march = period_map.marched(motion.start, samples_per_cycle=samples)
        self._passes = _passes_until_back(motion)
        self.smallest = cache(self._smallest)

    def best(self, sign: float, samples: Sequence[int], spacing: int) -> int:
        """Return the sample at which the smallest impulse of a sign is smallest, from some that are evenly spaced."""
        size = {sample: abs(self.smallest(sample, sign)) for sample in samples}
        known = {sample: value for sample, value in size.items() if np.isfinite(value)}
        if not known:
            return samples[0]
        nearest = min(known, key=known.__getitem__)

        def impulse(at: float) -> float:
            sample = round(at) % self.samples
            value = abs(self.smallest(sample, sign))
            if np.isfinite(value):
                known[sample] = value
                return value
            return 2.0 * max(known.values())

        bounds = (nearest - spacing, nearest + spacing)
        minimize_scalar(impulse, bounds=bounds, method="bounded", options={"xatol": 0.5, "maxiter": _MOST_INSTANTS})
        return min(known, key=known.__getitem__)

    def _smallest(self, sample: int, sign: float) -> float:
        """The smallest impulse of a sign (1 or -1) that tips the motion over [N m s]; NaN where none does."""
        cycles, system = self._map.cycles, self._map.system
        start = self._map.sampled(self._march, sample * cycles) if sample else self._motion.start
        inputs = system.inputs.later(sample / self.samples * cycles)
        ahead = PeriodMap(replace(system, inputs=inputs), cycles)
        border = _Border(ahead, start, self._inertia, self._passes).smallest(sign)
        self._count.one_more()
        return border


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
        impulse = np.zeros_like(self._state.y)
        impulse[self._at] = speed * self._unit
        state = self._map.struck(self._state, impulse)
        for _ in range(-(-self._passes // _CHUNK)):
            try:
                state = self._map.later(state, _CHUNK)
            except ConvergenceError:
                return False
            if np.linalg.norm((state.y - self._state.y) * self._map.scale) < _BACK * self._map.size:
                return True
        return False
