"""The half-period map of a symmetric driveline: half a motion forward, then mirrored.

A driveline is symmetric if its mirror image, all angles and torques reversed, is the same driveline half a period
later: no mean load, odd harmonics only, laws that are odd functions. Then a motion of n periods, n odd, may be its own
mirror image half its length later. With S y = -y and P_half the flow over half the length,

    H(y) = S P_half(y),      P = H(H(y)),      M = (dH/dy)^2.

Symmetric motions are the fixed points of H. A multiplier 1 of M alone does not say what happens there; that of H does:
1 is a fold, -1 the end of the symmetry.

Takes a PiecewiseSystem; gives Passes.

J. W. Swift, K. Wiesenfeld, Physical Review Letters 52 (1984), 705-708.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.period_map import Pass, PeriodMap, State
from gearrattle.engine.system.auxiliary import BACKWARD, FORWARD, OFF, STICK, Auxiliary
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise import PiecewiseSystem

_ODD = 1e-12  # largest relative difference between a law and its mirror image


def is_symmetric(system: PiecewiseSystem) -> bool:
    """Return whether the mirror image of a driveline is the same driveline half a period later."""
    inputs = system.inputs
    if system.signals is not None or system.clock is not None:
        return False
    is_used = np.any(inputs.torque_sine, axis=0) | np.any(inputs.torque_cosine, axis=0)
    is_used |= np.any(inputs.error_sine, axis=0) | np.any(inputs.error_cosine, axis=0)
    are_odd = np.round(inputs.cycles[is_used]).astype(int) % 2 == 1
    acts_evenly = all(np.array_equal(*_acting(auxiliary)) for auxiliary in system.auxiliaries if auxiliary.remembers)
    return bool(not np.any(inputs.mean) and are_odd.all() and acts_evenly and all(is_odd(law) for law in system.laws))


def _acting(slider: Auxiliary) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """In which pieces of its element's law a slider acts, from the lowest and from the highest piece on."""
    acts = slider.follow[:, STICK] != OFF
    return acts, acts[::-1]


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
    """Return the half-period map of n periods; None where there is none: no symmetry, or n is even."""
    return HalfPeriodMap(system, cycles) if cycles % 2 == 1 and is_symmetric(system) else None


class HalfPeriodMap(PeriodMap):
    """The map over half of n periods, mirrored; its fixed points are the symmetric motions.

    Parameters
    ----------
    system
        a symmetric driveline.
    cycles
        n, odd.

    Raises
    ------
    ValueError
        the driveline is not symmetric, or n is even.
    """

    def __init__(self, system: PiecewiseSystem, cycles: int = 1) -> None:
        if cycles % 2 == 0 or not is_symmetric(system):
            raise ValueError("a half-period map is for symmetric drivelines and an odd number of periods")
        super().__init__(system, cycles)

    @property
    def length(self) -> float:
        """Half the duration of n periods [s]."""
        return 0.5 * super().length

    @property
    def repeats_one_period(self) -> bool:
        """False: half a motion is no number of whole periods."""
        return False

    def __call__(self, state: State) -> Pass:
        """Follow a state over half of n periods, and mirror it.

        Raises
        ------
        ConvergenceError
            the motion could not be followed.
        """
        march = self.marched(state, samples_per_cycle=2)
        crossings = self.passages(march)
        crossings = crossings.where(crossings.time < self.length)
        turned = self.turned(march, self.cycles)
        end = self.mirrored(self.sampled(march, self.cycles))
        gradient = -self.gradient_along(march, crossings)
        return Pass(state, end, gradient, -turned, crossings, self.system.inputs.period, self.cycles)

    def later(self, state: State, passes: int = 1) -> State:
        """Return the state after some passes, without the gradient. Errors as in a call."""
        march = self.marched(state, -(-passes // 2), samples_per_cycle=2)
        end = self.sampled(march, passes * self.cycles)
        return end if passes % 2 == 0 else self.mirrored(end)

    def mirrored(self, state: State) -> State:
        """Return the mirror image of a state."""
        pieces = state.auxiliary_pieces
        if pieces is not None:
            exchanged = np.where(pieces == FORWARD, BACKWARD, np.where(pieces == BACKWARD, FORWARD, pieces))
            remembers = np.array([auxiliary.remembers for auxiliary in self.system.auxiliaries], dtype=np.bool_)
            pieces = np.where(remembers, exchanged, pieces)
        return State(-state.y, pieces)
