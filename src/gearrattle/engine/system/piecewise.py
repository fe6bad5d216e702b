"""A piecewise-linear system with clearances: the object that every solver works on.

    J q'' + D q' + sum_k w_k F_k(delta_k, delta_k') = T(t),      delta_k = w_k . q - e_k(t)

J and D are diagonal, w_k is row k of W, F_k a ``PiecewiseLaw``. T and the transmission errors e_k are means plus
harmonics of one reference speed. Given the piece of every element, the system is linear with constant coefficients.
An element may have auxiliaries, forces beside its law that remember or are limited; they have pieces of their own.
No gears, clutches or units exist here; q, delta and time carry whatever consistent units the maker chose (SI).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.auxiliary import Auxiliary
from gearrattle.engine.system.clock import Clock
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise_signals import Signals

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Harmonics:
    """Periodic inputs: mean + sum_j (sine_j sin(2 pi p_j t / T) + cosine_j cos(2 pi p_j t / T))."""

    period: float  # the common period T
    cycles: Array  # (H,) p_j, oscillations per period; whole numbers where the orders are commensurate
    mean: Array  # (n,) constant torque on every inertia
    # torque_sine, torque_cosine: (n, H) torque amplitudes
    torque_sine: Array
    torque_cosine: Array
    # error_sine, error_cosine: (m, H) transmission-error amplitudes
    error_sine: Array
    error_cosine: Array

    @property
    def count(self) -> int:
        """Number of distinct orders H."""
        return int(self.cycles.size)

    def later(self, periods: float) -> Harmonics:
        """Return the inputs from a number of periods later on, whole or not: theirs at t = 0 are these at periods T."""
        torque_sine, torque_cosine = turned(self.torque_sine, self.torque_cosine, self.cycles * periods)
        error_sine, error_cosine = turned(self.error_sine, self.error_cosine, self.cycles * periods)
        return replace(
            self,
            torque_sine=torque_sine,
            torque_cosine=torque_cosine,
            error_sine=error_sine,
            error_cosine=error_cosine,
        )

    def part(self, begin: float, length: float) -> Harmonics:
        """Return the inputs of a part of a motion: from a number of periods on, their period so many of these."""
        return replace(self.later(begin), period=length * self.period, cycles=length * self.cycles)


def turned(sine: Array, cosine: Array, cycles: Array) -> tuple[Array, Array]:
    """Return amplitudes (..., H) of sines and cosines whose oscillations begin so many cycles (H,) later."""
    angle = 2.0 * np.pi * np.remainder(cycles, 1.0)
    return sine * np.cos(angle) - cosine * np.sin(angle), sine * np.sin(angle) + cosine * np.cos(angle)


@dataclass(frozen=True)
class PiecewiseSystem:
    """J q'' + D q' + W^T F(W q - e, W q' - e') = T(t), piecewise linear."""

    # inertia, drag: (n,) diagonals of J and D (J > 0, D >= 0)
    inertia: Array
    drag: Array
    rows: Array  # (m, n) W, one row per element
    laws: tuple[PiecewiseLaw, ...]
    inputs: Harmonics  # T(t) and e(t)
    auxiliaries: tuple[Auxiliary, ...] = ()  # forces beside the laws. What looks at a system linearly leaves them out
    signals: Signals | None = None  # torques and transmission errors beside the harmonics; None without
    clock: Clock | None = None  # when auxiliaries change their piece by the clock; None for never

    @property
    def size(self) -> int:
        """Number of degrees of freedom n."""
        return int(self.inertia.size)

    @cached_property
    def clearances(self) -> tuple[int, ...]:
        """Indices of the elements that have a corner."""
        return tuple(k for k, law in enumerate(self.laws) if law.corners.size)

    @property
    def is_plain(self) -> bool:
        """Whether there is nothing but laws and harmonics."""
        return not self.auxiliaries and self.signals is None and self.clock is None

    @cached_property
    def memories(self) -> tuple[int, ...]:
        """Indices of the auxiliaries that have a state."""
        return tuple(c for c, auxiliary in enumerate(self.auxiliaries) if auxiliary.remembers)

    @property
    def watched(self) -> int:
        """Number of elements that may leave their piece: clearances, then auxiliaries."""
        return len(self.clearances) + len(self.auxiliaries)

    @cached_property
    def places(self) -> tuple[int, ...]:
        """Indices of the watched elements' pieces among all pieces, (W,)."""
        first = len(self.laws)
        return (*self.clearances, *range(first, first + len(self.auxiliaries)))

    def element_watched(self, watch: int) -> int:
        """The element that one of those watched belongs to."""
        index = watch - len(self.clearances)
        return self.auxiliaries[index].element if index >= 0 else self.clearances[watch]

    def beyond(self, pieces: tuple[int, ...], watch: int, upward: int) -> tuple[int, ...]:
        """The pieces, of elements and then of auxiliaries, after one of those watched has left its own.

        watch: the clearance, or the number of clearances and the auxiliary.
        upward: 1 beyond its upper bound, 0 beyond the lower one.
        """
        after = list(pieces)
        first = len(self.laws)
        auxiliary = watch - len(self.clearances)
        if auxiliary >= 0:
            way = self.auxiliaries[auxiliary].above if upward else self.auxiliaries[auxiliary].below
            after[first + auxiliary] = int(way[pieces[first + auxiliary]])
            return tuple(after)
        element = self.clearances[watch]
        after[element] += 1 if upward else -1
        for c, candidate in enumerate(self.auxiliaries):
            if candidate.element == element:
                after[first + c] = int(candidate.follow[after[element], pieces[first + c]])
        return tuple(after)

    def stiffness_of(self, pieces: tuple[int, ...]) -> Array:
        """Stiffness matrix (n, n) with every element in the piece given, (m,) indices."""
        slopes = np.array([law.stiffness[p] for law, p in zip(self.laws, pieces, strict=True)])
        return np.asarray((self.rows.T * slopes) @ self.rows)

    def damping_of(self, pieces: tuple[int, ...]) -> Array:
        """Damping matrix (n, n), drag included, with every element in the piece given."""
        coefficients = np.array([law.damping[p] for law, p in zip(self.laws, pieces, strict=True)])
        return np.asarray((self.rows.T * coefficients) @ self.rows + np.diag(self.drag))
