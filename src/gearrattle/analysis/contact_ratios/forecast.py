"""Contact ratios without time integration: equivalent linearisation of all clearances at once.

Replace every clearance by its equivalent gain and its damping of equal loss. The linear system answers every order by
itself; the sum of orders is a motion about a mean; the gains of the clearances on that motion are the multi-harmonic
describing functions. A *fixed point* is a set of gains that comes out as it went in (Padmanabhan et al. 1995, sec. 6,
third route; Gelb and Vander Velde 1968, ch. 3). The means follow from the mean loads (``averages``). There may be
several fixed points, as there may be several motions; the search begins at every combination of a grid of gains, and
all that are found are kept. None may be near the truth: only orders of the excitation are in the motion, so
sub-harmonics and chaos are not, and a fixed point need not be stable. Each is therefore followed to the periodic motion
it stands for, where there is one, and to that motion's Floquet multipliers (``harmonic_balance``). Stable motions come
first; among equals, the one most searches ended at.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.contact_ratios.averages import Averages
from gearrattle.analysis.contact_ratios.contact_ratio_record import (
    best_line,
    beyond,
    elastic,
    following,
    largest_slope,
    slopes,
)
from gearrattle.analysis.contact_ratios.harmonic_balance import Balance, balance
from gearrattle.derived_values import kept
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# searches begin at so many equal steps from this share of the largest slope to all of it,
LOWEST = 0.02
FINEST = 24
MOST_STARTS = 32  # largest number of starts
FEWEST_SAMPLES = 512
SAME = 1e-5  # distance up to which two fixed points are the same
CONVERGED = 1e-8  # largest change of a gain, as a share of the largest slope
_RELAXED = 25  # damped iterations before Newton's method
_MOST_SOUGHT = 32  # clearances beyond which no motions are computed: every one of hundreds of orders needs a matrix
_MANY = 12  # clearances beyond which Newton's steps are by Krylov's method
_MOST_KRYLOV = 20  # largest number of these steps
_FEW_KRYLOV = 6  # the same if the search need not be thorough
_PERIODS_WITHOUT_PERIOD = 61  # length of the samples of orders without a common period, in periods


@dataclass(frozen=True)
class FixedPoint:
    """Fixed point of equivalent linearisation: gains that the motion with these gains reproduces.

    Attributes
    ----------
    gain
        (K,) equivalent gain of every clearance, as a share of its largest slope.
    mean_slope
        (K,) mean of f' over the same motion, as a share of the largest slope.
    mean
        (K,) mean deflection [rad or m].
    deviation
        (K,) rms of the deflection about it [rad or m].
    starts
        how many searches ended here.
    motion
        the periodic motion that it leads to; None where none was sought: no clearance moves, nothing is
        excited, or the orders of the excitation have no common period.
    """

    gain: Array
    mean_slope: Array
    mean: Array
    deviation: Array
    starts: int
    motion: Balance | None = None

    @property
    def confirmed(self) -> bool:
        """Whether it leads to a stable periodic motion."""
        return self.motion is not None and self.motion.stable

    @property
    def ratios(self) -> tuple[Array, Array]:
        """(K,) gain and (K,) mean slope to be reported: those of the stable motion, or else of linearisation."""
        if self.motion is not None and self.confirmed:
            return self.motion.gain, self.motion.mean_slope
        return self.gain, self.mean_slope


@dataclass(frozen=True)
class Forecast:
    """All fixed points found, and how many searches there were, and failed.

    Those that lead to a stable motion come first; among equals, the one most searches ended at.
    """

    points: tuple[FixedPoint, ...]
    searches: int
    failed: int


class Linearisation:
    """Map from gains and dampings of the clearances to those on the motion that they make."""

    def __init__(self, system: PiecewiseSystem) -> None:
        self.system = system
        inputs = system.inputs
        self.moving = [k for k in system.clearances if system.laws[k].stiffness.max() > 0.0]
        turning = inputs.cycles > 0.0
        self.omega = 2.0 * np.pi * inputs.cycles[turning] / inputs.period
        self.torque = (inputs.torque_cosine - 1j * inputs.torque_sine)[:, turning]
        self.error = (inputs.error_cosine - 1j * inputs.error_sine)[:, turning]
        whole = bool(np.all(np.abs(inputs.cycles - np.rint(inputs.cycles)) < 1e-9))
        self.periodic = whole
        highest = float(inputs.cycles.max(initial=1.0)) * (1 if whole else _PERIODS_WITHOUT_PERIOD)
        count = max(FEWEST_SAMPLES, 16 * int(np.ceil(highest)))
        span = inputs.period * (1 if whole else _PERIODS_WITHOUT_PERIOD)
        self.waves: Complex = np.exp(1j * np.outer(self.omega, np.arange(count) * span / count))
        self.slope = np.array([law.stiffness[-1] for law in system.laws])
        self.damping = np.array([law.damping[-1] for law in system.laws])
        self.full = np.array([largest_slope(system.laws[k]) for k in self.moving])
        self.loss = np.array([max(float(system.laws[k].damping.max()), 1e-300) for k in self.moving])

    def equivalents(self, shares: Array) -> tuple[Array, Array]:
        """(m,) slopes and (m,) dampings of all elements, from those of the clearances as shares of the largest."""
        slope = self.slope.copy()
        damping = self.damping.copy()
        gains, losses = np.split(shares, 2)
        slope[self.moving] = gains * self.full
        damping[self.moving] = losses * self.loss
        return slope, damping

    def motion(self, shares: Array) -> tuple[Array, Array]:
        """(m, S) oscillating deflections and their rates, with gains and dampings (2K,) as shares of the largest."""
        system = self.system
        (slope, damping) = self.equivalents(shares)
        spring = (system.rows.T * slope) @ system.rows
        loss = (system.rows.T * damping) @ system.rows + np.diag(system.drag)
        deflection = np.empty(self.error.shape, dtype=np.complex128)
        for j, w in enumerate(self.omega):
            push = self.torque[:, j] + system.rows.T @ ((slope + 1j * w * damping) * self.error[:, j])
            dynamic = spring - w * w * np.diag(system.inertia) + 1j * w * loss
            deflection[:, j] = system.rows @ np.linalg.solve(dynamic, push) - self.error[:, j]
        return (deflection @ self.waves).real, ((1j * self.omega * deflection) @ self.waves).real

    @property
    def at_rest(self) -> bool:
        """Whether nothing oscillates: the driveline stands at its equilibrium, whatever the gains."""
        return not (self.torque.any() or self.error.any())

    @cached_property
    def _averages(self) -> Averages:
        return Averages(self.system)

    def means(self, oscillation: Array) -> Array:
        """(m,) mean deflections at which the averaged laws carry the mean loads, about oscillations (m, S)."""
        return self._averages.means(oscillation)

    def answer(self, shares: Array) -> Array:
        """(2K,) gains and dampings of equal loss, as shares of the largest, on the motion that given ones make."""
        oscillation, rate = self.motion(shares)
        means = self.means(oscillation)
        ratios = np.empty((2, len(self.moving)))
        for i, k in enumerate(self.moving):
            law = self.system.laws[k]
            delta = means[k] + oscillation[k]
            gain = best_line(elastic(law, delta), delta)
            at_mean = float(law.stiffness[law.piece_at(float(means[k]))])
            ratios[0, i] = (at_mean if np.isnan(gain) else gain) / self.full[i]
            between = 0.5 * (rate[k] + following(rate[k]))
            power = float(between @ between)
            loss = law.damping[0] + np.diff(law.damping) @ (beyond(law.corners, delta) @ between**2) / (power or 1.0)
            at_mean = float(law.damping[law.piece_at(float(means[k]))])
            ratios[1, i] = (loss if power > 0.0 else at_mean) / self.loss[i]
        return ratios.ravel()

    def point(self, shares: Array, starts: int, *, seek: bool = True) -> FixedPoint:
        """Describe the motion of a fixed point, for all clearances; ``seek`` the periodic motion it leads to."""
        oscillation, _ = self.motion(shares)
        means = self.means(oscillation)
        clearances = list(self.system.clearances)
        gain, slope = np.full((2, len(clearances)), np.nan)
        for i, k in enumerate(clearances):
            if k in self.moving:
                law = self.system.laws[k]
                gain[i] = shares[self.moving.index(k)]
                slope[i] = slopes(law, means[k] + oscillation[k]) / largest_slope(law)
        deviation = np.sqrt(np.mean(oscillation[clearances] ** 2, axis=1))
        sought = seek and bool(self.moving) and self.periodic
        motion = balance(self.system, *self.equivalents(shares), self.means) if sought else None
        return FixedPoint(gain, slope, means[clearances], deviation, starts, motion)


def _starts(count: int, *, thorough: bool) -> Iterator[Array]:
    """Yield gains (K,): all combinations of the levels, or all alike and one unlike where these are too many.

    No more than about ``MOST_STARTS``: of very many clearances only some, evenly spread, are the one unlike.

    Where it need not be thorough: all in contact, and up to ``_MANY`` clearances all open as well.
    """
    if not thorough:
        yield from (np.full(count, level) for level in ((1.0, LOWEST) if count <= _MANY else (1.0,)))
        return
    steps = max((n for n in range(2, FINEST + 1) if n**count <= MOST_STARTS), default=0)
    if steps:
        yield from (np.array(levels) for levels in product(np.linspace(LOWEST, 1.0, steps), repeat=count))
        return
    apart = -(-2 * count // MOST_STARTS)
    for level, other in ((LOWEST, 1.0), (1.0, LOWEST)):
        yield np.full(count, level)
        yield from (np.where(np.arange(count) == k, other, level) for k in range(0, count, apart))


def _search(linear: Linearisation, start: Array, *, thorough: bool) -> Iterator[Array]:
    """Yield the fixed points that searches from one start end at: Newton's method at once, and after relaxation.

    Beyond ``_MANY`` clearances after relaxation only, without the derivatives that cost an answer for every clearance.
    """
    from scipy.optimize import root

    def change(shares: Array) -> Array:
        return linear.answer(np.clip(shares, 0.0, 1.0)) - shares

    many = len(linear.moving) > _MANY
    most = _MOST_KRYLOV if thorough else _FEW_KRYLOV
    for relaxed in (_RELAXED,) if many else (0, _RELAXED):
        shares = start
        for _ in range(relaxed):
            shares = 0.5 * (shares + linear.answer(shares))
        if many:
            options = {"fatol": 1e-11, "maxiter": most}
            with suppress(ValueError):  # a direction of no length: it stays where it is
                shares = np.asarray(root(change, shares, method="krylov", options=options).x)
        else:
            shares = np.asarray(root(change, shares, tol=1e-11).x)
        if np.abs(change(shares)).max() <= CONVERGED:
            yield shares


def forecast(system: PiecewiseSystem, *, thorough: bool = True) -> Forecast:
    """Find the fixed points of equivalent linearisation.

    Parameters
    ----------
    thorough
        whether to search from a grid of starts and to seek the motions that fixed points lead to, of up to
        ``_MOST_SOUGHT`` clearances; otherwise from two starts, of more than ``_MANY`` clearances from one, and no
        motions.

    Raises
    ------
    Runaway
        an element of zero last slope cannot carry its load.
    """
    return _thorough(system) if thorough else _from_starts(system, thorough=False)


@kept
def _thorough(system: PiecewiseSystem) -> Forecast:
    """Gains and mean slopes are asked for one after the other: both are of one search."""
    return _from_starts(system, thorough=True)


def _from_starts(system: PiecewiseSystem, *, thorough: bool) -> Forecast:
    linear = Linearisation(system)
    if not linear.moving:
        return Forecast((linear.point(np.zeros(0), 1),), 1, 0)
    if linear.at_rest:  # every search ends at the slopes of the equilibrium
        return Forecast((linear.point(linear.answer(np.ones(2 * len(linear.moving))), 1, seek=False),), 1, 0)
    distinct: list[tuple[Array, int]] = []
    searches = 0
    ended = 0
    for start in _starts(len(linear.moving), thorough=thorough):
        searches += 1 if len(linear.moving) > _MANY else 2
        for shares in _search(linear, np.concatenate([start, start]), thorough=thorough):
            ended += 1
            same = next((i for i, (other, _) in enumerate(distinct) if np.abs(other - shares).max() < SAME), None)
            if same is None:
                distinct.append((shares, 1))
            else:
                distinct[same] = (distinct[same][0], distinct[same][1] + 1)
    seek = thorough and len(linear.moving) <= _MOST_SOUGHT
    points = [linear.point(shares, count, seek=seek) for shares, count in distinct]
    points.sort(key=lambda point: (not point.confirmed, -point.starts))
    return Forecast(tuple(points), searches, searches - ended)
