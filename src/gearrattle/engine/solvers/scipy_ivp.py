"""SciPy's steppers: DOP853 (explicit, order 8) and Radau (implicit, order 5), stepped by hand, blind to corners.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, sec. II.5 and II.6; II, sec. IV.8. The steps are
Python, the right-hand side and the Jacobian are compiled (``kernels.callbacks``). SciPy tells neither rejected steps
nor tries: they are derived here from what it does count.
"""

from __future__ import annotations

import ctypes
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.solvers.problem_for_c import Block
from gearrattle.engine.solvers.solver import Marching, Task
from gearrattle.engine.solvers.stepwise import LARGEST, Interpolant, StepwiseMarch
from gearrattle.outcome import Outcome

Array = NDArray[np.float64]

TOLERANCE = 1e-6
FINEST = 100 * float(np.finfo(float).eps)
"""The finest relative tolerance SciPy takes."""


class ScipyStepper:
    """One of SciPy's solvers as a ``stepwise.Stepper``.

    task: for tolerance and first step.
    method: name in ``scipy.integrate``.
    """

    stages = 12
    """Evaluations a try of DOP853 takes."""

    def __init__(self, block: Block, task: Task, method: str) -> None:
        import scipy.integrate

        from gearrattle.engine.kernels.callbacks import plain_jacobian, plain_slopes

        # compiled derivatives, called by their addresses
        kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 3)
        self._slopes = kind(plain_slopes.address)
        self._matrix = kind(plain_jacobian.address)
        self._given = np.zeros(block.states)
        self._answer = np.zeros(block.states)
        self._addresses = tuple(a.ctypes.data for a in (self._given, self._answer, block.words))
        # counts
        self.block = block
        self.implicit = method == "Radau"
        self.rejected_steps = 0
        self.refreshed = 0
        self._between = 0
        self.tried = 0.0
        # tolerances, none finer than SciPy takes
        asked = TOLERANCE if task.tolerance is None else task.tolerance
        relative, absolute = block.tolerances(asked)
        self.notes: tuple[str, ...] = ()
        if relative < FINEST:
            self.notes = (f"{method.lower()}: SciPy takes no relative tolerance below {FINEST:.2g}; that one is used.",)
            relative = FINEST
        # the solver at the start
        end = float(block.problem.sample_times[-1])
        start = block.initial
        self._lost = not np.isfinite(start).all()  # SciPy raises on such a start
        options: dict[str, Any] = {"jac": self._jacobian} if self.implicit else {}
        first = None if task.step is None else min(task.step, end)
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            self.solver = getattr(scipy.integrate, method)(
                self._derivative,
                0.0,
                np.zeros_like(start) if self._lost else start,
                end,
                rtol=relative,
                atol=absolute,
                first_step=first,
                **options,
            )

    def _derivative(self, time: float, z: Array) -> Array:
        self._given[:] = z
        self._slopes(time, *self._addresses)
        return self._answer.copy()

    def _jacobian(self, time: float, z: Array) -> Array:
        solver = getattr(self, "solver", None)
        self.refreshed += int(solver is not None and time == solver.t)  # within a step, not behind it
        out = np.empty((self.block.states, self.block.states))
        self._given[:] = z
        self._matrix(time, self._addresses[0], out.ctypes.data, self._addresses[2])
        return out.T

    @property
    def time(self) -> float:
        """End of the last step [s]."""
        return float(self.solver.t)

    @property
    def z(self) -> Array:
        """(S,) state there."""
        return np.asarray(self.solver.y)

    @property
    def function_calls(self) -> int:
        """Evaluations of the algorithm, without those of its interpolant."""
        return int(self.solver.nfev) - self._between

    @property
    def jacobian_calls(self) -> int:
        """Jacobians of the algorithm."""
        return int(self.solver.njev)

    def step(self) -> Outcome:
        """Take one step; SciPy's failures, and what it raises on numbers that are not finite, are outcomes."""
        # a step that is not finite is not tried
        solver = self.solver
        begin = self.time
        if self._lost or not (
            np.isfinite(solver.h_abs) and np.isfinite(solver.f).all()
        ):  # SciPy would try such a step for ever
            return Outcome.NON_FINITE
        # one step, with the counts before it
        first = min(float(solver.h_abs), solver.t_bound - begin)
        calls = solver.nfev
        factors = solver.nlu
        refreshed = self.refreshed
        fresh = getattr(solver, "LU_real", None) is None
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                solver.step()
        except (ValueError, ArithmeticError, np.linalg.LinAlgError):  # factors of a matrix that is not finite
            solver.status = "failed"
        # failures
        if not np.isfinite(solver.y).all() or not np.isfinite(solver.f).all():
            return Outcome.NON_FINITE
        if solver.status == "failed":
            return Outcome.NON_FINITE if np.abs(solver.y).max() > LARGEST else Outcome.NO_CONVERGENCE
        # tries that were rejected, and the sum of the steps tried
        if self.implicit:  # every rejection, and every new Jacobian on the way, makes a new pair of factors
            rejected = (solver.nlu - factors) // 2 - int(fresh) - (self.refreshed - refreshed)
        else:
            rejected = (solver.nfev - calls) // self.stages - 1
        h = self.time - begin
        self.rejected_steps += rejected
        self.tried += h + (max(first, h) + (rejected - 1) * h if rejected > 0 else 0.0)
        return Outcome.SLICE_SPENT

    def interpolant(self) -> Interpolant:
        """SciPy's dense output of the last step."""
        calls = self.solver.nfev
        output: Interpolant = self.solver.dense_output()
        self._between += self.solver.nfev - calls
        return output


def stepped(method: str) -> Callable[[Task], Marching]:
    """A solver from one of SciPy's classes."""
    return lambda task: StepwiseMarch(task, lambda block: ScipyStepper(block, task, method))
