"""An initial-value problem as C code reads it: counts and addresses of arrays, for ``kernels.callbacks``."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.equation_of_motion import Field
from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.solvers.vector_field import FieldProblem

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

UNCONTROLLED = 1e100
"""Absolute tolerance of reference angles and force integrals: they do not affect the motion and set no step size."""


def contiguous(field: Field) -> Field:
    """Return the field with contiguous arrays of int64 and float64, as C reads them."""

    def laid(array: Any) -> Any:
        return np.ascontiguousarray(array, np.int64 if array.dtype.kind == "i" else np.float64)

    *arrays, laws, period = field
    return Field._make([*map(laid, arrays), Laws._make(map(laid, laws)), float(period)])


@dataclass(frozen=True)
class Block:
    """A problem in scaled variables z = y / size, with every array its callbacks use.

    Keep it as long as they may be called.
    """

    problem: FieldProblem
    field: Field  # arrays in which the callbacks look up pieces, all C-contiguous
    clearances: IntArray  # (K,) elements with corners
    bounds: Array  # (K, 2) corners of the held pieces; used only by methods that hold pieces (``step_loop``)

    @classmethod
    def of(cls, problem: FieldProblem, field: Field | None = None) -> Block:
        """Pack a problem; ``field`` replaces its own where pieces are held."""
        clearances = np.array(problem.task.system.clearances, dtype=np.int64)
        return cls(problem, contiguous(field or problem.field), clearances, np.empty((len(clearances), 2)))

    @property
    def states(self) -> int:
        """S, the length of y."""
        return int(self.problem.initial.size)

    @cached_property
    def size(self) -> Array:
        """(S,) the unit of each state [SI]; 1 for reference angles and force integrals."""
        carried = self.states - self.problem.active
        return np.concatenate([self.problem.size, np.ones(carried)])

    @cached_property
    def initial(self) -> Array:
        """(S,) z at t = 0."""
        return self.problem.initial / self.size

    def tolerances(self, tolerance: float) -> tuple[float, Array]:
        """Return the relative and the (S,) absolute tolerances, for an error norm that is the rms over all S states.

        States that are not controlled add nothing to the sum of squares but count in S, so the norm is smaller by
        sqrt(active / S); both tolerances are reduced by the same factor.
        """
        tolerance *= float(np.sqrt(self.problem.active / self.states))
        absolute = np.full(self.states, tolerance)
        absolute[self.problem.active :] = UNCONTROLLED
        return tolerance, absolute

    @cached_property
    def _work(self) -> list[Array]:
        """State, wave, deflection, rate, piece, force: what the callbacks write to."""
        m = len(self.field.rows)
        waves = 2 * self.field.cycles.size
        return [np.zeros(self.states), np.zeros(waves), *(np.zeros(m) for _ in range(4))]

    @cached_property
    def _period(self) -> Array:
        return np.array([self.field.period])

    @cached_property
    def words(self) -> IntArray:
        """The block: two addresses of access functions, then counts, then addresses of arrays.

        The first two are 0 here; the C library fills them in.
        """
        f = self.field
        (m, n) = f.rows.shape
        r = f.basis.shape[0]
        counts = [n, m, r, f.references.size, f.laws.stiffness.size, f.cycles.size, len(self.clearances)]
        arrays = [*f[:-2], *f.laws, self._period, self.size, *self._work, self.clearances, self.bounds]
        return np.array([0, 0, *counts, *(a.ctypes.data for a in arrays)], dtype=np.int64)
