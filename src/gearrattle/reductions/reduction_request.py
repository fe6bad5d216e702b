"""Request to a reduction, and the subspace that it returns.

A reduction chooses a basis T, the same in every contact state, and the system moves as q = T p. That is all it does:
matrices, frequencies and responses follow from T, and so does the error, which ``accuracy`` measures against the full
system in the same way for every part. The ends of elements with a clearance that is kept must move freely in T: a
reduction may not decide beforehand whether a gap is open. A new reduction is a file beside this one with a function
``(Request) -> Subspace``, its line in the table of ``__init__``, and its test page.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.matrices import LinearSystem, linearised
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Request:
    """Request to a reduction.

    Attributes
    ----------
    up_to
        end of the band [rad/s].
    margin
        modes up to margin x up_to decide what must be represented.
    kept
        elements that must stay as they are, ascending; every clearance unless the user gives one up.
    driven
        inertias that carry a harmonic torque; they stay coordinates where the reduction has such.
    """

    system: PiecewiseSystem
    up_to: float
    margin: float
    kept: tuple[int, ...]
    driven: tuple[int, ...]

    @property
    def clearances(self) -> tuple[int, ...]:
        """Kept elements with a corner."""
        return tuple(k for k in self.kept if k in self.system.clearances)

    def masters(self) -> tuple[int, ...]:
        """Inertias at the ends of kept elements, and driven ones, ascending."""
        ends = np.flatnonzero(np.any(self.system.rows[list(self.kept)] != 0.0, axis=0))
        return tuple(sorted({*ends.tolist(), *self.driven}))

    def without_clearances(self) -> LinearSystem:
        """Return the system with every kept clearance taken out, all other elements in their last drive stage."""
        outer = np.array([law.stiffness[-1] for law in self.system.laws], dtype=float)
        damping = np.array([law.damping[-1] for law in self.system.laws], dtype=float)
        outer[list(self.clearances)] = 0.0
        damping[list(self.clearances)] = 0.0
        return linearised(self.system, outer, damping)


@dataclass(frozen=True)
class Subspace:
    """q = T p.

    Attributes
    ----------
    basis
        (n, r) T, of full column rank.
    coordinates
        (r,) the inertia whose angle a coordinate is; -1 for a generalised one (the amplitude of a mode).
    """

    basis: Array
    coordinates: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number of coordinates r."""
        return int(self.basis.shape[1])


Reducer = Callable[[Request], Subspace]
