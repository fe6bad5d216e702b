"""The half-period map of a symmetric driveline: the motion over half its length, then its mirror image.

A driveline is symmetric if its mirror image, all angles and torques reversed, is the same driveline half a period
later: no mean load, odd harmonics only, laws that are odd functions. Then a motion of n periods, n odd, may be its own
mirror image half its length later. With S y = -y and P_half the flow over half the length,

    H(y) = S P_half(y),      P = H(H(y)),      M = (dH/dy)^2.

Symmetric motions are the fixed points of H. A multiplier 1 of M is ambiguous; the multiplier of H decides: 1 is a fold,
-1 a breaking of the symmetry.

J. W. Swift, K. Wiesenfeld, Physical Review Letters 52 (1984), 705-708.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.motion import Pass, State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.system.auxiliary import BACKWARD, FORWARD, OFF, STICK, Auxiliary
from gearrattle.engine.system.flow import flow_of
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ODD = 1e-12  # largest relative difference between a law and its mirror image


@dataclass(frozen=True)
class Mirror:
    """The mirror image of a symmetric driveline's states: signs are reversed, drive and coast sides exchanged.

    auxiliary: (C,) index of the image of every auxiliary: a slider that acts in the pieces on the other side, often the
    same slider.
    """

    auxiliary: IntArray
    entry: IntArray  # (N,) index i of the entry of a state for every entry of its image: image = -state[i]
    remembers: NDArray[np.bool_]  # (C,) whether an auxiliary element has a memory

    def state(self, state: State) -> State:
        """Return the image of a state."""
        pieces = state.auxiliary_pieces
        if pieces is not None:
            reversed_pieces = np.where(pieces == FORWARD, BACKWARD, np.where(pieces == BACKWARD, FORWARD, pieces))
            pieces = np.where(self.remembers, reversed_pieces[self.auxiliary], pieces)
        return State(self.rows(state.y), pieces)

    def rows(self, matrix: Array) -> Array:
        """Return the images of columns (N, ...)."""
        return np.asarray(-matrix[self.entry])


def mirror_of(system: PiecewiseSystem) -> Mirror | None:
    """Return the mirror under which a driveline is the same half a period later; None where there is none."""
    inputs = system.inputs
    flow = flow_of(system)
    if system.signals is not None or system.clock is not None:
        return None
    is_used = np.any(inputs.torque_sine, axis=0) | np.any(inputs.torque_cosine, axis=0)
    is_used |= np.any(inputs.error_sine, axis=0) | np.any(inputs.error_cosine, axis=0)
    are_odd = np.round(inputs.cycles[is_used]).astype(int) % 2 == 1
    images = _images(system.auxiliaries)
    if np.any(inputs.mean) or not are_odd.all() or images is None or not all(is_odd(law) for law in system.laws):
        return None
    first = flow.states - len(system.memories)
    memories = [first + system.memories.index(images[c]) for c in system.memories]
    entry = np.array([*range(first), *memories], dtype=np.int64)
    remembers = np.array([auxiliary.remembers for auxiliary in system.auxiliaries], dtype=np.bool_)
    return Mirror(np.array(images, dtype=np.int64), entry, remembers)


def is_symmetric(system: PiecewiseSystem) -> bool:
    """Return whether the mirror image of a driveline is the same driveline half a period later."""
    return mirror_of(system) is not None


def _images(auxiliaries: Sequence[Auxiliary]) -> list[int] | None:
    """The mirror image of every auxiliary element; None where a slider has none."""
    images = list(range(len(auxiliaries)))
    for c, slider in enumerate(auxiliaries):
        if slider.remembers:
            alike = [d for d, other in enumerate(auxiliaries) if _is_image(slider, other)]
            if not alike:
                return None
            images[c] = c if c in alike else alike[0]
    return images if sorted(images) == list(range(len(auxiliaries))) else None


def _is_image(slider: Auxiliary, other: Auxiliary) -> bool:
    """Whether another slider of the element has the same strength, and acts in the pieces on the other side."""
    if slider.element != other.element or not other.remembers:
        return False
    acts, other_acts = (one.follow[:, STICK] != OFF for one in (slider, other))
    is_as_strong = np.array_equal(slider.memory, other.memory) and np.array_equal(slider.offset, other.offset)
    return is_as_strong and np.array_equal(acts, other_acts[::-1])


def is_odd(law: PiecewiseLaw) -> bool:
    """Return whether a law is an odd function of deflection and rate."""
    pairs = (
        (law.corners, -law.corners[::-1]),
        (law.stiffness, law.stiffness[::-1]),
        (law.damping, law.damping[::-1]),
        (law.offset, -law.offset[::-1]),
    )
    return all(bool(np.all(np.abs(a - b) <= _ODD * np.abs(a).max(initial=0.0))) for a, b in pairs)


def half_period_map(system: PiecewiseSystem, cycles: int = 1) -> HalfPeriodMap | None:
    """Return the half-period map of n periods; None without symmetry, or if n is even."""
    return HalfPeriodMap(system, cycles) if cycles % 2 == 1 and is_symmetric(system) else None


class HalfPeriodMap(PeriodMap):
    """The map over half of n periods, mirrored; its fixed points are the symmetric motions.

    mirror: the mirror of the driveline's states.
    ValueError: the driveline is not symmetric, or n is even.
    """

    def __init__(self, system: PiecewiseSystem, cycles: int = 1) -> None:
        mirror = mirror_of(system)
        if cycles % 2 == 0 or mirror is None:
            raise ValueError("a half-period map is for symmetric drivelines and an odd number of periods")
        super().__init__(system, cycles)
        self.mirror = mirror

    @property
    def length(self) -> float:
        """Half the duration of n periods [s]."""
        return 0.5 * super().length

    @property
    def repeats_one_period(self) -> bool:
        """False: half a motion is not a whole number of periods."""
        return False

    def __call__(self, state: State) -> Pass:
        """Follow a state over half of n periods, and mirror it."""
        march = self.marched(state, samples_per_cycle=2)
        crossings = self.passages(march)
        crossings = crossings.where(crossings.time < self.length)
        turned = self.turned(march, self.cycles)
        end = self.mirror.state(self.sampled(march, self.cycles))
        gradient = self.mirror.rows(self.gradient_along(march, crossings))
        return Pass(state, end, gradient, -turned, crossings, self.system.inputs.period, self.cycles)

    def later(self, state: State, passes: int = 1) -> State:
        """Return the state after some passes, without the gradient. Errors as in a call."""
        march = self.marched(state, -(-passes // 2), samples_per_cycle=2)
        end = self.sampled(march, passes * self.cycles)
        return end if passes % 2 == 0 else self.mirror.state(end)
