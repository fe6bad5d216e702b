"""NSGA-II by ask and tell: a genetic algorithm that keeps a front of designs of which none is better in everything.

K. Deb, A. Pratap, S. Agarwal, T. Meyarivan, A fast and elitist multiobjective genetic algorithm: NSGA-II, IEEE
Transactions on Evolutionary Computation 6, 2002, pp. 182-197; constraints by its rule that a feasible design beats any
other, and of two others the one that misses by less. By pymoo (J. Blank, K. Deb, pymoo: multi-objective optimization in
Python, IEEE Access 8, 2020, pp. 89497-89509). All randomness comes from the seed: the same answers lead to the same
questions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import NotInstalled

Array = NDArray[np.float64]
_NEVER = 10**9


class Evolution:
    """Search by NSGA-II, one generation after the other.

    Args of the constructor:
        first: (population, d) points of the first generation, 0 to 1.
        objectives: how many, all to be small.
        seed: of everything drawn.

    NotInstalled: pymoo is not here.
    """

    def __init__(self, first: Array, objectives: int, seed: int) -> None:
        nsga2, problem = _pymoo()
        d = first.shape[1]
        self._problem = problem(
            n_var=d, n_obj=objectives, n_ieq_constr=1, xl=np.zeros(d), xu=np.ones(d), elementwise=False
        )
        self._search = nsga2(pop_size=len(first), sampling=first)
        self._search.setup(self._problem, seed=seed, termination=("n_gen", _NEVER), verbose=False)
        self._asked: Any = None

    def ask(self) -> Array:
        """Return (population or fewer, d) points to be valued next; none if nothing new can be found."""
        self._asked = self._search.ask()
        if self._asked is None or not len(self._asked):
            return np.zeros((0, self._problem.n_var))
        return np.clip(np.asarray(self._asked.get("X"), dtype=np.float64), 0.0, 1.0)

    def tell(self, values: Array, violation: Array) -> None:
        """Take the objectives and violations of the points that were asked for.

        Parameters
        ----------
        values
            (n, objectives), finite, to be small.
        violation
            (n,) by how much constraints are missed, 0 for feasible designs.
        """
        from pymoo.core.evaluator import Evaluator
        from pymoo.problems.static import StaticProblem

        Evaluator().eval(StaticProblem(self._problem, F=values, G=violation[:, None]), self._asked)
        self._search.tell(infills=self._asked)


def _pymoo() -> tuple[Any, Any]:
    try:
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.core.problem import Problem as Searched
    except ImportError:
        rule = "an optimisation needs pymoo, which is not installed"
        raise NotInstalled.of("optimization", "optimize", "", rule) from None
    return NSGA2, Searched


def front_of(values: Array) -> NDArray[np.bool_]:
    """Return (n,) which rows of values (n, m), all to be small, no other row beats: nowhere worse, somewhere better.

    Rows with a NaN are on no front; of equal rows the first is.
    """
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(axis=1))
    on = np.array(finite)
    for i in np.flatnonzero(finite):
        others = finite & (values <= values[i]).all(axis=1)
        better = others & (values < values[i]).any(axis=1)
        twin = others[:i] & (values[:i] == values[i]).all(axis=1)
        on[i] = not (better.any() or twin.any())
    return on


def hypervolume(values: Array, reference: Array) -> float:
    """Return the volume between a front (n, m), all to be small, and a reference point (m,) that bounds it.

    By slices along the last objective, each the volume of what reaches it in the others: exact, for short fronts.
    """
    inside = values[(values < reference).all(axis=1)]
    if not len(inside):
        return 0.0
    if values.shape[1] == 1:
        return float(reference[0] - inside.min())
    inside = inside[np.argsort(inside[:, -1], kind="stable")]
    ends = np.append(inside[1:, -1], reference[-1])
    total = 0.0
    for i, (begin, end) in enumerate(zip(inside[:, -1], ends, strict=True)):
        if end > begin:
            below = inside[: i + 1, :-1]
            total += (end - begin) * hypervolume(below[front_of(below)], reference[:-1])
    return float(total)
